"""The page with a thousand jobs, one of them with a hundred thousand evaluations."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any
from urllib.parse import parse_qs, urlsplit

import pytest
from playwright.sync_api import expect
from sqlalchemy import (
    CTE,
    ColumnElement,
    Connection,
    Integer,
    Table,
    cast,
    func,
    insert,
    literal,
    select,
    true,
    update,
)

from benchmarks.large_store import PARTICLES, fill
from benchmarks.page import measure
from gaitswarm.api.page import PAGE_FOLDER
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.store.engine import Database
from gaitswarm.services.optimizer.store.job_rows import ID_ALPHABET
from gaitswarm.services.optimizer.store.tables import evaluations, iterations, jobs
from gaitswarm.services.runtime import open_store
from tests.examples.servers import Server
from tests.web.job_page import wait_for_iteration
from tests.web.pages import Pages
from tests.web.visit import Visit

pytestmark = pytest.mark.slow

ITERATIONS = 4000

LIST_BYTES, JOB_BYTES = 60_000, 250_000

WRITTEN_SHORT, SHORT_COPIES = 9, 110
WRITTEN_ITERATIONS = 40
"""Written by the store; the remaining rows are copies, which takes a tenth of the time."""


@pytest.fixture(scope="module")
def database(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("large") / "jobs.db"


@pytest.fixture(scope="module")
def long_job(database: Path) -> str:
    with closing(open_store(str(database))) as store:
        job_id = fill(store, jobs=WRITTEN_SHORT + 1, iterations=WRITTEN_ITERATIONS)
    with (
        closing(Database(str(database))) as opened,
        opened.write() as connection,
    ):
        multiply_others(connection, job_id)
        lengthen(connection, job_id)
    return job_id


def lengthen(connection: Connection, job_id: str) -> None:
    """Repeat the iterations of a job."""
    copies = numbers(ITERATIONS // WRITTEN_ITERATIONS - 1)
    for table in (iterations, evaluations):
        later = {"iteration": table.c.iteration + WRITTEN_ITERATIONS * copies.c.n}
        copy_rows(connection, table, table.c.job_id == job_id, copies, later)
    progress = {"iterations": ITERATIONS, "evaluations": ITERATIONS * PARTICLES}
    spec = func.json_set(jobs.c.spec, "$.iterations", ITERATIONS)
    connection.execute(update(jobs).where(jobs.c.id == job_id).values(spec=spec, **progress))


def multiply_others(connection: Connection, job_id: str) -> None:
    """Copy all jobs but one, with other ids and names."""
    copies = numbers(SHORT_COPIES)
    n = copies.c.n
    number = cast(func.substr(jobs.c.spec["name"].as_string(), 7), Integer) + WRITTEN_SHORT * n
    name = func.printf("short %04d", number)
    spec = func.json_set(jobs.c.spec, "$.name", name)
    found_by = {"sort_name": name, "search_text": name}
    changes = {"id": copied_id(jobs.c.id, n), "spec": spec, **found_by}
    copy_rows(connection, jobs, jobs.c.id != job_id, copies, changes)
    for table in (iterations, evaluations):
        changes = {"job_id": copied_id(table.c.job_id, n)}
        copy_rows(connection, table, table.c.job_id != job_id, copies, changes)


def numbers(count: int) -> CTE:
    """1..count in a column `n`."""
    series = select(literal(1).label("n")).cte("copies", recursive=True)
    return series.union_all(select(series.c.n + 1).where(series.c.n < count))


def copied_id(job_id: ColumnElement[str], n: ColumnElement[int]) -> ColumnElement[str]:
    """A distinct valid id with the same prefix."""
    size = len(ID_ALPHABET)
    other = func.instr(ID_ALPHABET, func.substr(job_id, 10, 1)) % size
    letters = [func.substr(ID_ALPHABET, k + 1, 1) for k in (other, n // size, n % size)]
    return func.printf("%.9s%s%s%s", job_id, *letters)


def copy_rows(
    connection: Connection,
    table: Table,
    where: ColumnElement[bool],
    copies: CTE,
    changes: dict[str, ColumnElement[Any]],
) -> None:
    """Insert copies of a table's rows with some columns changed."""
    values = [changes.get(column.name, column) for column in table.columns]
    rows = select(*values).select_from(table.join(copies, true())).where(where)
    connection.execute(insert(table).from_select(table.columns.keys(), rows))


@pytest.fixture(scope="module")
def large_server(long_job: str, database: Path, _chromium: str) -> Iterator[Server]:
    with closing(open_store(str(database))) as store:
        server = Server(JobService(store), page_folder=PAGE_FOLDER)
        yield server
        server.close()


