"""Metrics collected on request: the queue in the database, the workers' load"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, Protocol

from prometheus_client.metrics_core import GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from gaitswarm.services.monitoring.metrics import FAILURE_CAUSES, failure_cause
from gaitswarm.services.optimizer.errors import StoreUnavailable

if TYPE_CHECKING:
    from gaitswarm.services.optimizer.store import Store


class QueueCollector(Collector):
    """Jobs of a database, counted at each request for metrics.

    While the database is unavailable, the counts are missing and `gaitswarm_database_up` is 0.
    """

    def __init__(self, store: Callable[[], Store]) -> None:
        self._store = store

    def describe(self) -> list[Metric]:
        """Nothing, so that registering a collector needs no database."""
        return []

    def collect(self) -> Iterator[Metric]:
        name, text = "gaitswarm_database_up", "Whether the database answers: 1 or 0"
        try:
            queue = self._store().queue()
        except StoreUnavailable:
            yield _gauge(name, text, {(): 0})
            return
        causes = Counter(map(failure_cause, queue.errors))
        yield _gauge(name, text, {(): 1})
        by_state = {(state,): count for state, count in queue.jobs.items()}
        yield _gauge("gaitswarm_jobs", "Jobs in the database", by_state, "state")
        labels = ("state", "kind")
        yield _gauge("gaitswarm_queue_jobs", "Jobs that have not ended", queue.under_way, *labels)
        yield _gauge(
            "gaitswarm_failed_jobs",
            "Jobs in the database that have failed",
            {(cause,): causes[cause] for cause in FAILURE_CAUSES},
            "cause",
        )
        yield _gauge(
            "gaitswarm_queue_longest_wait_seconds",
            "Longest time that a queued job has waited for a runner",
            {(): queue.longest_wait},
        )


def _gauge(name: str, text: str, samples: Mapping[Any, float], *labels: str) -> GaugeMetricFamily:
    """Return a metric; samples: values by tuples of labels."""
    metric = GaugeMetricFamily(name, text, labels=labels)
    for values, sample in samples.items():
        metric.add_metric(values, sample)
    return metric


class WorkerLoad(Protocol):
    """Load of the workers of one kind."""

    @property
    def slots(self) -> int:
        """Number of tasks that can run concurrently."""

    @property
    def used(self) -> int:
        """Slots in use."""

    @property
    def waiting(self) -> int:
        """Tasks waiting for a slot."""


class WorkersCollector(Collector):
    """Slots and queues of the workers at each request for metrics."""

    def __init__(self, loads: Callable[[], Mapping[str, WorkerLoad]]) -> None:
        self._loads = loads

    def collect(self) -> Iterator[Metric]:
        loads = self._loads()
        for name, text, attribute in (
            ("slots", "Tasks that can run concurrently", "slots"),
            ("slots_used", "Slots in use", "used"),
            ("tasks_waiting", "Tasks waiting for a slot", "waiting"),
        ):
            samples = {(worker,): getattr(load, attribute) for worker, load in loads.items()}
            yield _gauge(f"gaitswarm_worker_{name}", text, samples, "workers")
