"""Identifiability of fitted parameters: their intervals among good designs (thesis fig. 2.14)

A search contracts whether or not a parameter matters, so the interval of one run says little. Runs
with different seeds contract to the same value only where the measured walks determine it: the
intervals here are over all runs, with each run's good designs relative to its own best.
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
"""Relative distances from a run's best fitness."""

_TRUSTED: Final = 0.15
_ROUGH: Final = 0.35
"""Limits on the width at the decisive threshold, as shares of the searched range."""


class Trust(StrEnum):
    """Agreement of several runs on a parameter."""

    TRUSTED = "trusted"
    ROUGH = "rough"
    UNKNOWN = "unknown"

    @property
    def phrase(self) -> str:
        """Explanation in one sentence."""
        return _PHRASES[self]


_PHRASES: Final = {
    Trust.TRUSTED: "all runs agree on a small part of the range",
    Trust.ROUGH: "all runs agree on a part of the range; more or longer walks may narrow it",
    Trust.UNKNOWN: "equally good runs disagree: these walks do not determine it",
}


@dataclass(frozen=True, slots=True)
class ChoiceEvidence:
    """Evidence for one choice of a categorical variable.

    Attributes:
        fitness: each run's least fitness with this choice, +inf if there is none.
        remains: whether any run's equally good designs include it.
    """

    name: str
    fitness: tuple[float, ...]
    remains: bool


@dataclass(frozen=True, slots=True)
class ParameterIdentifiability:
    """One parameter over all runs.

    Attributes:
        variable: with the bounds of the search.
        best: value in the best design of all runs; for a categorical variable the index of a
            choice.
        bests: value in each run's best design.
        intervals: least and greatest value at each of `THRESHOLDS`.
        trust: None for a single run.
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
        """Explanation of the trust in one sentence; None without any."""
        if self.trust is None or not self.choices:
            return None if self.trust is None else self.trust.phrase
        remaining = [choice.name for choice in self.choices if choice.remains]
        if self.trust is Trust.TRUSTED:
            return f"only the choice {remaining[0]} comes close to the best"
        if self.trust is Trust.ROUGH:
            return f"undecided between {', '.join(remaining)}; the others are worse"
        return "every choice comes close to the best: these walks do not determine it"

    def width(self, threshold: float = DECISIVE) -> float:
        """Return the width of an interval as a share of the searched range [1]."""
        low, high = self.intervals[THRESHOLDS.index(threshold)]
        return (high - low) / (self.variable.high - self.variable.low)


@dataclass(frozen=True, slots=True)
class Identifiability:
    """Identifiability of all searched parameters.

    Attributes:
        fitness: each run's least fitness.
        designs: number of designs of all runs within each of `THRESHOLDS`.
    """

    fitness: tuple[float, ...]
    designs: tuple[int, ...]
    parameters: tuple[ParameterIdentifiability, ...]


def identifiability(
    variables: Sequence[Variable],
    runs: Sequence[EvaluationColumns],
    as_good_as: Callable[[float], float] = lambda fitness: fitness * (1.0 + DECISIVE),
) -> Identifiability:
    if not runs or not all(np.isfinite(run.fitness).any() for run in runs):
        raise ValueError("every run must have a design that did not fail")
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
    """Check that jobs are runs of one problem with different seeds."""
    first, *others = jobs
    seeds = {first.spec.seed: first.id}
    for other in others:
        if other.spec.seed in seeds:
            raise InvalidRequest(
                f"job {other.id} has the seed of job {seeds[other.spec.seed]}, so they agree"
                " in any case; compare runs with different seeds",
                field="also",
            )
        seeds[other.spec.seed] = other.id
        if _problem(other.spec) != _problem(first.spec):
            raise InvalidRequest(
                f"job {other.id} solves another problem than job {first.id}; comparable runs"
                " differ only in name, seed, optimizer and iterations",
                field="also",
            )
    for job in jobs:
        if job.progress.best_fitness is None:
            raise Conflict(
                f"job {job.id} has no successful design yet; try again after its next"
                " iteration, or omit it"
            )


def _problem(spec: Spec) -> Spec:
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
    """Empty for a variable that is not categorical. near: of each run, its equally good designs."""
    choices = []
    for index, name in enumerate(variable.choices):
        chosen = [run.designs[:, column] == index for run in runs]
        least = tuple(
            float(run.fitness[rows].min(initial=np.inf))
            for run, rows in zip(runs, chosen, strict=True)
        )
        remains = any(bool((a & b).any()) for a, b in zip(chosen, near, strict=True))
        choices.append(ChoiceEvidence(name, least, remains))
    return tuple(choices)


def _trust(parameter: ParameterIdentifiability, width: float) -> Trust:
    """width: of the interval of equally good designs, as a share of the range."""
    if parameter.choices:
        remaining = sum(choice.remains for choice in parameter.choices)
        if remaining == len(parameter.choices):
            return Trust.UNKNOWN
        return Trust.TRUSTED if remaining == 1 else Trust.ROUGH
    if width > _ROUGH:
        return Trust.UNKNOWN
    return Trust.TRUSTED if width <= _TRUSTED else Trust.ROUGH
