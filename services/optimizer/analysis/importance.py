"""Which variables matter: first-order Sobol' indices, estimated from the designs that a job has.

The index of a variable is Var(E[Y | X]) / Var(Y), the share of the variance of an output that goes
with this variable alone (Sobol' 1993; Saltelli et al., Global Sensitivity Analysis, 2008, 1.2). It
is estimated from given data, without a further walk, by classes of the variable: the correlation
ratio (Plischke, An effective algorithm for computing global sensitivity indices, Reliability
Engineering & System Safety 95, 2010), here with Kelley's correction for chance (PNAS 21, 1935),
under which a variable that does nothing has 0 on average. Outputs are taken by rank, so that a few
very bad designs do not decide, and no unit does (Saltelli & Sobol', Reliability Engineering &
System Safety 50, 1995).

A search does not draw its designs at random: its variables move together. So an index speaks of the
designs that were tried, a variable that moved with another one shares its index, and indices do not
add up to 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.analysis.statistics import (
    Interval,
    average_ranks,
    percentile_interval,
)
from gaitswarm.services.optimizer.search.random_stream import RandomNumbers
from gaitswarm.sim.variables import Variable

Floats = NDArray[np.float64]

LEAST_DESIGNS: Final = 20
"""Designs below which nothing can be said of an output."""

MOST_DESIGNS: Final = 10_000
"""Designs that are looked at; of more, so many that are spread evenly over the iterations."""

_RESAMPLES: Final = 200
_MOST_CLASSES: Final = 24
_RESAMPLE: Final = 0x1337
"""Purpose of the random numbers."""


@dataclass(frozen=True, slots=True)
class Companion:
    """The variable that another one moved with the most.

    Attributes:
        name: Of the variable.
        correlation: Spearman's rank correlation of the two among the designs, -1 to 1 [1].
    """

    name: str
    correlation: float


def first_order_indices(
    designs: Floats, variables: Sequence[Variable], output: Floats
) -> tuple[Interval, ...] | None:
    """Estimate the first-order Sobol' index of every variable.

    Args:
        designs: (r, d) values of the variables, in their units.
        output: (r,) what they lead to, of any unit; only its order counts.
    """
    if len(output) < LEAST_DESIGNS:
        return None
    rank = average_ranks(output)
    # Centred, so that sums of squares lose no digits.
    rank -= rank.mean()
    if not rank.any():
        return None
    weights = np.vstack([np.ones(len(rank)), _bootstrap_weights(len(rank))])
    found = []
    for column, variable in enumerate(variables):
        ratios = _corrected_ratio(_classes(designs[:, column], variable), rank, weights)
        # A resample repeats designs, which makes its ratio larger: that shift is taken out.
        resampled = ratios[1:] - (np.mean(ratios[1:]) - ratios[0])
        index, *around = np.clip([ratios[0], *resampled], 0.0, 1.0)
        found.append(percentile_interval(float(index), np.array(around)))
    return tuple(found)


def companions(designs: Floats, variables: Sequence[Variable]) -> tuple[Companion | None, ...]:
    """Find for every variable the one that it moved with the most.

    Args:
        designs: (r, d) values of the variables.
    """
    ranks = np.apply_along_axis(average_ranks, 0, designs)
    ranks -= ranks.mean(axis=0)
    size = np.sqrt((ranks**2).sum(axis=0))
    with np.errstate(divide="ignore", invalid="ignore"):
        correlation = (ranks.T @ ranks) / np.outer(size, size)
    np.fill_diagonal(correlation, np.nan)
    found: list[Companion | None] = []
    for row in correlation:
        if np.isnan(row).all():
            found.append(None)
            continue
        other = int(np.nanargmax(np.abs(row)))
        found.append(Companion(variables[other].name, float(np.clip(row[other], -1.0, 1.0))))
    return tuple(found)


def _bootstrap_weights(rows: int) -> Floats:
    """(resamples, rows): how often each row is in each resample."""
    random = RandomNumbers(rows, _RESAMPLE)
    drawn = (random.uniform(_RESAMPLES, rows) * rows).astype(np.intp)
    return np.stack([np.bincount(row, minlength=rows) for row in drawn]).astype(np.float64)


def _classes(values: Floats, variable: Variable) -> NDArray[np.intp]:
    """(r,) class of each value, from 0: classes of equally many designs, as near as ties allow."""
    distinct, inverse = np.unique(values, return_inverse=True)
    # Some ten designs in a class, and more of both the more designs there are.
    count = int(np.clip(round(len(values) ** (1 / 3)), 2, _MOST_CLASSES))
    if variable.kind == "categorical" or len(distinct) <= count:
        return np.asarray(inverse, dtype=np.intp)
    edges = np.unique(np.quantile(values, np.linspace(0.0, 1.0, count + 1)[1:-1]))
    return np.searchsorted(edges, values, side="right")


def _corrected_ratio(classes: NDArray[np.intp], rank: Floats, weights: Floats) -> Floats:
    """(B,) epsilon squared of each row of weights (Kelley 1935); by chance below 0."""
    members = np.equal.outer(classes, np.arange(classes.max() + 1)).astype(np.float64)
    count = weights @ members
    sums = weights @ (members * rank[:, np.newaxis])
    rows, present = count.sum(axis=1), (count > 0).sum(axis=1)
    mean = sums.sum(axis=1) / rows
    total = weights @ rank**2 - rows * mean**2
    with np.errstate(divide="ignore", invalid="ignore"):
        between = np.where(count > 0, sums**2 / count, 0.0).sum(axis=1) - rows * mean**2
        unexplained = np.clip(1.0 - between / total, 0.0, 1.0)
        index = 1.0 - unexplained * (rows - 1) / (rows - present)
    return np.where((present > 1) & (total > 0.0), index, 0.0)
