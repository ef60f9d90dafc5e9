"""Statistics of a comparison: medians, ranks with intervals, running times, and tests."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.stats import friedmanchisquare, mannwhitneyu, rankdata, spearmanr

from gaitswarm_research.compare.problems import NAMES, problem
from gaitswarm_research.compare.runs import CHECKPOINTS, Run

Floats = NDArray[np.float64]

Runs = Mapping[str, Mapping[str, Sequence[Run]]]
"""Runs by problem, then by method."""

RESAMPLES: Final = 500
"""Bootstrap samples of an interval."""


@dataclass(frozen=True, slots=True)
class MethodOnProblem:
    """Results of a method on a problem.

    Attributes:
        runs: Number of runs.
        solved: Number of runs that reached the target; None without one.
        running_time: Expected evaluations until the target (Hansen et al. 2021, COCO): evaluations
            of all runs over the number of solved ones; None without a target.
        medians: Median of the best after each checkpoint up to the budget.
        quartiles: First and third quartile at the end of the budget.
        rank: Mean rank of its runs among all runs, ranked among the methods.
        p: p of a two-sided Mann-Whitney test against the best-ranked method; None for that method.
    """

    method: str
    runs: int
    solved: int | None
    running_time: float | None
    medians: tuple[float, ...]
    quartiles: tuple[float, float]
    rank: float
    p: float | None


@dataclass(frozen=True, slots=True)
class MeanRank:
    """Rank of a method, averaged over problems, with an interval of 95 % of resampled runs."""

    method: str
    value: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Summary:
    """Results of a comparison.

    Attributes:
        mean_ranks: Best first.
        friedman_p: p of Friedman's test that all methods rank equally; None for fewer than three
            methods or problems.
        problems: Methods by problem, best first.
        checkpoints: Evaluations of the medians, by problem.
        correlation: Spearman's correlation of the mean ranks on test functions and on walking jobs;
            None without both or for fewer than three methods.
    """

    mean_ranks: tuple[MeanRank, ...]
    friedman_p: float | None
    problems: Mapping[str, tuple[MethodOnProblem, ...]]
    checkpoints: Mapping[str, tuple[int, ...]]
    correlation: float | None


def grouped(runs: Iterable[Run]) -> dict[str, dict[str, list[Run]]]:
    """Group runs by problem and method, and leave out methods that miss a problem."""
    groups: dict[str, dict[str, list[Run]]] = {}
    for run in runs:
        groups.setdefault(run.task.problem, {}).setdefault(run.task.method, []).append(run)
    complete = set.intersection(*map(set, groups.values())) if groups else set()
    return {
        name: {method: by_method[method] for method in by_method if method in complete}
        for name, by_method in groups.items()
    }


def summarize(runs: Runs) -> Summary:
    """Compute the statistics of runs that `grouped` returns."""
    ranks = {name: _ranks(list(by_method.values())) for name, by_method in runs.items()}
    means = mean_ranks(runs)
    table = np.array([[r for _, r in sorted(zip(runs[n], ranks[n], strict=True))] for n in runs])
    friedman = None
    if len(runs) > 2 and len(means) > 2 and np.ptp(table, axis=1).any():
        friedman = float(friedmanchisquare(*table.T).pvalue)
    return Summary(
        mean_ranks=means,
        friedman_p=friedman,
        problems={name: _on_problem(runs[name], ranks[name]) for name in runs},
        checkpoints={name: _checkpoints(by_method) for name, by_method in runs.items()},
        correlation=rank_correlation(runs),
    )


def mean_ranks(runs: Runs) -> tuple[MeanRank, ...]:
    """Average the ranks of methods over problems, with bootstrap intervals, best first."""
    methods = sorted(next(iter(runs.values()), {}))
    fields = [[by_method[name] for name in methods] for by_method in runs.values()]
    scores = [_Scores(field) for field in fields]
    values = np.mean([score.ranks() for score in scores], axis=0)
    random = np.random.Generator(np.random.Philox(1))
    samples = [np.mean([s.resampled(random) for s in scores], axis=0) for _ in range(RESAMPLES)]
    low, high = np.quantile(samples, (0.025, 0.975), axis=0)
    rows = [
        MeanRank(name, float(values[k]), float(low[k]), float(high[k]))
        for k, name in enumerate(methods)
    ]
    return tuple(sorted(rows, key=lambda row: row.value))


def rank_correlation(runs: Runs) -> float | None:
    """Correlate mean ranks on test functions with those on walking jobs."""
    functions = {n: r for n, r in runs.items() if n in NAMES and problem(n).target is not None}
    walking = {n: r for n, r in runs.items() if n not in functions}
    if not functions or not walking or len(next(iter(runs.values()))) < 3:
        return None
    columns = [
        [row.value for row in sorted(mean_ranks(part), key=lambda row: row.method)]
        for part in (functions, walking)
    ]
    value = float(spearmanr(columns[0], columns[1]).statistic)
    return None if math.isnan(value) else value


def median(runs: Sequence[Run], checkpoint: int) -> float:
    """Return the median of the best after a checkpoint, +inf if most runs have none."""
    return float(_quantiles(runs, CHECKPOINTS.index(checkpoint))[1])


def mann_whitney(one: Sequence[Run], other: Sequence[Run]) -> float:
    """Return p of a two-sided Mann-Whitney test of the final values of two methods."""
    a, b = ([run.final for run in runs] for runs in (one, other))
    return float(mannwhitneyu(rankdata([*a, *b])[: len(a)], rankdata([*a, *b])[len(a) :]).pvalue)


class _Scores:
    """The order of all runs on a problem.

    A run precedes another one if it reached the target and the other did not, if both did and it
    took fewer evaluations, or if neither did and its best is lower.
    """

    def __init__(self, by_method: Sequence[Sequence[Run]]) -> None:
        keys = [
            (math.isnan(run.to_target), run.final if math.isnan(run.to_target) else run.to_target)
            for runs in by_method
            for run in runs
        ]
        order = {key: place for place, key in enumerate(sorted(set(keys)))}
        self._places = np.array([order[key] for key in keys])
        self._counts = np.array([len(runs) for runs in by_method])
        self._first = np.cumsum(self._counts) - self._counts

    def ranks(self, chosen: NDArray[np.intp] | None = None) -> Floats:
        """Return (M,) ranks of the methods by the mean rank of their runs."""
        places = self._places if chosen is None else self._places[chosen]
        sums = np.add.reduceat(rankdata(places), self._first)
        return np.asarray(rankdata(sums / self._counts), dtype=np.float64)

    def resampled(self, random: np.random.Generator) -> Floats:
        """Return the ranks of as many runs of each method, drawn with replacement."""
        counts, first = (np.repeat(n, self._counts) for n in (self._counts, self._first))
        return self.ranks(first + np.floor(random.random(len(counts)) * counts).astype(np.intp))


def _ranks(by_method: Sequence[Sequence[Run]]) -> list[float]:
    return [float(rank) for rank in _Scores(by_method).ranks()]


def _on_problem(
    by_method: Mapping[str, Sequence[Run]], ranks: Sequence[float]
) -> tuple[MethodOnProblem, ...]:
    best = min(zip(ranks, by_method, strict=True))[1]
    checkpoints = _checkpoints(by_method)
    rows = []
    for (method, runs), rank in zip(by_method.items(), ranks, strict=True):
        name = runs[0].task.problem
        has_target = name in NAMES and problem(name).target is not None
        solved = [run.to_target for run in runs if not math.isnan(run.to_target)]
        spent = sum(solved) + sum(r.task.evaluations for r in runs if math.isnan(r.to_target))
        quartiles = _quantiles(runs, CHECKPOINTS.index(checkpoints[-1]))
        rows.append(
            MethodOnProblem(
                method=method,
                runs=len(runs),
                solved=len(solved) if has_target else None,
                running_time=(spent / len(solved) if solved else math.inf) if has_target else None,
                medians=tuple(median(runs, count) for count in checkpoints),
                quartiles=(float(quartiles[0]), float(quartiles[2])),
                rank=rank,
                p=None if method == best else mann_whitney(runs, by_method[best]),
            )
        )
    return tuple(sorted(rows, key=lambda row: row.rank))


def _checkpoints(by_method: Mapping[str, Sequence[Run]]) -> tuple[int, ...]:
    budget = min(run.task.evaluations for runs in by_method.values() for run in runs)
    return tuple(count for count in CHECKPOINTS if count <= budget)


def _quantiles(runs: Sequence[Run], checkpoint: int) -> Floats:
    """Return quartiles and median at a checkpoint; every one is the value of a run."""
    values = np.array([run.best[checkpoint] for run in runs])
    values = np.where(np.isnan(values), np.inf, values)
    return np.asarray(np.quantile(values, (0.25, 0.5, 0.75), method="inverted_cdf"))
