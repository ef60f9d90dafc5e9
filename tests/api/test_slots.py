"""Who computes next, of all who ask."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine, Sequence
from typing import Any

from gaitswarm.api.slots import ComputingSlots
from gaitswarm.services.optimizer.errors import EvaluatorUnavailable, TooManyRequests


class Askers:
    """Requests that ask one after the other, and compute until they are told to end."""

    def __init__(self, workers: int, queue: int) -> None:
        self.slots = ComputingSlots("walks", workers, queue)
        self.computing: list[str] = []
        self.refused: dict[str, type[Exception]] = {}
        self._ends: dict[str, asyncio.Event] = {}
        self._tasks: dict[str, asyncio.Task[None]] = {}

    async def ask(self, *names: str) -> None:
        """names: of requests; the first letter is the asker's name."""
        for name in names:
            self._ends[name] = asyncio.Event()
            self._tasks[name] = asyncio.ensure_future(self._compute(name))
            await self.settle()

    async def end(self, *names: str, leaving: Sequence[str] = ()) -> None:
        """names: that have computed. leaving: that go away in the same instant."""
        for name in names:
            self._ends[name].set()
        for name in leaving:
            self._tasks[name].cancel()
        await self.settle()

    async def leave(self, *names: str) -> None:
        """Those who ask go away."""
        await self.end(leaving=names)

    async def leave_all(self) -> None:
        await self.leave(*self._tasks)

    async def settle(self) -> None:
        for _ in range(10):
            await asyncio.sleep(0)

    async def _compute(self, name: str) -> None:
        try:
            async with self.slots.one(name[0]):
                self.computing.append(name)
                try:
                    await self._ends[name].wait()
                finally:
                    self.computing.remove(name)
        except (EvaluatorUnavailable, TooManyRequests) as error:
            self.refused[name] = type(error)


def play(workers: int, queue: int, script: Callable[[Askers], Coroutine[Any, Any, None]]) -> None:
    """Let requests come and go in an event loop, and see that nothing is left of them."""

    async def run() -> None:
        askers = Askers(workers, queue)
        await script(askers)
        await askers.leave_all()
        assert askers.slots.remembered == 0
        await askers.ask(*(str(number) for number in range(workers)))
        assert len(askers.computing) == workers
        await askers.leave_all()

    asyncio.run(run())


def test_requests_of_one_asker_are_answered_in_order() -> None:
    async def script(askers: Askers) -> None:
        await askers.ask("a1", "a2", "a3", "a4")
        assert askers.computing == ["a1", "a2"]
        await askers.end("a1")
        assert askers.computing == ["a2", "a3"]
        await askers.end("a2")
        assert askers.computing == ["a3", "a4"]

    play(2, 9, script)


def test_while_others_wait_nobody_is_given_a_second_slot() -> None:
    async def script(askers: Askers) -> None:
        await askers.ask("a1", "a2", "a3", "a4", "b1", "c1")
        await askers.end("a1")
        assert askers.computing == ["a2", "b1"]
        await askers.end("b1")
        assert askers.computing == ["a2", "c1"]
        await askers.end("c1")
        assert askers.computing == ["a2", "a3"]

    play(2, 9, script)


def test_askers_take_turns_at_a_single_slot_however_many_requests_each_has() -> None:
    async def script(askers: Askers) -> None:
        await askers.ask("a1", "a2", "a3", "a4", "b1", "b2", "c1")
        for turn in ("a1", "b1", "c1", "a2", "b2", "a3", "a4"):
            assert askers.computing == [turn]
            await askers.end(turn)

    play(1, 9, script)


def test_in_a_full_queue_whoever_has_most_makes_room_for_one_who_has_fewer() -> None:
    async def script(askers: Askers) -> None:
        await askers.ask("a1", "a2", "a3", "a4")
        await askers.ask("a5")
        assert askers.refused == {"a5": EvaluatorUnavailable}
        await askers.ask("b1")
        assert askers.refused == {"a5": EvaluatorUnavailable, "a4": TooManyRequests}
        await askers.ask("b2", "c1", "d1")
        late = ("a3", "b2", "a2")
        assert [askers.refused[name] for name in late] == [TooManyRequests] * 3
        # All have one.
        await askers.ask("e1")
        assert askers.refused["e1"] is EvaluatorUnavailable
        for turn in ("a1", "b1", "c1", "d1"):
            assert askers.computing == [turn]
            await askers.end(turn)

    play(1, 3, script)


def test_where_nobody_may_wait_the_next_is_refused() -> None:
    async def script(askers: Askers) -> None:
        await askers.ask("a1", "b1")
        assert askers.refused == {"b1": EvaluatorUnavailable}

    play(1, 0, script)


def test_who_goes_away_leaves_the_slot_or_the_turn_to_the_next() -> None:
    async def script(askers: Askers) -> None:
        await askers.ask("a1", "b1", "c1", "d1")
        await askers.leave("b1", "a1")
        assert askers.computing == ["c1"]
        # It is given the slot in the instant in which it goes.
        await askers.end("c1", leaving=["d1"])
        assert askers.computing == []

    play(1, 9, script)
