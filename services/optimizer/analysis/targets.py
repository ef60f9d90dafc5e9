"""Distances of a calibration from its targets, also with each of them left out"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.jobs.columns import EvaluationColumns
from gaitswarm.services.optimizer.jobs.iteration import Evaluation
from gaitswarm.services.optimizer.jobs.kinds.calibration import CalibrationSpec
from gaitswarm.sim.calibration.targets import Target
from gaitswarm.sim.outcome import Status

Floats = NDArray[np.float64]

LeaveOut = Literal["target", "walk"]
"""What is left out together: one target, or all targets of a walk."""


@dataclass(frozen=True, slots=True)
class Reached:
    """A design's result for one target.

    Attributes:
        simulated: in the target's unit.
        difference: in tolerances; see `CalibrationSpec.differences`.
    """

    simulated: float
    difference: float


@dataclass(frozen=True, slots=True)
class TargetResult:
    """One target over all runs.

    Attributes:
        best: of the best design of all runs; NaN if its walk failed (only for targets that are not
            fitted).
        left_out: of the best design without this target; None if not requested, if the target is
            not fitted, or if no target would remain.
    """

    target: Target
    best: Reached
    left_out: Reached | None


@dataclass(frozen=True, slots=True)
class TargetResults:
    """All targets, for the best design of all runs.

    Attributes:
        run: index of the run that found it.
        design: (v,) as stored.
        fitness: root mean square over fitted targets, in tolerances.
    """

    run: int
    iteration: int
    particle: int
    design: Floats
    fitness: float
    targets: tuple[TargetResult, ...]


def target_results(
    spec: CalibrationSpec,
    runs: Sequence[EvaluationColumns],
    leave_out: LeaveOut | None = None,
    *,
    bests: Sequence[Evaluation] | None = None,
) -> TargetResults:
    """Compare the best design of all runs with the targets.

    Left-out targets are predicted from stored objectives: the design that is best without them
    gives the prediction. Nothing is simulated.
    """
    fitness = np.concatenate([run.fitness for run in runs])
    if not np.isfinite(fitness).any():
        raise ValueError("every design has failed")
    simulated = np.concatenate([spec.simulated(r.objectives, r.failed) for r in runs])
    differences = spec.differences(simulated)
    best = _best_of_all(runs) if bests is None else _best_in_double(bests)
    of_best = spec.simulated(best.objectives[None], (best.statuses != Status.OK)[None])
    off = spec.differences(of_best)
    results = []
    for index, target in enumerate(spec.targets):
        left_out = None
        if leave_out is not None and target.use == "fit":
            remaining = spec.fitted & ~_left_out(spec, index, leave_out)
            chosen = _best_by(differences[:, remaining]) if remaining.any() else None
            if chosen is not None:
                left_out = _reached(simulated, differences, chosen, index)
        results.append(TargetResult(target, _reached(of_best, off, 0, index), left_out))
    return TargetResults(
        run=best.run,
        iteration=best.iteration,
        particle=best.particle,
        design=best.design,
        fitness=best.fitness,
        targets=tuple(results),
    )


@dataclass(frozen=True, slots=True)
class _Best:
    """The best design of all runs; see `Evaluation`."""

    run: int
    iteration: int
    particle: int
    design: Floats
    objectives: Floats
    statuses: NDArray[np.uint8]
    fitness: float


def _best_of_all(runs: Sequence[EvaluationColumns]) -> _Best:
    run = int(np.argmin([columns.fitness.min(initial=math.inf) for columns in runs]))
    found = runs[run]
    row = int(np.argmin(found.fitness))
    return _Best(
        run,
        int(found.iteration[row]),
        int(found.particle[row]),
        found.designs[row],
        found.objectives[row],
        found.statuses[row],
        float(found.fitness[row]),
    )


def _best_in_double(bests: Sequence[Evaluation]) -> _Best:
    reevaluations = [best.reevaluation for best in bests]
    judged = [(a.fitness, run, a) for run, a in enumerate(reevaluations) if a is not None]
    fitness, run, found = min(judged, key=lambda entry: entry[:2])
    best = bests[run]
    return _Best(
        run,
        best.iteration,
        best.particle,
        best.design,
        found.objectives,
        found.statuses,
        fitness,
    )


def _left_out(spec: CalibrationSpec, index: int, leave_out: LeaveOut) -> NDArray[np.bool_]:
    """(T,) mask of the targets left out together with one."""
    if leave_out == "target":
        return np.array([k == index for k in range(len(spec.targets))], dtype=np.bool_)
    walk = spec.targets[index].walk
    together = [walk in (target.walk, target.relative_to) for target in spec.targets]
    return np.array(together, dtype=np.bool_)


def _best_by(differences: Floats) -> int | None:
    """Row of the least sum of squares; None if all failed."""
    squares = np.square(differences).sum(axis=1)
    row = int(np.argmin(squares))
    return row if math.isfinite(squares[row]) else None


def _reached(simulated: Floats, differences: Floats, row: int, column: int) -> Reached:
    return Reached(float(simulated[row, column]), float(differences[row, column]))
