"""List of many jobs, and comparison of jobs."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest
from playwright.sync_api import Page, expect

from tests.examples.servers import Server, ServerProcess
from tests.web.conftest import SMALL_JOB
from tests.web.job_page import choose
from tests.web.test_certificate import CERTIFICATE
from tests.web.test_views import AXE, RUN_AXE
from tests.web.visit import Visit, show_tab_again

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def two_jobs(server: ServerProcess, finished_job: str) -> tuple[str, str]:
    """The finished job, and one with another seed and a smaller budget."""
    other = server.submit(SMALL_JOB | {"name": "other", "seed": 6, "iterations": 3})
    server.wait_for(other, "succeeded")
    return finished_job, other


def rows(page: Page) -> list[str]:
    listed = page.locator("[data-job]")
    return [row.get_attribute("data-job") or "" for row in listed.all()]


def test_filters_order_and_search_are_in_the_address_and_saved_as_a_view(
    start_server: Callable[..., Server], visit: Callable[..., Visit]
) -> None:
    server = start_server()
    fuzzy = server.submit(SMALL_JOB)
    pi = server.submit(SMALL_JOB | {"name": "gains", "controller": "pi", "preference": "B"})
    # The content security policy would block the injected checker.
    page = visit(server.url, bypass_csp=True).go("/jobs")
    expect(page.get_by_text("2 jobs", exact=True)).to_be_visible()
    page.get_by_label("Controller", exact=True).select_option("pi")
    expect(page).to_have_url(re.compile("controller=pi"))
    expect(page.locator("[data-job]")).to_have_count(1)
    assert rows(page) == [pi]
    page.reload()
    expect(page.get_by_text("1 job", exact=True)).to_be_visible()
    page.get_by_label("Preference", exact=True).select_option("A")
    page.get_by_role("button", name="Show all jobs").click()
    expect(page.locator("[data-job]")).to_have_count(2)
    page.get_by_label("Order").select_option("name")
    expect(page.locator("[data-job]").first).to_have_attribute("data-job", pi)
    page.get_by_role("button", name="Name").click()
    expect(page).to_have_url(re.compile("order=name&reverse"))
    expect(page.locator("[data-job]").first).to_have_attribute("data-job", fuzzy)
    expect(page.locator("th[aria-sort]")).to_have_attribute("aria-sort", "descending")
    page.get_by_label("Search by name, id, note or tag").fill(fuzzy)
    expect(page.locator("[data-job]")).to_have_count(1)

    views = page.get_by_role("navigation", name="Saved views")
    views.get_by_label("Name of the view").fill("found")
    page.keyboard.press("Enter")
    link = views.get_by_role("link", name="found")
    expect(link).to_have_attribute("aria-current", "page")
    expect(views.get_by_role("button", name="Save view")).to_have_count(0)
    page.add_script_tag(path=AXE)
    assert page.evaluate(RUN_AXE.replace("document,", "'nav[aria-label=\"Saved views\"]',")) == []

    page.goto("/jobs")
    expect(page.locator("[data-job]")).to_have_count(2)
    link.click()
    expect(page).to_have_url(re.compile(f"order=name&reverse=.*search={fuzzy}$"))
    expect(page.locator("[data-job]")).to_have_count(1)
    page.get_by_role("button", name="Remove view found").press("Enter")
    expect(link).to_have_count(0)
    page.goto("/jobs")
    expect(page.locator("[data-job]")).to_have_count(2)
    expect(views).to_have_count(0)


def test_several_jobs_are_deleted_and_restored_and_refusals_explained(
    start_server: Callable[..., Server], visit: Callable[..., Visit]
) -> None:
    server = start_server()
    named = {name: server.submit(SMALL_JOB | {"name": name}) for name in ("one", "two", "kept")}
    queued = server.submit(SMALL_JOB | {"name": "queued"})
    for job_id in named.values():
        server.client.post(f"/v1/jobs/{job_id}/cancel").raise_for_status()
    server.client.put(f"/v1/jobs/{named['kept']}/keep").raise_for_status()
    page = visit(server.url, allowed="status of 409").go("/jobs")
    for job_id in (*named.values(), queued):
        page.locator(f"[data-job='{job_id}']").get_by_role("checkbox").check()
    page.get_by_role("button", name="Delete").click()
    note = page.get_by_role("status").filter(has_text="2 jobs deleted; 2 jobs not deleted.")
    expect(note).to_contain_text(f"{named['kept']}: cannot delete a job that is kept")
    expect(note).to_contain_text(f"{queued}: cannot delete a job that is queued; cancel it first")
    expect(page.locator("[data-job]")).to_have_count(2)
    assert rows(page) == [queued, named["kept"]]
    note.get_by_role("button", name="Undo").click()
    expect(page.locator("[data-job]")).to_have_count(4)


def test_paging_and_selection_reach_every_job(
    start_server: Callable[..., Server], visit: Callable[..., Visit]
) -> None:
    server = start_server()
    ids = [server.submit(SMALL_JOB | {"name": f"job {k}"}) for k in range(53)]
    page = visit(server.url).go("/jobs")
    expect(page.get_by_text("53 jobs", exact=True)).to_be_visible()
    expect(page.locator("[data-job]")).to_have_count(50)
    page.get_by_role("button", name="Next").click()
    expect(page.locator("[data-job]")).to_have_count(3)
    assert rows(page) == ids[2::-1]
    expect(page.get_by_text("page 2", exact=True)).to_be_visible()
    # Page and selection are in the address: Back and reload restore both.
    page.locator(f"[data-job='{ids[1]}']").get_by_role("checkbox").check()
    page.get_by_role("link", name="job 0", exact=True).click()
    expect(page).to_have_url(re.compile(f"/jobs/{ids[0]}$"))
    page.go_back()
    expect(page.locator("[data-job]")).to_have_count(3)
    page.reload()
    expect(page.locator("[data-job]")).to_have_count(3)
    expect(page.locator("[data-selected-jobs='1']")).to_be_visible()
    page.get_by_role("button", name="Previous").click()
    expect(page.locator("[data-job]")).to_have_count(50)
    page.go_back()
    expect(page.locator("[data-job]")).to_have_count(3)
    # Another order starts at the first page.
    page.get_by_label("Order").select_option("name")
    expect(page.locator("[data-job]")).to_have_count(50)

    page.get_by_label("Select the jobs of this page").check()
    expect(page.locator("[data-selected-jobs='50']")).to_be_visible()
    page.get_by_role("button", name="Select all pages").click()
    expect(page.locator("[data-selected-jobs='53']")).to_be_visible()
    page.get_by_role("link", name="Compare the first 12").click()
    expect(page.locator("[data-compared]")).to_have_count(12)


def test_selected_jobs_are_compared(
    server: ServerProcess, two_jobs: tuple[str, str], visit: Callable[..., Visit]
) -> None:
    page = visit(server.url).go("/jobs?order=name")
    expect(page.locator(f"[data-job='{two_jobs[0]}'] .sparkline polyline")).to_be_attached()
    for job_id in two_jobs:
        page.locator(f"[data-job='{job_id}']").get_by_role("checkbox").check()
    page.get_by_role("link", name="Compare").click()
    expect(page).to_have_url(re.compile(f"/compare.jobs={two_jobs[0]},{two_jobs[1]}$"))
    expect(page.locator("[data-compared]")).to_have_count(2)
    outcomes = page.get_by_role("table", name="Outcomes of the jobs")
    jobs = [server.job(job_id) for job_id in two_jobs]
    loaded = [job["best"]["scenarios"]["loaded"]["objectives"] for job in jobs]
    page.get_by_label("Scenario").select_option("loaded")
    energies = outcomes.locator("[data-quantity='energy'] td")
    expect(energies.nth(0)).to_contain_text(f"{loaded[0]['energy']:.3g}")
    winner = min((0, 1), key=lambda k: loaded[k]["energy"])
    expect(energies.nth(winner).locator("[data-best]")).to_be_visible()
    fastest = min((0, 1), key=lambda k: loaded[k]["reciprocal_speed"])
    speeds = outcomes.locator("[data-quantity='speed'] td")
    expect(speeds.nth(fastest).locator("[data-best]")).to_be_visible()
    page.get_by_role("button", name="Simulate the walks").click()
    expect(page.locator("[data-walk] canvas")).to_have_count(2)
    differences = page.get_by_role("table", name="Differences between specs")
    fields = differences.get_by_role("rowheader")
    expect(fields).to_have_text(["iterations", "seed"])
    published = server.job(two_jobs[0])["reference"]
    lines = page.get_by_role("img", name=re.compile("^Convergence of 2"))
    expect(lines).to_have_attribute(
        "aria-label", re.compile(f"; published A {published['fitness']:#.4g}$")
    )
    first = page.locator(f"[data-compared='{two_jobs[0]}']")
    expect(first).to_contain_text("% over A")
    # Links reproduce zoom and scale.
    page.get_by_label("logarithmic").uncheck()
    plot = page.locator(".uplot").first
    with_zoom = f"{page.url}&log=no&zoom=1:2"
    expect(page).to_have_url(re.compile("log=no$"))
    page.goto(with_zoom)
    expect(plot).to_have_attribute("data-range", "1 2")
    expect(page.get_by_label("logarithmic")).not_to_be_checked()
    page.get_by_label(re.compile("^By")).select_option("seconds")
    expect(page).to_have_url(re.compile("by=seconds"))
    expect(
        page.get_by_role("img", name="Convergence of 2 jobs by time of evaluation")
    ).to_be_visible()
    page.get_by_role("button", name=re.compile("^Show as table.*Distribution")).click()
    shares = page.get_by_role("table", name="Fitness by share of the designs")
    expect(shares.locator("tbody tr")).to_have_count(7)
    best = server.job(two_jobs[0])["best_fitness"]
    expect(shares.locator("tbody tr").first).to_contain_text(f"{best:.3f}"[:5])


@pytest.mark.thorough("test_selected_jobs_are_compared")
def test_a_comparison_follows_its_jobs(
    start_server: Callable[..., Server], visit: Callable[..., Visit]
) -> None:
    server = start_server()
    job_id = server.submit(SMALL_JOB)
    page = visit(server.url).go(f"/compare?jobs={job_id}")
    expect(page).to_have_title("small · 1 running · compared · gaitswarm")
    compared = page.locator(f"[data-compared='{job_id}']")
    expect(compared).to_contain_text("queued")

    server.client.post(f"/v1/jobs/{job_id}/cancel")

    show_tab_again(page)
    expect(compared).to_contain_text("cancelled")
    expect(page).to_have_title("small · compared · gaitswarm")


@pytest.mark.thorough("test_an_error_can_be_retried, of a comparison")
def test_errors_of_a_comparison_are_shown(
    server: ServerProcess, visit: Callable[..., Visit]
) -> None:
    page = visit(server.url).go("/compare")
    expect(page.get_by_role("heading", name="No jobs selected")).to_be_visible()
    page = visit(server.url, allowed="status of 404").go("/compare?jobs=aaaaaaaaaaaa")
    expect(page.get_by_role("heading", name="None of these jobs exists")).to_be_visible()


def test_a_job_is_labelled_and_archived_which_can_be_undone(
    start_server: Callable[..., Server], visit: Callable[..., Visit]
) -> None:
    server = start_server()
    job_id, other = server.submit(SMALL_JOB), server.submit(SMALL_JOB | {"name": "other"})
    page = visit(server.url).go(f"/jobs/{job_id}")
    choose(page, "Label…")
    page.get_by_label("Name", exact=True).fill("renamed")
    page.get_by_label("Tags, comma-separated").fill("thesis, wide")
    page.get_by_label("Note", exact=True).fill("P is at its bound")
    page.get_by_role("button", name="Save").click()
    expect(page.get_by_role("heading", name="renamed")).to_be_visible()
    expect(page.locator("[data-labels]")).to_contain_text("thesis · wide")
    page.goto("/jobs")
    row = page.locator(f"[data-job='{job_id}']")
    expect(row).to_contain_text("P is at its bound")
    page.get_by_label("Tag", exact=True).select_option("wide")
    expect(page.locator("[data-job]")).to_have_count(1)
    row.get_by_role("checkbox").check()
    page.get_by_role("button", name="Archive").click()
    expect(page.get_by_text("No matching jobs")).to_be_visible()
    page.get_by_role("button", name="Undo").click()
    expect(row).to_be_visible()
    row.get_by_role("checkbox").check()
    page.get_by_role("button", name="Archive").click()
    page.get_by_role("button", name="Show all jobs").click()
    expect(page.locator("[data-job]")).to_have_count(1)
    assert rows(page) == [other]
    page.get_by_label("archived", exact=True).check()
    expect(row).to_be_visible()


def test_jobs_of_other_kinds_are_not_sorted_by_fitness_and_do_not_end_a_comparison(
    server: ServerProcess, two_jobs: tuple[str, str], visit: Callable[..., Visit]
) -> None:
    certificate = server.submit(CERTIFICATE)
    page = visit(server.url, allowed="status of 404").go("/jobs")
    expect(page.locator(f"[data-job='{certificate}']")).to_be_visible()
    page.get_by_label("Order").select_option("fitness")
    expect(page.locator(f"[data-job='{certificate}']")).to_have_count(0)
    assert set(two_jobs) <= set(rows(page))

    ids = ",".join((*two_jobs, "aaaaaaaaaaaa", certificate))
    page.goto(f"/compare?jobs={ids}")
    expect(page.get_by_text("Not found, perhaps deleted: aaaaaaaaaaaa.")).to_be_visible()
    expect(page.locator("[data-compared]")).to_have_count(3)
    expect(page.get_by_role("table", name="Outcomes").get_by_role("columnheader")).to_have_count(3)
    expect(page.get_by_role("img", name=re.compile("^Convergence of 2 jobs"))).to_be_visible()
    header = page.get_by_role("columnheader", name="Best fitness")
    expect(header.get_by_role("button")).to_have_count(0)
