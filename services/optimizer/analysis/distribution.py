"""Spread of designs by iteration, and designs thinned for plots"""

from __future__ import annotations

from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gaitswarm.services.optimizer.analysis.utilities import objective_vectors, utilities
from gaitswarm.services.optimizer.jobs.design_space import DesignSpace
from gaitswarm.services.optimizer.jobs.iteration import EvaluationColumns
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.preference import WEIGHED
from gaitswarm.services.optimizer.views import (
    Finite,
    IterationIndex,
    JobName,
    NextPage,
    View,
    framed,
)
from gaitswarm.sim.arrays import Floats

QUANTILES: Final = (0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0)


class DistributionItemView(View):
    """Distribution of the designs of one iteration."""

    index: IterationIndex
    fitness: list[Finite] = Field(examples=[[20.9, 21.0, 21.4, 22.3, 24.0, 29.1, 41.7]])
    """One fitness for each of `quantiles`; null where every design failed."""
    mean: Finite = Field(description="Mean of its finite fitnesses.", examples=[23.2])
    failed: int = Field(description="Designs that failed in at least one scenario.")
    diversity: Finite = Field(examples=[0.12])
    """Standard deviation of the designs as a share of each searched variable's range, mean over
    these variables [1]: 0 when the search has converged; null for an iteration of a single
    design."""


class DistributionView(View):
    """A page of the designs' distribution. The list is complete when `next` is null."""

    quantiles: list[float] = Field(examples=[list(QUANTILES)])
    """Shares of the designs that `fitness` is given for."""
    items: list[DistributionItemView] = Field(description="Iterations, in order.")
    next: NextPage


def distribution(
    columns: EvaluationColumns, space: DesignSpace, *, limit: int | None = None
) -> DistributionView:
    """Describe the first `limit` iterations."""
    starts = iteration_starts(columns)
    more = limit is not None and limit < len(starts)
    columns = columns.rows(slice(int(starts[limit]) if more else None))
    starts = starts[:limit]
    sizes = np.diff(starts, append=len(columns))
    quantiles = np.empty((len(starts), len(QUANTILES)))
    mean, diversity, failed = np.empty((3, len(starts)))
    share = space.box.to_unit(columns.designs[:, : len(space.variables)])
    # By size: most methods have iterations of one or two sizes.
    for size in np.unique(sizes):
        chosen = sizes == size
        rows = starts[chosen][:, np.newaxis] + np.arange(size)
        fitness = columns.fitness[rows]
        finite = np.isfinite(fitness)
        count = finite.sum(axis=1)
        # A mean of huge values may overflow.
        with np.errstate(over="ignore", invalid="ignore"):
            mean[chosen] = np.where(finite, fitness, 0.0).sum(axis=1) / count
        quantiles[chosen] = finite_quantiles(fitness, QUANTILES)
        failed[chosen] = size - count
        diversity[chosen] = share[rows].std(axis=1).mean(axis=1) if size > 1 else np.nan
    described = (columns.iteration[starts], quantiles, mean, failed.astype(int), diversity)
    names = tuple(DistributionItemView.model_fields)
    items = [
        DistributionItemView.model_validate(dict(zip(names, row, strict=True)))
        for row in zip(*(column.tolist() for column in described), strict=True)
    ]
    return DistributionView(
        quantiles=list(QUANTILES),
        items=items,
        next=str(items[-1].index) if more else None,
    )


def iteration_starts(columns: EvaluationColumns) -> NDArray[np.intp]:
    """Return the (I,) row of the first design of each iteration."""
    return np.flatnonzero(np.diff(columns.iteration, prepend=-1))


def finite_quantiles(values: Floats, quantiles: tuple[float, ...]) -> Floats:
    """Return (I, q) quantiles of each row's finite values (I, n), linearly interpolated."""
    ordered = np.sort(values, axis=1)
    last = np.isfinite(ordered).sum(axis=1) - 1
    place = np.maximum(last, 0)[:, np.newaxis] * np.array(quantiles)
    below = np.floor(place).astype(np.intp)
    above = np.minimum(below + 1, np.maximum(last, 0)[:, np.newaxis])
    low = np.take_along_axis(ordered, below, axis=1)
    high = np.take_along_axis(ordered, above, axis=1)
    share = place - below
    with np.errstate(invalid="ignore"):
        between = np.where(share > 0.0, (1.0 - share) * low + share * high, low)
    return np.where(last[:, np.newaxis] >= 0, between, np.nan)


