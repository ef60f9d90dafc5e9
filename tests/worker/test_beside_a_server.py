"""Walks in threads leave the processors to what serves people in the same process."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest

from gaitswarm.services.runtime import open_evaluator, open_runtime
from gaitswarm.services.worker import EvaluatorKind
from tests.examples.processes import eventually

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="threads have no niceness here")

OpenedThreads = Callable[[], dict[str, int]]


@pytest.fixture
def opened_threads() -> OpenedThreads:
    """How far each thread that the test has started stands back, by its name."""
    others = set(threading.enumerate())
    own = os.getpriority(os.PRIO_PROCESS, 0)
    return lambda: {
        thread.name: os.getpriority(os.PRIO_PROCESS, thread.native_id) - own
        for thread in threading.enumerate()
        if thread not in others and thread.native_id is not None
    }


@pytest.mark.parametrize("kind", ["in-process", "ray"])
def test_a_servers_walks_stand_back_and_nothing_else_of_it_does(
    kind: EvaluatorKind, tmp_path: Path, opened_threads: OpenedThreads
) -> None:
    with open_runtime(f"sqlite:///{tmp_path}/jobs.db", evaluator=kind, cpus=2):
        eventually(
            lambda: len([b for b in opened_threads().values() if b == 10]) == 2, seconds=10.0
        )
        walks = {name for name, back in opened_threads().items() if back != 0}
        assert walks == {"walks-0", "walks-1"}
        assert len(opened_threads()) > len(walks)


def test_a_commands_walks_do_not(opened_threads: OpenedThreads) -> None:
    with closing(open_evaluator("in-process", cpus=2)):
        assert opened_threads() == {"walks-0": 0, "walks-1": 0}
