"""Robustness of winners by preference."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from playwright.sync_api import expect

from tests.examples.servers import ServerProcess
from tests.web.visit import Visit

pytestmark = pytest.mark.slow


@pytest.mark.thorough("simulations of all winners' neighbours")
def test_winners_of_preferences_are_compared_and_simulated_on_request(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit]
) -> None:
    visited = visit(server.url)
    page = visited.go(f"/jobs/{finished_job}/robustness")
    part = page.get_by_role("region", name="Robustness by preference")
    table = part.get_by_role("table", name="Winners under A, B, C and random preferences")
    expect(table).to_be_visible()
    named = " ".join(
        part.locator("[data-wins-under]").evaluate_all("rows => rows.map(r => r.dataset.winsUnder)")
    )
    assert sorted(named.split()) == ["A", "B", "C"]
    expect(table.get_by_text("Robustness index")).to_have_count(0)
    expect(part).to_have_attribute("data-most-robust", "")

    part.get_by_role("button", name="Simulate designs around the winners").click()
    expect(table.get_by_text("Robustness index")).to_be_visible()
    expect(part.get_by_text("The most robust winner is")).to_be_visible()
    first = part.get_attribute("data-most-robust") or ""
    expect(table.get_by_role("row").nth(1)).to_contain_text(f"design {first}")
    table.get_by_role("link", name="rank by it").first.click()
    expect(page.locator("[data-winner]")).to_have_attribute("data-winner", first)
