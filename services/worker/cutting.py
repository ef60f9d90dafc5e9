"""How the walks of an iteration are cut into chunks, one for each task."""

from __future__ import annotations

import heapq
import itertools
import math
from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

from gaitswarm.services.worker.pace import LONGEST_UNMEASURED, Pace
from gaitswarm.sim.kernel.lanes import plan_lanes

_TASKS_PER_SLOT: Final = 3
"""Of chunks of one case: enough for the last ones to end at about the same time."""

_ROUND_SHARES: Final = (1.0, 4.0 / 3.0, 2.0)
"""How many times the work that is left a round of chunks of several cases would do at its size."""

_NEAR: Final = 1.01
"""Of what was aimed at; a cut so near to it needs no better one."""


_FEW: Final = 16
"""Chunks of an iteration, up to which it pays to look for a better place to cut."""


@dataclass(frozen=True, slots=True)
class Part:
    """Designs start <= index < stop in one case.

    Attributes:
        case: Index of the case.
        start: Index of the first design.
        stop: Index after the last design.
    """

    case: int
    start: int
    stop: int


@dataclass(frozen=True, slots=True)
class Chunk:
    """What one task does.

    Attributes:
        parts: Designs in one case or in several, each case once.
        cost: Simulated seconds that the kernel's lanes step through, walking or idle.
    """

    parts: tuple[Part, ...]
    cost: float


def cut(
    durations: Sequence[float],
    designs: int,
    *,
    slots: int,
    lanes: int,
    pace: Pace | None = None,
    together: bool = True,
    shared: bool = False,
) -> tuple[Chunk, ...]:
    """Cut an iteration into chunks, longest first.

    With as many slots as cases, or more, each chunk is of one case, and a multiple of the lanes.
    With fewer, a chunk is of some designs in all cases: a kernel that refills its lanes then wastes
    none of them but at the end, and a design's tables are made once.

    Args:
        durations: Simulated seconds of each case.
        designs: Their number.
        slots: How many chunks run at the same time.
        lanes: How many walkers the kernel steps together, present or not.
        pace: Of the iterations before; None if there was none.
        together: Whether walks of several cases can be computed in one task.
        shared: Whether slots that are done take over walks of others', so that no short chunks are
            needed for the end.

    Returns:
        The chunks; every design of every case is in one.
    """
    pace = pace or Pace()
    if together and slots < len(durations):
        rounds = _ROUND_SHARES[:1] if shared else _ROUND_SHARES
        return _across_cases(tuple(durations), designs, slots, lanes, pace, rounds)
    return _by_case(durations, designs, slots, lanes, pace)


