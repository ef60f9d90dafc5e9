"""The best designs of earlier jobs, as the start of a new one."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import chain, zip_longest

import numpy as np

from gaitswarm.services.optimizer.errors import GaitswarmError, InvalidRequest
from gaitswarm.services.optimizer.jobs.columns import EvaluationColumns
from gaitswarm.services.optimizer.jobs.design_space import DesignSpace
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.services.optimizer.jobs.start import EarlierJobs

Design = dict[str, float | str]


def started(
    spec: Spec,
    job_of: Callable[[str], Job],
    columns_of: Callable[[Job], EvaluationColumns],
) -> Spec:
    """Look up the designs that a job starts from, if it names earlier jobs."""
    if not isinstance(spec.start, EarlierJobs):
        return spec
    searched = tuple(variable.name for variable in spec.design_space().variables)
    ranked = []
    for index, job_id in enumerate(spec.start.jobs):
        try:
            job = job_of(job_id)
            space, count = job.spec.design_space(), spec.start.count
            found = list(best_designs(space, columns_of(job), searched, count))
            if not found:
                raise InvalidRequest(f"job {job_id} has no design that has not failed")
            _check(spec, found)
        except (GaitswarmError, ValueError) as error:
            raise InvalidRequest(str(error), field=f"start.jobs.{index}") from error
        ranked.append(found)
    designs = [design for design in chain(*zip_longest(*ranked)) if design is not None]
    different = list({tuple(design.items()): design for design in designs}.values())
    start = tuple(different[: spec.start.count])
    if len(start) > spec.budget:
        raise InvalidRequest(
            f"{len(start)} designs are more than the budget of {spec.budget}; lower it, or give"
            " more iterations",
            field="start.count",
        )
    return spec.model_copy(update={"start": start})


def best_designs(
    space: DesignSpace, columns: EvaluationColumns, searched: tuple[str, ...], count: int
) -> Iterator[Design]:
    """Choose the best different designs of a job."""
    seen = set[tuple[float | str, ...]]()
    for row in np.argsort(columns.fitness, kind="stable").tolist():
        if len(seen) == count or not np.isfinite(columns.fitness[row]):
            return
        shown = space.shown(columns.designs[row].tolist())
        design = {name: shown[name] for name in searched if name in shown}
        if tuple(design.values()) not in seen:
            seen.add(tuple(design.values()))
            yield design


def _check(spec: Spec, designs: list[Design]) -> None:
    try:
        spec.design_space().positions(designs)
    except ValueError as error:
        place, _, problem = str(error).partition(": ")
        number, _, name = place.partition(".")
        raise ValueError(f"{name} of its best design no. {int(number) + 1}: {problem}") from error
