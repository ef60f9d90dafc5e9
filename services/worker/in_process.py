"""Simulations in threads of this process; the compiled kernel runs without Python's lock"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from functools import partial
from queue import SimpleQueue

from gaitswarm.services.optimizer.errors import EvaluatorUnavailable
from gaitswarm.services.optimizer.run.evaluator import EvaluationRequest
from gaitswarm.services.worker.chunks import Chunk
from gaitswarm.services.worker.dispatch import Dispatcher, Load, build_kernels
from gaitswarm.services.worker.tasks import Answer, TaskTotals, run_task
from gaitswarm.sim.outcome import Outcome


def available_cpus() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class InProcessEvaluator:
    """`Evaluator` on threads.

    Args:
        cpus: Number of threads; all processors by default.

    Raises:
        ValueError: cpus is less than 1.
    """

    def __init__(self, cpus: int | None = None) -> None:
        slots = cpus if cpus is not None else available_cpus()
        if slots < 1:
            raise ValueError(f"cpus must be at least 1, it is {slots}")
        self._dispatcher = Dispatcher()
        self._threads = _Threads(slots)

    @property
    def slots(self) -> int:
        """Number of threads."""
        return self._threads.slots

    @property
    def place(self) -> str:
        """Number of threads, as text."""
        return f"threads: {self.slots}"

    @property
    def totals(self) -> TaskTotals:
        """Totals of all tasks so far."""
        return self._dispatcher.totals

    @property
    def loads(self) -> dict[str, Load]:
        """Load of the threads."""
        return {"threads": self._dispatcher.load(self.slots)}

    def evaluate(
        self, request: EvaluationRequest, should_stop: Callable[[], bool]
    ) -> tuple[Outcome, ...]:
        """Simulate in the threads, once the robots' kernels are built."""
        build_kernels(request.cases, should_stop)
        return self._dispatcher.evaluate(self._threads, request, should_stop)

    def close(self) -> None:
        """End the threads after their present chunks. Idempotent."""
        self._threads.close()


class _Task(Future[Answer]):
    """A task in the queue."""

    def __init__(self, request: EvaluationRequest, chunk: Chunk) -> None:
        super().__init__()
        self.request, self.chunk, self.abandoned = request, chunk, False

    def run(self, should_stop: Callable[[], bool]) -> None:
        request, chunk = self.request, self.chunk
        try:
            answer = run_task(
                [request.cases[case] for case in chunk.cases],
                request.designs[chunk.start : chunk.stop],
                request.provenance,
                should_stop,
            )
        except Exception as error:  # noqa: BLE001 - raised again in `answer`
            self.set_exception(error)
        else:
            self.set_result(answer)


class _Threads:
    """`Engine` of this process."""

    def __init__(self, slots: int) -> None:
        self.slots = slots
        self._closed = False
        self._queue: SimpleQueue[_Task | None] = SimpleQueue()
        self._threads = [
            threading.Thread(target=self._work, name=f"walks-{k}", daemon=True)
            for k in range(slots)
        ]
        for thread in self._threads:
            thread.start()

    def submit(self, request: EvaluationRequest, chunk: Chunk, _attempts: int, /) -> _Task:
        task = _Task(request, chunk)
        self._queue.put(task)
        return task

    def wait(self, handles: Sequence[_Task], seconds: float) -> Sequence[_Task]:
        done = wait(handles, timeout=seconds, return_when=FIRST_COMPLETED).done
        return [task for task in handles if task in done]

    def answer(self, handle: _Task) -> Answer:
        return handle.result()

    def abandon(self, handles: Sequence[_Task]) -> None:
        for task in handles:
            task.abandoned = True
            task.cancel()

    def check(self) -> None:
        if self._closed:
            raise EvaluatorUnavailable("the evaluator was closed")

    def close(self) -> None:
        self._closed = True
        for _ in self._threads:
            self._queue.put(None)
        for thread in self._threads:
            thread.join()

    def _work(self) -> None:
        while (task := self._queue.get()) is not None:
            if not self._closed and task.set_running_or_notify_cancel():
                task.run(partial(self._in_vain, task))

    def _in_vain(self, task: _Task) -> bool:
        return task.abandoned or self._closed
