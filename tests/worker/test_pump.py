"""Cancellation of tasks, on a fake cluster."""

from __future__ import annotations

import itertools
import threading
import time
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from gaitswarm.services.optimizer.errors import KilledWorker
from gaitswarm.services.optimizer.run.evaluator import EvaluationStopped
from gaitswarm.services.worker.cluster import pump
from gaitswarm.services.worker.cluster.nodes import LOOK_AHEAD, Node, OwnNode, Wanted, chosen
from gaitswarm.services.worker.cluster.pump import Pump
from gaitswarm.services.worker.dispatch import Dispatcher
from gaitswarm.services.worker.ray_session import RaySession
from gaitswarm.services.worker.tries import MOST_KILLED
from tests.examples.processes import eventually
from tests.worker.requests import SCENARIOS, request

SLOTS = 2


class MadeUpRay:
    """Runs nothing: tasks end when a test says so."""

    def __init__(self) -> None:
        # Ray takes long to load, and is not when tests are collected.
        from ray import exceptions

        self.exceptions = exceptions
        self.sent: list[object] = []
        self.ended: set[object] = set()
        self.cancelled: dict[object, float] = {}
        self.error: Exception = exceptions.TaskCancelledError()

    def remote(self, **_: object) -> Any:
        return lambda _function: SimpleNamespace(remote=self._send)

    def _send(self, *_: object) -> object:
        self.sent.append(reference := object())
        return reference

    def put(self, _value: object) -> object:
        return object()

    def wait(
        self, references: list[object], num_returns: int, timeout: float
    ) -> tuple[list[object], list[object]]:
        time.sleep(min(timeout, 0.01))
        done = [reference for reference in references if reference in self.ended]
        return done, [reference for reference in references if reference not in self.ended]

    def get(self, reference: object) -> object:
        raise self.error

    def cancel(self, reference: object, *, force: bool) -> None:
        assert not force
        assert reference not in self.cancelled
        self.cancelled[reference] = time.monotonic()


@pytest.fixture
def made_up() -> MadeUpRay:
    return MadeUpRay()


class TwoNodes(OwnNode):
    """One with room, and one that is busy with walks of others."""

    def __init__(self) -> None:
        super().__init__(SLOTS)
        self.nodes = [Node("free", "", 1, ("", 0)), Node("busy", "", 1, ("", 0), flying=LOOK_AHEAD)]

    def place(self, wanted: Wanted, avoid: frozenset[str]) -> Node | None:
        for node in self.nodes:
            node.prepared.add(wanted)
        return chosen(self.nodes, wanted, avoid)


@pytest.fixture
def nodes() -> OwnNode:
    return OwnNode(SLOTS)


@pytest.fixture
def dispatcher(made_up: MadeUpRay, nodes: OwnNode) -> Iterator[Dispatcher]:
    """Of a pump that runs."""
    opened = Dispatcher(slots=SLOTS, lanes=lambda _: 4)
    session = SimpleNamespace(ray=made_up, directory=Path(), head_answers=lambda: True)
    pumped = Pump(cast(RaySession, session), opened, nodes, threading.Event())
    with ThreadPoolExecutor(1) as pool:
        running = pool.submit(pumped.run)
        yield opened
        opened.close("the test has ended")
        running.result()


def test_tasks_that_no_one_waits_for_may_end_before_they_are_cancelled_once(
    made_up: MadeUpRay, dispatcher: Dispatcher, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pump, "GRACE_SECONDS", 2.0)
    stop = threading.Event()
    with ThreadPoolExecutor(1) as pool:
        evaluated: Future[Any] = pool.submit(dispatcher.evaluate, request(64), stop.is_set)
        warmed = SLOTS
        eventually(lambda: len(made_up.sent) > warmed + 1)
        stop.set()
        with pytest.raises(EvaluationStopped):
            evaluated.result()
    dropped = time.monotonic()
    ending, *lasting = made_up.sent[warmed:]
    made_up.ended.add(ending)
    eventually(lambda: set(made_up.cancelled) >= set(lasting))
    assert min(made_up.cancelled.values()) - dropped > 1.0
    time.sleep(0.2)
    assert set(made_up.cancelled) == set(lasting)
    made_up.ended.update(lasting)


@pytest.mark.parametrize("nodes", [TwoNodes()], ids=["two nodes"])
def test_a_busy_node_is_waited_for_rather_than_one_on_which_a_worker_died_but_not_for_ever(
    made_up: MadeUpRay, dispatcher: Dispatcher, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pump, "PATIENCE_SECONDS", 1.0)
    made_up.error = made_up.exceptions.WorkerCrashedError()
    wanted, stop = request(1, scenarios=SCENARIOS[:1]), threading.Event()
    died: list[float] = []
    with ThreadPoolExecutor(1) as pool:
        evaluated = pool.submit(dispatcher.evaluate, wanted, stop.is_set)
        try:
            for _ in range(MOST_KILLED):
                eventually(lambda: len(made_up.sent) == SLOTS + len(died) + 1)
                died.append(time.monotonic())
                made_up.ended.add(made_up.sent[-1])
            with pytest.raises(KilledWorker):
                evaluated.result()
        finally:
            stop.set()
    assert all(after - before > 0.9 for before, after in itertools.pairwise(died))
