"""Metrics of one process, its store and its workers, named as Prometheus's conventions say"""

from __future__ import annotations

import collections
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from datetime import UTC, datetime
from functools import partial
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import prometheus_client
from prometheus_client.exposition import choose_encoder
from prometheus_client.metrics_core import GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from gaitswarm.services.optimizer.errors import LeaseLost, StoreUnavailable
from gaitswarm.services.optimizer.jobs.estimate import duration
from gaitswarm.services.optimizer.jobs.iteration import CompletedIteration
from gaitswarm.services.optimizer.jobs.job import Claim, Job, JobState
from gaitswarm.services.optimizer.jobs.provenance import installed_version
from gaitswarm.sim.outcome import Status

if TYPE_CHECKING:
    from gaitswarm.services.optimizer.store import Store
    from gaitswarm.services.worker.dispatch import Load

_NAMESPACE: Final = "gaitswarm"

_OTHER: Final = "other"

_CAUSES: Final = (
    ("quarantined", "quarantine"),
    ("died, one after the other, of the same task", "killed_worker"),
    ("the simulation failed", "simulation"),
    ("internal error", "internal"),
    ("the provenance of its results", "provenance"),
    ("what this job's numbers depend on", "provenance"),
)
"""Fragments of error messages, and the causes that they are counted under."""

FAILURE_CAUSES: Final = (*dict.fromkeys(cause for _, cause in _CAUSES), _OTHER)

_DATABASE_BUCKETS: Final = (0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 5.0, 15.0)
_HTTP_BUCKETS: Final = (0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0)
_LAG_BUCKETS: Final = (0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0, 60.0)
_ITERATION_BUCKETS: Final = (0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0, 60.0, 300.0, 1800.0)

_REMEMBERED_LOSSES: Final = 256
"""Lost leases remembered, so that each is counted once."""


class Metrics:
    """Counters, gauges and histograms of this process, and an `Observer` of stores. Thread-safe."""

    def __init__(self) -> None:
        # Creation times would double the number of series.
        prometheus_client.disable_created_metrics()  # type: ignore[no-untyped-call]
        self._lost: dict[tuple[str, int], None] = {}
        self._lock = threading.Lock()
        self.registry = prometheus_client.CollectorRegistry(auto_describe=False)
        counter = partial(prometheus_client.Counter, namespace=_NAMESPACE, registry=self.registry)
        gauge = partial(prometheus_client.Gauge, namespace=_NAMESPACE, registry=self.registry)
        histogram = partial(
            prometheus_client.Histogram, namespace=_NAMESPACE, registry=self.registry
        )
        prometheus_client.ProcessCollector(registry=self.registry)
        version = gauge("build_info", "1, with the version of gaitswarm as a label", ["version"])
        version.labels(installed_version()).set(1)
        self.iterations = counter("iterations_committed_total", "Committed iterations", ["kind"])
        self.iteration_seconds = histogram(
            "iteration_evaluation_seconds",
            "Duration of the evaluation of a committed iteration",
            buckets=_ITERATION_BUCKETS,
        )
        text = "Simulations run for committed iterations, by status"
        self.walks = counter("walks_total", text, ["status"])
        for status in Status:
            # A series that starts with 0 has a rate from its first increment.
            self.walks.labels(status.label)
        self.simulated_seconds = counter(
            "simulated_seconds_total", "Simulated time of committed iterations"
        )
        self.jobs_ended = counter("jobs_ended_total", "Jobs that ended", ["state", "kind"])
        self.job_failures = counter("job_failures_total", "Jobs that failed", ["cause"])
        for cause in FAILURE_CAUSES:
            self.job_failures.labels(cause)
        self.lease_losses = counter(
            "lease_losses_total", "Leases that another runner took over from this process"
        )
        self.lease_takeovers = counter(
            "lease_takeovers_total",
            "Jobs that this process took over from a runner with an expired lease",
        )
        self.database_seconds = histogram(
            "database_operation_duration_seconds",
            "Duration of a store operation, with all its statements",
            ["operation"],
            buckets=_DATABASE_BUCKETS,
        )
        self.database_errors = counter(
            "database_errors_total",
            "Store operations that found the database unavailable",
            ["operation"],
        )
        self.streams = gauge("event_streams", "Open event streams")
        self.stream_lag = histogram(
            "event_stream_lag_seconds",
            "Time from the commit of an iteration to its event, on streams open at the commit",
            buckets=_LAG_BUCKETS,
        )
        self.http_requests = counter(
            "http_requests_total", "Answered requests", ["method", "route", "status"]
        )
        self.http_seconds = histogram(
            "http_request_duration_seconds",
            "Time from a request to the start of its response",
            ["method", "route"],
            buckets=_HTTP_BUCKETS,
        )

    @contextmanager
    def open_stream(self) -> Iterator[Callable[[datetime], None]]:
        """Count an event stream as open inside the block; yield the observer of its events."""
        opened = datetime.now(UTC)

        def sent(committed_at: datetime) -> None:
            """Record an iteration's event, unless it was committed before the stream was opened."""
            if committed_at >= opened:
                self.stream_lag.observe(
                    max(0.0, (datetime.now(UTC) - committed_at).total_seconds())
                )

        with self.streams.track_inprogress():
            yield sent

    def exposition(self, accept: str) -> tuple[bytes, str]:
        """Return all metrics in the requested format, and its media type."""
        encode, media_type = choose_encoder(accept)
        return encode(self.registry), media_type

    def transaction(self, operation: str, seconds: float, error: BaseException | None) -> None:
        self.database_seconds.labels(operation).observe(seconds)
        if isinstance(error, StoreUnavailable):
            self.database_errors.labels(operation).inc()

    def claimed(self, claim: Claim) -> None:
        if claim.taken_from is not None:
            self.lease_takeovers.inc()

    def committed(self, claim: Claim, done: CompletedIteration, state: JobState) -> None:
        spec = claim.job.spec
        self.iterations.labels(spec.kind).inc()
        self.iteration_seconds.observe(done.evaluate_seconds)
        walked = np.array([key is not None for key in done.keys] or [True] * len(done.fitness))
        statuses = np.concatenate([outcome.statuses[walked] for outcome in done.outcomes])
        designs = int(walked.sum())
        if done.reevaluation is not None:
            statuses = np.concatenate([statuses, np.ravel(done.reevaluation.statuses)])
            designs += 1
        values, counts = np.unique(statuses, return_counts=True)
        for value, count in zip(values.tolist(), counts.tolist(), strict=True):
            self.walks.labels(Status(value).label).inc(count)
        seconds = duration(spec, spec.cases(claim.recordings))
        self.simulated_seconds.inc(designs * seconds)
        if state.terminal:
            self.jobs_ended.labels(state, spec.kind).inc()

    def released(self, claim: Claim, state: JobState, error: str | None) -> None:
        if state is JobState.FAILED:
            self.jobs_ended.labels(state, claim.job.spec.kind).inc()
            self.job_failures.labels(failure_cause(error)).inc()

    def lost(self, claim: Claim, error: LeaseLost) -> None:
        lease = (claim.job.id, claim.token)
        with self._lock:
            if not error.taken_over or lease in self._lost:
                return
            self._lost[lease] = None
            if len(self._lost) > _REMEMBERED_LOSSES:
                del self._lost[next(iter(self._lost))]
        self.lease_losses.inc()

    def cancelled(self, job: Job) -> None:
        kind = job.spec.kind if job.readable else "unknown"
        self.jobs_ended.labels(job.state, kind).inc()


