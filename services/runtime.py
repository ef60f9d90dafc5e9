"""The composition root: store, evaluator and runner meet here."""

from __future__ import annotations

import math
import signal
import threading
from collections import deque
from collections.abc import Callable, Collection, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from queue import SimpleQueue
from types import FrameType
from typing import TYPE_CHECKING, Any

from gaitswarm.services.optimizer.analysis.reference import note_reference
from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.housekeeping import Housekeeping
from gaitswarm.services.optimizer.jobs.job import QUARANTINE_AFTER
from gaitswarm.services.optimizer.run.embedded import run_embedded
from gaitswarm.services.optimizer.run.evaluator import Evaluator, Watched
from gaitswarm.services.optimizer.run.runner import Runner
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.store.port.base import Store
from gaitswarm.services.optimizer.store.sql_store import open_store
from gaitswarm.services.worker import EvaluatorKind
from gaitswarm.services.worker.hybrid import HybridEvaluator
from gaitswarm.services.worker.in_process import InProcessEvaluator
from gaitswarm.services.worker.ray_evaluator import RayEvaluator

if TYPE_CHECKING:
    from gaitswarm.services.monitoring.activity import Activity
    from gaitswarm.services.monitoring.metrics import Metrics
    from gaitswarm.services.monitoring.tracing import Tracing


def open_evaluator(
    kind: EvaluatorKind = "ray",
    *,
    address: str | None = None,
    cpus: int | None = None,
    should_stop: Callable[[], bool] = lambda: False,
    patient: bool = False,
) -> InProcessEvaluator | HybridEvaluator | RayEvaluator:
    """Open workers for walks."""
    check_address(address)
    if kind == "in-process":
        return InProcessEvaluator(cpus)
    if address is None:
        return HybridEvaluator(cpus)
    cluster = RayEvaluator(address, cpus=cpus)
    if patient:
        cluster.stay_connected(should_stop)
    else:
        cluster.wait_until_open(should_stop)
    return cluster


def check_address(address: str | None) -> None:
    """Check an address of a Ray cluster, before anything is begun with it."""
    if address is not None and "://" in address:
        raise InvalidRequest(
            f"{address!r} is no address of a cluster's head: Ray Client is not used, as it loses"
            " its tasks with its connection; give HOST:6379, or auto on a machine that is a node",
            field="ray_address",
        )


@dataclass(frozen=True, slots=True)
class Runtime:
    """What was opened.

    Attributes:
        service: On the database's jobs.
        evaluator: Where walks run; None in a process that runs no jobs.
        runner: What runs the jobs; None in a process that runs none.
    """

    service: JobService
    evaluator: Evaluator | None
    runner: Runner | None

    @property
    def slots(self) -> int:
        """Tasks that run at the same time; 0 while workers are away, and where there are none."""
        if self.evaluator is None or self.workers_trouble() is not None:
            return 0
        return self.evaluator.slots

    def workers_trouble(self) -> str | None:
        """Why walks cannot be run now; None if they can, or nothing is known against it."""
        watched: object = self.evaluator
        return watched.trouble() if isinstance(watched, Watched) else None


@contextmanager
def open_runtime(
    database: str,
    *,
    evaluator: EvaluatorKind | None = "ray",
    ray_address: str | None = None,
    cpus: int | None = None,
    concurrent_jobs: int = 2,
    lease_seconds: float = 30.0,
    cache: bool = False,
    quarantine_after: int = QUARANTINE_AFTER,
    longest_job: float = math.inf,
    keeps_house: bool = False,
    retention_days: float | None = None,
    audit_days: float | None = None,
    longest_fork: float = math.inf,
    should_stop: Callable[[], bool] = lambda: False,
    metrics: Metrics | None = None,
    tracing: Tracing | None = None,
    webhook_hosts: Collection[str] = (),
    webhook_secret: str | None = None,
    activity: Activity | None = None,
) -> Iterator[Runtime]:
    """Open a database and run its queued jobs until the block is left; then close all."""
    with ExitStack() as stack:
        store: Store = open_store(database)
        stack.callback(store.close)
        if metrics is not None:
            from gaitswarm.services.monitoring.measured_store import measured  # noqa: PLC0415

            store = measured(store, metrics)
        runners_store = store
        if tracing is not None:
            stack.callback(tracing.close)
            runners_store = tracing.traced_store(store)
        if webhook_hosts:
            from gaitswarm.services.monitoring.webhooks import Notifier  # noqa: PLC0415

            notifier = Notifier(store, webhook_hosts, webhook_secret)
            stack.callback(notifier.stop)
            notifier.start()
        service = JobService(store, longest_job=longest_job, longest_fork=longest_fork)
        if keeps_house:
            keeper = Housekeeping(store, retention_days, audit_days)
            keeper.start()
            stack.callback(keeper.stop)
        if evaluator is None:
            yield Runtime(service, None, None)
            return
        workers = open_evaluator(
            evaluator,
            address=ray_address,
            cpus=cpus,
            should_stop=should_stop,
            patient=True,
        )
        stack.callback(workers.close)
        if metrics is not None:
            from gaitswarm.services.monitoring.collectors import WorkersCollector  # noqa: PLC0415

            metrics.registry.register(WorkersCollector(lambda: workers.loads))
        seen: Evaluator = workers
        if activity is not None:
            stack.enter_context(activity.log_kept())
            seen = activity.watched_evaluator(seen)
        runner = Runner(
            runners_store,
            seen if tracing is None else tracing.traced_evaluator(seen),
            concurrency=concurrent_jobs,
            lease_seconds=lease_seconds,
            cache=cache,
            quarantine_after=quarantine_after,
            on_ended=partial(note_reference, runners_store),
        )
        stack.callback(runner.stop)
        runner.start()
        yield Runtime(service, workers, runner)


@contextmanager
def _set_by_signals() -> Iterator[Callable[[threading.Event], None]]:
    """Let handlers of signals set events that their own thread may be waiting for.

    A handler comes upon its thread anywhere, within `Event.wait` as well, which holds the lock
    that `Event.set` takes: the thread would wait for itself, for ever.
    """
    asked: SimpleQueue[threading.Event | None] = SimpleQueue()

    def set_them() -> None:
        while (event := asked.get()) is not None:
            event.set()

    thread = threading.Thread(target=set_them, name="signals", daemon=True)
    thread.start()
    try:
        # Unlike all else that wakes a thread, it may be interrupted by another call of itself.
        yield asked.put
    finally:
        asked.put(None)
        thread.join()


@contextmanager
def stop_on_signals(
    stop: threading.Event, at_once: threading.Event | None = None
) -> Iterator[None]:
    """Let SIGINT and SIGTERM set events inside the block. The main thread's to use.

    A SIGINT when all of them are set raises KeyboardInterrupt, for those who cannot wait.
    """
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
                # None stands for a handler that was not set from Python, which cannot be put back.
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
