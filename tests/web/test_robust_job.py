"""Robust jobs: form section and job page."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest
from playwright.sync_api import expect

from tests.examples.jobs import SMALL_SPEC
from tests.examples.servers import Server, ServerProcess
from tests.web.job_page import choose
from tests.web.test_job import fill_in, submitted
from tests.web.visit import Visit

pytestmark = pytest.mark.slow


def test_a_robust_job_is_configured_with_its_cost_in_view(
    start_server: Callable[..., Server], visit: Callable[..., Visit]
) -> None:
    server = start_server()
    page = visit(server.url, allowed="status of 422").go("/jobs/new")
    fill_in(page, "robust", iterations=2)
    walks = page.locator("[data-walks]")
    expect(walks).to_have_attribute("data-walks", "16")
    part = page.get_by_role("region", name="Robustness")
    expect(part.get_by_label(re.compile("^Worlds"))).to_have_count(0)

    part.get_by_role("button", name="many worlds").click()
    expect(part.get_by_text("Every design is simulated 8 times")).to_be_visible()
    expect(walks).to_have_attribute("data-walks", "128")
    worlds = part.get_by_label(re.compile("^Worlds"))
    worlds.fill("3")
    expect(walks).to_have_attribute("data-walks", "48")
    expect(part.get_by_label(re.compile("^Level"))).to_be_visible()
    part.get_by_label(re.compile("^Aggregate")).select_option("worst")
    expect(part.get_by_label(re.compile("^Level"))).to_have_count(0)

    worlds.fill("1000")
    page.get_by_role("button", name="Submit the job").click()
    expect(worlds).to_have_attribute("aria-invalid", "true")
    expect(worlds).to_be_focused()
    expect(part.get_by_text(re.compile("at most 100"))).to_be_visible()
    worlds.fill("2")
    page.get_by_role("button", name="Submit the job").click()

    job_id = submitted(page)
    spec = server.job(job_id)["spec"]
    assert (spec["worlds"]["count"], spec["worlds"]["aggregate"]) == (2, "worst")
    page.goto(f"{server.url}/jobs/{job_id}/summary")
    note = page.locator("[data-worlds='2']")
    expect(note).to_contain_text("Robust job: every design is simulated in 2 worlds")
    expect(note).to_contain_text("The utility of a scenario is the worst over all worlds.")


@pytest.mark.thorough("test_a_clone_has_the_same_spec, of a robust job")
def test_its_page_has_a_row_per_world_and_a_clone_has_the_same_spec(
    server: ServerProcess, visit: Callable[..., Visit]
) -> None:
    ranges = ["friction_factor", "efficiency_factor"]
    job_id = server.submit(SMALL_SPEC | {"worlds": {"count": 2, "ranges": ranges}})
    server.wait_for(job_id, "succeeded")
    page = visit(server.url).go(f"/jobs/{job_id}")
    table = page.get_by_role("table", name="Objectives of the winner by scenario")
    names = ["short.world-0", "short.world-1"]
    expect(table.get_by_role("rowheader")).to_have_text(names)
    page.get_by_role("link", name="Details", exact=True).click()
    note = page.locator("[data-worlds='2']")
    expect(note).to_contain_text("(2 perturbations)")
    expect(note).to_contain_text("the mean of the worst 25 %")

    choose(page, "Clone")
    expect(page.get_by_text("2 perturbations with the ranges of the cloned job")).to_be_visible()
    page.get_by_role("button", name="Submit the job").click()
    assert server.job(submitted(page))["spec"] == server.job(job_id)["spec"]


@pytest.mark.thorough("test_a_robust_job_is_configured_with_its_cost_in_view")
def test_other_jobs_are_not_described_as_robust(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit]
) -> None:
    page = visit(server.url).go(f"/jobs/{finished_job}/summary")
    expect(page.get_by_text("Computing time", exact=True)).to_be_visible()
    assert page.locator("[data-worlds]").count() == 0
