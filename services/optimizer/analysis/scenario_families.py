"""Relevance of scenarios: the winners that fewer scenarios would have chosen

From stored objectives alone: designs are judged by the geometric mean over some scenarios (eq.
4.2), and the winner is judged by that over all. A search with fewer scenarios would have evaluated
other designs, so results should be verified by a job.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from itertools import combinations
from typing import Final

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gaitswarm.services.optimizer.analysis.statistics import (
    Interval,
    percentile_interval,
    rank_correlation,
)
from gaitswarm.services.optimizer.jobs.iteration import EvaluationColumns
from gaitswarm.services.optimizer.search.random_stream import RandomNumbers
from gaitswarm.services.optimizer.views import Finite, IterationIndex, Particle, View

Floats = NDArray[np.float64]

TOLERANCE: Final = 0.01
"""Regret of the smallest family, by default [1]."""

_RESAMPLES: Final = 400
_LEAST_RESAMPLES: Final = 40
_RESAMPLED_ROWS: Final = 4_000_000
"""Of all resamples together: longer histories have fewer resamples."""

_FOREMOST: Final = 64
"""Best rows among which all winners are, as a rule: a resample has each with a chance of 2/3."""

_MOST_FAMILIES: Final = 64
"""Limit on the families of one size; beyond it, they are sampled."""

_RESAMPLE, _DRAW = 0xFA71, 0xFA72


class LossView(View):
    """By how much a design is worse than the job's best, as a share [1]; null where it fails."""

    value: Finite = Field(description="The estimate.", examples=[0.012])
    low: Finite = Field(description="Lower end of the interval of 95 %.", examples=[0.0])
    high: Finite = Field(description="Upper end.", examples=[0.031])


class FamilyView(View):
    """A subset of a job's scenarios, and the design that is best in them."""

    scenarios: list[str] = Field(description="Their names, in the job's order.")
    correlation: float | None = Field(
        description="Spearman's rank correlation of the fitness over these and over all scenarios,"
        " among designs that succeed in all [1]; null where it is undefined.",
        examples=[0.97],
    )
    iteration: IterationIndex
    particle: Particle
    regret: LossView = Field(
        description="Excess of that design's fitness over all scenarios above the job's best."
    )


class LeftOutView(View):
    """Effect of leaving out one scenario."""

    scenario: str = Field(description="Name of the scenario left out.", examples=["loaded-fast"])
    family: FamilyView = Field(description="The others.")
    loss: LossView = Field(
        description="Excess of the others' winner above the job's best in this scenario; negative"
        " if it is better."
    )
    similar: str | None = Field(
        description="The scenario whose utilities are most like it in rank; null if there is none."
    )
    similarity: float | None = Field(description="Spearman's rank correlation of the two [1].")


class FamilySizeView(View):
    """Families of one size."""

    size: int = Field(description="Scenarios of each.", examples=[3])
    families: int = Field(description="Families of this size that were evaluated.", examples=[20])
    median: Finite = Field(description="Of their regrets [1]; null if half of the winners fail.")
    worst: Finite = Field(description="Greatest of their regrets [1]; null if a winner fails.")
    within: int = Field(description="Families whose interval of regret is within the tolerance.")


class ScenarioFamiliesView(View):
    """Which scenarios of a job matter, from what it has stored; nothing is simulated."""

    scenarios: list[str] = Field(description="Of the job, in order.", examples=[["normal-fast"]])
    designs: int = Field(description="Designs that succeed in all of them.", examples=[618])
    failed: int = Field(description="Designs that do not.", examples=[7])
    tolerance: float = Field(description="Largest regret of a smallest family [1].")
    left_out: list[LeftOutView] = Field(description="Each scenario left out in turn.")
    sizes: list[FamilySizeView] = Field(
        description="Families by size; of more than 64, a sample of 64."
    )
    smallest: FamilyView | None = Field(
        description="The family of fewest scenarios whose interval of regret is within the"
        " tolerance, of these the one of least regret; null if there is none."
    )


