"""Simulations in threads of this process; the compiled kernel runs without Python's lock"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait

from gaitswarm.services.optimizer.errors import EvaluatorUnavailable
from gaitswarm.services.optimizer.run.evaluator import EvaluationRequest
from gaitswarm.services.worker.chunks import Chunk
from gaitswarm.services.worker.dispatch import Dispatcher, Load, build_kernels
from gaitswarm.services.worker.tasks import Answer, run_task
from gaitswarm.sim.outcome import Outcome

_Task = tuple[Future[Answer], threading.Event]
"""A task, and whether its answer is not needed any more."""


def available_cpus() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class InProcessEvaluator:
    """`Evaluator` on threads, by default on all processors, and the `Engine` of its tasks."""

    def __init__(self, cpus: int | None = None) -> None:
        self.slots = cpus if cpus is not None else available_cpus()
        if self.slots < 1:
            raise ValueError(f"cpus must be at least 1, it is {self.slots}")
        self._dispatcher = Dispatcher()
        self._pool = ThreadPoolExecutor(self.slots, thread_name_prefix="walks")
        self._closed = threading.Event()

    @property
    def place(self) -> str:
        return f"threads: {self.slots}"

    @property
    def loads(self) -> dict[str, Load]:
        return {"threads": self._dispatcher.load(self.slots)}

    def evaluate(
        self, request: EvaluationRequest, should_stop: Callable[[], bool]
    ) -> tuple[Outcome, ...]:
        """Simulate in the threads, once the robots' kernels are built."""
        build_kernels(request.cases, should_stop)
        return self._dispatcher.evaluate(self, request, should_stop)

    def close(self) -> None:
        """End the threads after their present chunks. Idempotent."""
        self._closed.set()
        self._pool.shutdown()

    def submit(self, request: EvaluationRequest, chunk: Chunk, /) -> _Task:
        abandoned = threading.Event()

        def in_vain() -> bool:
            return abandoned.is_set() or self._closed.is_set()

        def run() -> Answer:
            self.check()
            cases = [request.cases[case] for case in chunk.cases]
            designs = request.designs[chunk.start : chunk.stop]
            return run_task(cases, designs, request.provenance, in_vain)

        try:
            return self._pool.submit(run), abandoned
        except RuntimeError:
            # Closed meanwhile.
            self.check()
            raise

    def wait(self, handles: Sequence[_Task], seconds: float) -> Sequence[_Task]:
        futures = [future for future, _ in handles]
        done = wait(futures, timeout=seconds, return_when=FIRST_COMPLETED).done
        return [handle for handle in handles if handle[0] in done]

    def answer(self, handle: _Task) -> Answer:
        return handle[0].result()

    def abandon(self, handles: Sequence[_Task]) -> None:
        """Drop tasks that have not begun, and let the others end soon."""
        for future, abandoned in handles:
            abandoned.set()
            future.cancel()

    def check(self) -> None:
        """Raise EvaluatorUnavailable once closed."""
        if self._closed.is_set():
            raise EvaluatorUnavailable("the evaluator was closed")
