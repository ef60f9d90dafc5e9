"""A signal is heard whatever the main thread is at."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable
from typing import Any

import pytest

from gaitswarm.services.runtime import stop_on_signals
from tests.examples.forked import ForkedCommand

pytestmark = pytest.mark.slow


def held_to_wait_for(event: Any) -> threading.Condition:
    """What `Event.wait` holds for some microseconds whenever it begins, and ends."""
    condition: threading.Condition = event._cond  # noqa: SLF001
    return condition


def told_twice_while_it_begins_to_wait() -> None:
    stop, at_once = threading.Event(), threading.Event()
    with stop_on_signals(stop, at_once):
        with held_to_wait_for(stop), held_to_wait_for(at_once):
            signal.raise_signal(signal.SIGTERM)
            signal.raise_signal(signal.SIGINT)
        stop.wait()
        at_once.wait()


def told_once_more_than_can_be_heard() -> None:
    stop = threading.Event()
    stop.set()
    with stop_on_signals(stop):
        # Another stop request has no effect; another Ctrl-C ends at once.
        signal.raise_signal(signal.SIGTERM)
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)


@pytest.mark.parametrize(
    "program", [told_twice_while_it_begins_to_wait, told_once_more_than_can_be_heard]
)
def test_a_process_that_waits_for_a_signal_continues_when_it_comes(
    program: Callable[[], None],
) -> None:
    process = ForkedCommand(program=program, stdout=None, stderr=None)
    try:
        assert process.wait(timeout=20) == 0
    finally:
        process.kill()
