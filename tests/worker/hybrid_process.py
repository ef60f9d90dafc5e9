"""Lets Ray take over from threads, in a process of its own, loses it and closes it."""

from __future__ import annotations

import os
import signal
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from unittest.mock import Mock, patch

from gaitswarm.services.worker.hybrid import HybridEvaluator
from gaitswarm.services.worker.tasks import Task
from tests.examples.processes import eventually, within
from tests.worker.processes import descendants
from tests.worker.requests import bits, never, request, walked_at_once

WANTED = replace(request(40), iterations_left=1)


def walked(here: Mock) -> int:
    """Walks that this process was asked for."""
    tasks = [call.args[0] for call in here.call_args_list]
    return sum(part.stop - part.start for task in tasks for part in task.parts)


def take_over(evaluator: HybridEvaluator, then: str) -> None:
    """Ray takes over; then that is all, or it is lost and takes over again."""
    walks = len(WANTED.designs) * len(WANTED.cases)
    expected = bits(walked_at_once(WANTED))

    def walked_here() -> int:
        """Of a request, all of whose walks come to what they should."""
        with patch.object(Task, "run", autospec=True, side_effect=Task.run) as here:
            assert bits(evaluator.evaluate(WANTED, never)) == expected
        return walked(here)

    # The first request says how long the job is; while Ray is started, walks go on here.
    assert [walked_here(), walked_here()] == [walks, walks]
    eventually(lambda: evaluator.on_ray)
    assert walked_here() == 0
    sys.stdout.write("took over\n")
    if then == "is all":
        return

    # All that is said from here on is said of the loss.
    sys.stderr.write("loses Ray\n")
    for process in descendants(os.getpid()):
        if "gcs_server" in process.title:
            os.kill(process.pid, signal.SIGKILL)

    # Not asked of `on_ray`, which may say so between two requests and be true again at the next.
    with patch("gaitswarm.services.worker.cluster.pump.PULSE_SECONDS", 0.3):
        eventually(lambda: walked_here() > 0)
    eventually(lambda: evaluator.on_ray)
    assert walked_here() == 0
    sys.stdout.write("took over again\n")


def reach(evaluator: HybridEvaluator, state: str) -> None:
    """Walk until Ray is in a state."""
    left = 0 if state == "in threads" else 1
    evaluator.evaluate(replace(WANTED, iterations_left=left), never)
    if state == "while Ray is started":
        eventually(lambda: bool(descendants(os.getpid())))
    if state == "while a worker of Ray dies":
        eventually(lambda: any(map(killed, importing())))


def importing() -> list[int]:
    """Ray's workers that import what walks need, before any walk."""
    return [p.pid for p in descendants(os.getpid()) if "ray::warm_up" in p.title]


def killed(process: int) -> bool:
    """Kill a process; whether there was one still."""
    try:
        os.kill(process, signal.SIGKILL)
    except ProcessLookupError:
        return False
    return True


def leaves_nothing(evaluator: HybridEvaluator) -> bool:
    """Whether no process and no file is left of an evaluator, once it is closed."""
    evaluator.close()
    mine = f"gaitswarm-ray-{os.getpid()}-*"
    return within(10.0, lambda: not descendants(os.getpid())) and not any(
        Path(tempfile.gettempdir()).glob(mine)
    )


def main(what: str, *arguments: str) -> None:
    evaluator = HybridEvaluator(2 if what == "take-over" else 1, long_job_seconds=0.0)
    try:
        if what == "take-over":
            take_over(evaluator, *arguments)
        else:
            reach(evaluator, *arguments)
    finally:
        sys.stdout.write("nothing left\n" if leaves_nothing(evaluator) else "something left\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
