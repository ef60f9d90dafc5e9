"""Order in which walks enter the lanes of a kernel."""

from __future__ import annotations

import heapq
from bisect import bisect_left, insort
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

_GOOD_ENOUGH: Final = 1.005
"""Ratio to the time of perfectly even lanes below which the search stops."""

_EXCHANGES_PER_LANE: Final = 4
"""Limit of the search's length."""


@dataclass(frozen=True, slots=True)
class LanePlan:
    """Assignment of walks to lanes; a lane starts its next walk when one ends."""

    order: tuple[int, ...]  # indices of the walks in the order of their start
    end: float  # time at which the last lane finishes, in the unit of the durations
    use: float  # share of the lanes' time until then that is spent on walks [1]


def plan_lanes(durations: Sequence[float], lanes: int) -> LanePlan:
    """Distribute walks over lanes so that all lanes finish at nearly the same time."""
    if not durations:
        return LanePlan((), 0.0, 1.0)
    filled = _longest_first(durations, lanes)
    ideal = sum(durations) / lanes
    for _ in range(_EXCHANGES_PER_LANE * lanes):
        if filled[0].end <= _GOOD_ENOUGH * ideal or not _relieve(filled):
            break
        filled.sort(key=lambda lane: -lane.end)
    begins = [entry for lane in filled for entry in lane.begins()]
    order = tuple(index for _, index in sorted(begins))
    end = _end(durations, order, lanes)
    return LanePlan(order, end, ideal / end if end else 1.0)


def _end(durations: Sequence[float], order: Sequence[int], lanes: int) -> float:
    """Return when the last lane finishes if each free lane takes the next walk of the order."""
    free = [0.0] * lanes
    for index in order:
        heapq.heapreplace(free, free[0] + durations[index])
    return max(free)


@dataclass(slots=True)
class _Lane:
    """A lane; walks are (duration, index), the shortest first."""

    end: float
    walks: list[tuple[float, int]]

    def put(self, walk: tuple[float, int]) -> None:
        insort(self.walks, walk)
        self.end += walk[0]

    def drop(self, walk: tuple[float, int]) -> None:
        self.walks.remove(walk)
        self.end -= walk[0]

    def begins(self) -> list[tuple[float, int]]:
        """Return (start time, index) of every walk, the longest first."""
        time, begun = 0.0, []
        for duration, index in reversed(self.walks):
            begun.append((time, index))
            time += duration
        return begun


def _longest_first(durations: Sequence[float], lanes: int) -> list[_Lane]:
    """Apply the LPT rule; the lane that finishes last comes first."""
    filled = [_Lane(0.0, []) for _ in range(lanes)]
    free = [(0.0, k) for k in range(lanes)]
    for index in sorted(range(len(durations)), key=lambda k: -durations[k]):
        _, k = free[0]
        filled[k].put((durations[index], index))
        heapq.heapreplace(free, (filled[k].end, k))
    return sorted(filled, key=lambda lane: -lane.end)


def _relieve(filled: list[_Lane]) -> bool:
    """Shorten the first lane, which finishes last, by one move or exchange; return success."""
    last = filled[0]
    best: tuple[float, _Lane, tuple[float, int], tuple[float, int] | None] | None = None
    for lane in filled[1:]:
        gap = last.end - lane.end
        for given in last.walks:
            for taken in _near(lane, given[0] - 0.5 * gap):
                shift = given[0] - (taken[0] if taken else 0.0)
                end = max(last.end - shift, lane.end + shift)
                if end < (best[0] if best else last.end * (1.0 - 1e-9)):
                    best = end, lane, given, taken
    if best is None:
        return False
    _, lane, given, taken = best
    last.drop(given)
    lane.put(given)
    if taken:
        lane.drop(taken)
        last.put(taken)
    return True


def _near(lane: _Lane, duration: float) -> list[tuple[float, int] | None]:
    """Return the lane's walks just below and above a duration; None stands for no walk."""
    at = bisect_left(lane.walks, (duration, -1))
    below = lane.walks[at - 1] if at else None
    return [below, lane.walks[at]] if at < len(lane.walks) else [below]
