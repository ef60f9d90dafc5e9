"""Opens Ray, has robots walk, perhaps kills its cluster, and waits to be killed or to close it."""

from __future__ import annotations

import os
import signal
import sys
import threading
from dataclasses import replace
from unittest.mock import patch

from gaitswarm.services.optimizer.errors import EvaluatorUnavailable
from gaitswarm.services.optimizer.run.evaluator import EvaluationStopped
from gaitswarm.services.worker.ray_evaluator import RayEvaluator
from gaitswarm.services.worker.ray_session import RaySession, open_ray
from gaitswarm.sim.case import Walk
from tests.worker.cluster_runner import Sleep
from tests.worker.processes import descendants
from tests.worker.requests import bits, never, request

heard = threading.Event()


def say(line: str) -> None:
    """Flushed at once, as the reader may then end this process."""
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def main(ending: str) -> None:
    signal.signal(signal.SIGTERM, lambda *_: heard.set())
    evaluator = RayEvaluator(cpus=1)
    walked = bits(evaluator.evaluate(request(2), never))
    say("walked")
    if ending == "lose":
        for process in descendants(os.getpid()):
            if "gcs_server" in process.title:
                os.kill(process.pid, signal.SIGKILL)
        with patch("gaitswarm.services.worker.cluster.pump.PULSE_SECONDS", 0.3):
            say(until_lost(evaluator))
        say(told_to_stop_while_reopening(evaluator))
        assert bits(evaluator.evaluate(request(2), never)) == walked
        say(terminated())
    sys.stdin.readline()
    evaluator.close()


def told_to_stop_while_reopening(evaluator: RayEvaluator) -> str:
    """What came of a stop that was asked for while Ray took long to be opened."""
    reopening, may_open = threading.Event(), threading.Event()

    def open_slowly(address: str | None, *, cpus: int | None) -> RaySession:
        reopening.set()
        may_open.wait()
        return open_ray(address, cpus=cpus)

    with patch("gaitswarm.services.worker.ray_evaluator.open_ray", open_slowly):
        try:
            evaluator.evaluate(request(2), reopening.is_set)
        except EvaluationStopped:
            return "stopped"
        finally:
            may_open.set()
    return "not stopped"


def terminated() -> str:
    """Whether this process hears of SIGTERM as it did before Ray was opened."""
    os.kill(os.getpid(), signal.SIGTERM)
    return "heard" if heard.wait(5.0) else "not heard"


def until_lost(evaluator: RayEvaluator) -> str:
    """What is said when the loss is noticed, during a request.

    A loss between two requests is not reported: the next request opens Ray.
    """
    (walk, *_) = request(1).cases
    assert isinstance(walk, Walk)
    try:
        evaluator.evaluate(replace(request(1), cases=(Sleep(walk),)), never)
    except EvaluatorUnavailable as error:
        return str(error)
    return "the loss went unnoticed"


if __name__ == "__main__":
    main(sys.argv[1])