def failure_cause(error: str | None) -> str:
    """Return the cause that a job's failure is counted under."""
    return next((cause for words, cause in _CAUSES if words in (error or "")), _OTHER)


class QueueCollector(Collector):
    """Jobs of a database, counted at each request; without counts while it is unavailable."""

    def __init__(self, store: Callable[[], Store]) -> None:
        self._store = store

    def describe(self) -> list[Metric]:
        """Nothing, so that registering a collector needs no database."""
        return []

    def collect(self) -> Iterator[Metric]:
        name, text = "database_up", "Whether the database answers: 1 or 0"
        try:
            queue = self._store().queue()
        except StoreUnavailable:
            yield _gauge(name, text, {(): 0})
            return
        causes = collections.Counter(map(failure_cause, queue.errors))
        yield _gauge(name, text, {(): 1})
        by_state = {(state,): count for state, count in queue.jobs.items()}
        yield _gauge("jobs", "Jobs in the database", by_state, "state")
        labels = ("state", "kind")
        yield _gauge("queue_jobs", "Jobs that have not ended", queue.under_way, *labels)
        yield _gauge(
            "failed_jobs",
            "Jobs in the database that have failed",
            {(cause,): causes[cause] for cause in FAILURE_CAUSES},
            "cause",
        )
        yield _gauge(
            "queue_longest_wait_seconds",
            "Longest time that a queued job has waited for a runner",
            {(): queue.longest_wait},
        )


def _gauge(name: str, text: str, samples: Mapping[Any, float], *labels: str) -> GaugeMetricFamily:
    """Return a metric; samples: values by tuples of labels."""
    metric = GaugeMetricFamily(f"{_NAMESPACE}_{name}", text, labels=labels)
    for values, sample in samples.items():
        metric.add_metric(values, sample)
    return metric


class WorkersCollector(Collector):
    """Slots and queues of the workers at each request for metrics."""

    def __init__(self, loads: Callable[[], Mapping[str, Load]]) -> None:
        self._loads = loads

    def collect(self) -> Iterator[Metric]:
        loads = self._loads()
        for name, text, attribute in (
            ("slots", "Tasks that can run concurrently", "slots"),
            ("slots_used", "Slots in use", "used"),
            ("tasks_waiting", "Tasks waiting for a slot", "waiting"),
        ):
            samples = {(worker,): getattr(load, attribute) for worker, load in loads.items()}
            yield _gauge(f"worker_{name}", text, samples, "workers")
