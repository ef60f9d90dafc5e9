"""Walks in threads of this process: the compiled kernel lets other threads run meanwhile."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from functools import partial

from gaitswarm.services.optimizer.run.evaluator import EvaluationRequest
from gaitswarm.services.worker.dispatch import Dispatcher, Work
from gaitswarm.services.worker.preparation import KernelBuilder
from gaitswarm.services.worker.tasks import Load, TaskTotals
from gaitswarm.sim import simulate
from gaitswarm.sim.outcome import Outcome


def available_cpus() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class InProcessEvaluator:
    """`Evaluator` on a pool of threads.

    Args:
        cpus: Their number, all processors by default.

    Raises:
        ValueError: cpus is less than 1.
    """

    def __init__(self, cpus: int | None = None) -> None:
        slots = cpus if cpus is not None else available_cpus()
        if slots < 1:
            raise ValueError(f"cpus must be at least 1, it is {slots}")
        self._kernels = KernelBuilder()
        self._dispatcher = Dispatcher(slots, simulate.lanes, shared=True)
        self._threads = [
            threading.Thread(target=self._work, name=f"walks-{k}", daemon=True)
            for k in range(slots)
        ]
        for thread in self._threads:
            thread.start()

    @property
    def slots(self) -> int:
        """Number of threads."""
        return self._dispatcher.slots

    @property
    def totals(self) -> TaskTotals:
        """Of all tasks so far."""
        return self._dispatcher.totals

    @property
    def loads(self) -> dict[str, Load]:
        """What the threads have to do."""
        return {"threads": self._dispatcher.load}

    def evaluate(
        self, request: EvaluationRequest, should_stop: Callable[[], bool]
    ) -> tuple[Outcome, ...]:
        """Have the walks run by the pool, as soon as their robots' kernels are built."""
        self._kernels.build(request.cases, should_stop)
        return self._dispatcher.evaluate(request, should_stop)

    def trouble(self) -> str | None:
        """Whether threads are missing."""
        lost = sum(not thread.is_alive() for thread in self._threads)
        if not lost:
            return None
        return f"{lost} of {len(self._threads)} threads have ended; restart this process"

    def close(self) -> None:
        """End the threads; waits for the chunks that are being run."""
        self._dispatcher.close("the evaluator was closed")
        for thread in self._threads:
            thread.join()

    def _work(self) -> None:
        while not self._dispatcher.closed:
            work = self._dispatcher.take(timeout=1.0)
            if work is None:
                continue
            try:
                answer = work.task.run(partial(self._in_vain, work))
            except Exception as error:  # noqa: BLE001 - it is the caller's, in another thread
                self._dispatcher.fail(work, error)
            else:
                self._dispatcher.complete(work, answer)

    def _in_vain(self, work: Work) -> bool:
        return work.batch.ended or self._dispatcher.closed
