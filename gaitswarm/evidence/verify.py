"""Verification of evidence: consistency, derived values and replays."""

from __future__ import annotations

import hashlib
import json
import os
import re
import secrets
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.errors import InvalidRequest, NotFound, Unavailable
from gaitswarm.evidence.archive import check_hashes, parsed_json
from gaitswarm.evidence.certificates import (
    SUMMARY,
    by_certificate,
    certified_at,
    how_to_make_one,
    summary_differs,
)
from gaitswarm.evidence.contents import BEST, CHAIN, JOB, best_of, row_of
from gaitswarm.evidence.history import chain_check, head_check
from gaitswarm.evidence.reading import Evidence, by_iteration, check_robots, read_evidence
from gaitswarm.evidence.replay import (
    has_same_bits_anywhere,
    replay_answer,
    simulated_differences,
    why_no_replay,
)
from gaitswarm.services.optimizer.analysis.fork import retraced
from gaitswarm.services.optimizer.analysis.verification import BrokenChain, Chain, judged
from gaitswarm.services.optimizer.jobs.chain import VERSION as CHAIN_VERSION
from gaitswarm.services.optimizer.jobs.chain import ChainDocuments, Link, Outcomes
from gaitswarm.services.optimizer.jobs.columns import EvaluationColumns
from gaitswarm.services.optimizer.jobs.documents import SPECS, AnySpec
from gaitswarm.services.optimizer.jobs.fork import Lineage
from gaitswarm.services.optimizer.jobs.iteration import Reevaluation, best_particle
from gaitswarm.services.optimizer.jobs.kinds.certificate import CertificateSpec
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.provenance import RECORDS, job_provenance
from gaitswarm.services.optimizer.search.registry import METHODS
from gaitswarm.settings import place_of
from gaitswarm.sim.kernel.emitted.source import kernel_identity
from gaitswarm.sim.robot import load_robot
from gaitswarm.views.history import BestView
from gaitswarm.views.verification import DIGEST, CheckView, DifferenceView, VerificationView
from gaitswarm.zip_archive import LARGEST_ARCHIVE, BadArchive, unzipped

Floats = NDArray[np.float64]

_DIGITS: Final = 32

Answer = tuple[bool | None, str]
"""Whether a check passed, None where it does not apply; and the details."""


def checks_of(evidence: Evidence, members: Mapping[str, bytes]) -> dict[str, Callable[[], Answer]]:
    """List the checks that need no simulation."""
    found: dict[str, Callable[[], Answer]] = {
        "robot": lambda: _robot(evidence, members),
        "fitness": lambda: _fitness(evidence),
        "best": lambda: _best(evidence, members),
        "designs": lambda: _designs(evidence),
        "search": lambda: _search(evidence),
        "chain": lambda: _chain(evidence),
    }
    if SUMMARY in members:
        found["summary"] = lambda: _summary(evidence, members)
    return found


def _tables(evidence: Evidence) -> Iterator[tuple[AnySpec, EvaluationColumns]]:
    yield evidence.spec, evidence.columns
    if evidence.reevaluated is not None:
        yield evidence.spec.in_double(), evidence.reevaluated


def _robot(evidence: Evidence, members: Mapping[str, bytes]) -> Answer:
    """Check the robots' files against the digests of the provenance."""
    content = b""
    for number in range(len(evidence.spec.robot_sources)):
        folder = f"robots/{number}"
        for name in (f"{folder}/description.json", f"{folder}/robot.urdf"):
            if name not in members:
                return False, f"it has no {name}"
            content += members[name]
    expected = evidence.provenance.records[-1].provenance.simulation.robot_digest
    if hashlib.sha256(content).hexdigest()[:_DIGITS] != expected:
        return False, "the robot's files are not those that the provenance names"
    return True, f"its files have the digest {expected} of the provenance"


def _fitness(evidence: Evidence) -> Answer:
    """Check that fitness follows from the raw objectives."""
    wrong, count = 0, 0
    for spec, columns in _tables(evidence):
        again = judged(spec, columns)
        wrong += int((again.view(np.uint64) != columns.fitness.view(np.uint64)).sum())
        count += len(columns)
    if wrong:
        return False, f"{wrong} of {count} do not follow from the raw objectives"
    return True, f"{count} of {count} follow from the raw objectives, to the bit"


