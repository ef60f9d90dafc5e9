"""Checks evidence: what it says of itself, what follows from what, and what walks come to here."""

from __future__ import annotations

import hashlib
import os
import re
import secrets
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np

from gaitswarm.errors import InvalidRequest, NotFound, Unavailable
from gaitswarm.evidence.archive import check_hashes
from gaitswarm.evidence.certificates import (
    SUMMARY,
    by_certificate,
    certified_at,
    how_to_make_one,
)
from gaitswarm.evidence.checks import (
    Answer,
    best_row,
    changes_of_provenance,
    checks_of,
)
from gaitswarm.evidence.contents import JOB, row_of
from gaitswarm.evidence.history import head_check
from gaitswarm.evidence.reading import Evidence, check_robots, read_evidence
from gaitswarm.evidence.replay import (
    has_same_bits_anywhere,
    replay_answer,
    simulated_differences,
    why_no_replay,
)
from gaitswarm.places import place_of
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.views.verification import DIGEST, CheckView, DifferenceView, VerificationView
from gaitswarm.zip_archive import LARGEST_ARCHIVE, BadArchive, unzipped

_SHOWN: Final = 100
"""Differences that are listed."""


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
    """Check evidence of a job, by itself: no database is needed.

    Whatever is wrong with the file is a finding, not an error.

    Args:
        evidence: The file's name, or its content as `Jobs.evidence` writes it.
        replay: Evaluations to draw and simulate anew, besides the best one, of the job and of each
            certificate in its evidence; 0 for no walk at all.
        seed: By which they are drawn; None for one that nobody can foresee.
        head: Digest of an iteration of the job that was noted down earlier, as `JobView.head`, to
            be looked for; None to look for none.

    Returns:
        What was checked, and what differs.

    Raises:
        NotFound: There is no such file.
        InvalidRequest: The file cannot be opened, `replay` or `seed` is negative, or `head` is no
            digest.
        EvaluatorUnavailable: Walks cannot be run here.
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
        raise NotFound(f"there is no file {path}") from error
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
    """evidence: of the job that tried the design. Raises BadArchive."""
    if SUMMARY not in members:
        raise BadArchive(f"it has no {SUMMARY}")
    certificate = _check_run(members, found, replay, drawn, job_id)
    if certificate.job.id != job_id:
        raise BadArchive(f"{JOB} is of another certificate than its folder")
    passed, detail = _tried(lambda: _design(evidence, certificate))
    found.add("design", passed, detail, job_id)


def _design(evidence: Evidence, certificate: Evidence) -> Answer:
    """The design that is certified is one of those that the job tried."""
    best, spec, place = evidence.job.best, evidence.spec, None
    if isinstance(spec, JobSpec):
        place = certified_at(spec, evidence.columns, certificate.spec)
    if place is None:
        return False, "it is of no design that this job tried"
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
    """certificate: id of the one that the members are of. Raises BadArchive."""
    evidence = read_evidence(members)
    rows = f"{len(evidence.columns)} evaluations in {len(evidence.asked)} iterations"
    found.add("contents", True, f"{rows}, all as the spec has them", certificate)
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
    except Exception as error:  # noqa: BLE001 - whatever comes of numbers that no gaitswarm wrote
        return False, f"cannot be computed: {type(error).__name__}: {str(error)[:200]}"


def _replay(
    evidence: Evidence,
    found: _Found,
    replay: int,
    drawn: np.random.Generator,
    certificate: str | None,
) -> Answer:
    """Evaluations that are drawn, and the best one, come to the same bits here."""
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
