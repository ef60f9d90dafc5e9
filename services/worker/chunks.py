"""How one iteration is cut into tasks: one trial and one run of designs each."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

_TASKS_PER_SLOT: Final = 3
"""Enough for the last tasks to end at about the same time, few enough to keep each long."""

_SHORTEST: Final = 10.0
"""Simulated seconds in a task at least: tens of milliseconds of work, against milliseconds to
send it."""

_LONGEST: Final = 250.0
"""Simulated seconds in a task at most, if its trial can be cut so fine: about a second, so
that other jobs, and whoever cancels this one, need not wait."""


@dataclass(frozen=True, slots=True)
class Chunk:
    """Designs start <= index < stop in one trial.

    cost: simulated seconds that the kernel steps through, with its lanes filled up.
    """

    trial: int
    start: int
    stop: int
    cost: float


def cut(durations: Sequence[float], designs: int, *, slots: int, lanes: int) -> tuple[Chunk, ...]:
    """Chunks of all trials, longest first.

    durations: simulated seconds of each trial. Every chunk but a trial's last is a multiple
    of `lanes`, because the kernel steps so many walkers together, present or not.
    """
    blocks = math.ceil(designs / lanes)
    total = sum(durations) * blocks * lanes
    wanted = min(max(total / (_TASKS_PER_SLOT * slots), _SHORTEST), _LONGEST)
    chunks: list[Chunk] = []
    for trial, duration in enumerate(durations):
        largest = max(1, round(wanted / (duration * lanes)))
        pieces = max(1, math.ceil(blocks / largest))
        edges = [blocks * piece // pieces for piece in range(pieces + 1)]
        chunks += [
            Chunk(trial, a * lanes, min(b * lanes, designs), (b - a) * lanes * duration)
            for a, b in itertools.pairwise(edges)
            if b > a
        ]
    return tuple(sorted(chunks, key=lambda chunk: (-chunk.cost, chunk.trial, chunk.start)))
