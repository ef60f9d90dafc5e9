"""Designs that no other dominates: a Pareto front of many points at once.

Divide and conquer over objectives after Kung, Luccio and Preparata (1975), with leaves that are
compared by numpy all at once.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Rows = NDArray[np.intp]

_LEAF: Final = 1 << 15
"""Pairs of points that are compared with each other without further division."""


def non_dominated(points: Floats) -> NDArray[np.bool_]:
    """Find the points that no other dominates; all objectives are minimized.

    A point dominates another if it is no worse in any objective and better in one; of equal points
    none dominates the other.

    Args:
        points: (r, M) objectives; a row that is not finite is not on the front.

    Returns:
        (r,), true for the points of the front.
    """
    finite = np.isfinite(points).all(axis=1)
    front = np.zeros(len(points), dtype=np.bool_)
    if not finite.any():
        return front
    # Sorted by the first objective, then the second and so on: none is dominated by a later one.
    distinct, inverse = np.unique(points[finite], axis=0, return_inverse=True)
    kept = np.zeros(len(distinct), dtype=np.bool_)
    kept[_front(distinct, np.arange(len(distinct)))] = True
    front[finite] = kept[inverse.reshape(-1)]
    return front


def _front(points: Floats, rows: Rows) -> Rows:
    """Those of the rows, ascending, that no other of them dominates."""
    if len(rows) ** 2 <= _LEAF:
        return rows[~_any_below(points[rows], points[rows], itself=True)]
    half = len(rows) // 2
    better, worse = _front(points, rows[:half]), _front(points, rows[half:])
    # The first objective is in order already.
    return np.concatenate([better, _left(points, better, worse, 1)])


def _left(points: Floats, judges: Rows, rows: Rows, first: int) -> Rows:
    """Those of the rows, in order, that no judge is as good as in all objectives from `first` on.

    Judges are as good as all rows in the objectives before, and none is equal to a row throughout.
    """
    if not len(judges) or not len(rows):
        return rows
    objectives = points.shape[1]
    if first >= objectives:
        return rows[:0]
    if first == objectives - 1:
        best = float(points[judges, first].min())
        return np.asarray(rows[points[rows, first] < best])
    if len(judges) * len(rows) <= _LEAF:
        return rows[~_any_below(points[judges, first:], points[rows, first:])]
    if first == objectives - 2:
        return rows[~_swept(points[judges, first:], points[rows, first:])]
    own, others = points[rows, first], points[judges, first]
    pivot = np.median(np.concatenate([own, others]))
    low, judge_low = own < pivot, others < pivot
    if not (low.any() or judge_low.any()):
        # Nothing is below the pivot: most are equal to it, and they divide the rest.
        low, judge_low = own <= pivot, others <= pivot
        if low.all() and judge_low.all():
            return _left(points, judges, rows, first + 1)
    good = _left(points, judges[judge_low], rows[low], first)
    bad = _left(points, judges[judge_low], rows[~low], first + 1)
    return np.sort(np.concatenate([good, _left(points, judges[~judge_low], bad, first)]))


def _any_below(judges: Floats, points: Floats, *, itself: bool = False) -> NDArray[np.bool_]:
    """(n,): whether any judge is as good as each point in every objective; itself: but itself."""
    below = np.ones((len(judges), len(points)), dtype=np.bool_)
    for m in range(points.shape[1]):
        below &= judges[:, m, None] <= points[None, :, m]
    if itself:
        np.fill_diagonal(below, val=False)
    return np.asarray(below.any(axis=0))


def _swept(judges: Floats, points: Floats) -> NDArray[np.bool_]:
    """As `_any_below` for two objectives, in order of the first."""
    order = np.argsort(judges[:, 0], kind="stable")
    least = np.minimum.accumulate(judges[order, 1])
    before = np.searchsorted(judges[order, 0], points[:, 0], side="right")
    return np.asarray((before > 0) & (least[np.maximum(before, 1) - 1] <= points[:, 1]))
