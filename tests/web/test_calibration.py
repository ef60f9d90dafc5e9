"""Calibration jobs on the page: targets, named choices, and applicable tabs."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any, Final

import pytest
from playwright.sync_api import expect

from tests.examples.servers import ServerProcess
from tests.examples.walks import SHORT_WALK
from tests.web.job_page import choose
from tests.web.test_views import PHONE, TOO_WIDE
from tests.web.visit import Visit

pytestmark = pytest.mark.slow

CALIBRATION: Final[dict[str, Any]] = {
    "kind": "calibration",
    "name": "two laws of friction",
    "walks": [
        {
            "name": "stiff",
            "controller": "pi",
            "design": {"P": 0.45, "I": 0.1},
            "scenarios": [SHORT_WALK],
        }
    ],
    "targets": [
        {"walk": "stiff", "quantity": "speed", "value": 0.15, "tolerance": 0.1},
        {"walk": "stiff", "quantity": "energy", "value": 42.0, "tolerance": 0.2, "use": "predict"},
    ],
    "variables": [
        "battery_voltage",
        {"name": "contact_law", "kind": "categorical", "choices": ["linear_zone", "stick"]},
    ],
    "optimizer": {"particles": 8},
    "iterations": 2,
}


@pytest.fixture(scope="module")
def calibration(server: ServerProcess) -> str:
    """A succeeded calibration."""
    job_id = server.submit(CALIBRATION)
    server.wait_for(job_id, "succeeded")
    return job_id


def test_the_list_shows_its_kind_and_its_page_the_applicable_tabs_and_targets(
    server: ServerProcess, calibration: str, visit: Callable[..., Visit]
) -> None:
    page = visit(server.url).go("/jobs")

    row = page.get_by_role("row").filter(has_text="two laws of friction")
    expect(row).to_contain_text("calibration")
    row.get_by_role("link", name="two laws of friction").click()
    tabs = page.get_by_role("navigation", name="Parts of the job")
    expect(tabs.get_by_role("link")).to_have_text(["Result", "Explore", "Details"])
    best = server.job(calibration)["best"]["design"]["contact_law"]
    expect(page.get_by_role("definition").filter(has_text=best.replace("_", " "))).to_be_visible()

    targets = server.client.get(f"/v1/jobs/{calibration}/targets").json()["targets"]
    rows = [page.locator(f'[data-target="stiff {name}"]') for name in ("speed", "energy")]
    for row, target, use in zip(rows, targets, ("fitted", "predicted"), strict=True):
        expect(row).to_contain_text(use)
        numbers = [
            float(text.replace("\u2212", "-").split("\u00a0")[0].split(" ")[0])
            for text in row.locator("td.numeric:not(.minor)").all_inner_texts()
        ]
        expected = [target["value"], target["simulated"], target["difference"]]
        assert numbers == pytest.approx(expected, rel=1e-2)

    # With a single target, nothing is left to fit.
    page.get_by_label("Predict each target without").select_option("target")
    expect(page.get_by_role("columnheader", name="Left out", exact=True)).to_be_visible()


def test_a_calibration_that_meets_no_target_does_not_look_succeeded(
    server: ServerProcess, visit: Callable[..., Visit]
) -> None:
    far = [{"walk": "stiff", "quantity": "speed", "value": 0.9, "tolerance": 0.01}]
    job_id = server.submit(CALIBRATION | {"targets": far, "name": "too fast", "iterations": 1})
    server.wait_for(job_id, "succeeded")
    page = visit(server.url).go(f"/jobs/{job_id}")
    badge = page.get_by_role("status").locator(".badge")
    expect(badge).to_have_text("0 of 1 targets met")
    expect(badge).to_have_attribute("data-tone", "bad")
    expect(page.get_by_role("heading", name="0 of 1 targets met")).to_be_visible()
    expect(page.get_by_text("succeeded", exact=True)).to_have_count(0)


@pytest.mark.thorough("test_the_list_shows_its_kind_and_its_page_the_applicable_tabs_and_targets")
def test_choices_are_shown_by_name_everywhere(
    server: ServerProcess, calibration: str, visit: Callable[..., Visit]
) -> None:
    page = visit(server.url).go(f"/jobs/{calibration}/parameters")
    choices = page.get_by_role("table", name="Best fitness by choice")
    expect(choices.get_by_role("rowheader")).to_have_text(["linear zone", "stick"])

    page.goto(f"/jobs/{calibration}/variables")
    names = page.get_by_label("contact_law from").locator("option")
    page.get_by_text("Select by numbers").click()
    expect(names).to_have_text(["linear zone", "stick"])
    page.get_by_label("contact_law from").select_option("stick")
    designs = page.get_by_role("table", name="Designs", exact=True)
    expect(designs.get_by_role("cell", name="stick").first).to_be_visible()
    expect(designs.get_by_role("cell", name="linear zone")).to_have_count(0)

    page.goto(f"/jobs/{calibration}/iterations/0")
    particles = page.get_by_role("table", name="Designs of iteration 0")
    expect(particles.get_by_role("row").filter(has_text="linear zone")).not_to_have_count(0)


@pytest.mark.thorough("test_views_are_accessible_at_every_width, with another kind of job")
def test_no_tab_scrolls_horizontally(
    server: ServerProcess, calibration: str, visit: Callable[..., Visit]
) -> None:
    visited = visit(server.url, viewport=PHONE)
    overflows = {}
    for part in ("", "/parameters", "/variables", "/summary"):
        page = visited.go(f"/jobs/{calibration}{part}")
        page.wait_for_load_state("networkidle")
        expect(page.get_by_role("main").get_by_role("heading", level=2).first).to_be_visible()
        if too_wide := page.evaluate(TOO_WIDE):
            overflows[part] = too_wide
    assert overflows == {}


@pytest.mark.thorough("test_a_clone_has_the_same_spec, of another kind of job")
def test_it_is_cloned_as_json(
    server: ServerProcess, calibration: str, visit: Callable[..., Visit]
) -> None:
    page = visit(server.url).go(f"/jobs/{calibration}")
    choose(page, "Clone")

    spec = page.get_by_role("textbox", name="Spec as JSON")
    expect(spec).to_have_value(re.compile('"kind": "calibration"'))
