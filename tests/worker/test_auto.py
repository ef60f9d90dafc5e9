"""Simulations in threads until a local Ray has started."""

from __future__ import annotations

import logging
import os
import signal
import threading
import time
from collections.abc import Iterator
from unittest.mock import patch

import pytest

from gaitswarm.services.optimizer.errors import EvaluatorUnavailable, InvalidRequest
from gaitswarm.services.optimizer.run.evaluator import EvaluationStopped
from gaitswarm.services.runtime import AutoEvaluator, open_evaluator
from gaitswarm.services.worker.dispatch import InProcessEvaluator
from gaitswarm.services.worker.ray_evaluator import RayEvaluator, RaySession, open_ray
from tests.examples.processes import eventually
from tests.worker.cases import slow
from tests.worker.conftest import LocalRay
from tests.worker.requests import bits, never, request, walked_at_once


class Opening:
    """Takes as long to open Ray as the test wants, and then cannot."""

    def __init__(self) -> None:
        self.begun = threading.Event()
        self.may_end = threading.Event()

    def __call__(self, address: str | None, *, cpus: int | None) -> RaySession:
        self.begun.set()
        self.may_end.wait()
        raise EvaluatorUnavailable("Ray cannot be started on this machine: no memory")


@pytest.fixture
def opening() -> Iterator[Opening]:
    slow = Opening()
    with patch("gaitswarm.services.worker.ray_evaluator.open_ray", slow):
        yield slow
        slow.may_end.set()


@pytest.fixture
def auto(opening: Opening) -> Iterator[AutoEvaluator]:
    opened = open_evaluator(cpus=2, lasting=True)
    assert isinstance(opened, AutoEvaluator)
    yield opened
    opening.may_end.set()
    opened.close()


@pytest.mark.slow
def test_threads_simulate_while_ray_is_started_and_when_it_cannot_be(
    opening: Opening, auto: AutoEvaluator, caplog: pytest.LogCaptureFixture
) -> None:
    wanted = request(9)
    assert opening.begun.wait(5.0)
    assert bits(auto.evaluate(wanted, never)) == bits(walked_at_once(wanted))
    assert not auto.on_ray
    with caplog.at_level(logging.WARNING):
        opening.may_end.set()
        eventually(lambda: not auto.on_ray and bool(caplog.messages))
        assert bits(auto.evaluate(wanted, never)) == bits(walked_at_once(wanted))
    assert caplog.messages == [
        "Ray cannot be started on this machine: no memory; simulations continue in threads"
    ]


@pytest.mark.slow
def test_ray_takes_over_from_threads_to_the_same_bits(
    local_ray: LocalRay,
    in_process_evaluator: InProcessEvaluator,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    """And says nothing, and this process's handlers of signals are still its own."""
    may_open, heard = threading.Event(), threading.Event()

    def open_late(address: str | None, *, cpus: int | None) -> RaySession:
        may_open.wait()
        return open_ray(address, cpus=cpus)

    monkeypatch.setattr("gaitswarm.services.worker.ray_evaluator.open_ray", open_late)
    wanted = request(5)
    expected = bits(walked_at_once(wanted))
    local_ray.close()
    auto = AutoEvaluator(in_process_evaluator, local_ray.opened())
    before = signal.signal(signal.SIGTERM, lambda *_: heard.set())
    try:
        assert bits(auto.evaluate(wanted, never)) == expected
        assert not auto.on_ray
        may_open.set()
        eventually(lambda: auto.on_ray)
        assert bits(auto.evaluate(wanted, never)) == expected
        assert auto.place.startswith("ray: 2 workers")
        os.kill(os.getpid(), signal.SIGTERM)
        assert heard.wait(5.0)
    finally:
        may_open.set()
        signal.signal(signal.SIGTERM, before)
    assert capfd.readouterr() == ("", "")


@pytest.mark.slow
def test_closing_ends_requests_in_threads(auto: AutoEvaluator) -> None:
    threading.Timer(0.2, auto.close).start()
    with pytest.raises(EvaluatorUnavailable, match="closed"):
        auto.evaluate(slow(400, 0.1), never)


def test_without_an_address_only_servers_and_runners_start_ray() -> None:
    opened = open_evaluator(cpus=1)
    assert isinstance(opened, InProcessEvaluator)
    opened.close()


def test_a_stop_does_not_wait_for_a_cluster_that_is_being_connected(opening: Opening) -> None:
    begun = time.monotonic()
    with pytest.raises(EvaluationStopped):
        open_evaluator("auto", address="127.0.0.1:6379", should_stop=opening.begun.is_set)
    assert time.monotonic() - begun < 10.0


def test_a_cluster_that_cannot_be_connected_is_an_error_with_its_reason(opening: Opening) -> None:
    opening.may_end.set()
    with pytest.raises(EvaluatorUnavailable, match="no memory"):
        RayEvaluator("127.0.0.1:6379").wait_until_open(never)


def test_an_address_of_ray_client_is_refused_with_the_alternative() -> None:
    with pytest.raises(InvalidRequest, match=r"ray_address: 'ray://head:10001' .* HOST:6379"):
        open_evaluator("ray", address="ray://head:10001")
