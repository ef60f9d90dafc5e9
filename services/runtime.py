"""Composition root of store, evaluator and runner"""

from __future__ import annotations

import logging
import math
import signal
import threading
from collections import deque
from collections.abc import Callable, Collection, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from dataclasses import dataclass, replace
from functools import partial
from queue import SimpleQueue
from types import FrameType
from typing import TYPE_CHECKING, Any

from gaitswarm.services.optimizer.analysis.reference import note_reference
from gaitswarm.services.optimizer.errors import EvaluatorUnavailable, InvalidRequest
from gaitswarm.services.optimizer.jobs.job import QUARANTINE_AFTER
from gaitswarm.services.optimizer.run.evaluator import (
    EvaluationRequest,
    Evaluator,
    OnTask,
    TaskReport,
)
from gaitswarm.services.optimizer.run.runner import Runner, run_embedded
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.store import open_store
from gaitswarm.services.worker import EvaluatorKind
from gaitswarm.sim.outcome import Outcome

if TYPE_CHECKING:
    from gaitswarm.services.monitoring.activity import Activity
    from gaitswarm.services.monitoring.metrics import Metrics
    from gaitswarm.services.worker.dispatch import InProcessEvaluator, Load
    from gaitswarm.services.worker.ray_evaluator import RayEvaluator

_log = logging.getLogger(__name__)


def open_evaluator(
    kind: EvaluatorKind = "auto",
    *,
    address: str | None = None,
    cpus: int | None = None,
    should_stop: Callable[[], bool] = lambda: False,
    lasting: bool = False,
) -> InProcessEvaluator | AutoEvaluator | RayEvaluator:
    from gaitswarm.services.worker.dispatch import InProcessEvaluator  # noqa: PLC0415
    from gaitswarm.services.worker.ray_evaluator import RayEvaluator  # noqa: PLC0415

    check_address(address)
    if kind == "in-process" or (kind == "auto" and address is None and not lasting):
        return InProcessEvaluator(cpus)
    if kind == "auto" and address is None:
        threads = InProcessEvaluator(cpus)
        return AutoEvaluator(threads, RayEvaluator(cpus=threads.slots))
    ray = RayEvaluator(address, cpus=cpus)
    if lasting:
        ray.keep_open()
    else:
        ray.wait_until_open(should_stop)
    return ray


def check_address(address: str | None) -> None:
    """Check the address of a Ray cluster. Raises InvalidRequest."""
    if address is not None and "://" in address:
        raise InvalidRequest(
            f"{address!r} is not the address of a cluster's head: Ray Client is not supported, as"
            " it loses its tasks with its connection; use HOST:6379, or auto on a node",
            field="ray_address",
        )


class AutoEvaluator:
    """`Evaluator` of servers and runners: threads until a local Ray is open, or if it is lost."""

    def __init__(self, threads: InProcessEvaluator, ray: RayEvaluator) -> None:
        self._threads, self._ray = threads, ray
        self._used: InProcessEvaluator | RayEvaluator = threads
        self._without_ray = False

    @property
    def slots(self) -> int:
        return self._threads.slots

    @property
    def place(self) -> str:
        return self._used.place

    @property
    def loads(self) -> dict[str, Load]:
        return self._threads.loads | self._ray.loads

    @property
    def on_ray(self) -> bool:
        """Whether the next request runs on Ray."""
        if self._without_ray:
            return False
        try:
            return self._ray.is_open()
        except EvaluatorUnavailable as error:
            self._without_ray = True
            _log.warning("%s; simulations continue in threads", error)
            return False

    def evaluate(
        self, request: EvaluationRequest, should_stop: Callable[[], bool]
    ) -> tuple[Outcome, ...]:
        self._used = self._ray if self.on_ray else self._threads
        return self._used.evaluate(request, should_stop)

    def close(self) -> None:
        """End Ray and the threads. Idempotent."""
        self._without_ray = True
        self._threads.close()
        self._ray.close()


Observe = Callable[[EvaluationRequest], AbstractContextManager[OnTask]]
"""Observes one evaluation, and each of its tasks by the function in the block."""


class ObservedEvaluator:
    """An evaluator whose evaluations are observed."""

    def __init__(self, inner: Evaluator, observe: Observe) -> None:
        self._inner = inner
        self._observe = observe
        self.close = inner.close

    @property
    def slots(self) -> int:
        return self._inner.slots

    @property
    def place(self) -> str | None:
        place: str | None = getattr(self._inner, "place", None)
        return place

    def evaluate(
        self, request: EvaluationRequest, should_stop: Callable[[], bool]
    ) -> tuple[Outcome, ...]:
        with self._observe(request) as observe_task:

            def on_task(report: TaskReport) -> None:
                observe_task(report)
                if request.on_task is not None:
                    request.on_task(report)

            return self._inner.evaluate(replace(request, on_task=on_task), should_stop)


