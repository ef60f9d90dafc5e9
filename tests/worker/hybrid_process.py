"""Lets Ray take over from threads, in a process of its own, and loses or closes it."""

from __future__ import annotations

import os
import signal
import sys
import tempfile
import time
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
    evaluator = HybridEvaluator(2, long_job_seconds=0.0)
    walks = len(WANTED.designs) * len(WANTED.cases)
    expected = bits(walked_at_once(WANTED))
    with patch.object(Task, "run", autospec=True, side_effect=Task.run) as here:
        requests = 0
        while not evaluator.on_ray:
            here.reset_mock()
            assert bits(evaluator.evaluate(WANTED, never)) == expected
            requests += 1
            # Ray starts sooner on processors that rest now and then.
            time.sleep(0.2)
            # All of a request's walks; or none, if Ray took over a moment ago.
            assert walked(here) == walks or evaluator.on_ray
        assert requests > 1
        here.reset_mock()
        assert bits(evaluator.evaluate(WANTED, never)) == expected
        assert walked(here) == 0
    return f"took over\n{left_by(evaluator)}"


def lose() -> str:
    evaluator = HybridEvaluator(1, long_job_seconds=0.0)
    expected = bits(evaluator.evaluate(WANTED, never))
    eventually(lambda: evaluator.on_ray)
    assert bits(evaluator.evaluate(WANTED, never)) == expected
    for process in descendants(os.getpid()):
        if "gcs_server" in process.title:
            os.kill(process.pid, signal.SIGKILL)

    def lost() -> bool:
        assert bits(evaluator.evaluate(WANTED, never)) == expected
        time.sleep(0.1)
        return not evaluator.on_ray

    with patch("services.worker.cluster.pump.PULSE_SECONDS", 0.3):
        eventually(lost)
    eventually(lambda: evaluator.on_ray)
    assert bits(evaluator.evaluate(WANTED, never)) == expected
    evaluator.close()
    return "here, then on Ray again"


def close(state: str) -> str:
    evaluator = HybridEvaluator(1, long_job_seconds=0.0)
    left = 0 if state == "in threads" else 1
    evaluator.evaluate(replace(WANTED, iterations_left=left), never)
    if state == "while Ray is started":
        eventually(lambda: bool(descendants(os.getpid())))
    return left_by(evaluator)


def left_by(evaluator: HybridEvaluator) -> str:
    """What is told of processes and files of an evaluator once it is closed."""
    evaluator.close()
    mine = f"gaitswarm-ray-{os.getpid()}-*"
    assert within(10.0, lambda: not descendants(os.getpid()))
    assert not list(Path(tempfile.gettempdir()).glob(mine))
    return "nothing left"


def main(what: str, *arguments: str) -> None:
    if what == "take-over":
        told = take_over()
    elif what == "lose":
        told = lose()
    else:
        told = close(*arguments)
    sys.stdout.write(f"{told}\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
