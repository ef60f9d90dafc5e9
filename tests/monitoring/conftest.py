"""A job that walked while its server was scraped."""

from __future__ import annotations

import pytest

from tests.examples.jobs import SMALL_SPEC
from tests.monitoring.scraped import Scrape, scraped, serving


@pytest.fixture(scope="session")
def walked(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Scrape]:
    """A job that was submitted over HTTP and has ended: its id, and the metrics after it."""
    with serving(tmp_path_factory.mktemp("metrics") / "jobs.db") as server:
        job_id = server.client.post("/v1/jobs", json=SMALL_SPEC).json()["id"]
        server.client.get(f"/v1/jobs/{job_id}/events", timeout=120.0)
        server.client.get(f"/v1/nowhere/{job_id}")
        return job_id, scraped(server.client)
