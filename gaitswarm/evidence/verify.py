"""Checks evidence: what it says of itself, what follows from what, and what walks come to here."""

from __future__ import annotations

import hashlib
import json
import os
import secrets
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.errors import InvalidRequest, NotFound, Unavailable
from gaitswarm.evidence.archive import (
    LARGEST_ARCHIVE,
    BadArchive,
    check_hashes,
    parsed_json,
    read_archive,
)
from gaitswarm.evidence.contents import BEST, best_of, row_of
from gaitswarm.evidence.reading import Evidence, by_iteration, read_evidence
from gaitswarm.evidence.replay import has_same_bits_anywhere, simulated_differences, why_no_replay
from gaitswarm.views import BestView
from gaitswarm.views.verification import CheckView, DifferenceView, VerificationView
from services.optimizer.analysis.search_path import retraced
from services.optimizer.jobs.columns import EvaluationColumns
from services.optimizer.jobs.documents import AnySpec
from services.optimizer.jobs.iteration import best_particle
from services.optimizer.jobs.provenance import job_provenance
from services.optimizer.search.registry import METHODS
from sim.kernel.source import kernel_identity
from sim.robot import load_robot

Floats = NDArray[np.float64]

_SHOWN: Final = 100
"""Differences that are listed."""

_DIGITS: Final = 32

Answer = tuple[bool | None, str]
"""Whether a check passed, None where the job rules it out; and what was found."""


@dataclass(slots=True)
class _Found:
    checks: list[CheckView] = field(default_factory=list)
    differences: list[DifferenceView] = field(default_factory=list)
    provenance: list[str] = field(default_factory=list)
    job: str | None = None
    replayed: int = 0

    def add(self, name: str, passed: bool | None, detail: str) -> None:
        self.checks.append(CheckView(name=name, passed=passed, detail=detail))


def verify(
    evidence: bytes | str | os.PathLike[str], *, replay: int = 20, seed: int | None = None
) -> VerificationView:
    """Check evidence of a job, by itself: no database is needed.

    Whatever is wrong with the file is a finding, not an error.

    Args:
        evidence: The file's name, or its content as `Jobs.evidence` writes it.
        replay: Evaluations to draw and simulate anew, besides the best one; 0 for no walk at all.
        seed: By which they are drawn; None for one that nobody can foresee.

    Returns:
        What was checked, and what differs.

    Raises:
        NotFound: There is no such file.
        NotFound: There is no such file.
        InvalidRequest: The file cannot be opened, or `replay` or `seed` is negative.
        EvaluatorUnavailable: Walks cannot be run here.
    """
    for name, value in (("replay", replay), ("seed", seed or 0)):
        if value < 0:
            raise InvalidRequest("must not be negative", field=name)
    seed = secrets.randbelow(1 << 32) if seed is None else seed
    content = evidence if isinstance(evidence, bytes) else _content(Path(evidence))
    found = _Found()
    try:
        _check(content, found, replay, seed)
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
        raise NotFound(f"there is no file {path}") from error
    except OSError as error:
        raise InvalidRequest(f"cannot read {path}: {error.strerror}", field="evidence") from error


def _check(content: bytes, found: _Found, replay: int, seed: int) -> None:
    members = read_archive(content)
    wrong = check_hashes(members)
    found.add("archive", True, f"{len(members)} members, none compressed or hidden")
    hashes = f"SHA-256 of {len(members) - 1} members are those of the manifest"
    found.add("hashes", not wrong, "; ".join(wrong[:5]) or hashes)
    evidence = read_evidence(members)
    found.job = evidence.job.id
    rows = f"{len(evidence.columns)} evaluations in {len(evidence.asked)} iterations"
    found.add("contents", True, f"{rows}, all as the spec has them")
    for name, check in (
        ("robot", lambda: _robot(evidence, members)),
        ("fitness", lambda: _fitness(evidence)),
        ("best", lambda: _best(evidence, members)),
        ("designs", lambda: _designs(evidence)),
        ("search", lambda: _search(evidence)),
    ):
        passed, detail = _tried(check)
        found.add(name, passed, detail)
    found.provenance += _provenance(evidence)
    if replay:
        passed, detail = _tried(lambda: _replay(evidence, found, replay, seed))
        found.add("replay", passed, detail)


def _tried(check: Callable[[], Answer]) -> Answer:
    try:
        return check()
    except Unavailable:
        raise
    except Exception as error:  # noqa: BLE001 - whatever comes of numbers that no gaitswarm wrote
        return False, f"cannot be computed: {type(error).__name__}: {str(error)[:200]}"


def _tables(evidence: Evidence) -> Iterator[tuple[AnySpec, EvaluationColumns]]:
    yield evidence.spec, evidence.columns
    if evidence.reevaluated is not None:
        yield evidence.spec.in_double(), evidence.reevaluated


def _robot(evidence: Evidence, members: Mapping[str, bytes]) -> Answer:
    """The robots' files are those of which the provenance has the digest."""
    if not evidence.provenance.records:
        return None, "the job was stored before digests of robots were recorded"
    content = b""
    for number in range(len(evidence.spec.described)):
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
    """Fitness follows from raw objectives."""
    wrong, count = 0, 0
    for spec, columns in _tables(evidence):
        judged = _judged(spec, columns)
        wrong += int((judged.view(np.uint64) != columns.fitness.view(np.uint64)).sum())
        count += len(columns)
    if wrong:
        return False, f"{wrong} of {count} do not follow from the raw objectives"
    return True, f"{count} of {count} follow from the raw objectives, to the bit"