@pytest.mark.timeout(600)
@pytest.mark.thorough("a database of many jobs")
def test_the_first_view_of_the_list_is_small(
    large_server: Server, visit: Callable[..., Visit]
) -> None:
    visited = visit(large_server.url, fresh=True)
    page = visited.go("/")
    expect(page.locator("[data-job]").first).to_be_visible()

    assert visited.received() <= LIST_BYTES
    assert largest_asset(visited) < 100_000
    expect(page.get_by_text("1000 jobs", exact=True)).to_be_visible()
    page.get_by_label("Search by name, id, note or tag").fill("short 0123")
    expect(page.locator("[data-job]")).to_have_count(1)


@pytest.mark.timeout(600)
@pytest.mark.thorough("a long job")
def test_the_first_view_of_a_long_job_is_small_and_then_complete(
    large_server: Server, long_job: str, visit: Callable[..., Visit]
) -> None:
    visited = visit(large_server.url, fresh=True)
    page = visited.go(f"/jobs/{long_job}")
    wait_for_iteration(page, 1)

    # Further pages are loaded in the background.
    expect(page.locator("[data-dots]")).to_be_visible()
    assert visited.received(without="after=") <= JOB_BYTES
    assert largest_asset(visited) < 100_000
    wait_for_iteration(page, ITERATIONS - 1)
    page.get_by_role("link", name="Explore").click()
    # A sample first: all designs are 10 MB.
    expect(page.get_by_text("A sample of")).to_be_visible()
    page.get_by_role("button", name="Load all").click()
    expect(page.locator("[data-selected]")).to_have_attribute(
        "data-selected", str(PARTICLES * ITERATIONS)
    )


@pytest.mark.thorough("the benchmark of the page")
@pytest.mark.timeout(600)
def test_the_benchmark_of_the_page_measures_first_views_and_animations(
    large_server: Server, long_job: str, pages: Pages
) -> None:
    measurements = measure(pages, large_server.url, long_job, rounds=1, steps=6)
    assert len(measurements) == 5
    for numbers in measurements.values():
        if "seconds" in numbers:
            assert numbers["seconds"] > 0.0 and 1.0 < numbers["kilobytes"] < 120.0
        else:
            # Between the first and the last frame of the interaction.
            assert 1000.0 / numbers["longest_ms"] < numbers["per_second"] < 121.0


@pytest.mark.timeout(600)
@pytest.mark.thorough("a database of many jobs")
def test_a_picker_loads_pages_on_demand_and_searches_on_the_server(
    large_server: Server, visit: Callable[..., Visit]
) -> None:
    visited = visit(large_server.url)
    page = visited.go("/controller")
    field = page.get_by_role("combobox", name="Design")
    expect(field).to_have_value("fuzzy-pi: A")

    def job_queries() -> list[dict[str, list[str]]]:
        addresses = map(urlsplit, visited.requested)
        return [parse_qs(address.query) for address in addresses if address.path == "/v1/jobs"]

    assert job_queries() == []
    field.focus()
    field.press("ArrowDown")
    offered = page.get_by_role("group", name="Best of a job").get_by_role("option")
    expect(offered).to_have_count(20)
    page.get_by_role("option", name="Show more").click()
    expect(offered).to_have_count(40)
    field.press("Escape")
    expect(page.get_by_role("listbox")).to_have_count(0)
    expect(field).to_have_value("fuzzy-pi: A")

    query = "state=succeeded&search=short&reverse=true&limit=1"
    [oldest] = large_server.client.get(f"/v1/jobs?{query}").json()["items"]
    field.press_sequentially(oldest["name"])
    expect(offered).to_have_count(1)
    expect(offered).to_have_attribute("aria-selected", "true")
    assert field.get_attribute("aria-activedescendant") == offered.get_attribute("id")
    field.press("Enter")
    expect(page).to_have_url(re.compile(f"job={oldest['id']}"))
    expect(field).to_have_attribute("aria-expanded", "false")
    assert [params["limit"] for params in job_queries()] == [["20"]] * len(job_queries())

    field.press("ArrowDown")
    field.press_sequentially("no such job")
    expect(page.get_by_role("status").get_by_text("No matches.")).to_be_visible()


def largest_asset(visited: Visit) -> int:
    """Size of the largest asset received [B]."""
    return max(
        count
        for url, count in visited.received_by_url.items()
        if urlsplit(url).path.startswith("/assets/")
    )
