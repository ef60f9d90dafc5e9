"""What a tournament comes to: medians, times, ranks, profiles."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitswarm.services.optimizer.analysis.interval import Interval
from gaitswarm.services.optimizer.analysis.tournaments.tournament import (
    Floats,
    Results,
    Runs,
    data_profile,
    mean_ranks,
    rank_correlation,
    ranks,
    running_time_interval,
)

NEAR: Final = 0.01
"""Share of the least value of all runs, within which a run counts that has no target."""

LOOKED_AT: Final = (100, 250, 625, 2500)
"""Evaluations after which medians are reported, where the budget reaches as far."""

PRECISIONS: Final = (1e-1, 1e-3)
"""tau of the data profiles that are reported."""

_PROFILE_POINTS: Final = 60


@dataclass(frozen=True, slots=True)
class Standing:
    """How a method did on a problem.

    Attributes:
        method: Its label.
        runs: How many there are.
        solved: How many of them reached the target.
        running_time: Expected evaluations until the target is reached.
        medians: Median of the best after each of the evaluations that are looked at.
        least: Best of all runs.
        rank: Among the methods, from 1.
    """

    method: str
    runs: int
    solved: int
    running_time: Interval
    medians: tuple[float, ...]
    least: float
    rank: float


@dataclass(frozen=True, slots=True, eq=False)
class Profile:
    """Data profiles of all methods.

    Attributes:
        precision: tau: what share of the way from the usual first value to the least may be left.
        budgets: (b,) evaluations over the number of variables plus one, ascending.
        shares: Of each method (b,) the share of its runs that are solved within a budget.
    """

    precision: float
    budgets: Floats
    shares: Mapping[str, Floats]


@dataclass(frozen=True, slots=True)
class Standings:
    """All that a tournament tells.

    Attributes:
        results: Runs by problem, then by method, best first.
        looked_at: Evaluations after which medians are told.
        targets: By problem: that given, or else 1 % above the least value of all runs; NaN where
            all runs failed.
        by_problem: Methods on every problem, best first.
        mean_ranks: Of each method over all problems, best first.
        correlation: Of mean ranks with those of another tournament, and the methods in both; None
            without one.
    """

    results: Results
    looked_at: tuple[int, ...]
    targets: Mapping[str, float]
    by_problem: Mapping[str, tuple[Standing, ...]]
    mean_ranks: Mapping[str, Interval]
    correlation: tuple[Interval, tuple[str, ...]] | None

    @property
    def methods(self) -> tuple[str, ...]:
        """Labels of the methods, best first."""
        return tuple(self.mean_ranks)


def looked_at(evaluations: int) -> tuple[int, ...]:
    """Evaluations after which medians are reported."""
    return (*(count for count in LOOKED_AT if count < evaluations), evaluations)


def standings_of(
    results: Results, looked_at: Sequence[int], other: Results | None = None
) -> Standings:
    """Judge a tournament."""
    methods = list(next(iter(results.values())))
    targets = {name: _target(by_method) for name, by_method in results.items()}
    of_methods = mean_ranks(results, methods)
    ranked = dict(sorted(of_methods.items(), key=lambda item: item[1].value))
    return Standings(
        results={
            name: {method: by_method[method] for method in ranked}
            for name, by_method in results.items()
        },
        looked_at=tuple(looked_at),
        targets=targets,
        by_problem={
            name: _on_problem(by_method, targets[name], looked_at)
            for name, by_method in results.items()
        },
        mean_ranks=ranked,
        correlation=None if other is None else _compared(results, other, methods),
    )


def profiles_of(results: Results) -> tuple[Profile, ...]:
    """Data profiles, one for each of `PRECISIONS`."""
    methods = list(next(iter(results.values())))
    most = max(
        runs.budget / (runs.dimension + 1)
        for by_method in results.values()
        for runs in by_method.values()
    )
    budgets = np.geomspace(1.0, most, _PROFILE_POINTS)
    return tuple(
        Profile(
            precision,
            budgets,
            {m: data_profile(results, m, precision, budgets.tolist()) for m in methods},
        )
        for precision in PRECISIONS
    )


def _on_problem(
    by_method: Mapping[str, Runs], target: float, looked_at: Sequence[int]
) -> tuple[Standing, ...]:
    found = []
    for (label, runs), rank in zip(by_method.items(), ranks(by_method).tolist(), strict=True):
        aimed = runs if runs.target is not None else runs.aiming_at(target)
        found.append(
            Standing(
                method=label,
                runs=len(runs),
                solved=int(aimed.solved.sum()),
                running_time=running_time_interval(aimed),
                medians=tuple(runs.median_after(count) for count in looked_at),
                least=float(runs.final.min()),
                rank=rank,
            )
        )
    return tuple(sorted(found, key=lambda standing: standing.rank))


def _target(by_method: Mapping[str, Runs]) -> float:
    given = next(iter(by_method.values())).target
    if given is not None:
        return given
    least = min(float(runs.final.min()) for runs in by_method.values())
    return least + NEAR * abs(least) if math.isfinite(least) else math.nan


def _compared(
    results: Results, other: Results, methods: Sequence[str]
) -> tuple[Interval, tuple[str, ...]]:
    shared = [m for m in methods if all(m in by_method for by_method in other.values())]
    if len(shared) < 3:
        return Interval(math.nan, math.nan, math.nan), tuple(shared)
    return rank_correlation(results, other, shared), tuple(shared)
