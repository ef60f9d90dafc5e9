"""Importance of variables: first-order Sobol' indices, estimated from a job's designs

Var(E[Y | X]) / Var(Y) of an output's ranks (Saltelli et al., Global Sensitivity Analysis, 2008,
1.2), estimated by classes of the variable: the correlation ratio (Plischke, Reliability Engineering
& System Safety 95, 2010) with Kelley's correction for chance (PNAS 21, 1935). A search's variables
move together, so that correlated variables share their index, and indices do not add up to 1.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gaitswarm.services.optimizer.analysis.bounds import (
    End,
    WidenedView,
    bound_at,
    with_wider_bounds,
)
from gaitswarm.services.optimizer.analysis.distribution import thinned
from gaitswarm.services.optimizer.analysis.statistics import (
    CONFIDENCE,
    average_ranks,
    resample_weights,
)
from gaitswarm.services.optimizer.analysis.utilities import objective_vectors
from gaitswarm.services.optimizer.jobs.iteration import Evaluation, EvaluationColumns
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.preference import WEIGHED_NAMES
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.services.optimizer.search.random_stream import RandomNumbers
from gaitswarm.services.optimizer.views import View
from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.variables import Variable

LEAST_DESIGNS: Final = 20
"""Minimum number of designs for an estimate."""

MOST_DESIGNS: Final = 10_000
"""Limit on the number of designs; larger histories are thinned evenly over the iterations."""

_RESAMPLES: Final = 200
_MOST_CLASSES: Final = 24
_RESAMPLE: Final = 0x1337


class IndexIntervalView(View):
    """A first-order Sobol' index [1] with its interval."""

    value: float = Field(examples=[0.41])
    """Share of the variance of the output's rank explained by this variable alone."""
    low: float = Field(description="Lower end of the interval of 95 %.", examples=[0.35])
    high: float = Field(description="Upper end.", examples=[0.47])


class VariableImportanceView(View):
    """Influence of one variable on the results."""

    name: str = Field(description="Name of the variable.", examples=["FI1R"])
    unit: str = Field(description="Its unit.", examples=["counts"])
    low: float = Field(description="Lower bound of the search.", examples=[1500.0])
    high: float = Field(description="Upper bound.", examples=[6000.0])
    fitness: IndexIntervalView | None
    """Index for the fitness, among designs that succeed in every case; null if there are too few,
    or all are equal."""
    failing: IndexIntervalView | None
    """Index for failure or infeasibility, among all designs; null if none fails, all do, or there
    are too few."""
    objectives: dict[str, IndexIntervalView | None]
    """Index for each objective over all scenarios, among designs that succeed in every scenario;
    empty for a job that tunes no drive."""
    moved_with: str | None = Field(examples=["FI2R"])
    """Variable of the greatest correlation with it among all designs: an effect of one may be due
    to the other."""
    correlation: float | None = Field(examples=[0.62])
    """Spearman's rank correlation of the two [1]."""
    winner: float | None = Field(examples=[5950.0])
    """Value in the job's best design, of a categorical variable the index of the choice; null
    without one."""
    at: End | None
    """Bound at which the winner lies, within a hundredth of the range."""
    widened: WidenedView | None
    """Wider bounds that can be simulated, by half the range or less; null if the winner is inside,
    the job tunes no drive, or the controller sets the bound."""


class ImportanceView(View):
    """Which variables of a job matter, from what it has stored; nothing is simulated.

    First-order Sobol' indices of the outputs' ranks among the designs that were tried: a search
    does not draw at random, so variables that moved together share their indices.
    """

    designs: int = Field(description="Designs that succeed in every case.", examples=[613])
    failed: int = Field(description="Designs that do not.", examples=[12])
    sampled: int = Field(description="Designs used for the indices; a long job is thinned.")
    objectives: list[str] = Field(description="Names of the objectives, for a job that tunes.")
    iteration: int | None = Field(description="Iteration of the best design; null without one.")
    particle: int | None = Field(description="Number of the best design in its iteration.")
    variables: list[VariableImportanceView] = Field(description="Searched variables, in order.")


Indices = Sequence[IndexIntervalView | None]


def importance(spec: Spec, columns: EvaluationColumns, best: Evaluation | None) -> ImportanceView:
    """Estimate which variables of a job with evaluations matter."""
    succeeded = int(np.isfinite(columns.fitness).sum())
    sampled = columns.rows(thinned(columns, MOST_DESIGNS))
    return ImportanceView(
        designs=succeeded,
        failed=len(columns) - succeeded,
        sampled=len(sampled),
        objectives=list(WEIGHED_NAMES) if isinstance(spec, JobSpec) else [],
        iteration=None if best is None else best.iteration,
        particle=None if best is None else best.particle,
        variables=list(_variables(spec, sampled, None if best is None else best.design)),
    )


