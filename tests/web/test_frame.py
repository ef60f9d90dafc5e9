"""Skip link, titles, breadcrumbs, and persistent settings of charts and tables."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator

import pytest
from playwright.sync_api import Page, expect

from tests.examples.servers import Server, ServerProcess
from tests.web.conftest import SMALL_JOB
from tests.web.job_page import wait_for_iteration
from tests.web.visit import Visit, show_tab_again

pytestmark = pytest.mark.slow


def test_titles_name_the_content_and_the_skip_link_leads_to_it(
    server: ServerProcess,
    finished_job: str,
    start_server: Callable[..., Server],
    visit: Callable[..., Visit],
) -> None:
    page = visit(server.url).go(f"/jobs/{finished_job}")
    expect(page).to_have_title("small · succeeded · gaitswarm")
    page.get_by_role("link", name="Jobs", exact=True).click()
    expect(page).to_have_title("Jobs · gaitswarm")

    # The skip link skips the header.
    page.goto("/jobs")
    expect(page.get_by_role("heading", name="Jobs", exact=True)).to_be_visible()
    expect(page.locator(f"[data-job='{finished_job}']")).to_be_visible()
    page.keyboard.press("Tab")
    expect(page.get_by_role("link", name="Skip to content")).to_be_focused()
    page.keyboard.press("Enter")
    expect(page).to_have_url(re.compile("#main$"))
    page.keyboard.press("Tab")
    # The focus is in the content, not in the header.
    assert page.evaluate("document.querySelector('main').contains(document.activeElement)")

    waiting = start_server()
    page = visit(waiting.url).go(f"/jobs/{waiting.submit(SMALL_JOB)}")
    expect(page).to_have_title("small · queued 0/48 · gaitswarm")


@pytest.mark.thorough("test_titles_name_the_content_and_the_skip_link_leads_to_it")
def test_titles_and_breadcrumbs_name_the_content(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit]
) -> None:
    visited = visit(server.url)
    job = f"job={finished_job}"
    for path, title, crumbs in (
        (
            f"/walk?{job}&scenario=loaded&against=published:A",
            "Best of small, scenario loaded, compared with Published A, fuzzy-pi · Walk",
            ["All jobs", "small", "Walk of the best"],
        ),
        (
            f"/controller?{job}&iteration=2&particle=3",
            "small, design 2.3 · Controller",
            ["All jobs", "small", "Iterations", "2", "Controller of design 3"],
        ),
        (
            "/controller",
            "Published A, fuzzy-pi · Controller",
            ["Controller", "Published A, fuzzy-pi"],
        ),
        (f"/compare?jobs={finished_job}", "small · compared", ["All jobs", "Compared jobs"]),
        (f"/jobs/new?clone={finished_job}", "New job from small", ["All jobs", "small", "New job"]),
        ("/jobs/new?kind=calibration", "New calibration", ["All jobs", "New calibration"]),
    ):
        page = visited.go(path)
        expect(page).to_have_title(f"{title} · gaitswarm")
        place = page.get_by_role("navigation", name="Breadcrumbs").get_by_role("listitem")
        expect(place).to_have_text(crumbs)


@pytest.fixture
def endless_job(server: ServerProcess) -> Iterator[str]:
    """A job that runs until the end of the test."""
    job_id = server.submit(SMALL_JOB | {"iterations": 5000})
    yield job_id
    server.client.post(f"/v1/jobs/{job_id}/cancel")


@pytest.mark.thorough("test_titles_name_the_content_and_the_skip_link_leads_to_it")
def test_the_title_of_a_walk_shows_the_progress_of_its_job(
    server: ServerProcess, endless_job: str, visit: Callable[..., Visit]
) -> None:
    visited = visit(server.url)
    wait_for_iteration(visited.go(f"/jobs/{endless_job}"), 3)
    page = visited.go(f"/walk?job={endless_job}&scenario=loaded")
    named = "Best of small, scenario loaded"
    expect(page).to_have_title(re.compile(rf"^{named} · running \d+/40000 · Walk · gaitswarm$"))
    before = page.title()

    show_tab_again(page)

    expect(page).not_to_have_title(before)
    assert "running" in page.title()
    server.client.post(f"/v1/jobs/{endless_job}/cancel")
    server.wait_for(endless_job, "cancelled")
    show_tab_again(page)
    expect(page).to_have_title(f"{named} · Walk · gaitswarm")


FROM_ZERO = re.compile("^0 ")
"""Range of an axis that starts at the first iteration."""


DOUBLE_CLICK_WITH_AN_ITERATION = """() => new Promise((done) => {
    const clicked = (_, observer) => {
        observer.disconnect()
        const twice = new MouseEvent('dblclick', { bubbles: true })
        document.querySelector('.u-over').dispatchEvent(twice)
        done()
    }
    const job = document.querySelector('[data-stream]')
    new MutationObserver(clicked).observe(job, { attributeFilter: ['data-iteration'] })
})"""
"""Double-click after the page receives an iteration and before the chart draws it."""


DOUBLE_CLICK_ON_A_NEW_CHART = """() => new Promise((done) => {
    const chart = document.querySelector('.chart-box')
    const drawn = (_, observer) => {
        observer.disconnect()
        Promise.resolve().then(() => {
            const twice = new MouseEvent('dblclick', { bubbles: true })
            chart.querySelector('.u-over').dispatchEvent(twice)
            done()
        })
    }
    new MutationObserver(drawn).observe(chart, { childList: true })
    document.querySelector('.chart-frame input[type=checkbox]:checked').click()
})"""
"""Double-click right after the chart was recreated, by a change of its scale."""


def chart_range(page: Page) -> list[float]:
    """Range of the x axis of the first chart."""
    text = page.locator(".uplot").first.get_attribute("data-range")
    return [float(end) for end in (text or "").split()]


def test_a_zoom_stays_while_iterations_arrive(
    server: ServerProcess, endless_job: str, visit: Callable[..., Visit]
) -> None:
    page = visit(server.url).go(f"/jobs/{endless_job}")
    wait_for_iteration(page, 10)
    expect(page.locator(".u-over").first).to_be_visible()
    box = page.locator(".u-over").first.bounding_box()
    assert box is not None
    middle = box["y"] + box["height"] / 2
    page.mouse.move(box["x"] + 0.2 * box["width"], middle)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.6 * box["width"], middle, steps=5)
    page.mouse.up()
    expect(page.locator(".uplot").first).not_to_have_attribute("data-range", FROM_ZERO)
    low, high = zoomed = chart_range(page)
    assert 0.0 < low < high
    last = int(page.locator("[data-stream]").get_attribute("data-iteration") or 0)
    wait_for_iteration(page, last + 5)
    assert chart_range(page) == zoomed
    # The link restores the zoom, even before the iterations are loaded.
    expect(page).to_have_url(re.compile("zoom="))
    page.reload()
    wait_for_iteration(page, last + 5)
    assert chart_range(page) == pytest.approx(zoomed, rel=1e-4)
    # The zoom is reset even if an iteration arrives at the same moment.
    page.evaluate(DOUBLE_CLICK_WITH_AN_ITERATION)
    expect(page.locator(".uplot").first).to_have_attribute("data-range", FROM_ZERO)
    expect(page).not_to_have_url(re.compile("zoom="))
    wait_for_iteration(page, last + 10)
    assert chart_range(page)[0] == 0.0


@pytest.mark.thorough("test_a_zoom_stays_while_iterations_arrive")
def test_the_zoom_of_a_recreated_chart_can_be_reset(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit]
) -> None:
    page = visit(server.url).go(f"/jobs/{finished_job}?zoom=1:3")
    expect(page.locator(".uplot").first).to_have_attribute("data-range", "1 3")

    page.evaluate(DOUBLE_CLICK_ON_A_NEW_CHART)

    expect(page).not_to_have_url(re.compile("zoom="))
    expect(page.locator(".uplot").first).to_have_attribute("data-range", FROM_ZERO)


@pytest.mark.thorough("test_paging_and_selection_reach_every_job")
def test_a_new_order_starts_on_the_first_page(
    server: ServerProcess, visit: Callable[..., Visit]
) -> None:
    job_id = server.submit(SMALL_JOB | {"iterations": 60, "optimizer": {"particles": 2}})
    server.wait_for(job_id, "succeeded")
    page = visit(server.url).go(f"/jobs/{job_id}/iterations")
    page.get_by_role("button", name="Next").click()
    expect(page.get_by_text("page 2 of 2")).to_be_visible()
    # The link restores the page.
    expect(page).to_have_url(re.compile("page=2$"))
    page.reload()
    expect(page.get_by_text("page 2 of 2")).to_be_visible()
    page.get_by_role("columnheader", name="Worst").get_by_role("button").click()
    expect(page.get_by_text("page 1 of 2")).to_be_visible()
    # Narrow screens hide the columns that the chart does not show.
    page.set_viewport_size({"width": 360, "height": 740})
    expect(page.get_by_role("columnheader", name="Median")).to_be_visible()
    expect(page.get_by_role("columnheader", name="Mean")).to_be_hidden()


@pytest.mark.thorough("test_brushing_an_axis_selects_designs")
def test_bounds_of_a_selection_in_the_wrong_order_are_swapped(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit]
) -> None:
    page = visit(server.url).go(f"/jobs/{finished_job}/variables")
    expect(page.locator("[data-selected]")).to_have_attribute("data-selected", "48")
    page.get_by_text("Select by numbers").click()
    least, most = page.get_by_label("FI1R from"), page.get_by_label("FI1R to")
    least.fill("5000")
    least.press("Tab")
    expect(page.locator("[data-selected]")).not_to_have_attribute("data-selected", "48")
    most.fill("2000")
    most.press("Tab")
    expect(least).to_have_value("2000")
    expect(most).to_have_value("5000")
    expect(page.locator("[data-selected]")).not_to_have_attribute("data-selected", "0")