def _best(evidence: Evidence, members: Mapping[str, bytes]) -> Answer:
    """Check that the best design is the earliest of least fitness in double precision."""
    best, said = best_of(evidence.columns, evidence.reevaluated), evidence.job.best
    if best is None or said is None:
        return best is None and said is None, "no design has succeeded in every case"
    where = (best.iteration, best.particle)
    fitness = best.fitness if best.reevaluation is None else best.reevaluation.fitness
    if (said.iteration, said.particle, said.fitness) != (*where, fitness):
        return False, (f"design {place_of(*where)} is the best with {fitness!r}, not the named one")
    shown = json.loads(BestView.from_evaluation(best, evidence.spec).model_dump_json())
    if parsed_json(members.get(BEST, b""), BEST) != shown:
        return False, f"{BEST} does not show design {place_of(*where)}"
    return True, f"design {place_of(*where)}, {fitness!r}, is the least of all"


def best_row(evidence: Evidence) -> tuple[int | None, EvaluationColumns]:
    """Find the best evaluation."""
    judged = evidence.columns if evidence.reevaluated is None else evidence.reevaluated
    return (best_particle(judged.fitness) if len(judged) else None), judged


def _designs(evidence: Evidence) -> Answer:
    """Check that designs correspond to the asks."""
    space = evidence.spec.design_space()
    designs = space.designs(np.concatenate(evidence.asked))
    wrong = int((designs != evidence.columns.designs).any(axis=1).sum())
    if wrong:
        return False, f"{wrong} of {len(designs)} are not what the search asked for"
    return True, f"{len(designs)} of {len(designs)} are what the search asked for"


def _search(evidence: Evidence) -> Answer:
    """Check that the search proposes the same designs again."""
    spec, lineage = evidence.spec, evidence.job.lineage
    method = METHODS[spec.search.name]
    if method.missing:
        return None, f"{spec.search.name} needs {', '.join(method.missing)}, not installed here"
    columns = evidence.columns
    results = spec.search_feedback(columns.objectives, columns.failed, columns.fitness)
    feedback = by_iteration(evidence, results)
    try:
        retraced(spec, evidence.job.budgets, evidence.asked, feedback)
    except ValueError as error:
        if lineage is not None and lineage.carried == "search" and "preference" in lineage.changed:
            return None, "its state was judged by another preference when it was forked"
        return False, f"{error}: other code, another seed, or other results"
    return True, f"{spec.search.name} proposes the same designs in {len(feedback)} iterations"


def _chain(evidence: Evidence) -> Answer:
    """Check the history against its digests."""
    said = evidence.chain
    if said.version != CHAIN_VERSION:
        return None, f"it is of version {said.version}, which this gaitswarm does not compute"
    stored = (SPECS.validate_python(said.spec), said.lineage, said.provenance)
    if not _belongs(evidence, *stored):
        return False, f"{CHAIN} has another spec, lineage or provenance than the rest of the file"
    documents = ChainDocuments(said.spec, said.lineage, said.provenance)
    found = Chain(documents, evidence.spec)
    reevaluated = _reevaluations(evidence)
    links = zip(evidence.asked, said.asks, said.digests, strict=True)
    try:
        for index, (positions, ask, digest) in enumerate(links):
            columns = evidence.columns.of_iteration(index)
            link = Link(index, positions, ask, digest)
            found.extend(link, Outcomes.read(columns, reevaluated.get(index)))
    except BrokenChain as error:
        return False, str(error)
    check = chain_check(found.iterations, found.head)
    return check.passed, check.detail


def _belongs(evidence: Evidence, spec: AnySpec, lineage: Any, provenance: Any) -> bool:
    """Whether stored documents agree with the rest of the file."""
    own = evidence.job.lineage
    return (
        evidence.spec in (spec, spec.with_budget(evidence.spec.iterations))
        and (None if lineage is None else Lineage.model_validate(lineage)) == own
        and RECORDS.validate_python(provenance or ()) == evidence.provenance.records
    )


