"""Metrics collected on request: the queue in the database, the workers' load"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Protocol

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
        up = GaugeMetricFamily("gaitswarm_database_up", "Whether the database answers: 1 or 0")
        try:
            queue = self._store().queue()
        except StoreUnavailable:
            up.add_metric([], 0)
            yield up
            return
        up.add_metric([], 1)
        yield up
        by_state = GaugeMetricFamily("gaitswarm_jobs", "Jobs in the database", labels=["state"])
        for state, count in queue.jobs.items():
            by_state.add_metric([state], count)
        yield by_state
        by_kind = GaugeMetricFamily(
            "gaitswarm_queue_jobs", "Jobs that have not ended", labels=["state", "kind"]
        )
        for (state, kind), count in queue.under_way.items():
            by_kind.add_metric([state, kind], count)
        yield by_kind
        failed = GaugeMetricFamily(
            "gaitswarm_failed_jobs", "Jobs in the database that have failed", labels=["cause"]
        )
        causes = Counter(map(failure_cause, queue.errors))
        for cause in FAILURE_CAUSES:
            failed.add_metric([cause], causes[cause])
        yield failed
        wait = GaugeMetricFamily(
            "gaitswarm_queue_longest_wait_seconds",
            "Longest time that a queued job has waited for a runner",
        )
        wait.add_metric([], queue.longest_wait)
        yield wait


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
        slots = GaugeMetricFamily(
            "gaitswarm_worker_slots", "Tasks that can run concurrently", labels=["workers"]
        )
        used = GaugeMetricFamily("gaitswarm_worker_slots_used", "Slots in use", labels=["workers"])
        waiting = GaugeMetricFamily(
            "gaitswarm_worker_tasks_waiting", "Tasks waiting for a slot", labels=["workers"]
        )
        for name, load in self._loads().items():
            slots.add_metric([name], load.slots)
            used.add_metric([name], load.used)
            waiting.add_metric([name], load.waiting)
        yield from (slots, used, waiting)
