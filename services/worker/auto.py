"""Simulations in threads until a local Ray has started"""

from __future__ import annotations

import logging
from collections.abc import Callable

from gaitswarm.services.optimizer.errors import EvaluatorUnavailable, ProvenanceChanged
from gaitswarm.services.optimizer.run.evaluator import EvaluationRequest
from gaitswarm.services.worker.dispatch import Load
from gaitswarm.services.worker.in_process import InProcessEvaluator
from gaitswarm.services.worker.ray_evaluator import RayEvaluator
from gaitswarm.sim.outcome import Outcome

_log = logging.getLogger(__name__)


class AutoEvaluator:
    """`Evaluator` that starts a local Ray in the background; for servers and runners.

    Each request runs on one of the two: on Ray once it is ready, in threads before, and after a
    loss until it is ready again. If Ray cannot be started, threads remain.

    Args:
        cpus: Number of tasks that run concurrently; all processors by default.
    """

    def __init__(self, cpus: int | None = None) -> None:
        self._threads = InProcessEvaluator(cpus)
        self._ray = RayEvaluator(cpus=self._threads.slots)
        self._used: InProcessEvaluator | RayEvaluator = self._threads
        self._without_ray = False
        self._closed = False

    @property
    def slots(self) -> int:
        """Number of tasks that run concurrently."""
        return self._threads.slots

    @property
    def place(self) -> str:
        """Place of the last evaluation."""
        return self._used.place

    @property
    def loads(self) -> dict[str, Load]:
        """Load of threads and Ray."""
        return self._threads.loads | self._ray.loads

    @property
    def on_ray(self) -> bool:
        """Whether the next request runs on Ray."""
        if self._without_ray or self._closed:
            return False
        try:
            return self._ray.is_warm()
        except EvaluatorUnavailable as error:
            self._do_without(error)
            return False

    def evaluate(
        self, request: EvaluationRequest, should_stop: Callable[[], bool]
    ) -> tuple[Outcome, ...]:
        """Simulate on Ray if it is ready, else in threads."""
        if self.on_ray:
            try:
                outcomes = self._ray.evaluate(request, should_stop)
            except EvaluatorUnavailable as error:
                if self._closed or not self._ray.lost:
                    raise
                _log.warning("%s; simulations continue in threads until it is back", error)
            except ProvenanceChanged as error:
                # Its processes have read files that changed after the start of this one.
                self._do_without(error)
            else:
                self._used = self._ray
                return outcomes
        self._used = self._threads
        return self._threads.evaluate(request, should_stop)

    def close(self) -> None:
        """End Ray and the threads. Idempotent."""
        self._closed = True
        self._threads.close()
        self._ray.close()

    def _do_without(self, error: Exception) -> None:
        if not (self._without_ray or self._closed):
            self._without_ray = True
            _log.warning("%s; simulations continue in threads", error)
