"""Verification of evidence and of stored histories: consistency, derived values and replays."""

from __future__ import annotations

import hashlib
import math
import os
import re
import secrets
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np
from pydantic_core import from_json, to_json

from gaitswarm.evidence.archive import (
    BEST,
    CERTIFICATES,
    CHAIN,
    JOB,
    LARGEST_ARCHIVE,
    SPEC,
    SUMMARY,
    WORST,
    BadArchive,
    Evidence,
    Place,
    best_of,
    certified_place,
    check_hashes,
    check_robots,
    in_double,
    parsed_json,
    read_evidence,
    robot_members,
    unzipped,
)
from gaitswarm.services.optimizer.analysis.certificate import certificate as certificate_view
from gaitswarm.services.optimizer.analysis.fork import retraced
from gaitswarm.services.optimizer.analysis.verification import (
    BrokenChain,
    Chain,
    check_history,
    judged,
)
from gaitswarm.services.optimizer.errors import InvalidRequest, NotFound, Unavailable
from gaitswarm.services.optimizer.jobs.chain import VERSION as CHAIN_VERSION
from gaitswarm.services.optimizer.jobs.chain import ChainDocuments, Link
from gaitswarm.services.optimizer.jobs.documents import SPECS, AnySpec
from gaitswarm.services.optimizer.jobs.estimate import duration
from gaitswarm.services.optimizer.jobs.iteration import Evaluation, EvaluationColumns, Reevaluation
from gaitswarm.services.optimizer.jobs.kinds.certificate import CertificateSpec
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.provenance import ProvenanceRecord, job_provenance
from gaitswarm.services.optimizer.search.registry import METHODS
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.views import finite
from gaitswarm.settings import place_of
from gaitswarm.sim.identification import Recordings
from gaitswarm.sim.mujoco.engines import ENGINE
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.provenance import provenance_of
from gaitswarm.simulation import evaluated
from gaitswarm.tables import joined
from gaitswarm.views.job import BestView
from gaitswarm.views.verification import (
    DIGEST,
    CheckView,
    DifferenceView,
    HistoryVerificationView,
    VerificationView,
)

_DIGITS: Final = 32

_SHOWN: Final = 100
"""Differences that are listed at most."""

_TOLERANCE: Final = 1e-9
"""Relative tolerance for numbers computed by statistics libraries."""

Answer = tuple[bool | None, str]
"""Whether a check passed, None where it does not apply; and the details."""


@dataclass(slots=True)
class _Report:
    """Results of checks, in their order."""

    checks: list[CheckView] = field(default_factory=list)
    differences: list[DifferenceView] = field(default_factory=list)
    provenance: list[str] = field(default_factory=list)
    replayed: int = 0

    def add(self, name: str, answer: Answer, certificate: str | None = None) -> None:
        passed, detail = answer
        self.checks.append(
            CheckView(name=name, passed=passed, detail=detail, certificate=certificate)
        )

    def fields(self) -> dict[str, Any]:
        """Fields of a `ReplayedView` but for the seed."""
        return {
            "verified": all(check.passed is not False for check in self.checks),
            "checks": self.checks,
            "provenance": self.provenance,
            "replayed": self.replayed,
            "differences": self.differences[:_SHOWN],
        }


def run_verification(
    service: JobService,
    job_id: str,
    *,
    replay: int,
    seed: int | None,
    head: str | None,
    check: Callable[[float], None] = lambda _seconds: None,
) -> HistoryVerificationView:
    """Recompute a job's chain, and repeat evaluations whose simulated time [s] passes `check`."""
    job, report = service.job(job_id), _Report()
    seed = secrets.randbelow(1 << 32) if seed is None else seed
    history = check_history(service.store, job, head=head)
    if history.problem:
        where = "" if history.broken_at is None else f"iteration {history.broken_at}: "
        report.add("chain", (False, f"{where}{history.problem}"))
    else:
        report.add("chain", _intact(history.iterations, history.head))
    if head is not None:
        report.add("head", _head(head, history.head_found_at, history.iterations))
    if replay and job.readable:
        report.provenance += _changes(job.spec, job.provenance)
    if replay and history.sizes:
        spec, store, progress = job.spec, service.store, job.progress

        def read(iteration: int) -> Evaluations:
            columns = store.evaluation_columns(job.id, iteration, iteration + 1)
            if columns is None:
                raise NotFound(f"job {job.id} has no iteration {iteration} any more")
            again = store.reevaluations(job.id, iteration, iteration + 1)
            return columns, None if spec.precision == "double" else in_double(columns, again)

        best = None
        if progress.best_iteration is not None and progress.best_particle is not None:
            best = (progress.best_iteration, progress.best_particle)
        drawn = _Drawn(history.sizes, best, np.random.default_rng(seed), replay)
        recordings = store.recordings(spec.recording_ids)
        report.add("replay", _replay(report, spec, recordings, drawn, read, check=check))
    return HistoryVerificationView(
        job=job.id,
        iterations=history.iterations,
        head=history.head,
        broken_at=history.broken_at,
        seed=seed,
        **report.fields(),
    )


