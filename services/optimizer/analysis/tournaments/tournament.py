"""What a tournament says of its methods: running times, profiles, ranks, and how sure that is."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.analysis.interval import Interval, percentile_interval
from gaitswarm.services.optimizer.analysis.ranks import average_ranks, spearman
from gaitswarm.services.optimizer.jobs.columns import EvaluationColumns
from gaitswarm.services.optimizer.jobs.kinds.tournament import TournamentSpec
from gaitswarm.services.optimizer.search.random_stream import RandomNumbers

Floats = NDArray[np.float64]

RESAMPLES: Final = 500
"""Bootstrap samples of an interval."""

_BOOTSTRAP: Final = 2_000
"""Purpose of random streams: the same runs give the same intervals."""


@dataclass(frozen=True, slots=True, eq=False)
class Runs:
    """All runs of one method on one problem.

    Attributes:
        checkpoints: (m,) evaluations at which `best` was noted; the last is the budget.
        best: (r, m) least fitness of each run so far, NaN while all its evaluations failed.
        to_best: (r,) evaluations until its best was found, NaN without one.
        to_target: (r,) evaluations until the target was reached, NaN if it was not.
        dimension: Variables of the problem.
        target: Fitness that counts as solved; None if there is none.
    """

    checkpoints: NDArray[np.int64]
    best: Floats
    to_best: Floats
    to_target: Floats
    dimension: int
    target: float | None

    def __len__(self) -> int:
        return len(self.best)

    @property
    def final(self) -> Floats:
        """(r,) least fitness of each run, +inf if all its evaluations failed."""
        last = self.best[:, -1]
        return np.where(np.isnan(last), np.inf, last)

    @property
    def solved(self) -> NDArray[np.bool_]:
        """(r,) whether a run reached the target."""
        return ~np.isnan(self.to_target)

    @property
    def budget(self) -> int:
        """Evaluations of a run."""
        return int(self.checkpoints[-1])

    def aiming_at(self, target: float) -> Runs:
        """The same runs with another target, reached at the first checkpoint that shows it."""
        reached = np.nan_to_num(self.best, nan=math.inf) <= target
        at = self.checkpoints[reached.argmax(axis=1)].astype(np.float64)
        return replace(self, to_target=np.where(reached.any(axis=1), at, math.nan), target=target)

    def quartiles(self) -> Floats:
        """(3, m) lower quartile, median and upper quartile of the best so far.

        Each is the value of a run, none is interpolated: +inf where so many runs have none.
        """
        filled = np.where(np.isnan(self.best), np.inf, self.best)
        rows: Floats = np.quantile(filled, (0.25, 0.5, 0.75), axis=0, method="inverted_cdf")
        return rows

    def median_after(self, evaluations: int) -> float:
        """Median of the best after so many evaluations."""
        index = int(np.searchsorted(self.checkpoints, evaluations, "right")) - 1
        return math.nan if index < 0 else float(self.quartiles()[1, index])


Results = Mapping[str, Mapping[str, Runs]]
"""Runs by problem, then by method."""


def runs_of(
    spec: TournamentSpec, columns: EvaluationColumns, most: int | None = None
) -> dict[str, Runs]:
    """Runs of a job, by problem."""
    rows = columns.objectives[:most]
    count = len(spec.checkpoints)
    return {
        problem.name: Runs(
            checkpoints=np.array(spec.checkpoints),
            best=rows[:, k, :count],
            to_best=rows[:, k, count],
            to_target=rows[:, k, count + 1],
            dimension=problem.space.dimension,
            target=problem.target,
        )
        for k, problem in enumerate(spec.problems)
    }


def expected_running_time(to_target: Floats, budget: int) -> float:
    """Evaluations until the target is reached, if runs are repeated until one is successful.

    The sum of evaluations of all runs, each until it reached the target or its budget was spent,
    over the number of runs that reached it (Hansen, Auger, Ros, Mersmann, Tusar and Brockhoff 2021,
    COCO).

    Args:
        to_target: (r,) evaluations until the target was reached, NaN for runs that did not.
    """
    return float(_running_times(to_target[None], budget)[0])


def running_time_interval(runs: Runs) -> Interval:
    """Expected running time with an interval, of resampled runs."""
    value = expected_running_time(runs.to_target, runs.budget)
    return percentile_interval(
        value, _running_times(runs.to_target[_picks(len(runs))], runs.budget)
    )


def data_profile(
    results: Results, method: str, precision: float, budgets: Sequence[float]
) -> Floats:
    """Share of runs that are solved within a budget (More and Wild 2009, SIAM J. Optim. 20(1)).

    A run has solved a problem when f <= f_L + tau (f_0 - f_L), eq. 2.2, with f_L the least value of
    any run of any method. Methods start anywhere, so f_0 is the median over all runs of their best
    at the first checkpoint. Evaluations are those of the checkpoint at which a run is seen to have
    solved it.

    Args:
        budgets: (b,) evaluations over the number of variables plus one, the unit of a simplex
            gradient.

    Returns:
        (b,) shares, over all runs on all problems.
    """
    solved = []
    for by_method in results.values():
        least = min(float(runs.final.min(initial=math.inf)) for runs in by_method.values())
        first = np.concatenate([runs.best[:, 0] for runs in by_method.values()])
        begun = float(np.median(first[~np.isnan(first)])) if not np.isnan(first).all() else math.inf
        runs = by_method[method]
        bound = least + precision * (begun - least) if math.isfinite(begun) else least
        at = np.nan_to_num(runs.aiming_at(bound).to_target, nan=math.inf)
        solved.append(at / (runs.dimension + 1))
    gradients = np.concatenate(solved)
    return np.array([float((gradients <= budget).mean()) for budget in budgets])


def ranks(by_method: Mapping[str, Runs]) -> Floats:
    """Rank methods on a problem by how their runs compare.

    A run is before another one if it reached the target and the other did not, or both did and it
    took fewer evaluations, or neither did and its best is less. Methods are ranked by the mean rank
    of their runs among all runs, ties sharing a mean rank.

    Returns:
        (M,) ranks from 1, the best, in the order of the methods.
    """
    return _Field.of(list(by_method.values())).ranks()


def mean_ranks(results: Results, methods: Sequence[str]) -> dict[str, Interval]:
    """Ranks of methods, averaged over problems, with intervals of resampled runs."""
    fields = _fields(results, methods)
    value = _mean_ranks(fields, _Field.ranks)
    samples = np.array([_mean_ranks(fields, ranks) for ranks in _resampled_ranks()])
    return {
        name: percentile_interval(float(value[k]), samples[:, k]) for k, name in enumerate(methods)
    }


def rank_correlation(one: Results, other: Results, methods: Sequence[str]) -> Interval:
    """Spearman's correlation of methods' mean ranks on two sets of problems."""
    fields = [_fields(results, methods) for results in (one, other)]

    def correlation(ranks: Ranks) -> float:
        return spearman(*(_mean_ranks(problems, ranks) for problems in fields))

    samples = np.array([correlation(ranks) for ranks in _resampled_ranks()])
    return percentile_interval(correlation(_Field.ranks), samples)


@dataclass(frozen=True, slots=True, eq=False)
class _Field:
    """The runs of all methods on a problem, by how they compare.

    Attributes:
        place: (n,) place of every run in the order of all, from 0; equal ones share it.
        first: (M,) index of the first run of each method; its runs follow each other.
        count: (M,) runs of each method.
    """

    place: NDArray[np.intp]
    first: NDArray[np.intp]
    count: NDArray[np.intp]

    @classmethod
    def of(cls, runs: Sequence[Runs]) -> _Field:
        """Those of some methods."""
        scores = np.concatenate([_scores(of_method) for of_method in runs])
        _, place = np.unique(scores, axis=0, return_inverse=True)
        count = np.array([len(of_method) for of_method in runs], dtype=np.intp)
        return cls(place.reshape(-1), np.cumsum(count) - count, count)

    def ranks(self, chosen: NDArray[np.intp] | None = None) -> Floats:
        """(M,) ranks of the methods; chosen: (n,) runs that stand for theirs."""
        place = self.place if chosen is None else self.place[chosen]
        equal = np.bincount(place)
        # Half of an integer: sums are exact in any order.
        shared = np.cumsum(equal) - 0.5 * (equal - 1)
        return average_ranks(np.add.reduceat(shared[place], self.first) / self.count)

    def resampled(self, numbers: Floats) -> Floats:
        """(M,) ranks of as many runs of each method, drawn by (n,) uniform numbers."""
        count, first = (np.repeat(of_method, self.count) for of_method in (self.count, self.first))
        return self.ranks(first + np.floor(numbers * count).astype(np.intp))


Ranks = Callable[[_Field], Floats]
"""Runs on a problem -> (M,) ranks of the methods."""


def _scores(runs: Runs) -> Floats:
    """(r, 2) what runs are compared by: 0 and evaluations to the target, or 1 and the best."""
    solved = runs.solved
    return np.stack([~solved, np.where(solved, runs.to_target, runs.final)], axis=1)


def _fields(results: Results, methods: Sequence[str]) -> list[_Field]:
    """By problem."""
    return [_Field.of([by_method[name] for name in methods]) for by_method in results.values()]


def _mean_ranks(fields: Sequence[_Field], ranks: Ranks) -> Floats:
    total = sum(map(ranks, fields), np.zeros(len(fields[0].count)))
    return total / len(fields)


def _resampled_ranks() -> Iterator[Ranks]:
    """Ranks of runs that are drawn with replacement, `RESAMPLES` times."""
    random = RandomNumbers(1, _BOOTSTRAP)

    def ranks(field: _Field) -> Floats:
        return field.resampled(random.uniform(len(field.place)))

    for _ in range(RESAMPLES):
        yield ranks


@lru_cache(maxsize=8)
def _picks(count: int) -> NDArray[np.intp]:
    """(RESAMPLES, count) indices of runs that are drawn with replacement."""
    numbers = RandomNumbers(1, _BOOTSTRAP).uniform(RESAMPLES, count)
    return np.floor(numbers * count).astype(np.intp)


def _running_times(to_target: Floats, budget: int) -> Floats:
    """(s,) expected running time of every row of (s, r) runs."""
    solved = ~np.isnan(to_target)
    spent = np.where(solved, to_target, budget).sum(axis=1)
    count = solved.sum(axis=1)
    return np.where(count > 0, spent / np.maximum(count, 1), math.inf)
