"""Certificate jobs on the page: tables, empty state, and replay of a world."""

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
    "optimizer": {"name": "random", "particles": 5},
}


@pytest.fixture(scope="module")
def certificate(server: ServerProcess) -> str:
    """A succeeded certificate."""
    job_id = server.submit(CERTIFICATE)
    server.wait_for(job_id, "succeeded")
    return job_id


def test_tables_show_utilities_and_link_to_worlds(
    server: ServerProcess, certificate: str, visit: Callable[..., Visit]
) -> None:
    certificate_view = server.client.get(f"/v1/jobs/{certificate}/certificate").json()
    page = visit(server.url).go("/jobs")
    page.get_by_role("link", name="two steps in many worlds").click()
    tabs = page.get_by_role("navigation", name="Parts of the job")
    expect(tabs.get_by_role("link")).to_have_text(["Result", "Explore", "Details"])
    expect(page.get_by_text("13 evaluations in")).to_be_visible()

    failed = certificate_view["failed"]
    expect(page.locator(f"[data-failed='{failed['count']}']")).to_contain_text("of 12 worlds")
    table = page.get_by_role("table", name="Utility by scenario")
    expect(table.get_by_role("rowheader")).to_have_text(["short", "uphill", "all"])
    shown = page.locator('[data-scenario="all"] td.numeric').all_inner_texts()
    spread = certificate_view["fitness"]
    expected = [spread["nominal"], spread["quantiles"][2], spread["quantiles"][4]]
    assert [float(text) for text in shown[2:5]] == pytest.approx(expected, rel=1e-3)
    expect(page.get_by_role("table", name="Rank correlation")).to_contain_text("efficiency factor")

    worst = certificate_view["worst"][0]
    page.get_by_role("link", name=str(worst["world"]), exact=True).click()
    expect(page.get_by_label("Design")).to_be_visible()
    place = f"design {worst['iteration']}.{worst['particle']}"
    expect(page.get_by_text(place).first).to_be_attached()
    objective = page.get_by_role("table", name="Objectives").or_(page.locator("table")).first
    expect(objective).to_be_visible()
    assert f"particle={worst['particle']}" in page.url


@pytest.mark.thorough("test_tables_show_utilities_and_link_to_worlds")
def test_another_engine_has_a_separate_table(
    server: ServerProcess, visit: Callable[..., Visit]
) -> None:
    certificate = server.submit(CERTIFICATE | {"engines": ["mujoco"]})
    server.wait_for(certificate, "succeeded")
    certificate_view = server.client.get(f"/v1/jobs/{certificate}/certificate").json()["engines"][
        "mujoco"
    ]
    page = visit(server.url).go(f"/jobs/{certificate}")
    expect(page.get_by_role("heading", name="Nominal world in mujoco")).to_be_visible()
    expect(page.locator("[data-engine=mujoco]")).to_contain_text("2 of 2 scenarios succeed")
    table = page.get_by_role("table", name="Scenarios and objectives in mujoco")
    first = table.locator("tbody tr").first
    # Wait for the content: all_inner_texts does not.
    expect(first).to_contain_text("%")
    torque = certificate_view["scenarios"]["short"]["objectives"]["torque"]
    shown = first.locator("td.numeric").all_inner_texts()
    assert [float(text) for text in shown[:2]] == pytest.approx(
        [torque["ours"], torque["theirs"]], rel=1e-3
    )
    # By magnitude of the difference, greatest first.
    table.get_by_role("button", name="Difference").click()
    expect(table.locator("tbody tr").first).to_be_visible()

    page = visit(server.url).go(f"/walk?job={certificate}&iteration=0&particle=1&scenario=short")
    expect(page.get_by_text("this walk was simulated by mujoco")).to_be_visible()


def test_all_perturbations_fit_side_by_side_on_a_laptop(
    server: ServerProcess, visit: Callable[..., Visit]
) -> None:
    every = {
        name: value for name, value in CERTIFICATE.items() if name not in ("variables", "engines")
    }
    job_id = server.submit(every | {"worlds": 4, "scenarios": [SHORT_WALK]})
    server.wait_for(job_id, "succeeded")
    visited = visit(server.url, viewport={"width": 1440, "height": 900})
    page = visited.go(f"/jobs/{job_id}/variables")
    axes = page.locator(".parallel-scroll")
    expect(axes.get_by_role("img")).to_be_visible()
    assert axes.evaluate("box => box.scrollWidth <= box.clientWidth")
    assert axes.locator(".parallel-heads > span").count() > 20


@pytest.mark.thorough("test_a_queued_job_has_no_front, of another kind of job")
def test_a_queued_certificate_has_an_empty_state(
    start_server: Callable[..., Server], visit: Callable[..., Visit]
) -> None:
    idle = start_server()
    page = visit(idle.url).go(f"/jobs/{idle.submit(CERTIFICATE)}")
    expect(page.get_by_role("heading", name="No world yet")).to_be_visible()


@pytest.mark.thorough("test_views_are_accessible_at_every_width, with another kind of job")
def test_no_tab_scrolls_horizontally(
    server: ServerProcess, certificate: str, visit: Callable[..., Visit]
) -> None:
    visited = visit(server.url, viewport={"width": 360, "height": 740})
    for part in ("", "/variables"):
        page = visited.go(f"/jobs/{certificate}{part}")
        page.wait_for_load_state("networkidle")
        expect(page.get_by_role("main").get_by_role("heading", level=2).first).to_be_visible()
        assert page.evaluate(TOO_WIDE) == []
