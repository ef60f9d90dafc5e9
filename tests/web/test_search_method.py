"""Search methods: choice and settings in the form, display with the job."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest
from playwright.sync_api import Page, expect

from tests.examples.servers import Server, ServerProcess
from tests.web.conftest import SMALL_JOB
from tests.web.job_page import choose, expect_state
from tests.web.test_job import fill_in, submitted
from tests.web.visit import Visit

pytestmark = pytest.mark.slow


def setting(page: Page, name: str) -> object:
    """Value and default of a setting, as shown."""
    row = page.locator(f"tr[data-setting='{name}']")
    return [cell.strip() for cell in row.locator("td").all_text_contents()]


def test_a_method_is_configured_in_the_form_and_shown_with_its_job(
    start_server: Callable[..., Server], visit: Callable[..., Visit]
) -> None:
    server = start_server()
    page = visit(server.url, allowed="status of 422").go("/jobs/new")
    fill_in(page, "differential evolution", iterations=2)
    expect(page.get_by_label(re.compile("^Sigma"))).to_have_value("0.25")
    page.get_by_label("Method").select_option("de")
    expect(page.get_by_label(re.compile("^Sigma"))).to_have_count(0)
    # The number of designs per iteration is kept; other settings belong to the method.
    expect(page.get_by_label(re.compile("^Particles"))).to_have_value("8")

    crossover = page.get_by_label(re.compile("^Crossover"))
    crossover.fill("7")
    page.get_by_role("button", name="Submit the job").click()
    expect(crossover).to_have_attribute("aria-invalid", "true")
    expect(crossover).to_be_focused()
    crossover.fill("0.125")
    expect(page.get_by_text("Default: 0.9.")).to_be_visible()
    page.get_by_role("button", name="Submit the job").click()

    job_id = submitted(page)
    optimizer = server.job(job_id)["spec"]["optimizer"]
    assert (optimizer["name"], optimizer["crossover"]) == ("de", 0.125)
    expect(page.get_by_text(re.compile(r"\bde\b")).first).to_be_visible()
    page.get_by_role("link", name="Details", exact=True).click()
    page.get_by_role("link", name="Spec and evidence", exact=True).click()
    expect(page.get_by_role("heading", name="Search method: de")).to_be_visible()
    expect(page.locator("tr[data-setting='crossover']")).to_have_attribute("data-changed", "true")
    assert setting(page, "crossover") == ["0.125", "0.9"]
    assert setting(page, "memory") == ["10", "the same"]


@pytest.mark.thorough("test_a_method_is_configured_in_the_form_and_shown_with_its_job")
def test_the_budget_of_a_job_with_small_iterations_is_counted_in_designs(
    server: ServerProcess, visit: Callable[..., Visit]
) -> None:
    job_id = server.submit(
        SMALL_JOB
        | {
            "optimizer": {"name": "cma-es", "particles": 5, "population": 4},
            "name": "small iterations",
        }
    )
    job = server.wait_for(job_id, "succeeded")
    assert job["iterations"] > job["iterations_planned"]
    page = visit(server.url).go(f"/jobs/{job_id}")
    expect_state(page, "succeeded")
    evaluations = f"30 evaluations in {job['iterations']} iterations"
    expect(page.get_by_text(evaluations)).to_be_visible()
    expect(page.get_by_role("img", name=re.compile("^Convergence over"))).to_be_visible()

    choose(page, "Extend…")
    expect(page.get_by_text("30 of 30 evaluations are done")).to_be_visible()
    expect(page.get_by_label("Evaluations in total")).to_have_attribute("min", "31")
    page.get_by_role("button", name="Back").click()
    # A fork begins at its end, with as large a budget again.
    choose(page, "Fork…")
    expect(page.get_by_label("First new iteration")).to_have_value(str(job["iterations"]))
    expect(page.get_by_label("Evaluations in total")).to_have_value("60")
    page.get_by_role("button", name="Fork the job").click()
    expect(page).not_to_have_url(re.compile(job_id))
    fork = server.wait_for(page.url.rpartition("/")[2], "succeeded")
    assert fork["evaluations"] == 60
    page.go_back()

    page.get_by_role("link", name="Details", exact=True).click()
    page.get_by_role("link", name="Iterations", exact=True).click()
    rows = page.get_by_role("table", name="Iterations").locator("tbody tr")
    expect(rows).to_have_count(job["iterations"])
    page.get_by_role("link", name="Explore", exact=True).click()
    expect(page.get_by_text("30 of 30 designs selected")).to_be_visible()
    page.goto("/jobs")
    expect(page.get_by_text("30 of 30 evaluations").first).to_be_visible()


@pytest.mark.thorough(
    "test_a_method_is_configured_in_the_form_and_shown_with_its_job, with start designs"
)
def test_a_search_starts_from_the_best_of_a_job(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit]
) -> None:
    page = visit(server.url, allowed="status of 4(04|22)").go(f"/jobs/{finished_job}")
    choose(page, "Start from best design")
    expect(page.locator(f"[data-item='{finished_job}']")).to_contain_text("fitness")
    page.goto(f"{page.url},nosuchjob")
    jobs = page.get_by_label("Best designs of jobs")
    page.get_by_role("button", name="Submit the job").click()
    expect(jobs).to_be_focused()
    expect(page.get_by_text(re.compile("no job 'nosuchjob'")).first).to_be_visible()
    page.get_by_role("button", name="Remove nosuchjob").click()
    page.get_by_role("button", name=f"Remove {finished_job}").click()
    jobs.fill(finished_job)
    page.get_by_role("option", name=re.compile(finished_job)).click()
    expect(jobs).to_have_value("")
    jobs.fill(finished_job)
    expect(page.get_by_text("No matches.")).to_be_visible()
    page.get_by_label("Number of designs").fill("3")
    page.get_by_role("button", name="Submit the job").click()

    job_id = submitted(page)
    start = server.job(job_id)["spec"]["start"]
    assert len(start) == 3
    server.wait_for(job_id, "succeeded")
    expect_state(page, "succeeded")
    page.get_by_role("link", name="Details", exact=True).click()
    expect(page.locator("dl.figures div", has_text="Start designs")).to_be_visible()
    # Their evaluations are reused from the first job.
    saved = server.job(job_id)["evaluations_saved"]
    assert saved >= 3
    expect(page.get_by_text(re.compile(rf"^{saved} \("))).to_be_visible()
    page.get_by_role("link", name="Spec and evidence", exact=True).click()
    rows = page.get_by_role("table", name="Start designs").locator("tbody tr")
    expect(rows).to_have_count(3)

    choose(page, "Clone")
    expect(page.get_by_text("The search starts from 3 start designs")).to_be_visible()
