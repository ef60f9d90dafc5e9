"""Verification of a job's stored history."""

from __future__ import annotations

import secrets
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import groupby
from operator import itemgetter
from typing import TYPE_CHECKING, Final

import numpy as np

from gaitswarm.evidence.replay import (
    Table,
    has_same_bits_anywhere,
    replay_answer,
    simulated_differences,
    why_no_replay,
)
from gaitswarm.services.optimizer.errors import NotFound
from gaitswarm.services.optimizer.jobs.columns import EvaluationColumns
from gaitswarm.services.optimizer.jobs.estimate import duration
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.jobs.provenance import job_provenance
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.views.verification import (
    CheckView,
    HistoryVerificationView,
    VerificationRequest,
)

if TYPE_CHECKING:
    from gaitswarm.services.optimizer.analysis.verification import HistoryCheck

SHOWN: Final = 100
"""Differences that are listed at most."""


def run_verification(
    service: JobService,
    job_id: str,
    request: VerificationRequest,
    *,
    check: Callable[[float], None] = lambda _seconds: None,
) -> HistoryVerificationView:
    """Recompute a job's chain from the store and repeat some evaluations."""
    # Slow to import: it needs the database.
    from gaitswarm.services.optimizer.analysis.verification import check_history

    job = service.job(job_id)
    seed = secrets.randbelow(1 << 32) if request.seed is None else request.seed
    history = check_history(service.store, job, head=request.head)
    checks = [_chain(history)]
    if request.head is not None:
        checks.append(head_check(request.head, history.head_found_at, history.iterations))
    found = HistoryVerificationView(
        job=job.id,
        verified=True,
        iterations=history.iterations,
        head=history.head,
        broken_at=history.broken_at,
        checks=checks,
        provenance=list(_provenance(job)) if request.replay else [],
        replayed=0,
        seed=seed,
        differences=[],
    )
    if request.replay and history.sizes:
        found = _replayed(service, job, history, request.replay, found, check)
    return found.model_copy(update={"verified": all(c.passed is not False for c in found.checks)})


def _chain(history: HistoryCheck) -> CheckView:
    if history.problem:
        where = "" if history.broken_at is None else f"iteration {history.broken_at}: "
        return CheckView(name="chain", passed=False, detail=f"{where}{history.problem}")
    return chain_check(history.iterations, history.head)


def chain_check(iterations: int, head: str | None) -> CheckView:
    """Report an intact chain."""
    if head is None:
        return CheckView(name="chain", passed=None, detail="no iteration is committed yet")
    detail = f"{iterations} iterations chained, head {head}"
    return CheckView(name="chain", passed=True, detail=detail)


def head_check(head: str, at: int | None, iterations: int) -> CheckView:
    """Check a history against a digest noted earlier."""
    if at is None:
        detail = f"no iteration has the digest {head}: this is a different history"
    elif at == iterations - 1:
        detail = f"iteration {at}, the last, has the digest {head}"
    else:
        since = iterations - 1 - at
        detail = f"iteration {at} has the digest {head}; {since} more were committed since"
    return CheckView(name="head", passed=at is not None, detail=detail)


def _provenance(job: Job) -> Iterator[str]:
    """Changes of provenance on this machine."""
    if job.readable:
        here = job_provenance(job.spec)
        for record in job.provenance:
            for change in record.provenance.changes(here):
                yield f"from iteration {record.from_iteration} on: {change}"


def _replayed(
    service: JobService,
    job: Job,
    history: HistoryCheck,
    count: int,
    found: HistoryVerificationView,
    check: Callable[[float], None],
) -> HistoryVerificationView:
    """Add a replay to the verification."""
    spec = job.spec
    refused = why_no_replay(spec)
    if refused is not None:
        return _with(found, *refused)
    recordings = service.store.recordings(spec.recording_ids)
    places, best = _drawn(job, history, np.random.default_rng(found.seed), count)
    check(len(places) * duration(spec, spec.cases(recordings)))
    columns = _rows(service, job.id, places)
    columns = columns.rows(np.flatnonzero(has_same_bits_anywhere(spec, columns)))
    tables: list[Table] = [(spec, columns)]
    (at,) = np.nonzero((columns.iteration == best[0]) & (columns.particle == best[1]))
    if len(at) and spec.precision != "double":
        tables.append((spec.in_double(), _in_double(service, job.id, columns.rows(at))))
    differences = simulated_differences(tables, recordings)
    passed, detail = replay_answer(len(columns), len(at) > 0, spec, differences)
    replayed = {"replayed": len(columns), "differences": differences[:SHOWN]}
    return _with(found.model_copy(update=replayed), passed, detail)


Place = tuple[int, int]
"""Iteration and particle."""


def _drawn(
    job: Job, history: HistoryCheck, drawn: np.random.Generator, count: int
) -> tuple[list[Place], Place]:
    """Evaluations to simulate, the job's best among them."""
    ends = np.cumsum(history.sizes)
    rows = np.sort(drawn.permutation(int(ends[-1]))[:count])
    at = np.searchsorted(ends, rows, side="right")
    within = rows - ends[at] + np.array(history.sizes)[at]
    places = set(zip(at.tolist(), within.tolist(), strict=True))
    best = (job.progress.best_iteration, job.progress.best_particle)
    if best[0] is None or best[1] is None or best[0] >= len(ends):
        return sorted(places), (-1, -1)
    return sorted({*places, (best[0], best[1])}), (best[0], best[1])


def _rows(service: JobService, job_id: str, places: Sequence[Place]) -> EvaluationColumns:
    """Stored evaluations, in order."""
    pieces = []
    for iteration, found in groupby(places, key=itemgetter(0)):
        columns = service.store.evaluation_columns(job_id, iteration, iteration + 1)
        if columns is None:
            raise NotFound(f"job {job_id} has no iteration {iteration} any more")
        pieces.append(columns.rows(np.array([particle for _, particle in found])))
    arrays = zip(*(piece.arrays for piece in pieces), strict=True)
    return EvaluationColumns(*(np.concatenate(parts) for parts in arrays))


def _in_double(service: JobService, job_id: str, best: EvaluationColumns) -> EvaluationColumns:
    """The best evaluation in double precision."""
    iteration = int(best.iteration[0])
    found = service.store.reevaluations(job_id, iteration, iteration + 1)
    reevaluated = next(one for _, one in found)
    return replace(
        best,
        objectives=reevaluated.objectives[np.newaxis],
        statuses=reevaluated.statuses[np.newaxis],
        fitness=np.array([reevaluated.fitness]),
    )


def _with(
    found: HistoryVerificationView, passed: bool | None, detail: str
) -> HistoryVerificationView:
    check = CheckView(name="replay", passed=passed, detail=detail)
    return found.model_copy(update={"checks": [*found.checks, check]})
