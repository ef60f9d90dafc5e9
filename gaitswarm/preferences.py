"""A preference whose winner is robust: chosen from a job's history, then checked by walks."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from gaitswarm.errors import Conflict, InvalidRequest, simulation_errors
from gaitswarm.jobs.port import Jobs
from gaitswarm.requests import arguments
from gaitswarm.requests.robustness import RobustnessRequest, run_robustness
from gaitswarm.views.base import finite
from gaitswarm.views.preferences import PreferenceWinnerView, RobustPreferencesView
from gaitswarm.views.robustness import IndexView
from services.optimizer.analysis.robustness.preference_winners import (
    Winner,
    drawn_preferences,
    winners,
)
from services.optimizer.jobs.columns import EvaluationColumns
from services.optimizer.jobs.kinds.tuning import JobSpec
from sim.kernel.walk import Precision
from sim.outcome import Status


def robust_preferences(
    jobs: Jobs,
    job_id: str,
    *,
    drawn: int = 512,
    candidates: int = 8,
    samples: int = 128,
    radius: float = 0.02,
    seed: int = 1,
    precision: Precision = "double",
    progress: Callable[[int, int], None] | None = None,
) -> RobustPreferencesView:
    """Find the preference whose winner among a job's designs is the most robust.

    The designs are ranked anew under A, B and C (table 4.5) and under preferences that are drawn at
    random; of the winners, the robustness index (thesis 4.4.3) is estimated by walks here. Only
    designs that the job has tried can win.

    Args:
        jobs: Where the job is.
        job_id: Identifier of a job that tunes a drive.
        drawn: How many preferences to draw.
        candidates: Winners to let walk: those of A, B and C, and of the others those that win under
            most preferences.
        samples: Designs that walk beside each.
        radius: How far they are from it at most, as a share of each variable's bounds.
        seed: Of preferences and samples.
        precision: Of the physics' numbers.
        progress: Called with how many of how many walks are done.

    Returns:
        The candidates, the most robust first, with what they lose under the job's own preference.

    Raises:
        InvalidRequest: The job tunes no drive, or an argument makes no sense; names it.
        Conflict: No design of the job walks in all scenarios.
    """
    for field, number in (("drawn", drawn), ("candidates", candidates)):
        if not 1 <= number <= 100_000:
            raise InvalidRequest("must be 1 to 100000", field=field)
    spec = jobs.job(job_id).spec
    if not isinstance(spec, JobSpec):
        raise InvalidRequest(
            f"job {job_id} is of kind {spec.kind}; only a job that tunes a drive has a preference",
            field="job_id",
        )
    columns = _columns(jobs, job_id)
    if not np.isfinite(columns.fitness).any():
        raise Conflict(f"job {job_id} has no design yet that walks in all scenarios")
    drawn_ones = drawn_preferences(columns, count=drawn, seed=seed)
    found = winners(columns, drawn_ones, worlds=spec.worlds)
    chosen = found[: max(candidates, sum(bool(winner.named) for winner in found))]
    requests = [
        _request(spec, columns, winner, samples, radius, seed, precision) for winner in chosen
    ]
    best = float(columns.fitness.min())
    shown = []
    for number, (winner, request) in enumerate(zip(chosen, requests, strict=True)):
        with simulation_errors("job_id"):
            view = run_robustness(request, progress=_told(progress, number, len(chosen)))
        fitness = float(columns.fitness[winner.row])
        shown.append(
            PreferenceWinnerView(
                iteration=int(columns.iteration[winner.row]),
                particle=int(columns.particle[winner.row]),
                design=spec.design_space().shown(columns.designs[winner.row].tolist()),
                preference=winner.preference,
                named=list(winner.named),
                share=winner.share,
                fitness=finite(fitness),
                loss=finite(fitness / best - 1.0),
                index=view.index,
            )
        )
    return RobustPreferencesView(
        drawn=drawn,
        winners=len(found),
        samples=samples,
        radius=radius,
        seed=seed,
        candidates=sorted(shown, key=lambda candidate: _order(candidate.index)),
    )


def _columns(jobs: Jobs, job_id: str) -> EvaluationColumns:
    table = jobs.evaluations(job_id)
    return EvaluationColumns(
        table.iteration,
        table.particle,
        table.designs,
        table.objectives,
        # Whether a walk failed is all that matters to a ranking.
        np.where(table.statuses == Status.OK.label, Status.OK, Status.FELL).astype(np.uint8),
        np.where(np.isfinite(table.fitness), table.fitness, np.inf),
    )


def _request(
    spec: JobSpec,
    columns: EvaluationColumns,
    winner: Winner,
    samples: int,
    radius: float,
    seed: int,
    precision: Precision,
) -> RobustnessRequest:
    space = spec.design_space()
    return arguments.robustness(
        space.shown(columns.designs[winner.row].tolist()),
        {
            "robot": spec.robot,
            "controller": spec.controller,
            "scenarios": spec.resolved_scenarios(),
            "variables": space.variables,
            "samples": samples,
            "radius": radius,
            "seed": seed,
            "precision": precision,
        },
    )


def _told(
    progress: Callable[[int, int], None] | None, number: int, of: int
) -> Callable[[int, int], None] | None:
    """Progress of one of several estimates, as that of all."""
    if progress is None:
        return None
    return lambda done, planned: progress(number * planned + done, of * planned)


def _order(index: IndexView | None) -> float:
    return math.inf if index is None else index.value
