"""A preference whose winner is robust: chosen from a history, then checked by walks.

Knows nothing of HTTP.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from gaitswarm.errors import invalid_request, simulation_errors
from gaitswarm.requests.robustness import RobustnessRequest, run_robustness
from gaitswarm.requests.targets import Histories
from gaitswarm.services.optimizer.analysis.robustness.preference_winners import (
    Winner,
    drawn_preferences,
    winners,
)
from gaitswarm.services.optimizer.errors import Conflict, InvalidRequest
from gaitswarm.services.optimizer.jobs.columns import EvaluationColumns
from gaitswarm.services.optimizer.jobs.documents import AnySpec
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.sim.kernel.walk import Precision
from gaitswarm.views.base import finite
from gaitswarm.views.preferences import PreferenceWinnerView, RobustPreferencesView
from gaitswarm.views.robustness import IndexView

MOST: Final = 100_000
"""Preferences and candidates of a request."""


class PreferencesRequest(BaseModel):
    """Under which preferences a job's designs are ranked, and how their winners are compared."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    drawn: int = Field(
        default=512, ge=1, le=MOST, description="Preferences to draw beside A, B and C."
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
        description="Designs that walk around each of them, by which its robustness index is"
        " estimated; 0 for no walk and no index.",
    )
    radius: float = Field(
        default=0.02,
        gt=0.0,
        le=0.5,
        description="How far they are from it at most, as a share of each variable's bounds [1].",
    )
    seed: int = Field(default=1, ge=0, lt=2**63, description="Of preferences and samples.")
    precision: Precision = Field(default="double", description="Of the walks' physics.")


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
    """Rank a job's designs under many preferences, and compare the winners."""
    tuning = tuning_spec(job_id, spec)
    if not np.isfinite(columns.fitness).any():
        raise Conflict(f"job {job_id} has no design yet that walks in all scenarios")
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
    """Robustness index of every winner, None without walks."""
    if not request.samples:
        return [None for _ in chosen]
    if spec.case is not None:
        raise InvalidRequest(
            f"the job's designs were put to {spec.case.name}, and samples would walk in gaitswarm's"
            " simulator; give 0",
            field="samples",
        )
    asked = [_robustness_request(spec, columns, winner, request) for winner in chosen]
    walked = sum(one.simulated_seconds(one.resolved_scenarios()) for one in asked)
    check(walked * (1 + request.samples))
    found = []
    for number, one in enumerate(asked):
        with simulation_errors("job_id"):
            view = run_robustness(one, progress=_told(progress, number, len(asked)))
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


def _told(
    progress: Callable[[int, int], None] | None, number: int, of: int
) -> Callable[[int, int], None] | None:
    """Progress of one of several estimates, as that of all."""
    if progress is None:
        return None
    return lambda done, planned: progress(number * planned + done, of * planned)


def _order(index: IndexView | None) -> float:
    return math.inf if index is None else index.value
