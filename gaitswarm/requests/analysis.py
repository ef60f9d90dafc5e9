"""Analyses of jobs"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from gaitswarm.errors import invalid_request, simulation_errors
from gaitswarm.requests.identification import Histories
from gaitswarm.requests.robustness import RobustnessRequest, run_robustness
from gaitswarm.services.optimizer.analysis.certificate import certificate
from gaitswarm.services.optimizer.analysis.distribution import thinned
from gaitswarm.services.optimizer.analysis.front import pareto_front
from gaitswarm.services.optimizer.analysis.importance import (
    MOST_DESIGNS,
    companions,
    first_order_indices,
)
from gaitswarm.services.optimizer.analysis.preference_winners import (
    Winner,
    drawn_preferences,
    winners,
)
from gaitswarm.services.optimizer.analysis.robustness_index import NORMALISED_OBJECTIVES
from gaitswarm.services.optimizer.analysis.scenario_families import scenario_families
from gaitswarm.services.optimizer.analysis.statistics import Interval
from gaitswarm.services.optimizer.analysis.utilities import log_utilities, objective_vectors
from gaitswarm.services.optimizer.analysis.winning_preference import preference_fits
from gaitswarm.services.optimizer.errors import Conflict, InvalidRequest, NotFound
from gaitswarm.services.optimizer.jobs.columns import EvaluationColumns
from gaitswarm.services.optimizer.jobs.documents import AnySpec
from gaitswarm.services.optimizer.jobs.kinds.certificate import CertificateSpec
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.services.optimizer.views import finite
from gaitswarm.settings import place_of
from gaitswarm.sim.kernel.walk import Precision
from gaitswarm.sim.variables import Variable
from gaitswarm.views.analysis import (
    ImportanceView,
    IndexIntervalView,
    PreferenceWinnerView,
    RobustPreferencesView,
    ScenarioFamiliesView,
    VariableImportanceView,
    WidenedView,
)
from gaitswarm.views.certificate import CertificateView
from gaitswarm.views.robustness import IndexView
from gaitswarm.views.trade_offs import FrontView, PreferenceForView


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


DESIGNS: Final = 1000
"""Designs of a front that are listed, by default."""

MOST_FRONT_DESIGNS: Final = 10_000
"""Designs of a front that can be listed."""


def run_front(histories: Histories, job_id: str, *, most: int) -> FrontView:
    """Find the Pareto front of a job."""
    if not 1 <= most <= MOST_FRONT_DESIGNS:
        raise InvalidRequest(f"must be 1 to {MOST_FRONT_DESIGNS}", field="most")
    spec, columns = _tuning(histories, job_id)
    vectors = objective_vectors(columns, worlds=spec.worlds)
    if not np.isfinite(vectors).any():
        raise Conflict(f"job {job_id} has no design yet that succeeds in all scenarios")
    front = pareto_front(columns, vectors, worlds=spec.worlds)
    return FrontView.from_front(front, columns, spec, most=most)


def run_preference_for(
    histories: Histories, job_id: str, iteration: int, particle: int
) -> PreferenceForView:
    """Find preferences under which a design wins its job."""
    for field, number in (("iteration", iteration), ("particle", particle)):
        if number < 0:
            raise InvalidRequest("must be at least 0", field=field)
    spec, columns = _tuning(histories, job_id)
    rows = np.flatnonzero((columns.iteration == iteration) & (columns.particle == particle))
    if not len(rows):
        raise NotFound(f"job {job_id} has no design {place_of(iteration, particle)}")
    row = int(rows[0])
    if not np.isfinite(objective_vectors(columns.rows(rows), worlds=spec.worlds)).all():
        raise Conflict(
            f"design {place_of(iteration, particle)} fails in a scenario, so it wins under no"
            " preference"
        )
    fits = preference_fits(columns, row, spec.resolved_preference(), worlds=spec.worlds)
    return PreferenceForView.from_fits(row, fits, columns, spec)


def _tuning(histories: Histories, job_id: str) -> tuple[JobSpec, EvaluationColumns]:
    job = histories.job(job_id)
    if not isinstance(job.spec, JobSpec):
        raise InvalidRequest(
            f"job {job_id} is of kind {job.spec.kind}; only a job that tunes a drive has objectives"
            " to trade",
            field="job_id",
        )
    return job.spec, histories.columns(job)


MOST: Final = 100_000
"""Most preferences and candidates of a request."""


class PreferencesRequest(BaseModel):
    """Preferences to rank a job's designs by, and how to compare their winners."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    drawn: int = Field(
        default=512, ge=1, le=MOST, description="Preferences to draw in addition to A, B and C."
    )
    candidates: int = Field(
        default=8,
        ge=1,
        le=MOST,
        description="Winners to list: those of A, B and C, and of the others those that win under"
        " most preferences.",
    )
    samples: int = Field(
        default=0,
        ge=0,
        le=4096,
        description="Designs to simulate around each of them, to estimate its robustness index;"
        " 0 for no simulation and no index.",
    )
    radius: float = Field(
        default=0.02,
        gt=0.0,
        le=0.5,
        description="Largest distance from it, as a share of each variable's bounds [1].",
    )
    seed: int = Field(default=1, ge=0, lt=2**63, description="Of preferences and samples.")
    precision: Precision = Field(default="double", description="Of the physics.")


