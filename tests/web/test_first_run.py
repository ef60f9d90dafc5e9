"""Ways to begin: the view of an empty store, own robots, and drafts of jobs."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path

import pytest
from playwright.sync_api import expect

from tests.examples.servers import QUICK_EVENTS, Server, ServerProcess
from tests.robots.test_proposal import dog
from tests.web.conftest import SMALL_JOB
from tests.web.visit import Visit

pytestmark = pytest.mark.slow

MOST_CLICKS = 10
LONGEST_SECONDS = 300.0

COUNT_CLICKS = """
    addEventListener('click', (event) => {
        if (event.isTrusted) sessionStorage.clicks = Number(sessionStorage.clicks ?? 0) + 1
    }, true)"""


@pytest.fixture
def empty_server(tmp_path: Path, _chromium: str) -> Iterator[ServerProcess]:
    """A server with a runner and no jobs."""
    server = ServerProcess(tmp_path / "jobs.db", environment=QUICK_EVENTS)
    yield server
    server.close()


def test_a_newcomer_tunes_an_own_robot_in_ten_clicks(
    empty_server: ServerProcess, tmp_path: Path, visit: Callable[..., Visit]
) -> None:
    urdf = tmp_path / "dog.urdf"
    urdf.write_text(dog(foot="cylinder"), encoding="utf-8")
    visited = visit(empty_server.url)
    visited.page.add_init_script(COUNT_CLICKS)
    began = time.monotonic()
    page = visited.go("/")
    expect(page.get_by_role("heading", level=1)).to_contain_text("simulates your walking robot")

    with page.expect_file_chooser() as chooser:
        page.get_by_text("My robot").click()
    chooser.value.set_files(urdf)
    results = page.get_by_role("region", name="Check results")
    # The kernel of another robot is compiled first.
    expect(results).to_contain_text("dog: 4 legs, 12 joints", timeout=120_000)
    page.get_by_role("group", name="Preference").get_by_text("C · all alike").click()
    seconds = page.get_by_label("Effort in seconds")
    seconds.click()
    # Less than the default of this machine.
    seconds.fill(f"{float(seconds.input_value()) / 20.0:.2g}")
    seconds.press("Enter")
    expect(page.locator("[data-designs]")).not_to_contain_text("625 designs")
    page.get_by_role("button", name="Submit the job").click()

    expect(page).to_have_url(re.compile(r"/jobs/(?!new)\w+$"))
    job = empty_server.wait_for(page.url.rpartition("/")[2], "succeeded")
    assert job["best_fitness"] is not None
    assert int(page.evaluate("sessionStorage.clicks")) <= MOST_CLICKS
    assert time.monotonic() - began < LONGEST_SECONDS


def test_a_small_job_is_shown_once_it_ends_to_look_around(
    start_server: Callable[..., Server], visit: Callable[..., Visit]
) -> None:
    server = start_server()
    page = visit(server.url).go("/")
    page.get_by_role("button", name="Play").click()
    expect(page.get_by_role("button", name="Pause")).to_be_visible()
    page.get_by_role("button", name="Look around").click()
    expect(page.get_by_role("status")).to_have_text("Computing a small job…")
    while not (jobs := server.client.get("/v1/jobs").json()["items"]):
        page.wait_for_timeout(20)
    (job,) = jobs
    assert (job["name"], job["evaluations_planned"]) == ("example", 72)
    server.client.post(f"/v1/jobs/{job['id']}/cancel").raise_for_status()
    expect(page).to_have_url(f"{server.url}/jobs/{job['id']}")


def test_the_demo_is_started_once(
    start_server: Callable[..., Server], visit: Callable[..., Visit]
) -> None:
    server = start_server()
    page = visit(server.url).go("/")
    page.get_by_role("button", name="Run the demo").click(click_count=2)
    expect(page.get_by_role("heading", name="demo")).to_be_visible()
    (job,) = server.client.get("/v1/jobs").json()["items"]
    assert job["evaluations_planned"] == 625


def test_the_form_describes_presets_and_its_effort_and_is_large_enough_to_touch(
    start_server: Callable[..., Server], visit: Callable[..., Visit]
) -> None:
    page = visit(start_server().url).go("/jobs/new")
    words = page.locator(".presets .muted")
    expect(words.nth(1)).to_have_text("cycle time 2.2\xa0s")
    expect(words.nth(4)).to_have_text("slope 10\xa0deg")

    boxes = [button.bounding_box() for button in page.locator(".segmented button").all()]
    assert all(box and min(box["width"], box["height"]) >= 24.0 for box in boxes)

    designs = page.locator("[data-designs]")
    expect(designs).to_contain_text("625 designs in 25 batches")
    seconds = page.get_by_label("Effort in seconds")
    seconds.fill(str(2.0 * float(seconds.input_value())))
    seconds.press("Enter")
    expect(designs).not_to_contain_text("625 designs")
    count = int(designs.get_attribute("data-designs") or 0)
    assert count == pytest.approx(1250, rel=0.1)


def test_a_draft_survives_leaving_the_page_until_it_is_submitted(
    start_server: Callable[..., Server], visit: Callable[..., Visit]
) -> None:
    server = start_server()
    page = visit(server.url).go("/jobs/new")
    name = page.get_by_label("Name", exact=True)
    name.fill("draft")
    importance = page.get_by_label("Importance of speed")
    importance.fill("2")
    speed = page.get_by_label(re.compile("^Speed at least"))
    speed.fill("0.05")
    page.goto("/jobs/new")
    expect(page.get_by_text("Your draft was restored.")).to_be_visible()
    expect(name).to_have_value("draft")
    expect(importance).to_have_value("2")
    expect(speed).to_have_value("0.05")
    page.get_by_role("button", name="Submit the job").click()
    expect(page.get_by_role("heading", name="draft")).to_be_visible()
    spec = server.job(page.url.rpartition("/")[2])["spec"]
    assert spec["preference"]["exponent"][4] == 2.0
    least = {each["quantity"]: each["min"] for each in spec["constraints"]}
    assert least["speed"] == 0.05
    page.goto("/jobs/new")
    expect(name).to_have_value("")

    name.fill("another")
    page.reload()
    page.get_by_role("button", name="Start over").click()
    expect(name).to_have_value("")


def test_jobs_are_cards_on_a_phone(
    start_server: Callable[..., Server], visit: Callable[..., Visit]
) -> None:
    server = start_server()
    ids = [server.submit(SMALL_JOB | {"name": f"job {k}"}) for k in range(3)]
    page = visit(server.url, viewport={"width": 390, "height": 844}).go("/jobs")
    expect(page.locator("[data-job]")).to_have_count(3)
    boxes = [box for row in page.locator("[data-job]").all() if (box := row.bounding_box())]
    tops = [box["y"] for box in boxes]
    assert min(b - a for a, b in pairwise(tops)) > 60.0
    assert min(box["width"] for box in boxes) > 300.0
    assert page.evaluate("document.documentElement.scrollWidth") == 390
    for label in ("State", "Best fitness"):
        shown = page.locator(f"[data-job='{ids[0]}'] [data-label='{label}']")
        assert label in shown.evaluate("e => getComputedStyle(e, '::before').content")


def test_unknown_paths_jobs_and_pages_lead_back_to_the_list(
    start_server: Callable[..., Server], visit: Callable[..., Visit]
) -> None:
    server = start_server()
    server.submit(SMALL_JOB)
    page = visit(server.url, allowed="status of 4(04|22)").go("/nosuch/path")
    expect(page.get_by_role("heading", name="Page not found")).to_be_visible()
    assert server.client.get("/nosuch").json()["status"] == 404

    page.goto("/jobs/none")
    expect(page.get_by_role("heading", name="Job not found")).to_be_visible()
    expect(page.get_by_role("main").get_by_role("link", name="list of jobs")).to_be_visible()

    page.goto("/jobs?after=zzz")
    expect(page.locator("[data-job]")).to_have_count(1)
    expect(page.get_by_text("after=zzz")).to_be_visible()