def _variables(
    spec: Spec, columns: EvaluationColumns, winner: Floats | None
) -> Iterator[VariableImportanceView]:
    variables = spec.design_space().variables
    designs = columns.designs[:, : len(variables)]
    succeeded = np.isfinite(columns.fitness)

    def indices(output: Floats, among: NDArray[np.bool_]) -> Indices:
        estimates = first_order_indices(designs[among], variables, output[among])
        return (None,) * len(variables) if estimates is None else estimates

    fitness = indices(columns.fitness, succeeded)
    failing = indices((~succeeded).astype(np.float64), np.ones_like(succeeded))
    objectives = {}
    if isinstance(spec, JobSpec):
        vectors = objective_vectors(columns, aggregation=spec.aggregation)
        complete = succeeded & np.isfinite(vectors).all(axis=1)
        for column, name in enumerate(WEIGHED_NAMES):
            objectives[name] = indices(vectors[:, column], complete)
    moved = companions(designs, variables)
    for k, variable in enumerate(variables):
        value = None if winner is None else float(winner[k])
        at = None if value is None else bound_at(variable, value)
        companion, correlation = moved[k] or (None, None)
        yield VariableImportanceView(
            name=variable.name,
            unit=variable.unit,
            low=variable.low,
            high=variable.high,
            fitness=fitness[k],
            failing=failing[k],
            objectives={name: estimates[k] for name, estimates in objectives.items()},
            moved_with=companion,
            correlation=correlation,
            winner=value,
            at=at,
            widened=None if at is None else with_wider_bounds(spec, variable, at)[1],
        )


def first_order_indices(
    designs: Floats, variables: Sequence[Variable], output: Floats
) -> list[IndexIntervalView] | None:
    """Estimate every variable's first-order Sobol' index for an output (r,), by its order alone."""
    if len(output) < LEAST_DESIGNS:
        return None
    rank = average_ranks(output)
    # Centered, so that sums of squares lose no digits.
    rank -= rank.mean()
    if not rank.any():
        return None
    draws = RandomNumbers(len(rank), _RESAMPLE).uniform(_RESAMPLES, len(rank))
    weights = resample_weights(draws)
    tail = 0.5 * (1.0 - CONFIDENCE)
    result = []
    for column, variable in enumerate(variables):
        ratios = _corrected_ratio(_classes(designs[:, column], variable), rank, weights)
        # Resamples repeat designs, which increases their ratios: subtract that shift.
        resampled = ratios[1:] - (np.mean(ratios[1:]) - ratios[0])
        value, *around = np.clip([ratios[0], *resampled], 0.0, 1.0)
        low, high = np.quantile(around, (tail, 1.0 - tail), method="inverted_cdf")
        result.append(IndexIntervalView(value=value, low=low, high=high))
    return result


def companions(designs: Floats, variables: Sequence[Variable]) -> list[tuple[str, float] | None]:
    """Return for every variable the most strongly correlated one, with Spearman's correlation."""
    ranks = np.apply_along_axis(average_ranks, 0, designs)
    ranks -= ranks.mean(axis=0)
    size = np.sqrt((ranks**2).sum(axis=0))
    with np.errstate(divide="ignore", invalid="ignore"):
        correlation = (ranks.T @ ranks) / np.outer(size, size)
    np.fill_diagonal(correlation, np.nan)
    result: list[tuple[str, float] | None] = []
    for row in correlation:
        if np.isnan(row).all():
            result.append(None)
            continue
        other = int(np.nanargmax(np.abs(row)))
        result.append((variables[other].name, float(np.clip(row[other], -1.0, 1.0))))
    return result


def _classes(values: Floats, variable: Variable) -> NDArray[np.intp]:
    """(r,) class of each value, from 0, of equal sizes except for ties."""
    distinct, inverse = np.unique(values, return_inverse=True)
    # The number of classes grows with the cube root of the number of designs.
    count = int(np.clip(round(len(values) ** (1 / 3)), 2, _MOST_CLASSES))
    if variable.kind == "categorical" or len(distinct) <= count:
        return np.asarray(inverse, dtype=np.intp)
    edges = np.unique(np.quantile(values, np.linspace(0.0, 1.0, count + 1)[1:-1]))
    return np.searchsorted(edges, values, side="right")


def _corrected_ratio(classes: NDArray[np.intp], rank: Floats, weights: Floats) -> Floats:
    """(B,) epsilon squared of each row of weights (Kelley 1935); may be negative."""
    members = np.equal.outer(classes, np.arange(classes.max() + 1)).astype(np.float64)
    count = weights @ members
    sums = weights @ (members * rank[:, np.newaxis])
    rows, present = count.sum(axis=1), (count > 0).sum(axis=1)
    mean = sums.sum(axis=1) / rows
    total = weights @ rank**2 - rows * mean**2
    with np.errstate(divide="ignore", invalid="ignore"):
        between = np.where(count > 0, sums**2 / count, 0.0).sum(axis=1) - rows * mean**2
        unexplained = np.clip(1.0 - between / total, 0.0, 1.0)
        index = 1.0 - unexplained * (rows - 1) / (rows - present)
    return np.where((present > 1) & (present < rows) & (total > 0.0), index, 0.0)
