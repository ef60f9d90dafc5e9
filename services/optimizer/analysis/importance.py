"""Importance of variables: first-order Sobol' indices, estimated from a job's designs

The index of a variable is Var(E[Y | X]) / Var(Y), the share of an output's variance explained by
this variable alone (Sobol' 1993; Saltelli et al., Global Sensitivity Analysis, 2008, 1.2). It is
estimated from given data, without further simulations, by classes of the variable: the correlation
ratio (Plischke, An effective algorithm for computing global sensitivity indices, Reliability
Engineering & System Safety 95, 2010) with Kelley's correction for chance (PNAS 21, 1935), under
which an irrelevant variable has 0 on average. Outputs are replaced by ranks, so that neither a few
very bad designs nor units matter (Saltelli & Sobol', Reliability Engineering & System Safety 50,
1995).

A search does not draw its designs at random: its variables move together. So an index describes the
designs that were tried, correlated variables share their index, and indices do not add up to 1.
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
"""Minimum number of designs for an estimate."""

MOST_DESIGNS: Final = 10_000
"""Limit on the number of designs; larger histories are thinned evenly over the iterations."""

_RESAMPLES: Final = 200
_MOST_CLASSES: Final = 24
_RESAMPLE: Final = 0x1337


@dataclass(frozen=True, slots=True)
class Companion:
    """The variable most strongly correlated with another one.

    Attributes:
        correlation: Spearman's rank correlation among the designs [1].
    """

    name: str
    correlation: float


def first_order_indices(
    designs: Floats, variables: Sequence[Variable], output: Floats
) -> tuple[Interval, ...] | None:
    """Estimate every variable's first-order Sobol' index for an output (r,), by its order alone.

    None for too few designs or a constant output.
    """
    if len(output) < LEAST_DESIGNS:
        return None
    rank = average_ranks(output)
    # Centered, so that sums of squares lose no digits.
    rank -= rank.mean()
    if not rank.any():
        return None
    weights = np.vstack([np.ones(len(rank)), _bootstrap_weights(len(rank))])
    result = []
    for column, variable in enumerate(variables):
        ratios = _corrected_ratio(_classes(designs[:, column], variable), rank, weights)
        # Resamples repeat designs, which increases their ratios: subtract that shift.
        resampled = ratios[1:] - (np.mean(ratios[1:]) - ratios[0])
        index, *around = np.clip([ratios[0], *resampled], 0.0, 1.0)
        result.append(percentile_interval(float(index), np.array(around)))
    return tuple(result)


def companions(designs: Floats, variables: Sequence[Variable]) -> tuple[Companion | None, ...]:
    """Return for every variable the one most strongly correlated with it."""
    ranks = np.apply_along_axis(average_ranks, 0, designs)
    ranks -= ranks.mean(axis=0)
    size = np.sqrt((ranks**2).sum(axis=0))
    with np.errstate(divide="ignore", invalid="ignore"):
        correlation = (ranks.T @ ranks) / np.outer(size, size)
    np.fill_diagonal(correlation, np.nan)
    result: list[Companion | None] = []
    for row in correlation:
        if np.isnan(row).all():
            result.append(None)
            continue
        other = int(np.nanargmax(np.abs(row)))
        result.append(Companion(variables[other].name, float(np.clip(row[other], -1.0, 1.0))))
    return tuple(result)


def _bootstrap_weights(rows: int) -> Floats:
    """(resamples, rows): multiplicity of each row in each resample."""
    random = RandomNumbers(rows, _RESAMPLE)
    drawn = (random.uniform(_RESAMPLES, rows) * rows).astype(np.intp)
    return np.stack([np.bincount(row, minlength=rows) for row in drawn]).astype(np.float64)


def _classes(values: Floats, variable: Variable) -> NDArray[np.intp]:
    """(r,) class of each value, from 0, of equal sizes except for ties."""
    distinct, inverse = np.unique(values, return_inverse=True)
    # The number of classes grows with the cube root of the number of designs.
    count = int(np.clip(round(len(values) ** (1 / 3)), 2, _MOST_CLASSES))
    if variable.kind == "categorical" or len(distinct) <= count:
        return np.asarray(inverse, dtype=np.intp)
    edges = np.unique(np.quantile(values, np.linspace(0.0, 1.0, count + 1)[1:-1]))
    return np.searchsorted(edges, values, side="right")


def _corrected_ratio(classes: NDArray[np.intp], rank: Floats, weights: Floats) -> Floats:
    """(B,) epsilon squared of each row of weights (Kelley 1935); may be negative."""
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
