"""Metrics of one process, in a registry of their own.

Names, units and labels follow Prometheus's conventions: base units, `_total` for counters, and no
label whose values are without bound, such as ids of jobs.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from typing import Final

from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram, ProcessCollector
from prometheus_client.exposition import choose_encoder
from prometheus_client.metrics_core import Metric
from prometheus_client.registry import Collector

from gaitswarm.sim.outcome import Status

_OTHER: Final = "other"

_CAUSES: Final = (
    ("quarantined", "quarantine"),
    ("died, one after the other, of the same task", "killed_worker"),
    ("the simulation failed", "simulation"),
    ("internal error", "internal"),
    ("the provenance of its results", "provenance"),
    ("what this job's numbers depend on", "provenance"),
)
"""What an error says, and the cause that it is counted under."""

FAILURE_CAUSES: Final = (*dict.fromkeys(cause for _, cause in _CAUSES), _OTHER)
"""What failed jobs are counted under."""

_DATABASE_BUCKETS: Final = (0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 5.0, 15.0)
_HTTP_BUCKETS: Final = (0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0)
_LAG_BUCKETS: Final = (0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0, 60.0)
_ITERATION_BUCKETS: Final = (0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0, 60.0, 300.0, 1800.0)


class Metrics:
    """Counters, gauges and histograms of this process. Thread-safe.

    Attributes:
        registry: With all of them; none of the library's global registries is used.
        iterations: Committed iterations, by kind of job.
        iteration_seconds: How long an iteration's evaluation took [s].
        walks: Walks that were run for committed iterations, by status.
        simulated_seconds: Simulated time of these walks [s].
        jobs_ended: Jobs that ended, by state and kind.
        job_failures: Jobs that failed, by cause.
        lease_losses: Leases that another runner has taken over from this process.
        lease_takeovers: Jobs that this process has taken over from a runner that was not heard of.
        database_seconds: Time of one operation of the store [s], by operation.
        database_errors: Operations that found the database unavailable, by operation.
        streams: Event streams that are open.
        stream_lag: From the commit of an iteration to its event [s].
        http_requests: Requests answered, by method, template of the route and status.
        http_seconds: Time from a request to the beginning of its answer [s], by method and route.
    """

    def __init__(self) -> None:
        self.registry = CollectorRegistry(auto_describe=False)
        registry = self.registry
        ProcessCollector(registry=registry)
        Gauge(
            "gaitswarm_build_info",
            "1, with the version of gaitswarm as a label",
            ["version"],
            registry=registry,
        ).labels(_version()).set(1)
        self.iterations = Counter(
            "gaitswarm_iterations_committed_total",
            "Iterations that were committed",
            ["kind"],
            registry=registry,
        )
        self.iteration_seconds = Histogram(
            "gaitswarm_iteration_evaluation_seconds",
            "Time that the evaluation of a committed iteration took",
            buckets=_ITERATION_BUCKETS,
            registry=registry,
        )
        self.walks = Counter(
            "gaitswarm_walks_total",
            "Walks that were run for committed iterations, by how they ended",
            ["status"],
            registry=registry,
        )
        for status in Status:
            # A series that begins with 0 has a rate from its first increment on.
            self.walks.labels(status.label)
        self.simulated_seconds = Counter(
            "gaitswarm_simulated_seconds_total",
            "Simulated time of the walks of committed iterations",
            registry=registry,
        )
        self.jobs_ended = Counter(
            "gaitswarm_jobs_ended_total", "Jobs that ended", ["state", "kind"], registry=registry
        )
        self.job_failures = Counter(
            "gaitswarm_job_failures_total", "Jobs that failed", ["cause"], registry=registry
        )
        for cause in FAILURE_CAUSES:
            self.job_failures.labels(cause)
        self.lease_losses = Counter(
            "gaitswarm_lease_losses_total",
            "Leases that another runner has taken over from this process",
            registry=registry,
        )
        self.lease_takeovers = Counter(
            "gaitswarm_lease_takeovers_total",
            "Jobs that this process has taken over from a runner that was not heard of",
            registry=registry,
        )
        self.database_seconds = Histogram(
            "gaitswarm_database_operation_duration_seconds",
            "Time of one operation of the store, with all its statements",
            ["operation"],
            buckets=_DATABASE_BUCKETS,
            registry=registry,
        )
        self.database_errors = Counter(
            "gaitswarm_database_errors_total",
            "Operations of the store that found the database unavailable",
            ["operation"],
            registry=registry,
        )
        self.streams = Gauge(
            "gaitswarm_event_streams", "Event streams that are open", registry=registry
        )
        self.stream_lag = Histogram(
            "gaitswarm_event_stream_lag_seconds",
            "Time from the commit of an iteration to its event, on streams open at the commit",
            buckets=_LAG_BUCKETS,
            registry=registry,
        )
        self.http_requests = Counter(
            "gaitswarm_http_requests_total",
            "Requests that were answered",
            ["method", "route", "status"],
            registry=registry,
        )
        self.http_seconds = Histogram(
            "gaitswarm_http_request_duration_seconds",
            "Time from a request to the beginning of its answer",
            ["method", "route"],
            buckets=_HTTP_BUCKETS,
            registry=registry,
        )

    @contextmanager
    def open_stream(self) -> Iterator[OpenStream]:
        """Count an event stream as open inside the block."""
        self.streams.inc()
        try:
            yield OpenStream(self.stream_lag, datetime.now(UTC))
        finally:
            self.streams.dec()

    def exposition(self, accept: str) -> tuple[bytes, str]:
        """Write down all metrics as they are now."""
        encode, media_type = choose_encoder(accept)
        return encode(_Exposed(self.registry)), media_type


class OpenStream:
    """An event stream under way; see `Metrics.open_stream`."""

    def __init__(self, lag: Histogram, opened: datetime) -> None:
        self._lag = lag
        self._opened = opened

    def sent(self, committed_at: datetime) -> None:
        """Note the event of an iteration, unless it was committed before the stream was opened."""
        if committed_at >= self._opened:
            self._lag.observe(max(0.0, (datetime.now(UTC) - committed_at).total_seconds()))


def failure_cause(error: str | None) -> str:
    """Find what a job's failure is counted under."""
    return next((cause for words, cause in _CAUSES if words in (error or "")), _OTHER)


class _Exposed(Collector):
    """A registry without the times at which its series began, which double their number."""

    def __init__(self, registry: CollectorRegistry) -> None:
        self._registry = registry

    def collect(self) -> Iterator[Metric]:
        for metric in self._registry.collect():
            metric.samples = [s for s in metric.samples if not s.name.endswith("_created")]
            yield metric


def _version() -> str:
    """Of the installed package; a bare checkout has none."""
    try:
        return version("gaitswarm")
    except PackageNotFoundError:
        return "0+unknown"
