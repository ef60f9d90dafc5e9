"""Lets Ray take over from threads, in a process of its own, loses it and closes it."""

from __future__ import annotations

import os
import signal
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from unittest.mock import Mock, patch

from services.worker.hybrid import HybridEvaluator
from services.worker.tasks import Task
from tests.examples.processes import eventually, within
from tests.worker.processes import descendants
from tests.worker.requests import bits, never, request, walked_at_once

WANTED = replace(request(40), iterations_left=1)


def walked(here: Mock) -> int:
    """Walks that this process was asked for."""
    tasks = [call.args[0] for call in here.call_args_list]
    return sum(part.stop - part.start for task in tasks for part in task.parts)


def take_over() -> str:
    """Ray takes over, is lost, and takes over again; then the evaluator is closed."""
    evaluator = HybridEvaluator(2, long_job_seconds=0.0)
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
    # All that is said from here on is said of the loss.
    sys.stderr.write("loses Ray\n")
    for process in descendants(os.getpid()):
        if "gcs_server" in process.title:
            os.kill(process.pid, signal.SIGKILL)

    # Not asked of `on_ray`, which may say so between two requests and be true again at the next.
    with patch("services.worker.cluster.pump.PULSE_SECONDS", 0.3):
        eventually(lambda: walked_here() > 0)
    eventually(lambda: evaluator.on_ray)
    assert walked_here() == 0
    return f"took over\n{left_by(evaluator)}"


def close(state: str) -> str:
    evaluator = HybridEvaluator(1, long_job_seconds=0.0)
    left = 0 if state == "in threads" else 1
    evaluator.evaluate(replace(WANTED, iterations_left=left), never)
    if state == "while Ray is started":
        eventually(lambda: bool(descendants(os.getpid())))
    if state == "while a worker of Ray dies":
        eventually(lambda: any(map(killed, importing())))
    return left_by(evaluator)


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


def left_by(evaluator: HybridEvaluator) -> str:
    """What is told of processes and files of an evaluator once it is closed."""
    evaluator.close()
    mine = f"gaitswarm-ray-{os.getpid()}-*"
    assert within(10.0, lambda: not descendants(os.getpid()))
    assert not list(Path(tempfile.gettempdir()).glob(mine))
    return "nothing left"


def main(what: str, *arguments: str) -> None:
    told = take_over() if what == "take-over" else close(*arguments)
    sys.stdout.write(f"{told}\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