@dataclass(frozen=True, slots=True)
class Runtime:
    """An opened runtime."""

    service: JobService
    evaluator: Evaluator | None  # None in a process that runs no jobs
    runner: Runner | None  # None in a process that runs no jobs

    @property
    def slots(self) -> int:
        """Number of tasks that run concurrently; 0 without workers."""
        if self.evaluator is None or self.workers_trouble() is not None:
            return 0
        return self.evaluator.slots

    def workers_trouble(self) -> str | None:
        """Why designs cannot be evaluated now; None if they can or it is unknown."""
        trouble: Callable[[], str | None] | None = getattr(self.evaluator, "trouble", None)
        return None if trouble is None else trouble()


@contextmanager
def open_runtime(
    database: str,
    *,
    evaluator: EvaluatorKind | None = "auto",
    ray_address: str | None = None,
    cpus: int | None = None,
    concurrent_jobs: int = 2,
    lease_seconds: float = 30.0,
    cache: bool = False,
    quarantine_after: int = QUARANTINE_AFTER,
    longest_job: float = math.inf,
    housekeeping: bool = False,
    retention_days: float | None = None,
    audit_days: float | None = None,
    longest_fork: float = math.inf,
    longest_reference: float = math.inf,
    metrics: Metrics | None = None,
    webhook_hosts: Collection[str] = (),
    webhook_secret: str | None = None,
    activity: Activity | None = None,
) -> Iterator[Runtime]:
    """Open a database and run its queued jobs inside the block."""
    with ExitStack() as stack:
        store = open_store(database)
        stack.callback(store.close)
        if metrics is not None:
            store.observers.append(metrics)
        if webhook_hosts:
            from gaitswarm.services.monitoring.webhooks import Notifier  # noqa: PLC0415

            notifier = Notifier(store, webhook_hosts, webhook_secret)
            stack.callback(notifier.stop)
            notifier.start()
        service = JobService(
            store,
            longest_job=longest_job,
            longest_fork=longest_fork,
            longest_reference=longest_reference,
        )
        if housekeeping:
            from gaitswarm.services.optimizer.store.maintenance import Housekeeping  # noqa: PLC0415

            housekeeper = Housekeeping(store, retention_days, audit_days)
            housekeeper.start()
            stack.callback(housekeeper.stop)
        if evaluator is None:
            yield Runtime(service, None, None)
            return
        workers = open_evaluator(
            evaluator,
            address=ray_address,
            cpus=cpus,
            lasting=True,
        )
        stack.callback(workers.close)
        if metrics is not None:
            from gaitswarm.services.monitoring.metrics import WorkersCollector  # noqa: PLC0415

            metrics.registry.register(WorkersCollector(lambda: workers.loads))
        watched: Evaluator = workers
        if activity is not None:
            stack.enter_context(activity.recorded_log())
            watched = ObservedEvaluator(watched, activity.observed)
        runner = Runner(
            store,
            watched,
            concurrency=concurrent_jobs,
            lease_seconds=lease_seconds,
            cache=cache,
            quarantine_after=quarantine_after,
            on_ended=partial(note_reference, store),
        )
        stack.callback(runner.stop)
        runner.start()
        yield Runtime(service, workers, runner)


@contextmanager
def _set_by_signals() -> Iterator[Callable[[threading.Event], None]]:
    """Yield a function with which signal handlers set events safely."""
    events: SimpleQueue[threading.Event | None] = SimpleQueue()

    def set_them() -> None:
        while (event := events.get()) is not None:
            event.set()

    thread = threading.Thread(target=set_them, name="signals", daemon=True)
    thread.start()
    try:
        # Unlike other means to wake a thread, it is reentrant.
        yield events.put
    finally:
        events.put(None)
        thread.join()


@contextmanager
def stop_on_signals(
    stop: threading.Event, at_once: threading.Event | None = None
) -> Iterator[None]:
    """Set events on SIGINT and SIGTERM inside the block. For the main thread only."""
    left = deque(event for event in (stop, at_once) if event is not None)

    def _handle(number: int, _frame: FrameType | None) -> None:
        with suppress(IndexError):
            while (event := left.popleft()).is_set():
                pass
            set_event(event)
            return
        if number == signal.SIGINT:
            raise KeyboardInterrupt

    before: dict[int, Any] = {}
    with _set_by_signals() as set_event:
        try:
            for number in (signal.SIGINT, signal.SIGTERM):
                before[number] = signal.signal(number, _handle)
            yield
        finally:
            for caught, handler in before.items():
                # None: a handler that was not set from Python and cannot be restored.
                if handler is not None:
                    signal.signal(caught, handler)


__all__ = [
    "EvaluatorKind",
    "Runtime",
    "open_evaluator",
    "open_runtime",
    "open_store",
    "run_embedded",
    "stop_on_signals",
]