def verify(
    evidence: bytes | str | os.PathLike[str],
    *,
    replay: int = 20,
    seed: int | None = None,
    head: str | None = None,
) -> VerificationView:
    """Check evidence of a job; no database is needed.

    Defects of the file are findings, not errors.

    Args:
        evidence: The file's name, or its content as `Jobs.evidence` writes it.
        replay: Evaluations to draw and repeat, besides the best one, of the job and of each
            certificate in its evidence; 0 for no simulation.
        seed: Seed of the draw; None for a random one.
        head: Digest of an iteration of the job noted earlier, as `JobView.head`, that the
            history must contain; None for no check.

    Returns:
        The checks and the differences.

    Raises:
        NotFound: The file does not exist.
        InvalidRequest: The file cannot be opened, or `replay`, `seed` or `head` is invalid.
        EvaluatorUnavailable: Simulations cannot be run here.
    """
    for name, value in (("replay", replay), ("seed", seed or 0)):
        if value < 0:
            raise InvalidRequest("must not be negative", field=name)
    if head is not None and not re.fullmatch(DIGEST, head):
        raise InvalidRequest("must be 64 hexadecimal digits, in lower case", field="head")
    seed = secrets.randbelow(1 << 32) if seed is None else seed
    content = evidence if isinstance(evidence, bytes) else _content(Path(evidence))
    report, job_id = _Report(), None
    try:
        members = unzipped(content)
        wrong = check_hashes(members)
        report.add("archive", (True, f"{len(members)} members, none compressed or hidden"))
        hashes = f"SHA-256 of {len(members) - 1} members are those of the manifest"
        report.add("hashes", (not wrong, "; ".join(wrong[:5]) or hashes))
        check_robots(members)
        job = _check_run(members, report, replay, np.random.default_rng(seed))
        job_id = job.job.id
        if head is not None:
            digests = job.chain.digests
            at = digests.index(head) if head in digests else None
            report.add("head", _head(head, at, len(job.asked)))
        _check_certificates(job, report, replay, seed)
    except BadArchive as error:
        report.add("contents" if report.checks else "archive", (False, str(error)))
    digest = hashlib.sha256(content).hexdigest()
    return VerificationView(sha256=digest, job=job_id, seed=seed, **report.fields())


