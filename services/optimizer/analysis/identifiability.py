"""Which fitted parameters can be trusted: their intervals among good designs (thesis fig. 2.14).

A search contracts whether or not a parameter matters, so the interval of one run says little. Runs
that differ in their seed alone contract to the same value only where the measured walks ask for it:
the intervals here are over all runs together, each run's good designs by its own best.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.errors import Conflict, InvalidRequest
from gaitswarm.services.optimizer.jobs.columns import EvaluationColumns
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.jobs.spec import DECISIVE, Spec
from gaitswarm.services.optimizer.search.pso import PsoSettings
from gaitswarm.sim.variables import Variable

Floats = NDArray[np.float64]

THRESHOLDS: Final = (1.0, 0.7, 0.5, 0.35, 0.25, 0.2, 0.15, 0.1, 0.07, 0.05, 0.03, 0.02)
"""Twelve distances from a run's best fitness, as shares of it."""

_TRUSTED: Final = 0.15
_ROUGH: Final = 0.35
"""Widths at the decisive threshold, as shares of the range that was searched."""


class Trust(StrEnum):
    """What several runs say of a parameter."""

    TRUSTED = "trusted"
    ROUGH = "rough"
    UNKNOWN = "unknown"

    @property
    def phrase(self) -> str:
        """One sentence that a user can act on."""
        return _PHRASES[self]


_PHRASES: Final = {
    Trust.TRUSTED: "all runs agree on a small part of the range",
    Trust.ROUGH: "all runs agree on a part of the range; more or longer walks may narrow it",
    Trust.UNKNOWN: "runs as good as each other disagree: these walks cannot tell it",
}


@dataclass(frozen=True, slots=True)
class ChoiceEvidence:
    """What runs say of one choice of a categorical variable.

    Attributes:
        name: of the choice.
        fitness: each run's least among designs with this choice, +inf where there is none.
        remains: whether it is among the designs of any run that are as good as that run's best.
    """

    name: str
    fitness: tuple[float, ...]
    remains: bool


@dataclass(frozen=True, slots=True)
class ParameterIdentifiability:
    """One parameter over all runs.

    Attributes:
        variable: with the bounds of the search.
        best: value in the best design of all runs, in its unit; of a categorical variable the
            index of a choice.
        bests: value in each run's best design.
        intervals: least and greatest value at each of `THRESHOLDS`.
        trust: None for a single run, which cannot tell.
        choices: of a categorical variable.
    """

    variable: Variable
    best: float
    bests: tuple[float, ...]
    intervals: tuple[tuple[float, float], ...]
    trust: Trust | None
    choices: tuple[ChoiceEvidence, ...] = ()

    @property
    def explanation(self) -> str | None:
        """What the trust means, in a sentence; None without any."""
        if self.trust is None or not self.choices:
            return None if self.trust is None else self.trust.phrase
        remaining = [choice.name for choice in self.choices if choice.remains]
        if self.trust is Trust.TRUSTED:
            return f"no other choice than {remaining[0]} comes near the best"
        if self.trust is Trust.ROUGH:
            return f"undecided between {', '.join(remaining)}; the others are worse"
        return "every choice comes near the best: these walks cannot tell it"

    def width(self, threshold: float = DECISIVE) -> float:
        """Width of an interval.

        Returns:
            Share of the range that was searched [1].
        """
        low, high = self.intervals[THRESHOLDS.index(threshold)]
        return (high - low) / (self.variable.high - self.variable.low)


@dataclass(frozen=True, slots=True)
class Identifiability:
    """All searched parameters.

    Attributes:
        fitness: each run's least.
        designs: how many designs of all runs lie within each of `THRESHOLDS`.
        parameters: in the order of the variables.
    """

    fitness: tuple[float, ...]
    designs: tuple[int, ...]
    parameters: tuple[ParameterIdentifiability, ...]


