"""Trade-offs tab: Pareto front, and preferences for its designs."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from itertools import product
from typing import Any
from urllib.parse import parse_qs, urlsplit

import pytest
from playwright.sync_api import Locator, Page, expect

from tests.examples.servers import Server, ServerProcess
from tests.web.conftest import SMALL_JOB
from tests.web.visit import Visit

pytestmark = pytest.mark.slow

SCATTER = re.compile("designs of the front by")


def front_of(server: ServerProcess, job_id: str) -> Any:
    return server.client.post(f"/v1/jobs/{job_id}/front", json={}).json()


def place(design: dict[str, Any]) -> str:
    return f"{design['iteration']}.{design['particle']}"


def preference_of(server: ServerProcess, job_id: str, design: dict[str, Any]) -> Any:
    query = {name: design[name] for name in ("iteration", "particle")}
    return server.client.get(f"/v1/jobs/{job_id}/preference-for", params=query).json()


def table(page: Page, name: str) -> Locator:
    return page.get_by_role("table", name=name)


def test_the_front_is_drawn_over_any_two_objectives_chosen_from_and_listed(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit]
) -> None:
    front = front_of(server, finished_job)
    page = visit(server.url).go(f"/jobs/{finished_job}")
    page.get_by_role("link", name="Explore").click()
    page.get_by_role("link", name="Trade-offs").click()
    shown = page.locator("[data-front]")
    expect(shown).to_have_attribute("data-front", str(front["size"]))
    expect(page.get_by_role("img", name=SCATTER)).to_have_attribute(
        "aria-label", re.compile(rf"^{len(front['designs'])} .* time per metre and acceleration$")
    )
    page.get_by_label("Across").select_option("energy")
    expect(page).to_have_url(re.compile("x=energy"))
    expect(page.get_by_role("img", name=SCATTER)).to_have_attribute(
        "aria-label", re.compile("by energy and acceleration$")
    )

    # A click in the chart chooses the nearest design of the front.
    chart = page.get_by_role("img", name=SCATTER)
    chart.scroll_into_view_if_needed()
    box = chart.bounding_box()
    assert box is not None
    selected = page.locator("[data-selected-design]")
    expect(selected).to_have_attribute("data-selected-design", "")
    # There is a design somewhere along these lines.
    for share, step in product((0.3, 0.5, 0.7), range(8, 60)):
        page.mouse.click(box["x"] + box["width"] * step / 60, box["y"] + box["height"] * share)
        if selected.get_attribute("data-selected-design") != "":
            break
    expect(selected, "no click selected a design").not_to_have_attribute("data-selected-design", "")
    assert selected.get_attribute("data-selected-design") in {
        place(design) for design in front["designs"]
    }

    page.get_by_role("button", name=re.compile("^Show as table.*Pareto front")).click()
    rows = table(page, "Designs of the front").locator("tbody tr")
    expect(rows).to_have_count(min(20, len(front["designs"])))
    marked = [design for design in front["designs"] if design["marks"]]
    # Marked designs come first.
    expect(rows.nth(len(marked) - 1)).to_contain_text(re.compile("best|knee|least"))
    listed = table(page, "Designs of the front")
    listed.get_by_role("button", name=re.compile("^energy")).click()
    least = min(design["objectives"]["energy"] for design in front["designs"])
    expect(rows.first).to_contain_text(re.compile("least energy"))
    expect(rows.first).to_contain_text(f"{least:.4g}")
    rows.first.get_by_role("link").click()
    expect(page).to_have_url(re.compile(rf"/walk\?job={finished_job}&iteration="))


@pytest.mark.thorough("test_the_front_is_drawn_over_any_two_objectives_chosen_from_and_listed")
def test_published_designs_are_simulated_on_request_and_listed(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit]
) -> None:
    visited = visit(server.url)
    page = visited.go(f"/jobs/{finished_job}/trade-offs")
    expect(page.get_by_role("img", name=SCATTER)).to_be_visible()
    assert not any("/v1/simulations" in url for url in visited.requested)
    page.get_by_label("published designs").check()
    expect(page).to_have_url(re.compile("published="))
    page.get_by_role("button", name=re.compile("^Show as table.*Pareto front")).click()
    rows = table(page, "Published designs").get_by_role("rowheader")
    expect(rows).to_have_text(["published A", "published B", "published C"])


@pytest.mark.thorough("test_the_front_is_drawn_over_any_two_objectives_chosen_from_and_listed")
def test_winners_by_preference_and_the_hypervolume_are_shown(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit]
) -> None:
    front = front_of(server, finished_job)
    page = visit(server.url).go(f"/jobs/{finished_job}/trade-offs")
    assert {winner["preference"] for winner in front["winners"]} == {"job", "A", "B", "C"}
    for winner in front["winners"]:
        row = page.locator(f"[data-preference='{winner['preference']}']")
        expect(row).to_have_attribute("data-place", place(winner))
        expect(row).to_contain_text("yes" if winner["on_front"] else "dominated by")
    page.get_by_role("button", name=re.compile("^Show as table.*Hypervolume")).click()
    rows = table(page, "Hypervolume by iteration").locator("tbody tr")
    expect(rows).to_have_count(len(front["iterations"]))
    expect(rows.first).to_contain_text(f"{front['hypervolume']:.4g}".rstrip("0"))


def test_the_preference_for_a_design_ranks_the_history_and_starts_a_job(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit]
) -> None:
    front = front_of(server, finished_job)
    best = place(server.job(finished_job)["best"])
    selected = next(
        design
        for design in front["designs"]
        if place(design) != best and preference_of(server, finished_job, design)["wins"]
    )
    expected = preference_of(server, finished_job, selected)["fits"][0]["preference"]
    page = visit(server.url).go(f"/jobs/{finished_job}/trade-offs")
    expect(page.get_by_role("heading", name="No design selected")).to_be_visible()
    page.get_by_role("button", name=re.compile("^Show as table.*Pareto front")).click()
    name = f"design {place(selected)}"
    row = table(page, "Designs of the front").get_by_role("row").filter(has_text=name)
    row.get_by_role("button").click()
    expect(page.locator("[data-wins='true']")).to_contain_text("is the best design of the job")
    assert parse_qs(urlsplit(page.url).query)["design"] == [place(selected)]

    page.get_by_role("link", name="Rank the history with it").click()
    expect(page.locator("[data-winner]")).to_have_attribute("data-winner", place(selected))
    page.go_back()
    page.get_by_role("link", name="Start a job with it").click()
    query = parse_qs(urlsplit(page.url).query)
    assert json.loads(query["preference"][0]) == expected
    expect(
        page.get_by_role("group", name="Preference").get_by_role("button", name="custom")
    ).to_have_attribute("aria-pressed", "true")


@pytest.mark.thorough("test_the_preference_for_a_design_ranks_the_history_and_starts_a_job")
def test_a_missing_design_is_reported(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit]
) -> None:
    page = visit(server.url, allowed="status of 404").go(
        f"/jobs/{finished_job}/trade-offs?design=0.4000"
    )
    notice = page.get_by_role("alert")
    expect(notice).to_contain_text("Could not find a preference.")
    expect(notice).to_contain_text("has no design 0.4000")


def test_a_queued_job_has_no_front(
    start_server: Callable[..., Server], visit: Callable[..., Visit]
) -> None:
    server = start_server()
    page = visit(server.url).go(f"/jobs/{server.submit(SMALL_JOB)}/trade-offs")
    expect(page.get_by_role("heading", name="No front yet")).to_be_visible()
