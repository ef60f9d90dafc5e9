"""Comparison of jobs: convergence, distributions and differences of specs"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gaitswarm.services.optimizer.jobs.iteration import Iteration
from gaitswarm.services.optimizer.jobs.job import Job, JobState, ReferenceView
from gaitswarm.services.optimizer.views import Finite, JobName, View
from gaitswarm.sim.scenario import Scenario
from gaitswarm.sim.variables import Variable

if TYPE_CHECKING:
    from gaitswarm.services.optimizer.store import Store

MOST_JOBS: Final = 12
"""Jobs that can be compared at once."""

POINTS: Final = 400
"""Iterations of a job that are listed at most."""

_PAGE: Final = 5000
"""Iterations read at a time."""

_SHARES: Final = np.linspace(0.0, 1.0, 101)

_MEASURE: Final = {
    *("kind", "robot", "scenarios", "preference", "worlds", "recordings", "targets"),
    *("scenario_weights", "scenario_aggregate"),
}
"""Fields of a spec that define fitness."""


class ConvergenceView(View):
    """Convergence of a job: some of its iterations, the last among them."""

    id: JobName
    iterations: list[int] = Field(description="Index of each of them, from 0.", examples=[[0, 24]])
    evaluations: list[int] = Field(description="Designs evaluated by then.", examples=[[25, 625]])
    seconds: list[float] = Field(description="Time of evaluation by then [s].")
    best_so_far: list[Finite] = Field(examples=[[31.0, 17.2]])
    """Least fitness by then; null while every design has failed."""


class ConvergencesView(View):
    """Convergence of several jobs."""

    items: list[ConvergenceView]
    """Jobs in the requested order, without deleted ones."""


class ComparedJobView(View):
    """One of several jobs."""

    id: JobName
    name: str = Field(description="Name of the job.", examples=["chapter 4, preference A"])
    state: JobState = Field(description="Its state.", examples=["succeeded"])
    best_fitness: Finite = Field(description="Least fitness so far.", examples=[17.2])
    reference: ReferenceView | None = None
    """Published design that it is compared with, once known."""
    gain: Finite = Field(default=None, examples=[0.39])
    """Relative improvement of `best_fitness` over that of `reference` [1]; null if undefined."""
    evaluations: int = Field(description="Designs evaluated so far.", examples=[625])
    failed: int = Field(description="Of these, those that failed.", examples=[12])
    convergence: ConvergenceView = Field(description="Its convergence.")
    shares: list[float] = Field(examples=[[0.0, 0.5, 1.0]])
    """Shares of its designs that succeed in every case, rising from 0 to 1 [1]."""
    fitness: list[float] = Field(examples=[[17.2, 25.1, 310.0]])
    """Quantile of the fitness at each of these shares."""


class SpecDifferenceView(View):
    """A difference between the specs of jobs, names aside."""

    field: str = Field(examples=["optimizer.particles"])
    """Path of the field. A variable is one, as is a scenario that some specs lack."""
    values: list[str | None] = Field(examples=[["25", "50"]])
    """As JSON, by job; null where a spec has none. Of a variable its range in words; of a scenario
    that some specs lack its values that are not defaults."""


class JobComparisonView(View):
    """Comparison of jobs, without simulation."""

    jobs: list[ComparedJobView] = Field(description="In the requested order.")
    differences: list[SpecDifferenceView] = Field(description="Fields whose values differ.")
    comparable: bool
    """Whether all have the same measure: kind, robot, scenarios, preference and worlds. If not,
    their fitness is not the same quantity."""


def comparison(
    store: Store, jobs: Sequence[Job], fitness: Sequence[NDArray[np.float64]]
) -> JobComparisonView:
    """Compare jobs by the fitness (r,) of their designs, +inf for failed ones."""
    differences = list(_differences([job.spec.model_dump(mode="json") for job in jobs]))
    return JobComparisonView(
        jobs=[_compared(store, *parts) for parts in zip(jobs, fitness, strict=True)],
        differences=differences,
        comparable=_MEASURE.isdisjoint(d.field.split(".")[0] for d in differences),
    )


def _compared(store: Store, job: Job, fitness: NDArray[np.float64]) -> ComparedJobView:
    finite = fitness[np.isfinite(fitness)]
    return ComparedJobView(
        id=job.id,
        name=job.name,
        state=job.state,
        best_fitness=job.progress.best_fitness,
        reference=ReferenceView.from_reference(job.reference),
        gain=job.gain,
        evaluations=len(fitness),
        failed=len(fitness) - len(finite),
        convergence=convergence(store, job.id, POINTS),
        shares=_SHARES.tolist() if len(finite) else [],
        fitness=np.quantile(finite, _SHARES).tolist() if len(finite) else [],
    )


def convergence(store: Store, job_id: str, points: int) -> ConvergenceView:
    """Thin a job's iterations to some points."""
    iterations: list[Iteration] = []
    more = True
    while more:
        after = iterations[-1].index if iterations else None
        page = store.iterations(job_id, after=after, limit=_PAGE)
        iterations += page.items
        more = page.next is not None
    count = len(iterations)
    evaluations = np.cumsum([i.designs for i in iterations], dtype=np.int64)
    seconds = np.cumsum([i.evaluate_seconds for i in iterations], dtype=np.float64)
    rows = np.unique(np.linspace(0, count - 1, min(points, count)).round().astype(int))
    return ConvergenceView(
        id=job_id,
        iterations=[iterations[k].index for k in rows],
        evaluations=evaluations[rows].tolist(),
        seconds=seconds[rows].tolist(),
        best_so_far=[iterations[k].best_so_far for k in rows],
    )


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
            continue
        content = item
        if named and inner in lacked and path == "scenarios":
            content = Scenario.model_validate(item).model_dump(mode="json", exclude_defaults=True)
        if named:
            content = {k: part for k, part in content.items() if k != "name"} or content
        if named and inner in lacked:
            yield inner, json.dumps(content, ensure_ascii=False)
        else:
            yield from _leaves(content, inner, lacked)
    if not parts:
        yield path, json.dumps(value, ensure_ascii=False)


def _parts(value: Any, path: str) -> Iterator[tuple[str, Any, bool]]:
    """(path, part, whether it is of a list) of an object, or of a list of objects with names."""
    if isinstance(value, dict):
        for name, part in value.items():
            yield f"{path}.{name}" if path else name, part, False
    elif isinstance(value, list) and all(_named(item) for item in value):
        for item in value:
            yield f"{path}.{item['name']}", item, True


def _named(item: Any) -> bool:
    return isinstance(item, dict) and isinstance(item.get("name"), str)
