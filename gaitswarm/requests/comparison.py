"""Jobs beside each other, from what is stored. Knows nothing of HTTP."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from typing import Any, Final

import numpy as np

from gaitswarm.views.base import finite
from gaitswarm.views.comparison import (
    ComparedJobView,
    ConvergencesView,
    ConvergenceView,
    JobComparisonView,
    SpecDifferenceView,
)
from gaitswarm.views.reference import ReferenceView
from services.optimizer.errors import InvalidRequest, NotFound
from services.optimizer.jobs.iteration import Iteration
from services.optimizer.jobs.job import Job
from services.optimizer.service import JobService

MOST_JOBS: Final = 12
"""Jobs that are compared at once."""

POINTS: Final = 400
"""Iterations of a job that are listed; of more, so many."""

_SHARES: Final = np.linspace(0.0, 1.0, 101)
_PAGE: Final = 5000

_MEASURE: Final = ("kind", "robot", "scenarios", "preference", "worlds", "recordings", "targets")
"""Fields of a spec that say what fitness is."""


def run_comparison(service: JobService, job_ids: Sequence[str]) -> JobComparisonView:
    """Set jobs beside each other.

    Args:
        service: Where the jobs are.
        job_ids: Identifiers of one job at least, each once.

    Returns:
        How they converged, how their designs are spread, and how their specs differ.

    Raises:
        InvalidRequest: There are too many, or one is named twice.
        NotFound: No job of one of the ids.
        Unreadable: A spec cannot be read.
        Conflict: A job is too large to be held in memory.
    """
    if len(set(job_ids)) < len(job_ids) or len(job_ids) > MOST_JOBS:
        raise InvalidRequest(f"must be at most {MOST_JOBS} jobs, each once", field="job_ids")
    jobs = [service.job(job_id) for job_id in job_ids]
    documents = [job.spec.model_dump(mode="json") for job in jobs]
    differences = list(_differences(documents))
    measure = {difference.field.split(".")[0] for difference in differences}
    return JobComparisonView(
        jobs=[_compared(service, job) for job in jobs],
        differences=differences,
        comparable=measure.isdisjoint(_MEASURE),
    )


def run_convergences(service: JobService, job_ids: Sequence[str], points: int) -> ConvergencesView:
    """List how jobs came to their best, shortly.

    Args:
        service: Where the jobs are.
        job_ids: Their identifiers.
        points: Iterations of each to list, at most.

    Returns:
        One item for each job that there is.
    """
    found = []
    for job_id in job_ids:
        try:
            found.append(_convergence(service, job_id, points))
        except NotFound:
            # It was deleted since the list was made.
            continue
    return ConvergencesView(items=found)


def _compared(service: JobService, job: Job) -> ComparedJobView:
    fitness = service.columns(job).fitness if job.progress.iterations else np.empty(0)
    walks = fitness[np.isfinite(fitness)]
    return ComparedJobView(
        id=job.id,
        name=job.name,
        state=job.state,
        best_fitness=finite(job.progress.best_fitness),
        reference=ReferenceView.from_reference(job.reference),
        gain=finite(job.gain),
        evaluations=len(fitness),
        failed=len(fitness) - len(walks),
        convergence=_convergence(service, job.id, POINTS),
        shares=_SHARES.tolist() if len(walks) else [],
        fitness=np.quantile(walks, _SHARES).tolist() if len(walks) else [],
    )


def _convergence(service: JobService, job_id: str, points: int) -> ConvergenceView:
    known = list(_iterations(service, job_id))
    evaluations = np.cumsum([i.designs for i in known], dtype=np.int64)
    seconds = np.cumsum([i.evaluate_seconds for i in known], dtype=np.float64)
    chosen = np.unique(np.linspace(0, len(known) - 1, min(points, len(known))).round().astype(int))
    rows = chosen.tolist() if known else []
    return ConvergenceView(
        id=job_id,
        iterations=[known[k].index for k in rows],
        evaluations=[int(evaluations[k]) for k in rows],
        seconds=[float(seconds[k]) for k in rows],
        best_so_far=[finite(known[k].best_so_far) for k in rows],
    )


def _iterations(service: JobService, job_id: str) -> Iterator[Iteration]:
    after: int | None = None
    while True:
        page = service.iterations(job_id, after=after, limit=_PAGE)
        yield from page.items
        if page.next is None or not page.items:
            return
        after = page.items[-1].index


def _differences(documents: Sequence[dict[str, Any]]) -> Iterator[SpecDifferenceView]:
    flat = [dict(_leaves(document, "")) for document in documents]
    for field in dict.fromkeys(name for fields in flat for name in fields):
        values = [fields.get(field) for fields in flat]
        if len(set(values)) > 1:
            yield SpecDifferenceView(field=field, values=values)


def _leaves(value: Any, path: str) -> Iterator[tuple[str, str]]:
    """Fields by their paths, as JSON; items of a list by their names, if they have any."""
    if isinstance(value, dict) and value:
        for name, part in value.items():
            yield from _leaves(part, f"{path}.{name}" if path else name)
    elif isinstance(value, list) and value and all(_named(item) for item in value):
        for item in value:
            rest = {name: part for name, part in item.items() if name != "name"}
            yield from _leaves(rest or item, f"{path}.{item['name']}")
    else:
        yield path, json.dumps(value, ensure_ascii=False)


def _named(item: Any) -> bool:
    return isinstance(item, dict) and isinstance(item.get("name"), str)
