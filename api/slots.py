"""Room to compute, shared fairly by those who ask for it."""

from __future__ import annotations

from collections import Counter
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from typing import Final, TypeVar

import anyio
from anyio.to_thread import run_sync

from gaitswarm.services.optimizer.errors import EvaluatorUnavailable, TooManyRequests

T = TypeVar("T")

_RETRY_SECONDS: Final = 5.0
"""After which it is worth trying again, of one who waited in vain [s]."""


@dataclass(slots=True, eq=False)
class _Waiting:
    """A request that waits for a slot.

    asker: who asks. decided: set when it has one, or has to go. has_slot: which of both it is.
    """

    asker: str
    decided: anyio.Event = field(default_factory=anyio.Event)
    has_slot: bool = False


class ComputingSlots:
    """Lets only so many requests of a kind compute at the same time. Of one event loop.

    A slot that becomes free goes to whoever has fewest, and of those to whoever had their last
    one longest ago: while others wait, nobody has a second one, and requests of one asker do not
    keep those of another from their turn. If as many wait as may, the asker with most requests has
    to give one up for an asker with fewer.

    With one slot, for requests a1, a2, a3 and then b1: a1, b1, a2, a3.
    """

    def __init__(self, what: str, workers: int, queue: int) -> None:
        """Start without any at work."""
        self._what = what
        self._threads = anyio.CapacityLimiter(workers)
        self._free = workers
        self._queue = queue
        self._used: Counter[str] = Counter()
        self._waiting: list[_Waiting] = []
        # Of those who have a slot or wait: the number of the slot that was given to each last.
        self._last: dict[str, int] = {}
        self._given = 0

    @property
    def remembered(self) -> int:
        """Askers of whom something is known."""
        return len(self._used.keys() | self._last.keys())

    @asynccontextmanager
    async def one(self, asker: str) -> AsyncIterator[None]:
        """Have a slot while the block runs, which may compute in any one thread."""
        await self._take(asker)
        try:
            yield
        finally:
            self._give_back(asker)

    async def run(self, asker: str, work: Callable[[], T]) -> T:
        """Compute in a thread, as soon as there is a slot."""
        async with self.one(asker):
            return await run_sync(work, limiter=self._threads)

    async def _take(self, asker: str) -> None:
        if self._free:
            self._give(asker)
            return
        self._make_room(asker)
        own = _Waiting(asker)
        self._waiting.append(own)
        try:
            await own.decided.wait()
        except BaseException:
            # Whoever asked has gone.
            if own.has_slot:
                self._give_back(asker)
            elif own in self._waiting:
                self._waiting.remove(own)
                self._forget(asker)
            raise
        if not own.has_slot:
            raise TooManyRequests(
                f"others wait for {self._what}, too, and most of those that wait are yours; send"
                " fewer at once",
                retry_after=_RETRY_SECONDS,
            )

    def _make_room(self, asker: str) -> None:
        """For one more to wait; raises EvaluatorUnavailable."""
        if len(self._waiting) < self._queue:
            return
        has = self._used + Counter(waiting.asker for waiting in self._waiting)
        newest_first = reversed(self._waiting)
        last = max(newest_first, key=lambda waiting: has[waiting.asker], default=None)
        if last is None or has[last.asker] <= has[asker] + 1:
            raise EvaluatorUnavailable(
                f"too many {self._what} are waiting; try again in a few seconds"
            )
        self._waiting.remove(last)
        last.decided.set()

    def _give(self, asker: str) -> None:
        self._free -= 1
        self._given += 1
        self._used[asker] += 1
        self._last[asker] = self._given

    def _give_back(self, asker: str) -> None:
        self._free += 1
        self._used[asker] -= 1
        if self._waiting:
            # Of equal ones, `min` takes the first, which has waited longest.
            own = min(
                self._waiting,
                key=lambda waiting: (self._used[waiting.asker], self._last.get(waiting.asker, 0)),
            )
            self._waiting.remove(own)
            self._give(own.asker)
            own.has_slot = True
            own.decided.set()
        self._forget(asker)

    def _forget(self, asker: str) -> None:
        """Take no memory for those who have left."""
        if self._used[asker] == 0 and not any(own.asker == asker for own in self._waiting):
            del self._used[asker]
            self._last.pop(asker, None)


@dataclass(frozen=True, slots=True)
class AskersSlots:
    """The same for one asker.

    Attributes:
        slots: That all share.
        asker: Who asks.
    """

    slots: ComputingSlots
    asker: str

    async def run(self, work: Callable[[], T]) -> T:
        """Compute in a thread, when it is the asker's turn."""
        return await self.slots.run(self.asker, work)
