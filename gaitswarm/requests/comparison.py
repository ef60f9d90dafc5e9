"""Comparison of jobs."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from typing import Any, Final

import numpy as np

from gaitswarm.services.optimizer.errors import InvalidRequest, NotFound
from gaitswarm.services.optimizer.jobs.iteration import Iteration
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.views import finite
from gaitswarm.sim.scenario import Scenario
from gaitswarm.sim.variables import Variable
from gaitswarm.views.catalogue import ReferenceView
from gaitswarm.views.comparison import (
    ComparedJobView,
    ConvergencesView,
    ConvergenceView,
    JobComparisonView,
    SpecDifferenceView,
)

MOST_JOBS: Final = 12
"""Jobs that can be compared at once."""

POINTS: Final = 400
"""Iterations of a job that are listed at most."""

_SHARES: Final = np.linspace(0.0, 1.0, 101)
_PAGE: Final = 5000

_MEASURE: Final = ("kind", "robot", "scenarios", "preference", "worlds", "recordings", "targets")
"""Fields of a spec that define fitness."""


def run_comparison(service: JobService, job_ids: Sequence[str]) -> JobComparisonView:
    """Compare jobs."""
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
    """List the convergence of jobs, thinned to some points."""
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
    items = [set(_items(document, "")) for document in documents]
    lacked = items[0].union(*items) - items[0].intersection(*items)
    flat = [dict(_leaves(document, "", lacked)) for document in documents]
    fields = dict.fromkeys(field for document in flat for field in document)
    # Names are shown with the jobs.
    fields.pop("name", None)
    rooms = list(dict.fromkeys(field.split(".")[0] for field in fields))
    for field in sorted(fields, key=lambda field: rooms.index(field.split(".")[0])):
        values = [document.get(field) for document in flat]
        if len(set(values)) > 1:
            yield SpecDifferenceView(field=field, values=values)


def _items(value: Any, path: str) -> Iterator[str]:
    """Paths of the items of lists that have names."""
    for inner, item, named in _parts(value, path):
        if named:
            yield inner
        yield from _items(item, inner)


def _leaves(value: Any, path: str, lacked: set[str]) -> Iterator[tuple[str, str]]:
    """Fields by path; variables, and items that some specs lack, as one value."""
    parts = list(_parts(value, path))
    for inner, item, named in parts:
        if named and path == "variables":
            yield inner, Variable.model_validate(item).range_in_words
        elif named and inner in lacked:
            yield inner, _json(_said(item, path))
        else:
            yield from _leaves(_rest(item) if named else item, inner, lacked)
    if not parts:
        yield path, _json(value)


def _parts(value: Any, path: str) -> Iterator[tuple[str, Any, bool]]:
    """(path, part, whether it is of a list) of an object, or of a list of objects with names."""
    if isinstance(value, dict):
        for name, part in value.items():
            yield f"{path}.{name}" if path else name, part, False
    elif isinstance(value, list) and all(_named(item) for item in value):
        for item in value:
            yield f"{path}.{item['name']}", item, True


def _said(item: dict[str, Any], path: str) -> dict[str, Any]:
    """Content of a list's item; of a scenario its values that are not defaults."""
    if path == "scenarios":
        item = Scenario.model_validate(item).model_dump(mode="json", exclude_defaults=True)
    return _rest(item)


def _rest(item: dict[str, Any]) -> dict[str, Any]:
    """Fields of a list's item other than its name."""
    return {name: part for name, part in item.items() if name != "name"} or item


def _json(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False)


def _named(item: Any) -> bool:
    return isinstance(item, dict) and isinstance(item.get("name"), str)