def identifiability(
    variables: Sequence[Variable],
    runs: Sequence[EvaluationColumns],
    as_good_as: Callable[[float], float] = lambda fitness: fitness * (1.0 + DECISIVE),
) -> Identifiability:
    """Find the intervals of parameters over runs of one problem."""
    if not runs or not all(np.isfinite(run.fitness).any() for run in runs):
        raise ValueError("every run needs a design that did not fail")
    best = [int(np.argmin(run.fitness)) for run in runs]
    fitness = tuple(float(run.fitness[row]) for run, row in zip(runs, best, strict=True))
    overall = int(np.argmin(fitness))
    within = [
        [run.fitness <= least * (1.0 + threshold) for run, least in zip(runs, fitness, strict=True)]
        for threshold in THRESHOLDS
    ]
    near = [run.fitness <= as_good_as(least) for run, least in zip(runs, fitness, strict=True)]
    parameters = []
    for column, variable in enumerate(variables):
        bests = tuple(float(run.designs[row, column]) for run, row in zip(runs, best, strict=True))
        intervals = tuple(
            _interval([run.designs[rows, column] for run, rows in zip(runs, good, strict=True)])
            for good in within
        )
        parameter = ParameterIdentifiability(
            variable, bests[overall], bests, intervals, None, _choices(variable, column, runs, near)
        )
        if len(runs) > 1:
            low, high = _interval(
                [run.designs[rows, column] for run, rows in zip(runs, near, strict=True)]
            )
            width = (high - low) / (variable.high - variable.low)
            parameter = replace(parameter, trust=_trust(parameter, width))
        parameters.append(parameter)
    designs = tuple(int(sum(rows.sum() for rows in good)) for good in within)
    return Identifiability(fitness, designs, tuple(parameters))


def check_comparable(jobs: Sequence[Job]) -> None:
    """Check that jobs are runs of one problem that tell something about each other."""
    first, *others = jobs
    seeds = {first.spec.seed: first.id}
    for other in others:
        if other.spec.seed in seeds:
            raise InvalidRequest(
                f"job {other.id} has the seed of job {seeds[other.spec.seed]}, so that they"
                " agree whatever the walks say; compare runs of different seeds",
                field="also",
            )
        seeds[other.spec.seed] = other.id
        if _problem(other.spec) != _problem(first.spec):
            raise InvalidRequest(
                f"job {other.id} is of another problem than job {first.id}; runs that are"
                " compared differ in name, seed, optimizer and iterations alone",
                field="also",
            )
    for job in jobs:
        if job.progress.best_fitness is None:
            raise Conflict(
                f"job {job.id} has no design yet that did not fail; ask again after its next"
                " iteration, or leave it out"
            )


def _problem(spec: Spec) -> Spec:
    """The spec without what may differ between runs of one problem."""
    return spec.model_copy(
        update={"name": "", "seed": 0, "iterations": 1, "optimizer": PsoSettings()}
    )


def _interval(values: Sequence[Floats]) -> tuple[float, float]:
    together = np.concatenate(values)
    return float(together.min()), float(together.max())


def _choices(
    variable: Variable,
    column: int,
    runs: Sequence[EvaluationColumns],
    near: Sequence[NDArray[np.bool_]],
) -> tuple[ChoiceEvidence, ...]:
    """None for a variable that is not categorical. near: of each run, its best designs."""
    found = []
    for index, name in enumerate(variable.choices):
        chosen = [run.designs[:, column] == index for run in runs]
        least = tuple(
            float(run.fitness[rows].min(initial=np.inf))
            for run, rows in zip(runs, chosen, strict=True)
        )
        remains = any(bool((a & b).any()) for a, b in zip(chosen, near, strict=True))
        found.append(ChoiceEvidence(name, least, remains))
    return tuple(found)


def _trust(found: ParameterIdentifiability, width: float) -> Trust:
    """width: of the interval of designs as good as the best, as a share of the range."""
    if found.choices:
        remaining = sum(choice.remains for choice in found.choices)
        if remaining == len(found.choices):
            return Trust.UNKNOWN
        return Trust.TRUSTED if remaining == 1 else Trust.ROUGH
    if width > _ROUGH:
        return Trust.UNKNOWN
    return Trust.TRUSTED if width <= _TRUSTED else Trust.ROUGH