def run_preferences(
    histories: Histories,
    job_id: str,
    request: PreferencesRequest,
    *,
    check: Callable[[float], None] = lambda _seconds: None,
) -> RobustPreferencesView:
    """Find the preference whose winner among a job's designs is the most robust."""
    job = histories.job(job_id)
    tuning_spec(job_id, job.spec)
    return ranked_preferences(job_id, job.spec, histories.columns(job), request, check=check)


def tuning_spec(job_id: str, spec: AnySpec) -> JobSpec:
    """The spec of a job that has a preference."""
    if not isinstance(spec, JobSpec):
        raise InvalidRequest(
            f"job {job_id} is of kind {spec.kind}; only a job that tunes a drive has a preference",
            field="job_id",
        )
    return spec


def ranked_preferences(
    job_id: str,
    spec: AnySpec,
    columns: EvaluationColumns,
    request: PreferencesRequest,
    *,
    progress: Callable[[int, int], None] | None = None,
    check: Callable[[float], None] = lambda _seconds: None,
) -> RobustPreferencesView:
    """Rank a job's designs under many preferences and compare the winners."""
    tuning = tuning_spec(job_id, spec)
    if not np.isfinite(columns.fitness).any():
        raise Conflict(f"job {job_id} has no design yet that succeeds in all scenarios")
    drawn = drawn_preferences(columns, count=request.drawn, seed=request.seed)
    found = winners(columns, drawn, worlds=tuning.worlds)
    chosen = found[: max(request.candidates, sum(bool(winner.named) for winner in found))]
    indices = _indices(tuning, columns, chosen, request, progress, check)
    best = float(columns.fitness.min())
    shown = []
    for winner, index in zip(chosen, indices, strict=True):
        fitness = float(columns.fitness[winner.row])
        shown.append(
            PreferenceWinnerView(
                iteration=int(columns.iteration[winner.row]),
                particle=int(columns.particle[winner.row]),
                design=tuning.design_space().shown(columns.designs[winner.row].tolist()),
                preference=winner.preference,
                named=list(winner.named),
                share=winner.share,
                fitness=finite(fitness),
                loss=finite(fitness / best - 1.0),
                index=index,
            )
        )
    return RobustPreferencesView(
        drawn=request.drawn,
        winners=len(found),
        samples=request.samples,
        radius=request.radius,
        seed=request.seed,
        candidates=sorted(shown, key=lambda candidate: _order(candidate.index)),
    )


def _indices(
    spec: JobSpec,
    columns: EvaluationColumns,
    chosen: tuple[Winner, ...],
    request: PreferencesRequest,
    progress: Callable[[int, int], None] | None,
    check: Callable[[float], None],
) -> list[IndexView | None]:
    """Robustness index of every winner, None without simulations."""
    if not request.samples:
        return [None for _ in chosen]
    if spec.case is not None:
        raise InvalidRequest(
            f"the job's designs were evaluated by {spec.case.name}, and samples would use"
            " gaitswarm's simulator; give 0",
            field="samples",
        )
    asked = [_robustness_request(spec, columns, winner, request) for winner in chosen]
    walked = sum(one.simulated_seconds(one.resolved_scenarios()) for one in asked)
    check(walked * (1 + request.samples))
    found = []
    for number, one in enumerate(asked):
        with simulation_errors("job_id"):
            view = run_robustness(one, progress=_overall_progress(progress, number, len(asked)))
        found.append(view.index)
    return found


def _robustness_request(
    spec: JobSpec, columns: EvaluationColumns, winner: Winner, request: PreferencesRequest
) -> RobustnessRequest:
    space = spec.design_space()
    document = {
        "robot": spec.robot,
        "controller": spec.controller,
        "design": space.shown(columns.designs[winner.row].tolist()),
        "scenarios": spec.resolved_scenarios(),
        "variables": space.variables,
        "samples": request.samples,
        "radius": request.radius,
        "seed": request.seed,
        "precision": request.precision,
    }
    try:
        return RobustnessRequest.model_validate(document)
    except ValidationError as error:
        raise invalid_request(error) from error


def _overall_progress(
    progress: Callable[[int, int], None] | None, number: int, of: int
) -> Callable[[int, int], None] | None:
    """Convert the progress of one estimate to that of all."""
    if progress is None:
        return None
    return lambda done, planned: progress(number * planned + done, of * planned)


def _order(index: IndexView | None) -> float:
    return math.inf if index is None else index.value