def _by_case(
    durations: Sequence[float], designs: int, slots: int, lanes: int, pace: Pace
) -> tuple[Chunk, ...]:
    blocks = math.ceil(designs / lanes)
    total = sum(durations) * blocks * lanes
    shortest, longest = pace.bounds()
    wanted = min(max(total / (_TASKS_PER_SLOT * slots), shortest), longest)
    chunks: list[Chunk] = []
    for case, duration in enumerate(durations):
        largest = max(1, round(wanted / (duration * lanes)))
        pieces = max(1, math.ceil(blocks / largest))
        edges = [blocks * piece // pieces for piece in range(pieces + 1)]
        chunks += [
            Chunk((Part(case, a * lanes, min(b * lanes, designs)),), (b - a) * lanes * duration)
            for a, b in itertools.pairwise(edges)
            if b > a
        ]
    return tuple(sorted(chunks, key=lambda chunk: (-chunk.cost, chunk.parts[0].case)))


def _across_cases(
    durations: tuple[float, ...],
    designs: int,
    slots: int,
    lanes: int,
    pace: Pace,
    round_shares: tuple[float, ...],
) -> tuple[Chunk, ...]:
    """The cut that should end first of several, which leave more or less for the end.

    Few long chunks fill the lanes best and cost least to send; short ones at the end make up for
    workers that are not equally fast.
    """
    total = designs * sum(durations)
    shortest, longest = pace.bounds()
    block = lanes * max(durations)
    # Rounded, so that nearly the same pace gives the same cut, which is then known.
    longest = 2.0 ** (0.25 * math.floor(4.0 * math.log2(longest)))
    # Of one walk a lane, a kernel cannot refill; of two, it leaves some 5 % idle and not 20.
    longest = max(longest, block, min(2.0 * block, LONGEST_UNMEASURED))
    shortest = min(max(shortest, block), longest)
    cuts = [
        _cut_walks(durations, designs, lanes, _rounds(total, slots, share, shortest, longest))
        for share in round_shares
    ]
    return min(cuts, key=lambda chunks: _seconds(chunks, slots, pace))


def _rounds(
    total: float, slots: int, share: float, shortest: float, longest: float
) -> tuple[float, ...]:
    """Sizes of chunks, in rounds of one for each slot: factoring (Hummel, Schonberg, Flynn 1992).

    total: to be divided. share: a round does 1/share of what is left.
    """
    sizes: list[float] = []
    left = total
    while True:
        size = min(max(left / (share * slots), shortest), longest)
        if left <= slots * size * (1.0 + 1e-9):
            last = max(1, math.ceil(left / size - 1e-9))
            return (*sizes, *([left / last] * last))
        sizes += [size] * slots
        left -= slots * size


def _seconds(chunks: Sequence[Chunk], slots: int, pace: Pace) -> float:
    """When the last slot should be done, and how late it may be if paces differ [s]."""
    free = [0.0] * slots
    times = [chunk.cost * (pace.seconds or 1.0) + pace.overhead for chunk in chunks]
    for time in times:
        heapq.heapreplace(free, free[0] + time)
    return max(free) + pace.spread * max(times[-slots:])


@lru_cache(maxsize=64)
def _cut_walks(
    durations: tuple[float, ...], designs: int, lanes: int, sizes: tuple[float, ...]
) -> tuple[Chunk, ...]:
    """Cut all walks, design by design, into chunks of about these sizes that fill the lanes."""
    ranked = sorted(range(len(durations)), key=lambda case: -durations[case])
    walks = [durations[case] for case in ranked] * designs
    done = [0.0, *itertools.accumulate(walks)]
    edges, rest = [0], sum(sizes)
    reach = len(durations) if len(sizes) <= _FEW else 0
    for size in sizes[:-1]:
        rest -= size
        is_last = len(edges) + 1 == len(sizes)
        edges.append(_edge(walks, done, edges[-1], lanes, size, rest, is_last=is_last, reach=reach))
    edges.append(len(walks))
    chunks = [
        Chunk(_parts(ranked, a, b), _cost(walks[a:b], lanes))
        for a, b in itertools.pairwise(edges)
        if b > a
    ]
    return tuple(sorted(chunks, key=lambda chunk: -chunk.cost))


def _edge(
    walks: list[float],
    done: list[float],
    start: int,
    lanes: int,
    size: float,
    rest: float,
    *,
    is_last: bool,
    reach: int,
) -> int:
    """Where the chunk that begins at a walk ends, so that it and the rest end as early as they can.

    done: simulated seconds of the walks before each. rest: sizes of all chunks after this one.
    is_last: whether that is one. reach: how many walks off the nearest edge is looked for.
    """
    nearest = bisect_left(done, done[start] + size, start)
    best, found = math.inf, len(walks)
    for edge in sorted(
        range(max(start + 1, nearest - reach), min(len(walks), nearest + reach + 1)),
        key=lambda edge: abs(edge - nearest),
    ):
        late = max(
            _cost(walks[start:edge], lanes) / size,
            (_cost(walks[edge:], lanes) if is_last else done[-1] - done[edge]) / rest,
        )
        if late < best:
            best, found = late, edge
        if late <= _NEAR:
            break
    return found


def _cost(walks: Sequence[float], lanes: int) -> float:
    """Simulated seconds that lanes step through, which are refilled."""
    return lanes * _end_of_lanes(tuple(sorted(walks)), lanes)


@lru_cache(maxsize=1024)
def _end_of_lanes(walks: tuple[float, ...], lanes: int) -> float:
    return plan_lanes(walks, lanes).end


def _parts(ranked: Sequence[int], start: int, stop: int) -> tuple[Part, ...]:
    """Walks start <= index < stop, which are in the order of designs and, of each, of `ranked`."""
    count = len(ranked)
    parts = [
        Part(case, -((rank - start) // count), -((rank - stop) // count))
        for rank, case in enumerate(ranked)
    ]
    return tuple(sorted((p for p in parts if p.stop > p.start), key=lambda part: part.case))
