"""A thousand jobs, and one of a hundred thousand evaluations."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import expect

from benchmarks.large_store import PARTICLES, fill
from services.runtime import open_store
from tests.examples.servers import ServerProcess
from tests.web.job_page import wait_for_iteration
from tests.web.visit import Visit

pytestmark = pytest.mark.slow

JOBS = 1000
ITERATIONS = 4000

FIRST_VIEW_BYTES = 120_000


@pytest.fixture(scope="module")
def database(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("large") / "jobs.db"


@pytest.fixture(scope="module")
def long_job(database: Path) -> str:
    store = open_store(str(database))
    job_id = fill(store, jobs=JOBS, iterations=ITERATIONS)
    store.close()
    return job_id


@pytest.fixture(scope="module")
def large_server(long_job: str, database: Path) -> Iterator[ServerProcess]:
    server = ServerProcess(database, "--no-runner")
    yield server
    server.close()


@pytest.mark.timeout(600)
def test_the_first_view_of_the_list_is_small(
    large_server: ServerProcess, visit: Callable[..., Visit]
) -> None:
    visited = visit(large_server.url)
    page = visited.go("/")
    expect(page.locator("[data-job]").first).to_be_visible()

    assert visited.received() <= FIRST_VIEW_BYTES
    assert largest_asset(visited) < 100_000
    expect(page.get_by_text("1000 jobs", exact=True)).to_be_visible()
    page.get_by_label("Search by name or id").fill("short 0123")
    expect(page.locator("[data-job]")).to_have_count(1)


@pytest.mark.timeout(600)
def test_the_first_view_of_a_long_job_is_small_and_then_complete(
    large_server: ServerProcess, long_job: str, visit: Callable[..., Visit]
) -> None:
    visited = visit(large_server.url)
    page = visited.go(f"/jobs/{long_job}")
    wait_for_iteration(page, 1)

    # What follows is asked for page by page, while the first one is looked at.
    assert visited.received(without="after=") <= FIRST_VIEW_BYTES
    assert largest_asset(visited) < 100_000
    wait_for_iteration(page, ITERATIONS - 1)
    page.get_by_role("link", name="Variables").click()
    expect(page.locator("[data-selected]")).to_have_attribute(
        "data-selected", str(PARTICLES * ITERATIONS)
    )


def largest_asset(visited: Visit) -> int:
    """[B] as received: the chunk for three dimensions is larger than all others together."""
    return max(
        count
        for url, count in visited.received_by_url.items()
        if urlsplit(url).path.startswith("/assets/")
    )
