"""What was measured of tasks that have ended, by which the next ones are cut."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

_WEIGHT: Final = 0.5
"""Of the last iteration, against all before."""

_LONGEST_SECONDS: Final = 1.0
"""Of a task, if its walks can be cut so fine: other jobs, and whoever cancels this one, need not
wait longer."""

_OVERHEAD_SHARE: Final = 0.05
"""Of a task's time, that it takes to send it and its answer, if its job is large enough."""

_SHORTEST_UNMEASURED: Final = 10.0
LONGEST_UNMEASURED: Final = 256.0
"""Simulated seconds in a task, as long as nothing was measured: a job's first iteration."""


@dataclass(frozen=True, slots=True)
class TaskTime:
    """One task that has ended.

    Attributes:
        cost: as of its chunk [simulated s].
        seconds: that its worker took for it [s].
        overhead: that passed beside, until its answer was here [s].
    """

    cost: float
    seconds: float
    overhead: float


@dataclass(frozen=True, slots=True)
class Pace:
    """How fast the tasks of a job go.

    Attributes:
        seconds: that a task takes for each simulated second of its cost [s]; None before the first
            iteration has ended.
        overhead: that it takes to send a task and its answer [s].
        spread: mean deviation of a task's time from what it should take at this pace [1].
    """

    seconds: float | None = None
    overhead: float = 0.0
    spread: float = 0.0

    def after(self, tasks: Sequence[TaskTime]) -> Pace:
        """The pace as it is known when another iteration has ended.

        Args:
            tasks: All of the iteration.

        Returns:
            This pace, and the iteration's, with half of the weight each.
        """
        cost = sum(task.cost for task in tasks)
        if cost <= 0.0:
            return self
        seconds = sum(task.seconds for task in tasks) / cost
        off = sum(abs(task.seconds - seconds * task.cost) for task in tasks)
        # A task that had to wait for a free worker tells nothing: the quickest one had not.
        overhead = max(0.0, min(task.overhead for task in tasks))
        latest = Pace(seconds, overhead, off / (seconds * cost) if seconds > 0.0 else 0.0)
        if self.seconds is None:
            return latest
        return Pace(
            _blend(self.seconds, seconds),
            _blend(self.overhead, latest.overhead),
            _blend(self.spread, latest.spread),
        )

    def bounds(self) -> tuple[float, float]:
        """Least and largest cost of a task that is worth sending and ends soon [simulated s]."""
        if not self.seconds:
            return _SHORTEST_UNMEASURED, LONGEST_UNMEASURED
        longest = _LONGEST_SECONDS / self.seconds
        return min(self.overhead / _OVERHEAD_SHARE / self.seconds, longest), longest


def _blend(before: float, latest: float) -> float:
    return (1.0 - _WEIGHT) * before + _WEIGHT * latest
