"""Relevance of scenarios: the winners that fewer scenarios would have chosen

From stored objectives alone: designs are judged by the geometric mean over some scenarios (eq.
4.2), and the winner is judged by that over all. A search with fewer scenarios would have evaluated
other designs, so results should be verified by a job.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.analysis.ranking import rank_correlation
from gaitswarm.services.optimizer.analysis.statistics import Interval, percentile_interval
from gaitswarm.services.optimizer.search.random_stream import RandomNumbers, uniform

Floats = NDArray[np.float64]

_RESAMPLES: Final = 400
_LEAST_RESAMPLES: Final = 40
_RESAMPLED_ROWS: Final = 4_000_000
"""Of all resamples together: longer histories have fewer resamples."""

_FOREMOST: Final = 64
"""Rows among which a resample's winner is first looked for: a resample contains each of them with a
probability of two thirds.
"""

_MOST_FAMILIES: Final = 64
"""Limit on the families of one size; beyond it, they are sampled."""

_RESAMPLE, _DRAW = 0xFA71, 0xFA72


@dataclass(frozen=True, slots=True)
class Family:
    """A non-empty subset of a job's scenarios.

    Attributes:
        scenarios: indices, ascending.
        correlation: Spearman's, between the fitness over them and over all, among designs that
            succeed in all; None if undefined.
        winner: row of the best design by them.
        regret: relative excess of the winner's fitness over all scenarios above the job's best;
            +inf for a winner that fails.
    """

    scenarios: tuple[int, ...]
    correlation: float | None
    winner: int
    regret: Interval


@dataclass(frozen=True, slots=True)
class LeftOut:
    """All scenarios but one.

    Attributes:
        scenario: index of the omitted one.
        loss: relative excess of the family's winner above the job's best in the omitted scenario;
            negative if it is better.
        similar: index of the scenario with the most similar ranking; None if undefined.
        similarity: Spearman's correlation of the two.
    """

    scenario: int
    family: Family
    loss: Interval
    similar: int | None
    similarity: float | None


@dataclass(frozen=True, slots=True)
class ScenarioFamilies:
    """Results of judging by fewer scenarios.

    Attributes:
        left_out: one entry for each scenario; empty for a single scenario.
        families: of every smaller size, all of them or a sample, smaller ones first.
        smallest: smallest family whose interval of regret ends within the tolerance, of these the
            one of least regret; None if there is none.
    """

    designs: int
    failed: int
    left_out: tuple[LeftOut, ...]
    families: tuple[Family, ...]
    tolerance: float
    smallest: Family | None


def scenario_families(log_utilities: Floats, *, tolerance: float) -> ScenarioFamilies:
    """Judge designs by fewer scenarios.

    log_utilities: (r, K), +inf for a failure; at least one row is finite.
    """
    judged = _Judged.of(log_utilities)
    count = log_utilities.shape[1]
    families = tuple(judged.family(chosen) for chosen in _families(count))
    whole = [family for family in families if len(family.scenarios) == count - 1]
    within = [family for family in families if family.regret.high <= tolerance]
    return ScenarioFamilies(
        designs=len(judged.complete),
        failed=len(log_utilities) - len(judged.complete),
        left_out=tuple(sorted(map(judged.left_out, whole), key=lambda left: left.scenario)),
        families=families,
        tolerance=tolerance,
        smallest=min(within, key=_order, default=None),
    )


def _order(family: Family) -> tuple[float, ...]:
    correlation = -math.inf if family.correlation is None else family.correlation
    return (len(family.scenarios), family.regret.high, family.regret.value, -correlation)


def _families(count: int) -> Iterator[tuple[int, ...]]:
    """Subsets of scenario indices, always including single scenarios and all but one."""
    for size in range(1, count):
        number = math.comb(count, size)
        if number <= _MOST_FAMILIES or size in (1, count - 1):
            yield from combinations(range(count), size)
        else:
            yield from _drawn(count, size)


def _drawn(count: int, size: int) -> Iterable[tuple[int, ...]]:
    numbers = RandomNumbers(0, _DRAW, iteration=size)
    drawn: set[tuple[int, ...]] = set()
    while len(drawn) < _MOST_FAMILIES:
        drawn.add(tuple(sorted(numbers.permutation(count)[:size].tolist())))
    return sorted(drawn)


@dataclass(frozen=True, slots=True, eq=False)
class _Judged:
    """log_utilities: (r, K); fitness: (r,) its mean; complete: rows that succeed in all scenarios;
    drawn: (1 + B, r) whether a row is present, first in the whole, then in each resample; bests:
    (1 + B,) best row of each by the fitness over all.
    """

    log_utilities: Floats
    fitness: Floats
    complete: NDArray[np.intp]
    drawn: NDArray[np.bool_]
    bests: NDArray[np.intp]

    @classmethod
    def of(cls, log_utilities: Floats) -> _Judged:
        rows = len(log_utilities)
        fitness = log_utilities.mean(axis=1)
        count = min(_RESAMPLES, max(_LEAST_RESAMPLES, _RESAMPLED_ROWS // rows))
        # Multiplicities do not affect winners; a mask takes an eighth of their memory.
        drawn = np.zeros((1 + count, rows), dtype=np.bool_)
        drawn[0] = True
        for k in range(count):
            numbers = uniform(0, _RESAMPLE, iteration=0, particle=k, count=rows)
            drawn[1 + k, (numbers * rows).astype(np.intp)] = True
        return cls(
            log_utilities,
            fitness,
            np.flatnonzero(np.isfinite(fitness)),
            drawn,
            _winners(fitness, drawn),
        )

    def family(self, chosen: tuple[int, ...]) -> Family:
        fitness = self.log_utilities[:, chosen].mean(axis=1)
        winners = _winners(fitness, self.drawn)
        return Family(
            scenarios=chosen,
            correlation=rank_correlation(fitness[self.complete], self.fitness[self.complete]),
            winner=int(winners[0]),
            regret=_loss(self.fitness[winners], self.fitness[self.bests]),
        )

    def left_out(self, family: Family) -> LeftOut:
        count = self.log_utilities.shape[1]
        (scenario,) = set(range(count)) - set(family.scenarios)
        utility = self.log_utilities[:, scenario]
        fitness = self.log_utilities[:, family.scenarios].mean(axis=1)
        similar = self._similar(scenario, family.scenarios)
        return LeftOut(
            scenario=scenario,
            family=family,
            loss=_loss(utility[_winners(fitness, self.drawn)], utility[self.bests]),
            similar=similar[0],
            similarity=similar[1],
        )

    def _similar(self, own: int, others: Sequence[int]) -> tuple[int | None, float | None]:
        rows = self.log_utilities[self.complete]
        found = {other: rank_correlation(rows[:, other], rows[:, own]) for other in others}
        known = {other: value for other, value in found.items() if value is not None}
        if not known:
            return None, None
        most = max(known, key=lambda other: known[other])
        return most, known[most]


def _winners(fitness: Floats, drawn: NDArray[np.bool_]) -> NDArray[np.intp]:
    """(1 + B,) row of the least fitness (r,) in each sample; ties by age."""
    winners = np.empty(len(drawn), dtype=np.intp)
    left, most = np.arange(len(drawn)), _FOREMOST
    while len(left):
        order = _best_first(fitness, most)
        held = drawn[np.ix_(left, order)]
        found = held.any(axis=1)
        winners[left[found]] = order[held[found].argmax(axis=1)]
        left, most = left[~found], 8 * most
    return winners


def _best_first(fitness: Floats, most: int) -> NDArray[np.intp]:
    """The `most` rows of least fitness (r,), and all ties with the last of them, in order."""
    if most >= len(fitness):
        return np.argsort(fitness, kind="stable")
    rows = np.flatnonzero(fitness <= np.partition(fitness, most - 1)[most - 1])
    return rows[np.argsort(fitness[rows], kind="stable")]


def _loss(own: Floats, best: Floats) -> Interval:
    """Relative excess of designs above others.

    own, best: (1 + B,) logarithms, of the designs themselves and of each resample.
    """
    # A resample may have no design that succeeds in all scenarios.
    known = np.isfinite(best)
    with np.errstate(over="ignore"):
        losses = np.expm1(own[known] - best[known])
    found = percentile_interval(float(losses[0]), losses)
    return Interval(found.value, min(found.low, found.value), max(found.high, found.value))
