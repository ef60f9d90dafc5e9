"""Metrics of one process, in a separate registry

Names, units and labels follow Prometheus's conventions: base units, `_total` for counters, and no
label with unbounded values, such as job ids.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from functools import partial
from typing import Final

from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram, ProcessCollector
from prometheus_client.exposition import choose_encoder
from prometheus_client.metrics_core import Metric
from prometheus_client.registry import Collector

from gaitswarm.services.optimizer.jobs.provenance import installed_version
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
"""Fragments of error messages, and the causes that they are counted under."""

FAILURE_CAUSES: Final = (*dict.fromkeys(cause for _, cause in _CAUSES), _OTHER)

_DATABASE_BUCKETS: Final = (0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 5.0, 15.0)
_HTTP_BUCKETS: Final = (0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0)
_LAG_BUCKETS: Final = (0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0, 60.0)
_ITERATION_BUCKETS: Final = (0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0, 60.0, 300.0, 1800.0)


class Metrics:
    """Counters, gauges and histograms of this process. Thread-safe."""

    def __init__(self) -> None:
        self.registry = CollectorRegistry(auto_describe=False)
        registry = self.registry
        counter = partial(Counter, registry=registry)
        histogram = partial(Histogram, registry=registry)
        ProcessCollector(registry=registry)
        Gauge(
            "gaitswarm_build_info",
            "1, with the version of gaitswarm as a label",
            ["version"],
            registry=registry,
        ).labels(installed_version()).set(1)
        self.iterations = counter(
            "gaitswarm_iterations_committed_total", "Committed iterations", ["kind"]
        )
        self.iteration_seconds = histogram(
            "gaitswarm_iteration_evaluation_seconds",
            "Duration of the evaluation of a committed iteration",
            buckets=_ITERATION_BUCKETS,
        )
        self.walks = counter(
            "gaitswarm_walks_total",
            "Simulations run for committed iterations, by status",
            ["status"],
        )
        for status in Status:
            # A series that starts with 0 has a rate from its first increment.
            self.walks.labels(status.label)
        self.simulated_seconds = counter(
            "gaitswarm_simulated_seconds_total", "Simulated time of committed iterations"
        )
        self.jobs_ended = counter(
            "gaitswarm_jobs_ended_total", "Jobs that ended", ["state", "kind"]
        )
        self.job_failures = counter("gaitswarm_job_failures_total", "Jobs that failed", ["cause"])
        for cause in FAILURE_CAUSES:
            self.job_failures.labels(cause)
        self.lease_losses = counter(
            "gaitswarm_lease_losses_total", "Leases that another runner took over from this process"
        )
        self.lease_takeovers = counter(
            "gaitswarm_lease_takeovers_total",
            "Jobs that this process took over from a runner with an expired lease",
        )
        self.database_seconds = histogram(
            "gaitswarm_database_operation_duration_seconds",
            "Duration of a store operation, with all its statements",
            ["operation"],
            buckets=_DATABASE_BUCKETS,
        )
        self.database_errors = counter(
            "gaitswarm_database_errors_total",
            "Store operations that found the database unavailable",
            ["operation"],
        )
        self.streams = Gauge("gaitswarm_event_streams", "Open event streams", registry=registry)
        self.stream_lag = histogram(
            "gaitswarm_event_stream_lag_seconds",
            "Time from the commit of an iteration to its event, on streams open at the commit",
            buckets=_LAG_BUCKETS,
        )
        self.http_requests = counter(
            "gaitswarm_http_requests_total", "Answered requests", ["method", "route", "status"]
        )
        self.http_seconds = histogram(
            "gaitswarm_http_request_duration_seconds",
            "Time from a request to the start of its response",
            ["method", "route"],
            buckets=_HTTP_BUCKETS,
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
        """Return all metrics in the requested format, and its media type."""
        encode, media_type = choose_encoder(accept)
        return encode(_Exposed(self.registry)), media_type


class OpenStream:
    """An open event stream; see `Metrics.open_stream`."""

    def __init__(self, lag: Histogram, opened: datetime) -> None:
        self._lag = lag
        self._opened = opened

    def sent(self, committed_at: datetime) -> None:
        """Record an iteration's event, unless it was committed before the stream was opened."""
        if committed_at >= self._opened:
            self._lag.observe(max(0.0, (datetime.now(UTC) - committed_at).total_seconds()))


def failure_cause(error: str | None) -> str:
    """Return the cause that a job's failure is counted under."""
    return next((cause for words, cause in _CAUSES if words in (error or "")), _OTHER)


class _Exposed(Collector):
    """A registry without creation times, which would double the number of series."""

    def __init__(self, registry: CollectorRegistry) -> None:
        self._registry = registry

    def collect(self) -> Iterator[Metric]:
        for metric in self._registry.collect():
            metric.samples = [s for s in metric.samples if not s.name.endswith("_created")]
            yield metric
