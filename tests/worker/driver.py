"""Simulates in threads, on Ray, loses it, and does the same again."""

from __future__ import annotations

import os
import signal
import sys
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
    vars(ray_evaluator)["PULSE_SECONDS"] = 0.3
    wanted = request(20)
    expected = bits(walked_at_once(wanted))
    evaluator = AutoEvaluator(InProcessEvaluator(1), RayEvaluator(cpus=1))

    def evaluate(place: str) -> None:
        assert evaluator.on_ray == (place == "ray")
        assert bits(evaluator.evaluate(wanted, never)) == expected
        sys.stdout.write(f"{place}\n")
        sys.stdout.flush()

    def in_threads() -> bool:
        with suppress(EvaluatorUnavailable):
            assert bits(evaluator.evaluate(wanted, never)) == expected
        return not evaluator.on_ray

    evaluate("threads")
    eventually(lambda: evaluator.on_ray)
    evaluate("ray")
    for process in descendants(os.getpid()):
        if "raylet/raylet" in process.title:
            os.kill(process.pid, signal.SIGKILL)
    eventually(in_threads)
    evaluate("threads")
    eventually(lambda: evaluator.on_ray)
    evaluate("ray")
    sys.stdin.readline()


if __name__ == "__main__":
    main()