def scenario_families(
    columns: EvaluationColumns, log_utilities: Floats, names: Sequence[str], *, tolerance: float
) -> ScenarioFamiliesView:
    """Judge designs by fewer scenarios.

    log_utilities: (r, K), +inf for a failure; at least one row is finite.
    """
    count = log_utilities.shape[1]
    total = log_utilities.mean(axis=1)
    complete = np.flatnonzero(np.isfinite(total))
    drawn = _resampled(len(total))
    bests = _winners(total, drawn)
    left_out: dict[int, LeftOutView] = {}
    regrets = defaultdict[int, list[float]](list)
    within: list[tuple[tuple[float, ...], FamilyView]] = []
    for chosen in families_of(count):
        fitness = log_utilities[:, chosen].mean(axis=1)
        winners = _winners(fitness, drawn)
        regret = _loss(total[winners], total[bests])
        family = FamilyView(
            scenarios=[names[k] for k in chosen],
            correlation=rank_correlation(fitness[complete], total[complete]),
            iteration=int(columns.iteration[winners[0]]),
            particle=int(columns.particle[winners[0]]),
            regret=LossView.model_validate(regret),
        )
        regrets[len(chosen)].append(regret.value)
        if regret.high <= tolerance:
            correlation = -math.inf if family.correlation is None else family.correlation
            order = (len(chosen), regret.high, regret.value, -correlation)
            within.append((order, family))
        if len(chosen) == count - 1:
            (absent,) = set(range(count)) - set(chosen)
            utility = log_utilities[:, absent]
            similar, similarity = _most_similar(log_utilities[complete], absent, chosen)
            left_out[absent] = LeftOutView(
                scenario=names[absent],
                family=family,
                loss=LossView.model_validate(_loss(utility[winners], utility[bests])),
                similar=None if similar is None else names[similar],
                similarity=similarity,
            )
    sizes = [order[0] for order, _ in within]
    return ScenarioFamiliesView(
        scenarios=list(names),
        designs=len(complete),
        failed=len(total) - len(complete),
        tolerance=tolerance,
        left_out=[left_out[k] for k in sorted(left_out)],
        sizes=[
            FamilySizeView(
                size=size,
                families=len(values),
                median=_median(values),
                worst=max(values),
                within=sizes.count(size),
            )
            for size, values in regrets.items()
        ],
        smallest=min(within, key=lambda entry: entry[0])[1] if within else None,
    )


def families_of(count: int) -> Iterator[tuple[int, ...]]:
    """Yield subsets of scenario indices, always including single scenarios and all but one."""
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


def _resampled(rows: int) -> NDArray[np.bool_]:
    """(1 + B, r): whether a row is present, first in the whole, then in each resample.

    Multiplicities do not affect winners; a mask takes an eighth of their memory.
    """
    count = min(_RESAMPLES, max(_LEAST_RESAMPLES, _RESAMPLED_ROWS // rows))
    drawn = np.zeros((1 + count, rows), dtype=np.bool_)
    drawn[0] = True
    for k in range(count):
        numbers = RandomNumbers(0, _RESAMPLE, particle=k).uniform(rows)
        drawn[1 + k, (numbers * rows).astype(np.intp)] = True
    return drawn


def _most_similar(
    rows: Floats, absent: int, others: Sequence[int]
) -> tuple[int | None, float | None]:
    """The scenario whose ranking is most similar to an absent one's, and their correlation."""
    correlations = {k: rank_correlation(rows[:, k], rows[:, absent]) for k in others}
    defined = [(value, -k) for k, value in correlations.items() if value is not None]
    if not defined:
        return None, None
    value, negative = max(defined)
    return -negative, value


def _median(values: Sequence[float]) -> float:
    if math.inf in values:
        return float(np.quantile(values, 0.5, method="higher"))
    return float(np.median(values))


def _winners(fitness: Floats, drawn: NDArray[np.bool_]) -> NDArray[np.intp]:
    """(1 + B,) row of the least fitness (r,) in each sample; ties by age."""
    order = np.argsort(fitness, kind="stable")
    foremost = order[:_FOREMOST]
    if not drawn[:, foremost].any(axis=1).all():
        foremost = order
    return np.asarray(foremost[drawn[:, foremost].argmax(axis=1)])


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
