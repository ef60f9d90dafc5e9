"""Which variables of a job matter, from what is stored. Knows nothing of HTTP."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from gaitswarm.requests.targets import Histories
from gaitswarm.services.optimizer.analysis.distribution import thinned
from gaitswarm.services.optimizer.analysis.importance import (
    MOST_DESIGNS,
    companions,
    first_order_indices,
)
from gaitswarm.services.optimizer.analysis.interval import Interval
from gaitswarm.services.optimizer.analysis.robustness.index import NORMALISED_OBJECTIVES
from gaitswarm.services.optimizer.analysis.utilities import objective_vectors
from gaitswarm.services.optimizer.errors import Conflict, InvalidRequest
from gaitswarm.services.optimizer.jobs.columns import EvaluationColumns
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.sim.variables import Variable
from gaitswarm.views.importance import (
    ImportanceView,
    IndexIntervalView,
    VariableImportanceView,
    WidenedView,
)

NEAR: Final = 0.01
"""Share of a variable's range within which a winner lies at the bound [1]."""

_STEPS: Final = (0.5, 0.25, 0.1)
"""How far a bound may move, in shares of the range; the first that can be simulated."""

_KINDS: Final = ("tuning", "identification", "calibration")

Floats = NDArray[np.float64]
Indices = Sequence[Interval | None]


def run_importance(histories: Histories, job_id: str) -> ImportanceView:
    """Say which variables of a job matter, from what is stored."""
    job = histories.job(job_id)
    if job.spec.kind not in _KINDS:
        raise InvalidRequest(
            f"job {job_id} is of kind {job.spec.kind}; only a job that tunes a drive or fits"
            " parameters has variables that may matter",
            field="job_id",
        )
    columns = histories.columns(job)
    if not len(columns):
        raise Conflict(f"job {job_id} has no design yet; ask again after its first iteration")
    walks = int(np.isfinite(columns.fitness).sum())
    sampled = columns.rows(thinned(columns, MOST_DESIGNS))
    best = histories.best(job_id)
    winner = None if best is None else best.design
    return ImportanceView(
        designs=walks,
        failed=len(columns) - walks,
        sampled=len(sampled),
        objectives=[o.name for o in NORMALISED_OBJECTIVES] if job.spec.kind == "tuning" else [],
        iteration=None if best is None else best.iteration,
        particle=None if best is None else best.particle,
        variables=list(_variables(job.spec, sampled, winner)),
    )


def _variables(
    spec: Spec, columns: EvaluationColumns, winner: Floats | None
) -> Iterator[VariableImportanceView]:
    variables = spec.design_space().variables
    designs = columns.designs[:, : len(variables)]
    walks = np.isfinite(columns.fitness)

    def indices(output: Floats, among: NDArray[np.bool_]) -> Indices:
        found = first_order_indices(designs[among], variables, output[among])
        return (None,) * len(variables) if found is None else found

    fitness = indices(columns.fitness, walks)
    failing = indices((~walks).astype(np.float64), np.ones_like(walks))
    objectives = {}
    if isinstance(spec, JobSpec):
        vectors = objective_vectors(columns, worlds=spec.worlds)
        known = walks & np.isfinite(vectors).all(axis=1)
        for column, objective in enumerate(NORMALISED_OBJECTIVES):
            objectives[objective.name] = indices(vectors[:, column], known)
    moved = companions(designs, variables)
    for k, variable in enumerate(variables):
        value = None if winner is None else float(winner[k])
        at = None if value is None else _bound_at(variable, value)
        companion = moved[k]
        yield VariableImportanceView(
            name=variable.name,
            unit=variable.unit,
            low=variable.low,
            high=variable.high,
            fitness=_view(fitness[k]),
            failing=_view(failing[k]),
            objectives={name: _view(found[k]) for name, found in objectives.items()},
            moved_with=None if companion is None else companion.name,
            correlation=None if companion is None else companion.correlation,
            winner=value,
            at=at,
            widened=None if at is None else _widened(spec, variable, at),
        )


def _view(interval: Interval | None) -> IndexIntervalView | None:
    return None if interval is None else IndexIntervalView.from_interval(interval)


def _bound_at(variable: Variable, value: float) -> Literal["low", "high"] | None:
    # All that a categorical variable, or one of two whole numbers, can be is at an end.
    if variable.kind == "categorical" or (variable.kind == "integer" and _range(variable) < 2):
        return None
    near = NEAR * _range(variable)
    if value <= variable.low + near:
        return "low"
    return "high" if value >= variable.high - near else None


def _range(variable: Variable) -> float:
    return variable.high - variable.low


def _widened(spec: Spec, variable: Variable, at: Literal["low", "high"]) -> WidenedView | None:
    """The widest of some bounds that the job could be simulated with; None for none of them."""
    if not isinstance(spec, JobSpec):
        return None
    for low, high in _wider(variable, at):
        wider = variable.model_copy(update={"low": low, "high": high})
        chosen = [wider if v.name == variable.name else v for v in spec.design_space().variables]
        try:
            spec.model_copy(update={"variables": tuple(chosen)}).check_can_be_simulated()
        except InvalidRequest:
            continue
        return WidenedView(low=low, high=high)
    return None


def _wider(variable: Variable, at: Literal["low", "high"]) -> Iterator[tuple[float, float]]:
    low, high = variable.low, variable.high
    for step in _STEPS:
        further = step * _range(variable)
        if variable.kind == "integer":
            further = max(1.0, round(further))
        if at == "high":
            yield low, _shown(variable, high + further)
        # What is above zero by its bounds stays so.
        elif low <= 0.0 or low - further > 0.0:
            yield _shown(variable, low - further), high
    if at == "low" and low > 0.0 and variable.kind != "integer":
        yield _shown(variable, 0.5 * low), high


def _shown(variable: Variable, bound: float) -> float:
    """Without digits that nobody would type."""
    return bound if variable.kind == "integer" else float(f"{bound:.6g}")