def _reevaluations(evidence: Evidence) -> dict[int, Reevaluation]:
    """Reevaluations by iteration."""
    columns = evidence.reevaluated
    if columns is None:
        return {}
    return {
        int(columns.iteration[row]): Reevaluation(
            int(columns.particle[row]),
            columns.objectives[row],
            columns.statuses[row],
            float(columns.fitness[row]),
        )
        for row in range(len(columns))
    }


def _summary(evidence: Evidence, members: Mapping[str, bytes]) -> Answer:
    """Check that a certificate's summary follows from its evaluations."""
    spec = evidence.spec
    if not isinstance(spec, CertificateSpec):
        return False, f"a job of kind {spec.kind} has no {SUMMARY}"
    where = summary_differs(evidence.job.id, spec, evidence.columns, members[SUMMARY])
    if where is not None:
        return False, f"{SUMMARY} has another {where} than follows from the evaluations"
    return True, f"{SUMMARY} follows from {len(evidence.columns)} evaluations"


def changes_of_provenance(evidence: Evidence) -> Iterator[str]:
    """Yield changes of provenance on this machine, and what they mean."""
    spec, here = evidence.spec, job_provenance(evidence.spec)
    found: list[str] = []
    for record in evidence.provenance.records:
        found += [
            f"from iteration {record.from_iteration} on: {change}"
            for change in record.provenance.changes(here)
        ]
    yield from found
    if not found:
        return
    kernels = tuple(
        kernel_identity(load_robot(r), spec.precision).hex() for r in spec.robot_sources
    )
    if kernels == evidence.provenance.kernels:
        yield (
            "the kernels' source is the same as when the file was written: physics and"
            " control loop are the same, and the changes are outside of them"
        )
    else:
        yield "the kernels' source differs from when the file was written: results may differ"
    yield "equal bits in the replay show that these changes do not matter for what was replayed"


_SHOWN: Final = 100
"""Differences that are listed at most."""


