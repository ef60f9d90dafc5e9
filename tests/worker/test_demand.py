"""Demand shown to an autoscaler, on a fake cluster."""

from __future__ import annotations

import pickle
import sys
from collections.abc import Callable
from types import ModuleType, SimpleNamespace
from typing import Any, cast
from unittest.mock import patch

import pytest

from gaitswarm.services.worker.cluster.demand import Demand


class RayError(Exception):
    """As Ray raises where a task cannot be cancelled."""


class MadeUpRay:
    """A cluster in which tasks wait until a test gives them a slot."""

    exceptions = SimpleNamespace(RayError=RayError)

    def __init__(self) -> None:
        self.waiting: list[object] = []
        self.cancelled: list[object] = []
        self.options: dict[str, object] = {}
        self.body: Callable[[], None]

    def remote(self, **options: object) -> Any:
        self.options = options

        def decorate(body: Callable[[], None]) -> SimpleNamespace:
            self.body = body
            return SimpleNamespace(remote=self._send)

        return decorate

    def _send(self) -> object:
        self.waiting.append(reference := object())
        return reference

    def wait(
        self, references: list[object], num_returns: int, timeout: float
    ) -> tuple[list[object], list[object]]:
        assert num_returns == len(references) > 0
        assert timeout == 0.0
        waits = [reference for reference in references if reference in self.waiting]
        return [reference for reference in references if reference not in waits], waits

    def cancel(self, reference: object) -> None:
        self.cancelled.append(reference)
        self.waiting.remove(reference)
        if len(self.cancelled) == 1:
            raise RayError


class Clock:
    """Seconds that a test lets pass."""

    now = 100.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def ray() -> MadeUpRay:
    return MadeUpRay()


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def demand(ray: MadeUpRay, clock: Clock) -> Demand:
    return Demand(cast(ModuleType, ray), clock)


def test_as_many_tasks_wait_as_slots_are_wanted_and_those_that_ran_are_replaced_a_second_later(
    demand: Demand, ray: MadeUpRay, clock: Clock
) -> None:
    demand.show(3)
    demand.show(3)
    assert len(ray.waiting) == 3
    # A node has come.
    del ray.waiting[:2]
    demand.show(5)
    assert len(ray.waiting) == 1
    clock.now += 1.0
    demand.show(5)
    assert len(ray.waiting) == 5
    clock.now += 1.0
    demand.show(2)
    assert len(ray.waiting) == 5
    assert not ray.cancelled


def test_no_autoscaler_is_asked_for_very_many_at_once(demand: Demand, ray: MadeUpRay) -> None:
    demand.show(1000)
    assert len(ray.waiting) == 64


def test_what_is_not_wanted_any_more_is_withdrawn_after_it_had_time_to_end_by_itself(
    demand: Demand, ray: MadeUpRay, clock: Clock
) -> None:
    demand.show(0)
    demand.show(3)
    ended, *waiting = ray.waiting
    ray.waiting.remove(ended)
    clock.now += 1.9
    demand.show(0)
    assert not ray.cancelled
    clock.now += 0.2
    demand.show(0)
    # Though Ray could not cancel one of them.
    assert ray.cancelled == waiting
    clock.now += 9.0
    demand.show(0)
    assert ray.cancelled == waiting
    demand.show(2)
    assert len(ray.waiting) == 2


def test_it_takes_a_slot_like_a_walk_and_imports_nothing(demand: Demand, ray: MadeUpRay) -> None:
    from ray import cloudpickle

    demand.show(1)
    assert ray.options == {"num_cpus": 1, "max_retries": 0}
    sent = cloudpickle.dumps(ray.body)  # type: ignore[no-untyped-call]
    # By value: it runs with any version of gaitswarm, and without one.
    with patch.dict("sys.modules", {Demand.__module__: None}):
        received = pickle.loads(sent)  # noqa: S301
    known = set(sys.modules)
    received()
    assert set(sys.modules) == known
