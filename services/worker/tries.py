"""Whether a lost task is run again or given up, and which is run twice. Pure: no clock."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Final

MOST_KILLED: Final = 3
"""Workers that may die of one task."""

_OVERDUE_FACTOR: Final = 3.0
"""How many times as long as predicted a task takes that is run a second time; as Apache Spark's
`spark.speculation.multiplier`."""

_OVERDUE_SECONDS: Final = 2.0
"""How much longer than predicted it takes at least [s]: a copy has to be sent, and perhaps waits
for a worker to start."""


class Verdict(StrEnum):
    """What becomes of a task whose worker was lost."""

    AGAIN = "again"
    """It is queued once more."""
    GOES_ON = "goes on"
    """Another worker runs it already."""
    GIVEN_UP = "given up"
    """Too many workers have died of it: its request fails."""


@dataclass(frozen=True, slots=True)
class Tries:
    """How often one task is under way, and how many workers died while they had it, and where.

    A worker that dies takes its task along, so that every try is on another process; nodes on which
    one died are left out of the next tries, as long as there are others.

    lost(suspect) with under_way, killed   ->  under_way, killed, verdict
    1, 0   suspect                         ->  0, 1, again
    1, 0   not: its node went              ->  0, 0, again
    2, 0   suspect: it had a copy          ->  1, 1, goes on
    1, 2   suspect                         ->  0, 3, given up

    Attributes:
        under_way: Workers that have it now.
        killed: Workers that have died while they had it.
        copied: Whether it was run a second time because the first took too long.
        died_on: Ids of the nodes of those workers.
    """

    under_way: int = 0
    killed: int = 0
    copied: bool = False
    died_on: frozenset[str] = frozenset()

    def sent(self) -> Tries:
        """After it was handed to a worker."""
        return replace(self, under_way=self.under_way + 1)

    def lost(self, *, suspect: bool, node: str = "") -> tuple[Tries, Verdict]:
        """After a worker that had it was lost.

        Args:
            suspect: Whether the task may be what ended the worker; not so if its whole node went.
            node: Id of the worker's node; "" where there is only one.

        Returns:
            The tries, and what becomes of the task.
        """
        after = replace(
            self,
            under_way=max(0, self.under_way - 1),
            killed=self.killed + int(suspect),
            died_on=self.died_on | {node} if suspect and node else self.died_on,
        )
        if after.killed >= MOST_KILLED:
            return after, Verdict.GIVEN_UP
        return after, Verdict.GOES_ON if after.under_way else Verdict.AGAIN


@dataclass(frozen=True, slots=True)
class Running:
    """A task that a worker has.

    Attributes:
        seconds: Since it can have begun to run [s].
        predicted: How long it should take [s]; None if that is not known.
        tries: Of its chunk.
    """

    seconds: float
    predicted: float | None
    tries: Tries


def straggler(running: Iterable[Running], *, slots: int, waiting: int) -> int | None:
    """Choose the task that is worth running a second time.

    Whichever of the two ends first wins; both have the same bits.

    Args:
        running: All that workers have.
        slots: Tasks that can run at the same time.
        waiting: Tasks that no worker has yet.

    Returns:
        Index of the one that takes the most times as long as predicted, if any is overdue and has
        no copy; None if no slot is free for it.
    """
    tasks = list(running)
    if waiting or len(tasks) >= slots:
        return None
    late = [(_lateness(task), index) for index, task in enumerate(tasks) if not task.tries.copied]
    lateness, index = max(late, default=(0.0, 0))
    return index if lateness > 0.0 else None


def _lateness(task: Running) -> float:
    """How many times as long as predicted it takes; 0 for one that is not overdue."""
    if not task.predicted:
        return 0.0
    overdue = (
        task.seconds > _OVERDUE_FACTOR * task.predicted
        and task.seconds > task.predicted + _OVERDUE_SECONDS
    )
    return task.seconds / task.predicted if overdue else 0.0
