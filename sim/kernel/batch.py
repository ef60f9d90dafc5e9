"""Walks that several callers want, in as few calls of kernels as can be."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import TypeVar

from sim.kernel.walk import Coding, Kernel, WalkResult, WalkSetup

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


def walk_together(walkings: Sequence[Walking[T]]) -> tuple[T, ...]:
    """Run several computations side by side; walks of one kernel and coding share one call.

    walkings                        calls
    a yields x1, x2; b yields y1    kernel.walk(x1, x2, y1)
    a returns; b yields y2          kernel.walk(y2)
    b returns                       -

    Args:
        walkings: The computations, none of which was begun.

    Returns:
        Their results, in order; a walk has the same bits in any company.

    Raises:
        Exception: What one of them raises.
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
        computed = iter(_computed([walk for walks in wanted.values() for walk in walks]))
        answers = {index: list(islice(computed, len(walks))) for index, walks in wanted.items()}
    return tuple(results[index] for index in range(len(walkings)))


def _computed(walks: Sequence[WantedWalk]) -> list[WalkResult]:
    """What became of the walks, in order."""
    calls: dict[tuple[Kernel, Coding, bool], list[int]] = {}
    for index, walk in enumerate(walks):
        calls.setdefault((walk.kernel, walk.coding, walk.log), []).append(index)
    found: dict[int, WalkResult] = {}
    for (kernel, coding, log), indices in calls.items():
        results = kernel.walk([walks[index].setup for index in indices], coding, log=log)
        found.update(zip(indices, results, strict=True))
    return [found[index] for index in range(len(walks))]
