"""What a tournament came to, as numbers: for the report, the terminal and programs."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from services.optimizer.analysis.tournament import (
    Interval,
    Results,
    Runs,
    mean_ranks,
    rank_correlation,
    ranks,
    running_time_interval,
)

NEAR: Final = 0.01
"""Share of the least value of all runs, within which a run counts that has no target."""


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


@dataclass(frozen=True, slots=True)
class Standings:
    """All that a report tells.

    Attributes:
        results: Runs by problem, then by method, best first.
        looked_at: Evaluations after which medians are told.
        targets: By problem: that given, or else 1 % above the least value of all runs.
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

    def document(self) -> dict[str, Any]:
        """Everything but the runs, as JSON has it; null for what is not finite."""
        return {
            "mean_ranks": {m: _interval(r) for m, r in self.mean_ranks.items()},
            "problems": {
                name: {
                    "target": self.targets[name],
                    "methods": {s.method: self._standing(s) for s in standings},
                }
                for name, standings in self.by_problem.items()
            },
            "rank_correlation": None
            if self.correlation is None
            else {**_interval(self.correlation[0]), "methods": list(self.correlation[1])},
        }

    def _standing(self, standing: Standing) -> dict[str, Any]:
        medians = zip(self.looked_at, standing.medians, strict=True)
        return {
            "rank": standing.rank,
            "runs": standing.runs,
            "solved": standing.solved,
            "expected_running_time": _interval(standing.running_time),
            "median_best": {str(count): _finite(value) for count, value in medians},
            "least": _finite(standing.least),
        }


def standings_of(
    results: Results, looked_at: Sequence[int], other: Results | None = None
) -> Standings:
    """Judge a tournament.

    Args:
        results: Its runs.
        looked_at: Evaluations after which medians are told, the budget last.
        other: Runs of another tournament, whose ranks are compared.

    Returns:
        The standings.
    """
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
    return least + NEAR * abs(least)


def _compared(
    results: Results, other: Results, methods: Sequence[str]
) -> tuple[Interval, tuple[str, ...]]:
    shared = [m for m in methods if all(m in by_method for by_method in other.values())]
    if len(shared) < 3:
        return Interval(math.nan, math.nan, math.nan), tuple(shared)
    return rank_correlation(results, other, shared), tuple(shared)


def _interval(interval: Interval) -> dict[str, float | None]:
    return {
        "value": _finite(interval.value),
        "low": _finite(interval.low),
        "high": _finite(interval.high),
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
