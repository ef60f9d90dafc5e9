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
from typing import TYPE_CHECKING, Any, Final

from gaitswarm.services.optimizer.analysis.reference import note_reference
from gaitswarm.services.optimizer.deletion import Housekeeping
from gaitswarm.services.optimizer.errors import InvalidRequest
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


_NICENESS: Final = 10
"""Of walks beside a server: people wait for its answers."""


def open_evaluator(
    kind: EvaluatorKind = "ray",
    *,
    address: str | None = None,
    cpus: int | None = None,
    should_stop: Callable[[], bool] = lambda: False,
    patient: bool = False,
    niceness: int = 0,
) -> InProcessEvaluator | HybridEvaluator | RayEvaluator:
    """Open workers for walks.

    Args:
        kind: Where walks run.
        address: Of a Ray cluster: `host:port` of its head, of which this machine becomes a node, or
            `auto` where it is one. Without an address, walks run in this process at once, and long
            jobs on a cluster that is started for them and ends with this process.
        cpus: Walks to compute at once on this machine; all of its cores by default.
        should_stop: Polled several times a second while a cluster is connected.
        patient: Whether a cluster that is away is waited for by whoever wants walks of it.
        niceness: Of walks in threads of this process, as for `InProcessEvaluator`.

    Returns:
        The workers; whoever opens them closes them.

    Raises:
        InvalidRequest: The address is one of Ray Client (ray://).
        EvaluatorUnavailable: They cannot be reached, and nobody is patient; says what to do.
        EvaluationStopped: `should_stop` said so.
    """
    check_address(address)
    if kind == "in-process":
        return InProcessEvaluator(cpus, niceness=niceness)
    if address is None:
        return HybridEvaluator(cpus, niceness=niceness)
    cluster = RayEvaluator(address, cpus=cpus)
    if patient:
        cluster.stay_connected(should_stop)
    else:
        cluster.wait_until_open(should_stop)
    return cluster


def check_address(address: str | None) -> None:
    """Check an address of a Ray cluster, before anything is begun with it.

    Args:
        address: As for `open_evaluator`.

    Raises:
        InvalidRequest: It is one of Ray Client (ray://).
    """
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
    """Open a database and run its queued jobs until the block is left; then close all.

    Args:
        database: URL for `open_store`.
        evaluator: Where walks run; None for a process that runs no jobs.
        ray_address: Of a Ray cluster, as for `open_evaluator`; jobs wait for one that is away.
        cpus: Walks to compute at once on this machine; all of its cores by default.
        concurrent_jobs: Jobs to run at once.
        lease_seconds: After so long without a word from this process another one takes its jobs
            over [s].
        cache: Whether a design is walked only if no job has walked it before.
        quarantine_after: A job with which so many runner processes in a row went down fails.
        longest_job: Simulated time of all walks of all designs that a new job may have [s].
        keeps_house: Whether rows of deleted jobs are removed, and jobs that ended long ago.
        retention_days: After so long they did [d]; None: none is deleted.
        audit_days: Older entries of the audit log are removed with them [d]; None: none is.
        longest_fork: Time that bringing a search to where it was may take, for a fork [s].
        should_stop: As for `open_evaluator`.
        metrics: Are told what store, runner and workers do; None: nobody asks.
        tracing: Is told of the jobs that are run, and closed; None: nobody follows them.
        webhook_hosts: Hosts that may be told that jobs have ended; none: nobody is.
        webhook_secret: Signs what they are told.
        activity: Takes note of what happens to the jobs that are run; None: nobody looks at it.

    Yields:
        What was opened.

    Raises:
        InvalidRequest: As for `open_evaluator`.
        StoreUnavailable: The database cannot be opened.
        EvaluationStopped: `should_stop` said so.
    """
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
            niceness=_NICENESS,
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

    Yields:
        What a handler calls with an event: another thread sets it, in the order of the calls.
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

    Args:
        stop: Set by the first signal.
        at_once: Set by the second.

    Yields:
        Nothing.
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
