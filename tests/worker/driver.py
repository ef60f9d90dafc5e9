"""Simulates in threads, on Ray, perhaps loses it, and closes it at a line of its input."""

from __future__ import annotations

import os
import signal
import sys
import threading
from contextlib import suppress

from gaitswarm.services.optimizer.errors import EvaluatorUnavailable
from gaitswarm.services.runtime import AutoEvaluator
from gaitswarm.services.worker import ray_evaluator
from gaitswarm.services.worker.dispatch import InProcessEvaluator
from gaitswarm.services.worker.ray_evaluator import RayEvaluator
from tests.examples.processes import eventually
from tests.worker.processes import descendants
from tests.worker.requests import bits, never, request, walked_at_once


def main() -> None:
    heard = threading.Event()
    signal.signal(signal.SIGTERM, lambda *_: heard.set())
    vars(ray_evaluator)["PULSE_SECONDS"] = 0.3
    wanted = request(20)
    expected = bits(walked_at_once(wanted))
    evaluator = AutoEvaluator(InProcessEvaluator(1), RayEvaluator(cpus=1))

    def evaluate(place: str) -> None:
        assert evaluator.on_ray == (place == "ray")
        assert bits(evaluator.evaluate(wanted, never)) == expected
        sys.stdout.write(f"{place}\n")
        sys.stdout.flush()

    evaluate("threads")
    eventually(lambda: evaluator.on_ray)
    evaluate("ray")
    if "lose" in sys.argv:
        for process in descendants(os.getpid()):
            if "raylet/raylet" in process.title:
                os.kill(process.pid, signal.SIGKILL)

        def in_threads() -> bool:
            with suppress(EvaluatorUnavailable):
                assert bits(evaluator.evaluate(wanted, never)) == expected
            return not evaluator.on_ray

        eventually(in_threads)
        evaluate("threads")
        eventually(lambda: evaluator.on_ray)
        evaluate("ray")
    sys.stdin.readline()
    os.kill(os.getpid(), signal.SIGTERM)
    if heard.wait(5.0):
        sys.stdout.write("heard\n")
    evaluator.close()


if __name__ == "__main__":
    main()
