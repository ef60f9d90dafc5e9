"""Opens Ray, has robots walk, and then closes it, waits to be killed, or kills its cluster."""

from __future__ import annotations

import os
import signal
import sys
import time

from services.optimizer.errors import EvaluatorUnavailable
from services.worker.ray_evaluator import RayEvaluator
from tests.worker.processes import descendants
from tests.worker.requests import bits, never, request


def main(ending: str) -> None:
    evaluator = RayEvaluator(cpus=1)
    walked = bits(evaluator.evaluate(request(2), never))
    sys.stdout.write("walked\n")
    sys.stdout.flush()
    if ending == "wait":
        time.sleep(600.0)
    if ending == "lose":
        for process in descendants(os.getpid()):
            if "gcs_server" in process.title:
                os.kill(process.pid, signal.SIGKILL)
        sys.stdout.write(f"{until_lost(evaluator)}\n")
        assert bits(evaluator.evaluate(request(2), never)) == walked
    sys.stdin.readline()
    evaluator.close()


def until_lost(evaluator: RayEvaluator) -> str:
    """What is said when the loss is noticed; walks may go on for a while without the head."""
    deadline = time.monotonic() + 50.0
    while time.monotonic() < deadline:
        try:
            evaluator.evaluate(request(2), never)
        except EvaluatorUnavailable as error:
            return str(error)
        time.sleep(0.2)
    return "the loss went unnoticed"


if __name__ == "__main__":
    main(sys.argv[1])
