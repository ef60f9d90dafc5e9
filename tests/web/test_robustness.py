"""Robustness tab: index by scenario and variable."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest
from playwright.sync_api import expect

from tests.examples.servers import Server, ServerProcess
from tests.web.conftest import SMALL_JOB
from tests.web.visit import Visit

pytestmark = pytest.mark.slow


def test_the_index_is_drawn_and_listed(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit]
) -> None:
    spec = server.job(finished_job)["spec"]
    request = {name: spec[name] for name in ("robot", "controller", "scenarios", "variables")}
    design = server.job(finished_job)["best"]["design"]
    view = server.client.post(
        "/v1/robustness", json=request | {"design": design, "samples": 128}
    ).json()

    page = visit(server.url).go(f"/jobs/{finished_job}")
    page.get_by_role("link", name="Robustness", exact=True).click()
    shown = page.locator("[data-robustness]")
    expect(shown).to_have_attribute("data-robustness", str(view["index"]["value"]))
    bars = page.locator(".bars").first.get_by_role("listitem")
    expect(bars).to_have_count(3)
    expect(bars.last).to_contain_text("all")
    expect(page.get_by_text("Fixed: FOMF")).to_be_visible()

    page.get_by_role("button", name=re.compile("^Show as table.*Robustness index")).click()
    rows = page.get_by_role("table", name="Robustness index by scenario").get_by_role("row")
    expect(rows).to_have_count(4)
    most = max(view["by_variable"], key=view["by_variable"].get)
    page.get_by_role("button", name=re.compile("^Show as table.*Sensitivity by variable")).click()
    sensitive = page.get_by_role("table", name="Sensitivity by variable").get_by_role("row")
    expect(sensitive.nth(1)).to_contain_text(most)


@pytest.mark.thorough("test_a_queued_job_has_no_front, on another tab")
def test_a_job_without_a_winner_has_no_index(
    start_server: Callable[..., Server], visit: Callable[..., Visit]
) -> None:
    server = start_server()
    job_id = server.submit(SMALL_JOB)
    page = visit(server.url).go(f"/jobs/{job_id}/robustness")
    expect(page.get_by_role("heading", name="No winner yet")).to_be_visible()