def thinned(columns: EvaluationColumns, most: int) -> NDArray[np.intp]:
    """Return at most `most` rows for a plot: whole iterations, evenly chosen, ascending."""
    rows = len(columns)
    if rows <= most:
        return np.arange(rows)
    best = np.argmin(columns.fitness)
    starts = iteration_starts(columns)
    sizes = np.diff(starts, append=rows)
    chosen = np.linspace(0, rows - 1, most - 1).round().astype(np.intp)
    # As many as fit at the mean size; fewer if larger ones are among them.
    iterations = (most - 1) * len(starts) // rows
    while iterations >= 1:
        selected = np.linspace(0, len(starts) - 1, iterations).round().astype(np.intp)
        taken = int(sizes[selected].sum())
        if taken < most:
            chosen = np.concatenate([np.arange(starts[k], starts[k] + sizes[k]) for k in selected])
            break
        iterations = min(iterations - 1, iterations * (most - 1) // taken)
    return np.unique(np.append(chosen, best))


class ParticleColumnView(View):
    """Meaning of one column of numbers."""

    name: str
    """`iteration`, `particle`, `fitness`, a searched variable's name, `utility:<scenario>`, or
    `objective:<name>`."""
    unit: str = Field(description="Unit of its numbers.", examples=["counts"])
    low: float | None = Field(description="Lower bound of a variable; else null.")
    high: float | None = Field(description="Upper bound of a variable; else null.")
    kind: Literal[
        "index", "fitness", "continuous", "integer", "categorical", "utility", "objective"
    ] = Field(
        description="`continuous`, `integer` and `categorical` are variables,"
        " `objective` is an objective's geometric mean over the scenarios."
    )
    choices: list[str]
    """Names of a categorical variable's choices; its numbers are their indices."""


class ParticlesHeaderView(View):
    """Meaning of the numbers that follow."""

    job_id: JobName
    rows: int = Field(description="Evaluations that follow: numbers of each column.")
    total: int = Field(description="Evaluations from which the rows were chosen.")
    iterations: tuple[int, int] | None = Field(examples=[(0, 24)])
    """First and last iteration among the rows; null without any."""
    columns: list[ParticleColumnView] = Field(description="The columns, in order.")


def encoded_particles(
    job: Job, columns: EvaluationColumns, *, most: int, objectives: bool = False
) -> bytes:
    """Encode at most `most` evaluations, with f1 to f5 of a tuning job on request."""
    chosen, spec = columns.rows(thinned(columns, most)), job.spec
    rows = len(chosen)
    described: list[ParticleColumnView] = []
    numbers: list[NDArray[Any]] = []

    def add(name: str, unit: str, kind: str, values: NDArray[Any]) -> None:
        none: dict[str, Any] = {"low": None, "high": None, "choices": []}
        column = {"name": name, "unit": unit, "kind": kind, **none}
        described.append(ParticleColumnView.model_validate(column))
        numbers.append(values)

    unit = "A" if spec.kind == "identification" else "1"
    add("iteration", "1", "index", chosen.iteration)
    add("particle", "1", "index", chosen.particle)
    add("fitness", unit, "fitness", chosen.fitness)
    variables = spec.design_space().variables
    described += map(ParticleColumnView.model_validate, variables)
    numbers += list(chosen.designs[:, : len(variables)].T)
    for name, values in zip(spec.case_names, utilities(chosen, spec).T, strict=True):
        add(f"utility:{name}", unit, "utility", values)
    if objectives and isinstance(spec, JobSpec):
        vectors = objective_vectors(chosen, aggregation=spec.aggregation).T
        for objective, values in zip(WEIGHED, vectors, strict=True):
            add(f"objective:{objective.name}", objective.unit, "objective", values)
    header = ParticlesHeaderView(
        job_id=job.id,
        rows=rows,
        total=len(columns),
        iterations=(int(chosen.iteration[0]), int(chosen.iteration[-1])) if rows else None,
        columns=described,
    )
    table = np.stack(numbers).astype(np.float64)
    table[~np.isfinite(table)] = np.nan
    return framed(header, table)
