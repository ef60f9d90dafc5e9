"""Walks in this process at once, and on its own Ray when that pays."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from typing import Final

from gaitswarm.services.optimizer.errors import EvaluatorUnavailable, ProvenanceChanged
from gaitswarm.services.optimizer.run.evaluator import EvaluationRequest
from gaitswarm.services.worker.in_process import InProcessEvaluator
from gaitswarm.services.worker.preparation import KernelBuilder
from gaitswarm.services.worker.ray_evaluator import RayEvaluator
from gaitswarm.services.worker.tasks import Load
from gaitswarm.sim.outcome import Outcome

LONG_JOB_SECONDS: Final = 60.0
"""Ray is started for a job that is expected to take longer yet [s]: its processes take some six
seconds of a core to start, and are worth it on many cores, or if a walk kills its process."""

_log = logging.getLogger(__name__)


class HybridEvaluator:
    """`Evaluator` in threads of this process first, and on a Ray of its own in long jobs.

    Ray is started beside the walks when a job is long enough, and takes over when its workers have
    imported what walks need; every request is run by one of the two, from its first chunk to its
    last. Walks go on in this process if Ray cannot be started, which is logged, and while it is
    started again after it was lost.

    request of job a, 9 more to follow, took 1 s in threads  ->  9 s to go: threads
    request of job b, 99 more to follow, took 1 s in threads ->  99 s to go: Ray begins to start
    requests of any job, Ray not ready                       ->  threads
    requests of any job, Ray ready                           ->  Ray

    Args:
        cpus: Walks to compute at once; all processors by default.
        long_job_seconds: Ray is started for a job that is expected to take longer yet [s].

    Raises:
        ValueError: cpus is less than 1.
    """

    def __init__(
        self,
        cpus: int | None = None,
        *,
        long_job_seconds: float = LONG_JOB_SECONDS,
    ) -> None:
        self._long_job_seconds = long_job_seconds
        self._kernels = KernelBuilder()
        self._threads = InProcessEvaluator(cpus)
        self._changing = threading.Lock()
        self._ray: RayEvaluator | None = None
        self._without_ray = False
        self._walked_on_ray = False
        self._closed = False

    @property
    def slots(self) -> int:
        """Chunks that run at the same time, in threads as on Ray."""
        return self._threads.slots

    @property
    def loads(self) -> dict[str, Load]:
        """What the threads have to do, and Ray if it was started."""
        ray = self._ray
        return self._threads.loads | (ray.loads if ray is not None else {})

    @property
    def on_ray(self) -> bool:
        """Whether the next request is run by Ray."""
        return self._ready_ray() is not None

    def trouble(self) -> str | None:
        """Whether threads are missing; walks go on without Ray."""
        return self._threads.trouble()

    def evaluate(
        self, request: EvaluationRequest, should_stop: Callable[[], bool]
    ) -> tuple[Outcome, ...]:
        """Have the walks run by Ray if it is ready, and by this process otherwise."""
        ray = self._ready_ray()
        if ray is None:
            # Lost between two requests, if the last one was run by it.
            if self._walked_on_ray and not (self._without_ray or self._closed):
                self._say_lost()
            return self._walk_here(request, should_stop)
        try:
            outcomes = ray.evaluate(request, should_stop)
        except EvaluatorUnavailable:
            # Not if walks have killed their workers: they would kill this process.
            if self._closed or not ray.lost:
                raise
            self._say_lost()
        except ProvenanceChanged as error:
            # Workers have imported the code later than this process, if it is theirs that differs.
            outcomes = self._walk_here(request, should_stop)
            self._do_without_ray(error)
            return outcomes
        else:
            self._walked_on_ray = True
            return outcomes
        return self._walk_here(request, should_stop)

    def _say_lost(self) -> None:
        self._walked_on_ray = False
        _log.warning("walks go on in this process until Ray is open again")

    def close(self) -> None:
        """End Ray and the threads; waits for what they are just doing. Idempotent."""
        with self._changing:
            self._closed = True
        self._threads.close()
        if self._ray is not None:
            self._ray.close()

    def _walk_here(
        self, request: EvaluationRequest, should_stop: Callable[[], bool]
    ) -> tuple[Outcome, ...]:
        # Built before the clock is started: what takes long only once says nothing of the job.
        self._kernels.build(request.cases, should_stop)
        begun = time.monotonic()
        outcomes = self._threads.evaluate(request, should_stop)
        if (time.monotonic() - begun) * request.iterations_left > self._long_job_seconds:
            self._start_ray()
        return outcomes

    def _start_ray(self) -> None:
        with self._changing:
            if self._ray is None and not self._closed:
                _log.info("Ray is started for a long job")
                self._ray = RayEvaluator(cpus=self.slots)

    def _ready_ray(self) -> RayEvaluator | None:
        ray = self._ray
        if ray is None or self._without_ray or self._closed:
            return None
        try:
            return ray if ray.is_warm() else None
        except EvaluatorUnavailable as error:
            self._do_without_ray(error)
            return None

    def _do_without_ray(self, error: Exception) -> None:
        with self._changing:
            known, self._without_ray = self._without_ray, True
        if not (known or self._closed):
            _log.warning("%s; walks go on in this process", error)