def _content(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(LARGEST_ARCHIVE + 1)
    except FileNotFoundError as error:
        raise NotFound(f"no such file: {path}") from error
    except OSError as error:
        raise InvalidRequest(f"cannot read {path}: {error.strerror}", field="evidence") from error


def _check_run(
    members: Mapping[str, bytes],
    report: _Report,
    replay: int,
    rng: np.random.Generator,
    certificate: str | None = None,
) -> Evidence:
    """Check one run; `certificate` is its id, None for the job itself."""
    evidence = read_evidence(members)
    rows = f"{len(evidence.columns)} evaluations in {len(evidence.asked)} iterations"
    report.add("contents", (True, f"{rows}, as in the spec"), certificate)
    checks = {
        "robot": _robot,
        "fitness": _fitness,
        "best": _best,
        "designs": _designs,
        "search": _search,
        "chain": _chain,
    }
    if certificate is not None or SUMMARY in members:
        checks["summary"] = _summary
    if replay:
        checks["replay"] = lambda evidence: _replay_file(evidence, report, replay, rng, certificate)
    for name, check in checks.items():
        report.add(name, _tried(check, evidence), certificate)
    whose = "" if certificate is None else f"certificate {certificate}: "
    changes = _changes(evidence.spec, evidence.provenance)
    report.provenance += [f"{whose}{change}" for change in changes]
    return evidence


def _check_certificates(job: Evidence, report: _Report, replay: int, seed: int) -> None:
    """Check every certificate in the evidence of a job."""
    folders: dict[str, dict[str, bytes]] = {}
    for name, content in job.members.items():
        folder, _, rest = name.partition("/")
        job_id, slash, member = rest.partition("/")
        if folder == CERTIFICATES and slash:
            folders.setdefault(job_id, {})[member] = content
    for number, (job_id, members) in enumerate(sorted(folders.items())):
        rng = np.random.default_rng((seed, number))
        try:
            certificate = _check_run(members, report, replay, rng, job_id)
            report.add("design", _tried(partial(_design, job, job_id), certificate), job_id)
        except BadArchive as error:
            report.add("contents", (False, str(error)), job_id)
    if folders:
        report.add("certificates", (True, f"{len(folders)} of designs of this job"))
    elif isinstance(job.spec, JobSpec):
        remedy = f"`gaitswarm certify {job.job.id}` makes one, and evidence written afterwards"
        report.add("certificates", (None, f"there is none; {remedy} includes it"))


def _tried(check: Callable[[Evidence], Answer], evidence: Evidence) -> Answer:
    try:
        return check(evidence)
    except Unavailable:
        raise
    except Exception as error:  # noqa: BLE001 - the numbers may not be gaitswarm's
        return False, f"cannot be computed: {type(error).__name__}: {str(error)[:200]}"


def _robot(evidence: Evidence) -> Answer:
    """Check the robots' files against the digests of the provenance, and against the spec."""
    members, code = evidence.members, evidence.provenance[-1].provenance.simulation
    content = b""
    for number in range(len(evidence.spec.robot_sources)):
        for name in (f"robots/{number}/description.json", f"robots/{number}/robot.urdf"):
            if name not in members:
                return False, f"it has no {name}"
            content += members[name]
    if hashlib.sha256(content).hexdigest()[:_DIGITS] != code.robot_digest:
        return False, "the robot's files are not those that the provenance names"
    if code.code_digest == job_provenance(evidence.spec).simulation.code_digest:
        files = robot_members(evidence.spec.robot_sources)
        wrong = [name for name, file in files.items() if members[name] != file]
        if wrong:
            return False, f"{wrong[0]} is not of the robot in the spec"
    return True, f"its files have the digest {code.robot_digest} of the provenance"


def _fitness(evidence: Evidence) -> Answer:
    """Check that fitness follows from the raw objectives."""
    tables = [(evidence.spec, evidence.columns)]
    if evidence.reevaluated is not None:
        tables.append((evidence.spec.in_double(), evidence.reevaluated))
    wrong, count = 0, 0
    for spec, columns in tables:
        again = judged(spec, columns)
        wrong += int((again.view(np.uint64) != columns.fitness.view(np.uint64)).sum())
        count += len(columns)
    if wrong:
        return False, f"{wrong} of {count} do not follow from the raw objectives"
    return True, f"{count} of {count} follow from the raw objectives, to the bit"


def _best(evidence: Evidence) -> Answer:
    """Check that the best design is the earliest of least fitness in double precision."""
    best, view = best_of(evidence.columns, evidence.reevaluated), None
    result = "no design has succeeded in every case"
    if best is not None:
        view = BestView.from_evaluation(best, evidence.spec)
        result = f"design {place_of(*_place(best))}, {view.fitness!r}, is the least of all"
    if parsed_json(evidence.members.get(BEST, b""), BEST) != from_json(to_json(view)):
        return False, f"{BEST} shows another one: {result}"
    return True, result


def _place(best: Evaluation) -> Place:
    return best.iteration, best.particle


def _designs(evidence: Evidence) -> Answer:
    """Check that designs correspond to the asks."""
    designs = evidence.spec.design_space().designs(np.concatenate(evidence.asked))
    wrong = int((designs != evidence.columns.designs).any(axis=1).sum())
    if wrong:
        return False, f"{wrong} of {len(designs)} are not what the search asked for"
    return True, f"{len(designs)} of {len(designs)} are what the search asked for"


def _search(evidence: Evidence) -> Answer:
    """Check that the search proposes the same designs again."""
    spec, lineage = evidence.spec, evidence.lineage
    method = METHODS[spec.search.name]
    if method.missing:
        return None, f"{spec.search.name} needs {', '.join(method.missing)}, not installed here"
    columns = evidence.columns
    results = spec.search_feedback(columns.objectives, columns.failed, columns.fitness)
    ends = np.cumsum([len(positions) for positions in evidence.asked])
    feedback = np.split(results, ends[:-1])
    try:
        retraced(spec, evidence.job.budgets, evidence.asked, feedback)
    except ValueError as error:
        measure = {"preference", "constraints"}
        if lineage and lineage.carried == "search" and measure.intersection(lineage.changed):
            return None, "its state was judged by another measure when it was forked"
        return False, f"{error}: other code, another seed, or other results"
    return True, f"{spec.search.name} proposes the same designs in {len(feedback)} iterations"


def _chain(evidence: Evidence) -> Answer:
    """Check the history against its digests."""
    said, spec, again = evidence.chain, evidence.spec, evidence.reevaluated
    if said.version != CHAIN_VERSION:
        return None, f"it is of version {said.version}, which this gaitswarm does not compute"
    submitted = SPECS.validate_python(said.spec)
    if spec not in (submitted, submitted.with_budget(spec.iterations)):
        return False, f"{CHAIN} has another spec than {SPEC}"
    reevaluations = {} if again is None else dict(_reevaluations(again))
    chain = Chain(ChainDocuments(said.spec, said.lineage, said.provenance), spec)
    links = zip(evidence.asked, said.asks, said.digests, strict=True)
    try:
        for index, (positions, ask, digest) in enumerate(links):
            columns = evidence.columns.of_iteration(index)
            link = Link(index, positions, ask, digest)
            chain.extend(link, columns, reevaluations.get(index))
    except BrokenChain as error:
        return False, str(error)
    return _intact(chain.iterations, chain.head)


def _reevaluations(columns: EvaluationColumns) -> Iterator[tuple[int, Reevaluation]]:
    rows = zip(*columns.arrays, strict=True)
    for iteration, particle, _, objectives, statuses, fitness in rows:
        yield int(iteration), Reevaluation(int(particle), objectives, statuses, float(fitness))


def _intact(iterations: int, head: str | None) -> Answer:
    if head is None:
        return None, "no iteration is committed yet"
    return True, f"{iterations} iterations chained, head {head}"


def _head(head: str, at: int | None, iterations: int) -> Answer:
    """Check a history against a digest noted earlier."""
    if at is None:
        return False, f"no iteration has the digest {head}: this is a different history"
    if at == iterations - 1:
        return True, f"iteration {at}, the last, has the digest {head}"
    since = iterations - 1 - at
    return True, f"iteration {at} has the digest {head}; {since} more were committed since"


def _summary(evidence: Evidence) -> Answer:
    """Check that a certificate's summary follows from its evaluations."""
    spec = evidence.spec
    if not isinstance(spec, CertificateSpec):
        return False, f"a job of kind {spec.kind} has no {SUMMARY}"
    view = certificate_view(evidence.job.id, spec, evidence.columns, most=WORST)
    said = parsed_json(evidence.members.get(SUMMARY, b""), SUMMARY)
    where = next(_unequal(from_json(to_json(view)), said, ""), None)
    if where is not None:
        return False, f"{SUMMARY} has another {where} than follows from the evaluations"
    return True, f"{SUMMARY} follows from {len(evidence.columns)} evaluations"


def _unequal(here: Any, there: Any, path: str) -> Iterator[str]:
    """Yield the paths at which two JSON documents differ."""
    if isinstance(here, dict) and isinstance(there, dict) and here.keys() == there.keys():
        for name in here:
            yield from _unequal(here[name], there[name], f"{path}.{name}" if path else name)
    elif isinstance(here, list) and isinstance(there, list) and len(here) == len(there):
        for number, (ours, theirs) in enumerate(zip(here, there, strict=True)):
            yield from _unequal(ours, theirs, f"{path}.{number}")
    elif isinstance(here, float) and isinstance(there, float):
        if not math.isclose(here, there, rel_tol=_TOLERANCE, abs_tol=_TOLERANCE):
            yield path
    elif here != there:
        yield path


def _design(job: Evidence, folder: str, certificate: Evidence) -> Answer:
    """Check that the certified design is one of the job's."""
    if certificate.job.id != folder:
        return False, f"{JOB} is of another certificate than its folder"
    best = best_of(job.columns, job.reevaluated)
    place = certified_place(job.spec, job.columns, certificate.spec)
    if place is None:
        return False, "its design is not one of this job"
    is_best = best is not None and place == _place(best)
    return True, f"it is of design {place_of(*place)}, {'the best' if is_best else 'not the best'}"


def _changes(spec: AnySpec, records: Iterable[ProvenanceRecord]) -> list[str]:
    """Changes of provenance on this machine."""
    here = job_provenance(spec)
    return [
        f"from iteration {record.from_iteration} on: {change}"
        for record in records
        for change in record.provenance.changes(here)
    ]


Evaluations = tuple[EvaluationColumns, EvaluationColumns | None]
"""Evaluations, and those of them that were repeated in double precision if the search's is not."""


@dataclass(frozen=True, slots=True)
class _Drawn:
    """Evaluations to repeat: some drawn from all iterations, and the best one."""

    sizes: Sequence[int]  # designs by iteration
    best: Place | None
    rng: np.random.Generator
    count: int


def _replay_file(
    evidence: Evidence,
    report: _Report,
    count: int,
    rng: np.random.Generator,
    certificate: str | None,
) -> Answer:
    def read(iteration: int) -> Evaluations:
        again = evidence.reevaluated
        again = None if again is None else again.of_iteration(iteration)
        return evidence.columns.of_iteration(iteration), again

    best = best_of(evidence.columns, evidence.reevaluated)
    sizes = [len(positions) for positions in evidence.asked]
    drawn = _Drawn(sizes, None if best is None else _place(best), rng, count)
    return _replay(report, evidence.spec, evidence.recordings, drawn, read, certificate)


def _replay(
    report: _Report,
    spec: AnySpec,
    recordings: Recordings,
    drawn: _Drawn,
    read: Callable[[int], Evaluations],
    certificate: str | None = None,
    check: Callable[[float], None] = lambda _seconds: None,
) -> Answer:
    """Simulate evaluations again and compare every bit; only their iterations are read."""
    refused = _why_no_replay(spec)
    if refused is not None:
        return refused
    ends = np.cumsum(drawn.sizes)
    begins = ends - drawn.sizes
    rows = drawn.rng.permutation(int(ends[-1]))[: drawn.count]
    best = drawn.best if drawn.best is not None and drawn.best[0] < len(ends) else None
    if best is not None:
        rows = np.append(rows, begins[best[0]] + best[1])
    rows = np.unique(rows)
    check(len(rows) * duration(spec, spec.cases(recordings)))
    at = np.searchsorted(ends, rows, side="right")
    pieces, tables, among = [], [], ""
    for iteration in np.unique(at).tolist():
        evaluations, again = read(iteration)
        pieces.append(evaluations.rows(rows[at == iteration] - begins[iteration]))
        if again is not None and best is not None and iteration == best[0]:
            tables.append((spec.in_double(), again))
    columns = joined(pieces)
    if isinstance(spec, CertificateSpec) and spec.engines:
        # Other engines have other bits on other machines.
        engines = columns.designs[:, spec.design_space().names.index(ENGINE)]
        columns = columns.rows(np.flatnonzero(engines == 0.0))
    if best is not None and best in zip(columns.iteration, columns.particle, strict=True):
        among = ", the best among them,"
    differences = list(_differences([(spec, columns), *tables], recordings, certificate))
    report.differences += differences
    report.replayed += len(columns)
    what = f"{len(columns)} evaluations{among} in {len(spec.case_names)} cases"
    if not differences:
        return True, f"{what}: every bit is the same"
    count = len({(d.iteration, d.particle) for d in differences})
    return False, f"{what}: {len(differences)} numbers of {count} of them differ"


def _why_no_replay(spec: AnySpec) -> Answer | None:
    """Explain why evaluations of a job cannot be replayed here; None if they can."""
    if isinstance(spec, JobSpec) and spec.case is not None:
        name = spec.case.name
        return None, f"designs were evaluated by the plug-in {name}, which may give other bits"
    if provenance_of(*spec.robot_sources, precision=spec.precision).backend == "reference":
        return False, (
            "there is no C compiler here: the interpreter gives other bits, and takes some hundred"
            " times as long"
        )
    return None


def _differences(
    tables: Sequence[tuple[AnySpec, EvaluationColumns]],
    recordings: Recordings,
    certificate: str | None,
) -> Iterator[DifferenceView]:
    """Simulate evaluations and yield differences of any bit."""
    for spec, columns in tables:
        designs = spec.design_space().simulated(columns.designs)
        outcomes = evaluated(spec.cases(recordings), designs, spec.robot_sources, spec.precision)
        for number, (case, outcome) in enumerate(zip(spec.case_names, outcomes, strict=True)):
            stored, statuses = columns.objectives[:, number], columns.statuses[:, number]
            here = np.where(np.isfinite(outcome.objectives), outcome.objectives, np.nan)
            same = (stored == here) & (np.signbit(stored) == np.signbit(here))
            same |= np.isnan(stored) & np.isnan(here)
            found: list[tuple[int, str, float | str | None, float | str | None]] = [
                (row, spec.columns[k].name, finite(stored[row, k]), finite(here[row, k]))
                for row, k in np.argwhere(~same).tolist()
            ]
            found += [
                (row, "status", Status(statuses[row]).label, Status(outcome.statuses[row]).label)
                for row in np.flatnonzero(statuses != outcome.statuses).tolist()
            ]
            for row, what, before, now in found:
                yield DifferenceView(
                    iteration=int(columns.iteration[row]),
                    particle=int(columns.particle[row]),
                    case=case,
                    what=what,
                    stored=before,
                    simulated=now,
                    certificate=certificate,
                )