@dataclass(slots=True)
class _Found:
    checks: list[CheckView] = field(default_factory=list)
    differences: list[DifferenceView] = field(default_factory=list)
    provenance: list[str] = field(default_factory=list)
    job: str | None = None
    replayed: int = 0

    def add(
        self, name: str, passed: bool | None, detail: str, certificate: str | None = None
    ) -> None:
        self.checks.append(
            CheckView(name=name, passed=passed, detail=detail, certificate=certificate)
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
        InvalidRequest: The file cannot be opened, `replay` or `seed` is negative, or `head` is no
            digest.
        EvaluatorUnavailable: Simulations cannot be run here.
    """
    for name, value in (("replay", replay), ("seed", seed or 0)):
        if value < 0:
            raise InvalidRequest("must not be negative", field=name)
    if head is not None and not re.fullmatch(DIGEST, head):
        raise InvalidRequest("must be 64 hexadecimal digits, in lower case", field="head")
    seed = secrets.randbelow(1 << 32) if seed is None else seed
    content = evidence if isinstance(evidence, bytes) else _content(Path(evidence))
    found = _Found()
    try:
        _check(content, found, replay, seed, head)
    except BadArchive as error:
        found.add("contents" if found.checks else "archive", False, str(error))
    return VerificationView(
        sha256=hashlib.sha256(content).hexdigest(),
        job=found.job,
        verified=all(check.passed is not False for check in found.checks),
        checks=found.checks,
        provenance=found.provenance,
        replayed=found.replayed,
        seed=seed,
        differences=found.differences[:_SHOWN],
    )


def _content(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(LARGEST_ARCHIVE + 1)
    except FileNotFoundError as error:
        raise NotFound(f"no such file: {path}") from error
    except OSError as error:
        raise InvalidRequest(f"cannot read {path}: {error.strerror}", field="evidence") from error


def _check(content: bytes, found: _Found, replay: int, seed: int, head: str | None) -> None:
    members = unzipped(content)
    wrong = check_hashes(members)
    found.add("archive", True, f"{len(members)} members, none compressed or hidden")
    hashes = f"SHA-256 of {len(members) - 1} members are those of the manifest"
    found.add("hashes", not wrong, "; ".join(wrong[:5]) or hashes)
    check_robots(members)
    evidence = _check_run(members, found, replay, np.random.default_rng(seed))
    found.job = evidence.job.id
    if head is not None:
        digests = evidence.chain.digests
        at = digests.index(head) if head in digests else None
        found.checks.append(head_check(head, at, len(evidence.asked)))
    certificates = by_certificate(members)
    for number, (job_id, own) in enumerate(sorted(certificates.items())):
        drawn = np.random.default_rng((seed, number))
        try:
            _check_certificate(evidence, job_id, own, found, replay, drawn)
        except BadArchive as error:
            found.add("contents", False, str(error), job_id)
    if isinstance(evidence.spec, JobSpec):
        said = f"{len(certificates)} of designs of this job"
        none = f"there is none; {how_to_make_one(evidence.job.id)}"
        passed = True if certificates else None
        found.add("certificates", passed, said if certificates else none)


def _check_certificate(
    evidence: Evidence,
    job_id: str,
    members: Mapping[str, bytes],
    found: _Found,
    replay: int,
    drawn: np.random.Generator,
) -> None:
    """Check a certificate of a design of the job that the evidence is of."""
    if SUMMARY not in members:
        raise BadArchive(f"it has no {SUMMARY}")
    certificate = _check_run(members, found, replay, drawn, job_id)
    if certificate.job.id != job_id:
        raise BadArchive(f"{JOB} is of another certificate than its folder")
    passed, detail = _tried(lambda: _design(evidence, certificate))
    found.add("design", passed, detail, job_id)


def _design(evidence: Evidence, certificate: Evidence) -> Answer:
    """Check that the certified design is one of the job's."""
    best, spec, place = evidence.job.best, evidence.spec, None
    if isinstance(spec, JobSpec):
        place = certified_at(spec, evidence.columns, certificate.spec)
    if place is None:
        return False, "its design is not one of this job"
    is_best = best is not None and place == (best.iteration, best.particle)
    what = "the best" if is_best else "not the best"
    return True, f"it is of design {place_of(*place)}, {what}"


def _check_run(
    members: Mapping[str, bytes],
    found: _Found,
    replay: int,
    drawn: np.random.Generator,
    certificate: str | None = None,
) -> Evidence:
    """Check one run; `certificate` is its id, None for the job itself."""
    evidence = read_evidence(members)
    rows = f"{len(evidence.columns)} evaluations in {len(evidence.asked)} iterations"
    found.add("contents", True, f"{rows}, as in the spec", certificate)
    for name, check in checks_of(evidence, members).items():
        passed, detail = _tried(check)
        found.add(name, passed, detail, certificate)
    whose = "" if certificate is None else f"certificate {certificate}: "
    found.provenance += [f"{whose}{change}" for change in changes_of_provenance(evidence)]
    if replay:
        passed, detail = _tried(lambda: _replay(evidence, found, replay, drawn, certificate))
        found.add("replay", passed, detail, certificate)
    return evidence


def _tried(check: Callable[[], Answer]) -> Answer:
    try:
        return check()
    except Unavailable:
        raise
    except Exception as error:  # noqa: BLE001 - the numbers may not be gaitswarm's
        return False, f"cannot be computed: {type(error).__name__}: {str(error)[:200]}"


def _replay(
    evidence: Evidence,
    found: _Found,
    replay: int,
    drawn: np.random.Generator,
    certificate: str | None,
) -> Answer:
    """Check that drawn evaluations and the best one have the same bits here."""
    spec, columns = evidence.spec, evidence.columns
    refused = why_no_replay(spec)
    if refused is not None:
        return refused
    repeatable = has_same_bits_anywhere(spec, columns)
    chosen = drawn.permutation(np.flatnonzero(repeatable))[:replay]
    row, judged = best_row(evidence)
    best = chosen[:0]
    if row is not None:
        where = (int(judged.iteration[row]), int(judged.particle[row]))
        at = np.array([row_of(columns, *where)])
        best = at[repeatable[at]]
    rows = np.unique(np.concatenate([chosen, best]))
    tables = [(spec, columns.rows(rows))]
    if evidence.reevaluated is not None and len(best):
        tables.append((spec.in_double(), evidence.reevaluated.rows(np.array([row]))))
    differences = simulated_differences(tables, evidence.recordings, certificate)
    found.differences += differences
    found.replayed += len(rows)
    return replay_answer(len(rows), len(best) > 0, spec, differences)
