"""Walks that begin in this process and move to Ray in long jobs."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from unittest.mock import patch

import pytest

from gaitswarm.services.optimizer.errors import EvaluatorUnavailable
from gaitswarm.services.optimizer.run.evaluator import EvaluationRequest, EvaluationStopped
from gaitswarm.services.worker.hybrid import HybridEvaluator
from gaitswarm.services.worker.ray_evaluator import RayEvaluator
from gaitswarm.services.worker.ray_session import RaySession
from tests.examples.processes import eventually, python
from tests.examples.walks import short_walk
from tests.worker.requests import bits, never, request, walked_at_once


def first_of_many(count: int = 9) -> EvaluationRequest:
    return replace(request(count), iterations_left=1_000_000)


@contextmanager
def ray_opened_by(opening: object) -> Iterator[None]:
    with patch("gaitswarm.services.worker.ray_evaluator.open_ray", opening):
        yield


class Opening:
    """Takes as long to open Ray as the test wants, and then cannot."""

    def __init__(self) -> None:
        self.begun = threading.Event()
        self.may_end = threading.Event()
        self.count = 0

    def __call__(self, address: str | None, *, cpus: int | None) -> RaySession:
        self.count += 1
        self.begun.set()
        self.may_end.wait()
        raise EvaluatorUnavailable("Ray cannot be started on this machine: no memory")


@pytest.fixture
def opening() -> Iterator[Opening]:
    slow = Opening()
    with ray_opened_by(slow):
        yield slow
        slow.may_end.set()


@pytest.fixture
def hybrid(opening: Opening) -> Iterator[HybridEvaluator]:
    opened = HybridEvaluator(2)
    yield opened
    opening.may_end.set()
    opened.close()


@pytest.mark.slow
def test_ray_is_started_for_a_job_that_is_expected_to_take_a_minute_more(
    opening: Opening, hybrid: HybridEvaluator
) -> None:
    wanted = request(9)
    hybrid.evaluate(wanted, never)
    begun = time.monotonic()
    hybrid.evaluate(wanted, never)
    seconds = time.monotonic() - begun
    # A tenth of a minute to go, and ten minutes.
    hybrid.evaluate(replace(wanted, iterations_left=round(6.0 / seconds)), never)
    assert opening.count == 0
    hybrid.evaluate(replace(wanted, iterations_left=round(600.0 / seconds)), never)
    assert opening.begun.wait(5.0)


@pytest.mark.slow
def test_the_time_that_a_kernel_takes_to_build_says_nothing_of_how_long_a_job_is(
    opening: Opening, hybrid: HybridEvaluator, monkeypatch: pytest.MonkeyPatch
) -> None:
    takes = iter([1.0])
    monkeypatch.setattr(
        "gaitswarm.sim.simulate.prepare", lambda _, precision: time.sleep(next(takes, 0.0))
    )
    hybrid.evaluate(replace(request(1), iterations_left=60), never)
    assert opening.count == 0


@pytest.mark.slow
def test_walks_go_on_while_ray_is_started_and_a_stop_is_heard(
    opening: Opening, hybrid: HybridEvaluator
) -> None:
    wanted = first_of_many()
    hybrid.evaluate(wanted, never)
    assert opening.begun.wait(5.0)
    assert not hybrid.on_ray
    assert bits(hybrid.evaluate(wanted, never)) == bits(walked_at_once(wanted))
    long = short_walk(cycle_time=2.0, cycles=5)
    stopped_at = time.monotonic() + 0.2
    with pytest.raises(EvaluationStopped):
        hybrid.evaluate(request(8000, scenarios=(long,)), lambda: time.monotonic() > stopped_at)
    assert time.monotonic() - stopped_at < 10.0
    assert not opening.may_end.is_set()


@pytest.mark.slow
def test_a_ray_that_cannot_be_started_is_reported_once_and_walks_go_on(
    opening: Opening, hybrid: HybridEvaluator, caplog: pytest.LogCaptureFixture
) -> None:
    wanted = first_of_many()
    opening.may_end.set()
    with caplog.at_level(logging.WARNING):
        hybrid.evaluate(wanted, never)
        eventually(lambda: not hybrid.on_ray and bool(caplog.messages))
        for _ in range(3):
            assert bits(hybrid.evaluate(wanted, never)) == bits(walked_at_once(wanted))
    assert caplog.messages == [
        "Ray cannot be started on this machine: no memory; walks go on in this process"
    ]
    assert opening.count == 1


@pytest.mark.slow
def test_closing_ends_requests_under_way_in_threads(hybrid: HybridEvaluator) -> None:
    threading.Timer(0.2, hybrid.close).start()
    with pytest.raises(EvaluatorUnavailable, match="closed"):
        hybrid.evaluate(request(500), never)
    with pytest.raises(EvaluatorUnavailable, match="closed"):
        hybrid.evaluate(request(1), never)


def test_whoever_stops_while_a_cluster_is_connected_does_not_wait_for_it(opening: Opening) -> None:
    cluster = RayEvaluator("127.0.0.1:6379")
    begun = time.monotonic()
    with pytest.raises(EvaluationStopped):
        cluster.wait_until_open(opening.begun.is_set)
    assert time.monotonic() - begun < 10.0
    opening.may_end.set()


def test_a_cluster_that_cannot_be_connected_is_an_error_with_its_reason(opening: Opening) -> None:
    opening.may_end.set()
    with pytest.raises(EvaluatorUnavailable, match="no memory"):
        RayEvaluator("127.0.0.1:6379").wait_until_open(never)


@pytest.mark.variants("in threads", "while Ray is started")
@pytest.mark.slow
@pytest.mark.parametrize(
    "state", ["in threads", "while Ray is started", "while a worker of Ray dies"]
)
def test_closed_before_ray_is_open_it_leaves_nothing_behind_and_says_nothing(state: str) -> None:
    done = python("-m", "tests.worker.hybrid_process", "close", state)
    assert (done.stdout, done.stderr, done.returncode) == ("nothing left\n", "", 0)


@pytest.mark.slow
def test_ray_takes_over_to_the_same_bits_and_leaves_nothing() -> None:
    """Every chunk is walked once, here or there."""
    done = python("-m", "tests.worker.hybrid_process", "take-over", "is all")
    assert (done.stdout, done.stderr, done.returncode) == ("took over\nnothing left\n", "", 0)


@pytest.mark.thorough(
    "test_ray_takes_over_to_the_same_bits_and_leaves_nothing",
    "test_a_cluster_that_was_lost_is_noticed_and_opened_again_with_the_same_bits",
)
@pytest.mark.slow
def test_ray_that_took_over_is_lost_and_takes_over_again_to_the_same_bits() -> None:
    """Every chunk is walked once, here or there; here, too, until a Ray that was lost is open."""
    done = python("-m", "tests.worker.hybrid_process", "take-over", "is lost")
    said = "took over\ntook over again\nnothing left\n"
    assert (done.stdout, done.returncode) == (said, 0), done.stderr
    before, _, after = done.stderr.partition("loses Ray\n")
    assert before == ""
    assert "walks go on in this process until Ray is open again" in after
