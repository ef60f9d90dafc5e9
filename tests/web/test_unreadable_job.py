"""Jobs whose spec the server cannot read."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest
from playwright.sync_api import expect

from tests.examples.servers import Server
from tests.web.conftest import SMALL_JOB
from tests.web.job_page import choose
from tests.web.visit import Visit

pytestmark = pytest.mark.slow


def test_it_is_listed_and_its_page_shows_the_reason(
    start_server: Callable[..., Server], visit: Callable[..., Visit], tmp_path: Path
) -> None:
    server = start_server()
    job_id, readable = server.submit(SMALL_JOB), server.submit(SMALL_JOB)
    with closing(sqlite3.connect(tmp_path / "jobs.db")) as connection, connection:
        connection.execute(
            "UPDATE jobs SET spec = json_set(spec, '$.schema_version', 99) WHERE id = ?", (job_id,)
        )
    page = visit(server.url).go("/jobs")
    for listed in (job_id, readable):
        expect(page.locator(f"[data-job='{listed}']")).to_be_visible()
    page.locator(f"[data-job='{job_id}'] a").click()
    expect(page.get_by_role("alert")).to_contain_text("schema_version")
    expect(page.get_by_role("heading", name="small")).to_be_visible()
    expect(page.get_by_role("navigation", name="Parts of the job")).to_have_count(0)
    choose(page, "Cancel…")
    page.get_by_role("button", name="Cancel the job").click()
    expect(page.get_by_role("status").filter(has_text="cancelled")).to_be_visible()
