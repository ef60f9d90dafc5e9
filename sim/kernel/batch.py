"""Walks that several callers want, in as few calls of kernels as can be."""

from __future__ import annotations

import time
from collections.abc import Generator, Sequence
from dataclasses import dataclass, field
from itertools import islice
from typing import TypeVar

from gaitswarm.sim.kernel.walk import Coding, Kernel, LaneUse, WalkResult, WalkSetup

T = TypeVar("T")


@dataclass(frozen=True, slots=True, eq=False)
class WantedWalk:
    """One walk, and what computes it.

    Attributes:
        kernel: of the robot that walks.
        coding: sensors, PWM and rates of the walk.
        setup: the walk.
        log: whether its states are to be kept.
    """

    kernel: Kernel
    coding: Coding
    setup: WalkSetup
    log: bool = False


Walking = Generator[Sequence[WantedWalk], Sequence[WalkResult], T]
"""What has walks computed on its way to a result: it yields the walks that it wants, is sent what
became of them, in their order, as often as it likes, and returns the result."""


@dataclass(slots=True)
class KernelTime:
    """What calls of kernels took, of those who ask for it.

    Attributes:
        seconds: wall time in the calls but for `waited`, added to [s].
        waited: time in the calls that went by until other threads had ended walks that they had
            taken over, added to [s].
        lane_use: of all of them.
    """

    seconds: float = 0.0
    waited: float = 0.0
    lane_use: LaneUse = field(default_factory=LaneUse)


def walk_together(
    walkings: Sequence[Walking[T]], kernel_time: KernelTime | None = None
) -> tuple[T, ...]:
    """Run several computations side by side; walks of one kernel and coding share one call.

    walkings                        calls
    a yields x1, x2; b yields y1    kernel.walk(x1, x2, y1)
    a returns; b yields y2          kernel.walk(y2)
    b returns                       -
    """
    results: dict[int, T] = {}
    answers: dict[int, Sequence[WalkResult] | None] = dict.fromkeys(range(len(walkings)))
    while answers:
        wanted: dict[int, Sequence[WantedWalk]] = {}
        for index, answer in answers.items():
            walking = walkings[index]
            try:
                wanted[index] = next(walking) if answer is None else walking.send(answer)
            except StopIteration as ended:
                results[index] = ended.value
        walks = [walk for own in wanted.values() for walk in own]
        computed = iter(_computed(walks, kernel_time or KernelTime()))
        answers = {index: list(islice(computed, len(own))) for index, own in wanted.items()}
    return tuple(results[index] for index in range(len(walkings)))


def _computed(walks: Sequence[WantedWalk], kernel_time: KernelTime) -> list[WalkResult]:
    """What became of the walks, in order."""
    calls: dict[tuple[Kernel, Coding, bool], list[int]] = {}
    for index, walk in enumerate(walks):
        calls.setdefault((walk.kernel, walk.coding, walk.log), []).append(index)
    found: dict[int, WalkResult] = {}
    for (kernel, coding, log), indices in calls.items():
        setups = [walks[index].setup for index in indices]
        begun = time.perf_counter()
        results = kernel.walk(setups, coding, log=log)
        kernel_time.seconds += time.perf_counter() - begun - results.waited
        kernel_time.waited += results.waited
        kernel_time.lane_use += results.lane_use
        found.update(zip(indices, results, strict=True))
    return [found[index] for index in range(len(walks))]
