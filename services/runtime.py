"""The composition root: store, evaluator and runner meet here."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from types import FrameType
from typing import Any, Final

from services.optimizer.errors import Conflict
from services.optimizer.jobs.job import Claim, Job, JobState
from services.optimizer.run.coordinator import Backoff
from services.optimizer.run.evaluator import Evaluator
from services.optimizer.run.runner import (
    OnCommit,
    OnRetry,
    Runner,
    Surroundings,
    run_claim,
    runner_name,
)
from services.optimizer.service import JobService
from services.optimizer.store.base import Store
from services.optimizer.store.sql_store import open_store
from services.worker import EvaluatorKind

EMBEDDED_LEASE_SECONDS: Final = 5.0
"""Short, because a person waits for it when the process before was killed."""

_PATIENCE: Final = 60.0
"""Seconds to wait for a lease that nobody renews; the longest lease in use is shorter."""

_CLAIM_POLL: Final = 0.25


def open_evaluator(
    kind: EvaluatorKind = "ray", *, address: str | None = None, cpus: int | None = None
) -> Evaluator:
    """Workers for walks. Raises EvaluatorUnavailable with what to do.

    address: of a Ray cluster; None starts one that ends with this process.
    cpus: slots to use on this machine; all by default.
    """
    if kind == "in-process":
        from services.worker.in_process import InProcessEvaluator  # noqa: PLC0415 - see below

        return InProcessEvaluator(cpus)
    # Ray takes a second to import, which nobody who does not use it should wait for.
    from services.worker.ray_evaluator import RayEvaluator  # noqa: PLC0415

    return RayEvaluator(address, cpus=cpus)


@dataclass(frozen=True, slots=True)
class Runtime:
    """What was opened. evaluator and runner are None in a process that runs no jobs."""

    service: JobService
    evaluator: Evaluator | None
    runner: Runner | None


@contextmanager
def open_runtime(
    database: str,
    *,
    evaluator: EvaluatorKind | None = "ray",
    ray_address: str | None = None,
    cpus: int | None = None,
    concurrent_jobs: int = 2,
    lease_seconds: float = 30.0,
) -> Iterator[Runtime]:
    """Open a database and run its queued jobs until the block is left; then close all.

    Args:
        database: URL for `open_store`.
        evaluator: Where walks run; None for a process that runs no jobs.
        ray_address: Of a Ray cluster; None starts one that ends with this process.
        cpus: Walks to compute at once on this machine; all of its cores by default.
        concurrent_jobs: Jobs to run at once.
        lease_seconds: After so long without a word from this process another one takes its jobs
            over [s].

    Yields:
        What was opened.

    Raises:
        StoreUnavailable: The database cannot be opened.
        EvaluatorUnavailable: The workers cannot be started or reached.
    """
    with ExitStack() as stack:
        store = open_store(database)
        stack.callback(store.close)
        service = JobService(store)
        if evaluator is None:
            yield Runtime(service, None, None)
            return
        workers = open_evaluator(evaluator, address=ray_address, cpus=cpus)
        stack.callback(workers.close)
        runner = Runner(store, workers, concurrency=concurrent_jobs, lease_seconds=lease_seconds)
        stack.callback(runner.stop)
        runner.start()
        yield Runtime(service, workers, runner)


def run_embedded(
    store: Store,
    evaluator: Evaluator,
    job_id: str,
    *,
    on_commit: OnCommit | None = None,
    on_retry: OnRetry | None = None,
    on_wait: Callable[[str], None] | None = None,
    stop: threading.Event | None = None,
    backoff: Backoff | None = None,
    accepts_changes: bool = False,
) -> Job:
    """Run one job here and now, until it ends or is paused; the job as it is then.

    A job that a killed process held is taken over when its lease has run out. on_wait: called
    once, with the reason, if that must be waited for. stop: when set, the job goes back to the
    queue and the function returns; see `stop_on_signals`. accepts_changes: go on although what its
    numbers depend on has changed, and record it; the job fails otherwise.
    Raises NotFound, and Conflict if the job cannot be run or another process is running it.
    """
    stop = stop or threading.Event()
    claim = _claim(store, job_id, stop, on_wait)
    if claim is None:
        return store.job(job_id)
    around = Surroundings(
        store,
        evaluator,
        lease_seconds=EMBEDDED_LEASE_SECONDS,
        backoff=backoff or Backoff(),
        on_commit=on_commit,
        on_retry=on_retry,
        accepts_changes=accepts_changes,
    )
    return run_claim(claim, around, stop)


@contextmanager
def stop_on_signals(stop: threading.Event) -> Iterator[None]:
    """SIGINT and SIGTERM set `stop` inside the block. The main thread's to use.

    A second SIGINT raises KeyboardInterrupt, for those who cannot wait.
    """

    def _handle(number: int, _frame: FrameType | None) -> None:
        if stop.is_set() and number == signal.SIGINT:
            raise KeyboardInterrupt
        stop.set()

    before: dict[int, Any] = {}
    try:
        for number in (signal.SIGINT, signal.SIGTERM):
            before[number] = signal.signal(number, _handle)
        yield
    finally:
        for caught, handler in before.items():
            # None stands for a handler that was not set from Python, which cannot be put back.
            if handler is not None:
                signal.signal(caught, handler)


def _claim(
    store: Store, job_id: str, stop: threading.Event, on_wait: Callable[[str], None] | None
) -> Claim | None:
    """The job's claim; None if it was stopped before."""
    name = runner_name()
    waited = 0.0
    while not stop.is_set():
        claim = store.claim(name, lease_seconds=EMBEDDED_LEASE_SECONDS, job_id=job_id)
        if claim is not None:
            return claim
        job = store.job(job_id)
        if job.state not in (JobState.QUEUED, JobState.RUNNING, JobState.PAUSING):
            why = f" ({job.error})" if job.error else ""
            raise Conflict(f"job {job_id} is {job.state}{why}; only a queued job can be run")
        if waited == 0.0 and on_wait is not None:
            on_wait("another process runs this job, or was killed while it did")
        if waited >= _PATIENCE:
            raise Conflict(
                f"job {job_id} is being run by another process; watch it, or pause it there first"
            )
        stop.wait(_CLAIM_POLL)
        waited += _CLAIM_POLL
    return None


__all__ = [
    "EvaluatorKind",
    "Runtime",
    "open_evaluator",
    "open_runtime",
    "open_store",
    "run_embedded",
    "stop_on_signals",
]
