"""Chunks: the tasks into which an iteration is cut"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

_TASKS_PER_SLOT: Final = 3
"""Chunks of single cases per slot, so that all slots finish at about the same time."""

_LONGEST_SECONDS: Final = 1.0
"""Of a task on few slots; other jobs and a stop wait for so long."""

_SECONDS_PER_SLOT: Final = 0.003
"""Length of tasks on many slots, per slot: the evaluator spends about 1 ms on each of its tasks
(docs/scale.md), and is to be idle for most of the time."""

_OVERHEAD_SHARE: Final = 0.05
"""Largest share of a task's time that sending it may take."""

_UNMEASURED: Final = (10.0, 256.0)
"""Smallest and largest cost of a job's first tasks [simulated s]."""

_WEIGHT: Final = 0.5
"""Of the last iteration in a pace, against all earlier ones."""


@dataclass(frozen=True, slots=True)
class Chunk:
    """What one task simulates: designs `start` <= index < `stop` in some cases."""

    cases: tuple[int, ...]
    start: int
    stop: int
    cost: float  # simulated time that the kernel's lanes step through [s]


@dataclass(frozen=True, slots=True)
class Pace:
    """Speed of a job's tasks."""

    seconds: float | None = None  # per simulated second of cost [s]; None before any is measured
    overhead: float = 0.0  # time to send a task and its answer [s]

    def after(self, times: Sequence[tuple[float, float, float]]) -> Pace:
        """Return the pace after tasks of cost [simulated s], computing time and overhead [s]."""
        cost = sum(cost for cost, _, _ in times)
        if cost <= 0.0:
            return self
        seconds = sum(seconds for _, seconds, _ in times) / cost
        # Other tasks may have waited for a free worker.
        overhead = max(0.0, min(overhead for _, _, overhead in times))
        if self.seconds is None:
            return Pace(seconds, overhead)
        return Pace(
            (1.0 - _WEIGHT) * self.seconds + _WEIGHT * seconds,
            (1.0 - _WEIGHT) * self.overhead + _WEIGHT * overhead,
        )

    def bounds(self, slots: int) -> tuple[float, float]:
        """Return the smallest and largest cost of a task [simulated s]."""
        if not self.seconds:
            return _UNMEASURED
        longest = max(_LONGEST_SECONDS, _SECONDS_PER_SLOT * slots) / self.seconds
        return min(self.overhead / _OVERHEAD_SHARE / self.seconds, longest), longest


def cut(
    durations: Sequence[float],
    designs: int,
    *,
    slots: int,
    lanes: int,
    pace: Pace | None = None,
    together: bool = True,
) -> tuple[Chunk, ...]:
    """Cut an iteration into chunks, longest first, of one case that fill the kernel's lanes.

    With fewer slots than cases a chunk has some designs in all cases, which the kernel packs into
    its lanes without gaps. durations: of each case [s].
    """
    bounds = (pace or Pace()).bounds(slots)
    if together and slots < len(durations):
        # With one simulation per lane, the kernel cannot refill its lanes; with two, few are idle.
        filled = lanes * max(durations)
        longest = max(bounds[1], filled, min(2.0 * filled, _UNMEASURED[1]))
        return _by_designs(durations, designs, slots, longest)
    return _by_case(durations, designs, slots, lanes, bounds)


def _by_designs(
    durations: Sequence[float], designs: int, slots: int, longest: float
) -> tuple[Chunk, ...]:
    cases, duration = tuple(range(len(durations))), sum(durations)
    pieces = slots * math.ceil(designs * duration / (slots * longest))
    chunks = (Chunk(cases, a, b, (b - a) * duration) for a, b in _edges(designs, pieces))
    return tuple(sorted(chunks, key=lambda chunk: (-chunk.cost, chunk.start)))


def _by_case(
    durations: Sequence[float], designs: int, slots: int, lanes: int, bounds: tuple[float, float]
) -> tuple[Chunk, ...]:
    blocks = math.ceil(designs / lanes)
    shortest, longest = bounds
    even = sum(durations) * blocks * lanes / (_TASKS_PER_SLOT * slots)
    target = min(max(even, shortest), longest)
    chunks = [
        Chunk((case,), a * lanes, min(b * lanes, designs), (b - a) * lanes * duration)
        for case, duration in enumerate(durations)
        for a, b in _edges(blocks, math.ceil(blocks / max(1, round(target / (duration * lanes)))))
    ]
    return tuple(sorted(chunks, key=lambda chunk: (-chunk.cost, chunk.cases, chunk.start)))


def _edges(count: int, pieces: int) -> list[tuple[int, int]]:
    """Divide `count` into at most `pieces` equal ranges."""
    edges = [count * piece // pieces for piece in range(pieces + 1)]
    return [(a, b) for a, b in itertools.pairwise(edges) if b > a]
