"""Distances of a calibration from its targets, also with each of them left out"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gaitswarm.services.optimizer.jobs.iteration import (
    Evaluation,
    EvaluationColumns,
    evaluations_of,
)
from gaitswarm.services.optimizer.jobs.kinds.calibration import CalibrationSpec
from gaitswarm.services.optimizer.views import DesignValues, Finite, IterationIndex, Particle, View
from gaitswarm.sim.outcome import Status

LeaveOut = Literal["target", "walk"]
"""What is left out together: one target, or all targets of a walk."""


class ReachedView(View):
    """Simulated value of one target."""

    simulated: Finite = Field(description="In the target's unit; null if its simulation failed.")
    difference: Finite = Field(examples=[0.69])
    """From the target's value, in tolerances: ln(simulated / value) / ln(1 + tolerance), of
    height_loss (simulated - value) / tolerance."""


class TargetResultView(ReachedView):
    """One target and the best design's value."""

    walk: str = Field(description="Label of the simulation.", examples=["fuzzy-pso-ps"])
    relative_to: str | None
    """Simulation that the value is the ratio to; null for a value of its own."""
    quantity: str = Field(description="Measured quantity.", examples=["energy"])
    unit: str = Field(description="Unit of the value; 1 for a ratio.", examples=["J/m"])
    value: float = Field(description="The target.", examples=[41.96])
    tolerance: float = Field(description="Relative tolerance; of height_loss in metres.")
    use: str = Field(description="fit, or predict for one that is only compared.", examples=["fit"])
    left_out: ReachedView | None
    """Value of the design that is best without this target; null if that was not requested, the
    target is not fitted, or no other target is."""


class TargetsView(View):
    """Targets reached by the best design of several runs of a calibration."""

    jobs: list[str] = Field(description="The runs.", examples=[["k2q7zr5dm9xw"]])
    job: str = Field(description="The run of the best design.", examples=["k2q7zr5dm9xw"])
    iteration: IterationIndex
    particle: Particle
    fitness: float = Field(examples=[0.84])
    """Root mean square of the differences of fitted targets, in tolerances [1]."""
    design: DesignValues
    targets: list[TargetResultView] = Field(description="Every target, in the job's order.")


_TARGET: Final = ("walk", "relative_to", "quantity", "unit", "value", "tolerance", "use")


def target_results(
    job_ids: Sequence[str],
    spec: CalibrationSpec,
    runs: Sequence[EvaluationColumns],
    leave_out: LeaveOut | None = None,
    *,
    bests: Sequence[Evaluation] | None = None,
) -> TargetsView:
    """Compare the best design of all runs with the targets; bests: those in double precision."""
    simulated = np.concatenate([spec.simulated(r.objectives, r.failed) for r in runs])
    differences = spec.differences(simulated)
    if bests is None:
        run = int(np.argmin([columns.fitness.min(initial=math.inf) for columns in runs]))
        (best,) = evaluations_of(runs[run].rows(np.array([runs[run].fitness.argmin()])))
    else:
        run, best = _best_in_double(bests)
    of_best = spec.simulated(best.objectives[None], (best.statuses != Status.OK)[None])
    off = spec.differences(of_best)
    results = []
    for index, target in enumerate(spec.targets):
        left_out = None
        remaining = spec.fitted & ~_left_out(spec, index, leave_out)
        if leave_out is not None and target.use == "fit" and remaining.any():
            squares = np.square(differences[:, remaining]).sum(axis=1)
            row = int(np.argmin(squares))
            if math.isfinite(squares[row]):
                left_out = ReachedView(
                    simulated=simulated[row, index], difference=differences[row, index]
                )
        results.append(
            TargetResultView(
                simulated=of_best[0, index],
                difference=off[0, index],
                **{name: getattr(target, name) for name in _TARGET},
                left_out=left_out,
            )
        )
    return TargetsView(
        jobs=list(job_ids),
        job=job_ids[run],
        iteration=best.iteration,
        particle=best.particle,
        fitness=best.fitness,
        design=spec.design_space().shown(best.design.tolist()),
        targets=results,
    )


def _best_in_double(bests: Sequence[Evaluation]) -> tuple[int, Evaluation]:
    reevaluations = [best.reevaluation for best in bests]
    judged = [(a.fitness, run, a) for run, a in enumerate(reevaluations) if a is not None]
    fitness, run, result = min(judged, key=lambda entry: entry[:2])
    objectives, statuses = result.objectives, result.statuses
    return run, bests[run]._replace(objectives=objectives, statuses=statuses, fitness=fitness)


def _left_out(spec: CalibrationSpec, index: int, leave_out: LeaveOut | None) -> NDArray[np.bool_]:
    """(T,) mask of the targets left out together with one."""
    if leave_out != "walk":
        return np.asarray(np.arange(len(spec.targets)) == index)
    walk = spec.targets[index].walk
    together = [walk in (target.walk, target.relative_to) for target in spec.targets]
    return np.array(together, dtype=np.bool_)
