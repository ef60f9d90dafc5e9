"""Runs one stored job to its end, or several at once to their middle; processes to be killed."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from multiprocessing.connection import Connection

from gaitswarm.services.optimizer.run.evaluator import EvaluationRequest
from gaitswarm.services.optimizer.run.runner import Runner
from gaitswarm.services.runtime import open_evaluator, open_store, run_embedded
from gaitswarm.services.worker.in_process import InProcessEvaluator
from gaitswarm.services.worker.ray_evaluator import RayEvaluator
from gaitswarm.sim.outcome import Outcome


def main(url: str, job_id: str, kind: str, connection: Connection) -> None:
    """Evaluate on `kind`; the state of the job's search is sent after every commit."""
    store = open_store(url)
    # On Ray from the first walk on, however short the job is.
    evaluator = RayEvaluator(cpus=2) if kind == "ray" else open_evaluator("in-process", cpus=2)
    run_embedded(store, evaluator, job_id, on_commit=lambda _, state: connection.send(str(state)))
    evaluator.close()
    store.close()


def run_to_the_middle(url: str, middles: Mapping[str, int], connection: Connection) -> None:
    """Run jobs at once, each up to an iteration whose walks never end; send its id then."""
    evaluator = _Halting(middles, connection.send)
    Runner(open_store(url), evaluator, concurrency=len(middles), poll_seconds=0.01).start()
    threading.Event().wait()


class _Halting(InProcessEvaluator):
    """Runs walks, but those of an iteration of each job for ever."""

    def __init__(self, middles: Mapping[str, int], on_halt: Callable[[str], None]) -> None:
        super().__init__(2)
        self._middles, self._on_halt, self._one = middles, on_halt, threading.Lock()

    def evaluate(
        self, request: EvaluationRequest, should_stop: Callable[[], bool]
    ) -> tuple[Outcome, ...]:
        outcomes = super().evaluate(request, should_stop)
        if request.iteration == self._middles[request.job_id]:
            with self._one:
                self._on_halt(request.job_id)
            threading.Event().wait()
        return outcomes