def _judged(spec: AnySpec, columns: EvaluationColumns) -> Floats:
    # What is not finite is stored as nothing, and was infinite where the walk succeeded.
    lost = ~columns.failed[:, :, np.newaxis] & np.isnan(columns.objectives)
    with np.errstate(all="ignore"):
        objectives = np.where(lost, np.inf, columns.objectives)
        return np.ascontiguousarray(spec.judge(objectives, columns.failed).fitness)


def _best(evidence: Evidence, members: Mapping[str, bytes]) -> Answer:
    """The best is the earliest of least fitness, in double precision, and is shown as it is."""
    best, said = best_of(evidence.columns, evidence.reevaluated), evidence.job.best
    if best is None or said is None:
        return best is None and said is None, "no design has walked in every case"
    where = (best.iteration, best.particle)
    fitness = best.fitness if best.reevaluation is None else best.reevaluation.fitness
    if (said.iteration, said.particle, said.fitness) != (*where, fitness):
        return False, (
            f"particle {where[1]} of iteration {where[0]} is the best with {fitness!r}, not the one"
            " that is named"
        )
    shown = json.loads(BestView.from_evaluation(best, evidence.spec).model_dump_json())
    if parsed_json(members.get(BEST, b""), BEST) != shown:
        return False, f"{BEST} does not show particle {where[1]} of iteration {where[0]}"
    return True, f"particle {where[1]} of iteration {where[0]}, {fitness!r}, is the least of all"


def _best_row(evidence: Evidence) -> tuple[int | None, EvaluationColumns]:
    """Its row in the table of what was judged in double."""
    judged = evidence.columns if evidence.reevaluated is None else evidence.reevaluated
    return (best_particle(judged.fitness) if len(judged) else None), judged


def _designs(evidence: Evidence) -> Answer:
    """Designs are those that the asks stand for."""
    space = evidence.spec.design_space()
    designs = space.designs(np.concatenate(evidence.asked))
    wrong = int((designs != evidence.columns.designs).any(axis=1).sum())
    if wrong:
        return False, f"{wrong} of {len(designs)} are not what the search asked for"
    return True, f"{len(designs)} of {len(designs)} are what the search asked for"


def _search(evidence: Evidence) -> Answer:
    """The search, told the same, asks for the same."""
    spec, lineage = evidence.spec, evidence.job.lineage
    method = METHODS[spec.search.name]
    if method.missing:
        return None, f"{spec.search.name} needs {', '.join(method.missing)}, not installed here"
    columns = evidence.columns
    told = by_iteration(evidence, spec.told(columns.objectives, columns.failed, columns.fitness))
    try:
        retraced(spec, evidence.job.budgets, evidence.asked, told)
    except ValueError as error:
        if lineage is not None and lineage.carried == "search" and "preference" in lineage.changed:
            return None, "its memory was judged anew by another preference when it was forked"
        return False, f"{error}: other code, another seed, or numbers that it was never told"
    return True, f"{spec.search.name} asks for the same designs in {len(told)} iterations"


def _provenance(evidence: Evidence) -> Iterator[str]:
    """What is different here, and what that means."""
    spec, here = evidence.spec, job_provenance(evidence.spec)
    found: list[str] = []
    for record in evidence.provenance.records:
        found += [
            f"from iteration {record.from_iteration} on: {change}"
            for change in record.provenance.changes(here)
        ]
    if not evidence.provenance.records:
        found.append("the job was stored before gaitswarm recorded what numbers depend on")
    yield from found
    if not found:
        return
    kernels = tuple(kernel_identity(load_robot(r), spec.precision).hex() for r in spec.described)
    if kernels == evidence.provenance.kernels:
        yield (
            "the kernels have the source that they had when the file was written: physics and"
            " control loop are the same, and what differs lies around them"
        )
    else:
        yield "kernels have another source than when the file was written: walks may differ"
    yield "equal bits in the replay show that none of this matters for what was replayed"


def _replay(evidence: Evidence, found: _Found, replay: int, seed: int) -> Answer:
    """Evaluations that are drawn, and the best one, come to the same bits here."""
    spec, columns = evidence.spec, evidence.columns
    refused = why_no_replay(spec)
    if refused is not None:
        return refused
    repeatable = has_same_bits_anywhere(spec, columns)
    drawn = np.random.default_rng(seed).permutation(np.flatnonzero(repeatable))[:replay]
    row, judged = _best_row(evidence)
    best = drawn[:0]
    if row is not None:
        where = (int(judged.iteration[row]), int(judged.particle[row]))
        at = np.array([row_of(columns, *where)])
        best = at[repeatable[at]]
    rows = np.unique(np.concatenate([drawn, best]))
    tables = [(spec, columns.rows(rows))]
    if evidence.reevaluated is not None and len(best):
        tables.append((spec.in_double(), evidence.reevaluated.rows(np.array([row]))))
    found.differences = simulated_differences(tables, evidence.recordings)
    found.replayed = len(rows)
    among = ", the best among them," if len(best) else ""
    what = f"{len(rows)} evaluations{among} in {len(spec.case_names)} cases"
    if not found.differences:
        return True, f"{what}: every bit is the same"
    evaluations = len({(d.iteration, d.particle) for d in found.differences})
    return False, f"{what}: {len(found.differences)} numbers of {evaluations} of them differ"
