"""Analyses of jobs"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from gaitswarm.requests.identification import Histories
from gaitswarm.services.optimizer.analysis.certificate import certificate
from gaitswarm.services.optimizer.analysis.distribution import thinned
from gaitswarm.services.optimizer.analysis.importance import (
    MOST_DESIGNS,
    companions,
    first_order_indices,
)
from gaitswarm.services.optimizer.analysis.scenario_families import scenario_families
from gaitswarm.services.optimizer.analysis.statistics import Interval
from gaitswarm.services.optimizer.analysis.utilities import (
    NORMALISED_OBJECTIVES,
    log_utilities,
    objective_vectors,
)
from gaitswarm.services.optimizer.errors import Conflict, InvalidRequest
from gaitswarm.services.optimizer.jobs.columns import EvaluationColumns
from gaitswarm.services.optimizer.jobs.kinds.certificate import CertificateSpec
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.sim.variables import Variable
from gaitswarm.views.analysis import (
    ImportanceView,
    IndexIntervalView,
    ScenarioFamiliesView,
    VariableImportanceView,
    WidenedView,
)
from gaitswarm.views.certificate import CertificateView


def run_certificate(
    histories: Histories, job_id: str, *, worlds: int | None = None, most: int = 5
) -> CertificateView:
    """Summarize a certificate."""
    job = histories.job(job_id)
    spec = job.spec
    if not isinstance(spec, CertificateSpec):
        raise InvalidRequest(
            f"job {job.id} is of kind {spec.kind}; only a certificate has worlds", field="job_id"
        )
    found = certificate(spec, histories.columns(job), worlds=worlds, most=most)
    return CertificateView.from_certificate(job.id, spec, found)


TOLERANCE: Final = 0.01
"""Regret of the smallest family, by default [1]."""


def run_scenario_families(
    histories: Histories, job_id: str, tolerance: float
) -> ScenarioFamiliesView:
    """Judge a job's designs by fewer scenarios."""
    if not 0.0 <= tolerance < np.inf:
        raise InvalidRequest("must be at least 0", field="tolerance")
    job = histories.job(job_id)
    if not isinstance(job.spec, JobSpec):
        raise InvalidRequest(
            f"job {job_id} is of kind {job.spec.kind}; only a job that tunes a drive has scenarios",
            field="job_id",
        )
    columns = histories.columns(job)
    spec, names = job.spec, [scenario.name for scenario in job.spec.resolved_scenarios()]
    judged = log_utilities(columns, spec.resolved_preference())
    if spec.worlds is not None:
        judged = spec.worlds.aggregated(judged)
    if not np.isfinite(judged).all(axis=1).any():
        raise Conflict(f"job {job_id} has no design yet that succeeds in all scenarios")
    found = scenario_families(judged, tolerance=tolerance)
    return ScenarioFamiliesView.from_families(found, names, columns)


NEAR: Final = 0.01
"""Share of a variable's range within which a winner lies at the bound [1]."""

_STEPS: Final = (0.5, 0.25, 0.1)
"""How far a bound may move, in shares of the range; the first that can be simulated."""

_KINDS: Final = ("tuning", "identification", "calibration")

Floats = NDArray[np.float64]
Indices = Sequence[Interval | None]


def run_importance(histories: Histories, job_id: str) -> ImportanceView:
    """Estimate which variables of a job matter."""
    job = histories.job(job_id)
    if job.spec.kind not in _KINDS:
        raise InvalidRequest(
            f"job {job_id} is of kind {job.spec.kind}; only a job that tunes a drive or fits"
            " parameters has variables that may matter",
            field="job_id",
        )
    columns = histories.columns(job)
    if not len(columns):
        raise Conflict(f"job {job_id} has no design yet; try again after its first iteration")
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
    # Every value of a categorical variable, or of one of two integers, is at an end.
    if variable.kind == "categorical" or (variable.kind == "integer" and _range(variable) < 2):
        return None
    near = NEAR * _range(variable)
    if value <= variable.low + near:
        return "low"
    return "high" if value >= variable.high - near else None


def _range(variable: Variable) -> float:
    return variable.high - variable.low


def _widened(spec: Spec, variable: Variable, at: Literal["low", "high"]) -> WidenedView | None:
    """The widest bounds that can be simulated; None if none can."""
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
        # Positive variables stay positive.
        elif low <= 0.0 or low - further > 0.0:
            yield _shown(variable, low - further), high
    if at == "low" and low > 0.0 and variable.kind != "integer":
        yield _shown(variable, 0.5 * low), high


def _shown(variable: Variable, bound: float) -> float:
    """Round a bound to six digits."""
    return bound if variable.kind == "integer" else float(f"{bound:.6g}")
