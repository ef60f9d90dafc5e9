"""Firmware tab: memory use and download."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Callable

import pytest
from playwright.sync_api import expect

from tests.examples.servers import Server, ServerProcess
from tests.web.conftest import SMALL_JOB
from tests.web.visit import Visit

pytestmark = pytest.mark.slow


def digits(text: str) -> str:
    """Remove grouping spaces."""
    return re.sub(r"\s", "", text)


def grouped(number: int) -> re.Pattern[str]:
    """Pattern of a number with optional grouping spaces."""
    return re.compile(r"\s?".join(str(number)))


def test_memory_use_is_shown_and_firmware_is_downloaded(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit]
) -> None:
    summary = f"/v1/jobs/{finished_job}/firmware/summary"
    memory = server.client.get(summary).json()["memory"]
    page = visit(server.url).go(f"/jobs/{finished_job}")
    page.get_by_role("link", name="Firmware").click()
    table = page.get_by_role("table", name="Memory of a leg's microcontroller")
    tables = table.get_by_role("row", name=re.compile("^Fuzzy tables"))
    expect(tables).to_contain_text(grouped(memory["tables"]))
    limits = table.get_by_role("row", name=re.compile("^MSP430F2618 capacity")).inner_text()
    assert digits(limits).endswith("118784B8192B")
    expect(page.get_by_text("116 kB of flash, 8 kB of RAM")).to_be_visible()
    walks = page.get_by_role("table", name="Trajectories and simulations by scenario")
    expect(walks.get_by_role("rowheader")).to_have_text(["short", "loaded"])

    smaller = server.client.get(summary, params={"table_bits": "8x6"}).json()
    page.get_by_label("Fuzzy table").select_option("8x6")
    expect(page.locator("[data-table-difference]")).to_contain_text("in angular acceleration")
    expect(tables).to_contain_text(grouped(smaller["memory"]["tables"]))

    with page.expect_download() as download:
        page.get_by_role("link", name="Download", exact=True).click()
    assert download.value.suggested_filename == f"{finished_job}-firmware.zip"
    with zipfile.ZipFile(download.value.path()) as archive:
        assert {"Makefile", "tick.c", "law.h"} <= set(archive.namelist())
        assert sum(entry.file_size for entry in archive.infolist()) == sum(
            smaller["files"].values()
        )

    with page.expect_download() as download:
        page.get_by_role("link", name="Download angles").click()
    assert download.value.suggested_filename == f"{finished_job}-trajectories.zip"
    with zipfile.ZipFile(download.value.path()) as archive:
        assert {"short-cycle.csv", "loaded.yaml"} <= set(archive.namelist())


@pytest.mark.thorough("test_a_queued_job_has_no_front, on another tab")
def test_a_job_without_a_winner_has_no_firmware(
    start_server: Callable[..., Server], visit: Callable[..., Visit]
) -> None:
    server = start_server()
    page = visit(server.url).go(f"/jobs/{server.submit(SMALL_JOB)}/firmware")
    expect(page.get_by_role("heading", name="No firmware yet")).to_be_visible()
    expect(page.get_by_role("link", name="Download")).to_have_count(0)


@pytest.mark.thorough("test_an_error_can_be_retried, on another tab")
def test_an_error_is_shown(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit]
) -> None:
    visited = visit(server.url, allowed="status of 503")
    visited.page.route(
        "**/firmware/summary*",
        lambda route: route.fulfill(
            status=503, json={"detail": "the compiler is missing", "errors": []}
        ),
    )
    page = visited.go(f"/jobs/{finished_job}/firmware")
    expect(page.get_by_role("alert")).to_contain_text("The compiler is missing.")
