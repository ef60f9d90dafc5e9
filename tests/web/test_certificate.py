"""A certificate on the page: its tables, its empty state, and a world that is walked again."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import pytest
from playwright.sync_api import expect

from tests.examples.servers import Server, ServerProcess
from tests.examples.walks import SHORT_WALK, UPHILL_WALK
from tests.web.test_views import TOO_WIDE
from tests.web.visit import Visit

pytestmark = pytest.mark.slow

CERTIFICATE: Final[dict[str, Any]] = {
    "kind": "certificate",
    "name": "two steps in many worlds",
    "controller": "pi",
    "design": {"P": 0.45, "I": 0.1},
    "scenarios": [SHORT_WALK, UPHILL_WALK],
    "variables": ["friction_factor", "efficiency_factor"],
    "worlds": 12,
    "engines": ["mujoco"],
    "optimizer": {"name": "random", "particles": 5},
}


@pytest.fixture(scope="module")
def certificate(server: ServerProcess) -> str:
    """A certificate that the server has run to its end."""
    job_id = server.submit(CERTIFICATE)
    server.wait_for(job_id, "succeeded")
    return job_id


def test_it_has_the_parts_that_make_sense_for_one_design(
    server: ServerProcess, certificate: str, visit: Callable[..., Visit]
) -> None:
    page = visit(server.url).go("/jobs")
    page.get_by_role("link", name="two steps in many worlds").click()
    tabs = page.get_by_role("navigation", name="Parts of the job")
    expect(tabs.get_by_role("link")).to_have_text(
        ["Overview", "Certificate", "Variables", "Iterations", "Activity", "Spec"]
    )
    expect(page.get_by_role("progressbar", name="14 of 14 designs")).to_be_visible()


def test_tables_show_what_the_design_comes_to_and_worlds_are_a_click_away(
    server: ServerProcess, certificate: str, visit: Callable[..., Visit]
) -> None:
    found = server.client.get(f"/v1/jobs/{certificate}/certificate").json()
    page = visit(server.url).go(f"/jobs/{certificate}/certificate")

    expect(page.get_by_role("heading", name="The design in 12 worlds")).to_be_visible()
    table = page.get_by_role("table", name="Utility by scenario")
    expect(table.get_by_role("rowheader")).to_have_text(["short", "uphill", "all"])
    shown = page.locator('[data-scenario="all"] td.numeric').all_inner_texts()
    spread = found["fitness"]
    expected = [spread["nominal"], spread["quantiles"][2], spread["quantiles"][4]]
    assert [float(text) for text in shown[2:5]] == pytest.approx(expected, rel=1e-3)
    expect(page.get_by_role("table", name="Rank correlation")).to_contain_text("efficiency factor")

    worst = found["worst"][0]
    page.get_by_role("link", name=str(worst["world"]), exact=True).click()
    expect(page.get_by_label("Design")).to_be_visible()
    place = f"design {worst['iteration']}.{worst['particle']}"
    expect(page.get_by_text(place).first).to_be_attached()
    objective = page.get_by_role("table", name="Objectives").or_(page.locator("table")).first
    expect(objective).to_be_visible()
    assert f"particle={worst['particle']}" in page.url


def test_what_another_engine_makes_of_it_is_a_table_of_its_own(
    server: ServerProcess, certificate: str, visit: Callable[..., Visit]
) -> None:
    found = server.client.get(f"/v1/jobs/{certificate}/certificate").json()["engines"]["mujoco"]
    page = visit(server.url).go(f"/jobs/{certificate}/certificate")
    expect(page.get_by_role("heading", name="The nominal world in mujoco")).to_be_visible()
    expect(page.locator("[data-engine=mujoco]")).to_contain_text("walks in 2 of 2 scenarios")
    table = page.get_by_role("table", name="Scenarios and objectives in mujoco")
    first = table.locator("tbody tr").first
    # Texts are read at once, whether they are there or not.
    expect(first).to_contain_text("%")
    torque = found["scenarios"]["short"]["objectives"]["torque"]
    shown = first.locator("td.numeric").all_inner_texts()
    assert [float(text) for text in shown[:2]] == pytest.approx(
        [torque["ours"], torque["theirs"]], rel=1e-3
    )
    # By the size of the difference, the greatest first.
    table.get_by_role("button", name="Difference").click()
    expect(table.locator("tbody tr").first).to_be_visible()

    page = visit(server.url).go(f"/walk?job={certificate}&iteration=0&particle=1&scenario=short")
    expect(page.get_by_text("this walk was computed by mujoco")).to_be_visible()


def test_a_certificate_that_waits_says_so(
    start_server: Callable[..., Server], visit: Callable[..., Visit]
) -> None:
    idle = start_server()
    page = visit(idle.url).go(f"/jobs/{idle.submit(CERTIFICATE)}/certificate")
    expect(page.get_by_role("heading", name="No world yet")).to_be_visible()


def test_no_part_has_to_be_scrolled_sideways(
    server: ServerProcess, certificate: str, visit: Callable[..., Visit]
) -> None:
    visited = visit(server.url, viewport={"width": 360, "height": 740})
    for part in ("", "/certificate", "/variables"):
        page = visited.go(f"/jobs/{certificate}{part}")
        page.wait_for_load_state("networkidle")
        expect(page.get_by_role("main").get_by_role("heading", level=2).first).to_be_visible()
        assert page.evaluate(TOO_WIDE) == []
