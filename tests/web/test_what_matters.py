"""Required scenarios, and robustness of winners by preference."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from playwright.sync_api import expect

from tests.examples.jobs import SMALL_SPEC
from tests.examples.servers import ServerProcess
from tests.web.visit import Visit

pytestmark = pytest.mark.slow


def test_each_scenario_is_left_out_and_the_smallest_set_starts_a_job(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit]
) -> None:
    tolerance = 0.05
    analysis = server.client.get(
        f"/v1/jobs/{finished_job}/scenarios", params={"tolerance": tolerance}
    ).json()
    smallest = analysis["smallest"]
    assert smallest is not None
    page = visit(server.url).go(f"/jobs/{finished_job}/scenarios")
    part = page.get_by_role("region", name="Required scenarios")
    part.get_by_label("Tolerated regret").select_option(str(tolerance))
    expect(part).to_have_attribute("data-smallest", " ".join(smallest["scenarios"]))
    rows = part.locator("[data-left-out]")
    expect(rows).to_have_count(len(analysis["left_out"]))
    for left in analysis["left_out"]:
        winner = f"design {left['family']['iteration']}.{left['family']['particle']}"
        expect(part.locator(f"[data-left-out='{left['scenario']}']")).to_contain_text(winner)
    part.get_by_role("link", name="Start a job with these").click()
    expect(page.locator("[data-custom]")).to_have_count(len(smallest["scenarios"]))


@pytest.mark.thorough("test_each_scenario_is_left_out_and_the_smallest_set_starts_a_job")
def test_a_job_with_one_scenario_has_an_empty_state(
    server: ServerProcess, visit: Callable[..., Visit]
) -> None:
    job_id = server.submit(SMALL_SPEC)
    server.wait_for(job_id, "succeeded")
    page = visit(server.url).go(f"/jobs/{job_id}/scenarios")
    expect(page.get_by_role("heading", name="Only one scenario")).to_be_visible()


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
