"""Identifiability of fitted parameters: their intervals among good designs (thesis fig. 2.14)

The interval of one run says little, as any search contracts: intervals are over runs with different
seeds, with each run's good designs relative to its own best.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from enum import StrEnum
from typing import Final

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gaitswarm.services.optimizer.errors import Conflict, InvalidRequest
from gaitswarm.services.optimizer.jobs.iteration import (
    EvaluationColumns,
)
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.services.optimizer.search.pso import PsoSettings
from gaitswarm.services.optimizer.views import Finite, View
from gaitswarm.sim.variables import Variable

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


_PHRASES: Final = {
    Trust.TRUSTED: "all runs agree on a small part of the range",
    Trust.ROUGH: "all runs agree on a part of the range; more or longer walks may narrow it",
    Trust.UNKNOWN: "equally good runs disagree: these walks do not determine it",
}


class IntervalView(View):
    """Values of a parameter among designs within a threshold, in the parameter's unit."""

    low: float = Field(description="Least of them.", examples=[10.9])
    high: float = Field(description="Greatest of them.", examples=[11.3])


class ChoiceView(View):
    """One choice of a categorical parameter."""

    name: str = Field(description="Name of the choice.", examples=["stick"])
    fitness: Finite = Field(examples=[0.84])
    """Least fitness of all runs among designs with it; null if all failed, or none was tried."""
    by_run: list[Finite] = Field(description="The same of each run.", examples=[[0.84, None]])
    remains: bool
    """Whether a run has it among the designs that count as good as its best: within 5 %, of a
    calibration those whose sum of squared differences, in tolerances, is at most 4 (times the best
    fitness squared, if that is above 1) greater."""


class ParameterView(View):
    """One parameter over all runs."""

    name: str = Field(description="Name of the variable.", examples=["battery_voltage"])
    unit: str = Field(description="Its unit.", examples=["V"])
    low: float = Field(description="Lower bound of the search.", examples=[8.0])
    high: float = Field(description="Upper bound of the search.", examples=[13.0])
    best: float | str = Field(examples=[11.1])
    """Value in the best design of all runs, of a categorical parameter a choice."""
    bests: list[float | str] = Field(examples=[[11.1, 11.2, 11.0]])
    """Value in each run's best design."""
    intervals: list[IntervalView]
    """One for each of `thresholds`, over all runs; of a categorical parameter indices of
    choices."""
    choices: list[ChoiceView] = Field(description="Those of a categorical parameter; else none.")
    trust: Trust | None
    """Agreement of the runs among designs as good as their best (see `remains` of choices): within
    15 %, within 35 %, or not within 35 % of the searched range; of a categorical parameter on one
    choice, on some, or on none; null for a single run."""
    explanation: str | None = Field(examples=["all runs agree on a small part of the range"])
    """The same in a sentence."""


class IdentifiabilityView(View):
    """How runs of one problem, that differ in their seed, converge (thesis fig. 2.14)."""

    jobs: list[str] = Field(description="The runs.", examples=[["k2q7zr5dm9xw"]])
    fitness: list[float] = Field(description="Each run's least fitness.", examples=[[0.0312]])
    thresholds: list[float]
    """Distances from a run's best fitness, as shares of it [1]."""
    designs: list[int] = Field(description="Number of designs of all runs within each of them.")
    parameters: list[ParameterView] = Field(description="Every variable that was searched.")


def identifiability(
    job_ids: Sequence[str],
    variables: Sequence[Variable],
    runs: Sequence[EvaluationColumns],
    as_good_as: Callable[[float], float],
) -> IdentifiabilityView:
    """Compare runs of one problem, each with a design that did not fail."""
    best = [int(np.argmin(run.fitness)) for run in runs]
    fitness = [float(run.fitness[row]) for run, row in zip(runs, best, strict=True)]
    overall = int(np.argmin(fitness))
    within = [
        [run.fitness <= least * (1.0 + threshold) for run, least in zip(runs, fitness, strict=True)]
        for threshold in THRESHOLDS
    ]
    near = [run.fitness <= as_good_as(least) for run, least in zip(runs, fitness, strict=True)]

    def interval(column: int, good: Sequence[NDArray[np.bool_]]) -> IntervalView:
        values = [run.designs[rows, column] for run, rows in zip(runs, good, strict=True)]
        together = np.concatenate(values)
        return IntervalView(low=float(together.min()), high=float(together.max()))

    parameters = []
    for column, variable in enumerate(variables):
        bests = [
            variable.shown(float(run.designs[row, column]))
            for run, row in zip(runs, best, strict=True)
        ]
        choices = _choices(variable, column, runs, near)
        trust = explanation = None
        if len(runs) > 1:
            equally_good = interval(column, near)
            width = (equally_good.high - equally_good.low) / (variable.high - variable.low)
            trust, explanation = _trust(choices, width)
        parameters.append(
            ParameterView(
                name=variable.name,
                unit=variable.unit,
                low=variable.low,
                high=variable.high,
                best=bests[overall],
                bests=bests,
                intervals=[interval(column, good) for good in within],
                choices=choices,
                trust=trust,
                explanation=explanation,
            )
        )
    return IdentifiabilityView(
        jobs=list(job_ids),
        fitness=fitness,
        thresholds=list(THRESHOLDS),
        designs=[int(sum(rows.sum() for rows in good)) for good in within],
        parameters=parameters,
    )


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


def _choices(
    variable: Variable,
    column: int,
    runs: Sequence[EvaluationColumns],
    near: Sequence[NDArray[np.bool_]],
) -> list[ChoiceView]:
    """Empty for a variable that is not categorical. near: of each run, its equally good designs."""
    choices = []
    for index, name in enumerate(variable.choices):
        chosen = [run.designs[:, column] == index for run in runs]
        least = [
            float(run.fitness[rows].min(initial=np.inf))
            for run, rows in zip(runs, chosen, strict=True)
        ]
        remains = any(bool((a & b).any()) for a, b in zip(chosen, near, strict=True))
        choices.append(ChoiceView(name=name, fitness=min(least), by_run=least, remains=remains))
    return choices


def _trust(choices: Sequence[ChoiceView], width: float) -> tuple[Trust, str]:
    """width: of the interval of equally good designs, as a share of the range."""
    remaining = [choice.name for choice in choices if choice.remains]
    if not choices:
        trust = Trust.TRUSTED if width <= _TRUSTED else Trust.ROUGH
        trust = Trust.UNKNOWN if width > _ROUGH else trust
        return trust, _PHRASES[trust]
    if len(remaining) == len(choices):
        text = "every choice comes close to the best: these walks do not determine it"
        return Trust.UNKNOWN, text
    if len(remaining) == 1:
        return Trust.TRUSTED, f"only the choice {remaining[0]} comes close to the best"
    return Trust.ROUGH, f"undecided between {', '.join(remaining)}; the others are worse"
