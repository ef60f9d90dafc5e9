"""Samples of an exposition by name and labels, and a job that changes metrics"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx2
from prometheus_client.metrics_core import Metric
from prometheus_client.parser import text_string_to_metric_families

from gaitswarm.services.monitoring.metrics import Metrics
from gaitswarm.services.runtime import open_runtime
from tests.examples.servers import Server


@dataclass(frozen=True)
class Scrape:
    """One answer of /metrics."""

    families: tuple[Metric, ...]

    def value(self, name: str, **labels: str) -> float:
        """The one sample of this name and these labels; 0 where there is none."""
        found = [
            sample.value
            for family in self.families
            for sample in family.samples
            if sample.name == name and sample.labels == labels
        ]
        assert len(found) <= 1
        return found[0] if found else 0.0

    def labels(self, name: str) -> list[dict[str, str]]:
        """Labels of all samples of a name."""
        return [
            sample.labels
            for family in self.families
            for sample in family.samples
            if sample.name == name
        ]


def parsed(text: str) -> Scrape:
    """An exposition as Prometheus's own parser reads it."""
    return Scrape(tuple(text_string_to_metric_families(text)))


def scraped(client: httpx2.Client, **options: object) -> Scrape:
    """What /metrics answers."""
    answer = client.get("/metrics", **options)  # type: ignore[arg-type]
    assert answer.status_code == 200, answer.text
    return parsed(answer.text)


def of(metrics: Metrics) -> Scrape:
    """What a process would answer."""
    text, _ = metrics.exposition("")
    return parsed(text.decode())


@contextmanager
def serving(database: Path, **settings: Any) -> Iterator[Server]:
    """A server with a runner, as in `gaitswarm serve`, simulating in threads."""
    metrics = Metrics()
    with open_runtime(str(database), evaluator="in-process", cpus=1, metrics=metrics) as opened:
        server = Server(opened.service, metrics=metrics, **settings)
        try:
            yield server
        finally:
            server.close()
