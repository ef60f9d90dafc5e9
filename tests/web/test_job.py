"""Jobs from submission to the end."""

from __future__ import annotations

import json
import re
from collections.abc import Callable

import pytest
from playwright.sync_api import Page, Route, expect

from tests.examples.servers import Server, ServerProcess
from tests.web.conftest import SMALL_JOB
from tests.web.job_page import (
    choose,
    expect_state,
    job_element,
    shown_iteration,
    wait_for_iteration,
)
from tests.web.visit import Visit

pytestmark = pytest.mark.slow

OTHER_SCENARIOS = ("normal-slow", "loaded-fast", "loaded-slow", "slope-fast", "turn-right-fast")


def fill_in(page: Page, name: str, *, iterations: int) -> None:
    """Fill in the form of a job with one scenario and eight particles."""
    page.get_by_label("Name", exact=True).fill(name)
    open_advanced(page)
    page.get_by_label(re.compile("^Iterations")).fill(str(iterations))
    page.get_by_label(re.compile("^particles", re.IGNORECASE)).fill("8")
    for scenario in OTHER_SCENARIOS:
        page.get_by_label(re.compile(f"^[1-6] {scenario}$")).uncheck()


def open_advanced(page: Page) -> None:
    page.get_by_text(re.compile("^Advanced:")).click()


def submitted(page: Page) -> str:
    """Id of the submitted job, from the address."""
    expect(page).to_have_url(re.compile(r"/jobs/(?!new)\w+$"))
    return page.url.rpartition("/")[2]


def test_a_job_is_submitted_watched_paused_reloaded_and_resumed(
    server: ServerProcess, visit: Callable[..., Visit]
) -> None:
    page = visit(server.url, allowed="status of 422").go("/jobs/new")
    fill_in(page, "from the form", iterations=0)
    # An invalid spec is not submitted, and its field is marked.
    page.get_by_role("button", name="Submit the job").click()
    iterations = page.get_by_label(re.compile("^Iterations"))
    expect(iterations).to_have_attribute("aria-invalid", "true")
    expect(iterations).to_be_focused()
    assert page.url.endswith("/jobs/new")
    iterations.fill("5000")
    # The API's estimate before submission.
    expect(page.locator("[data-walks]")).to_have_attribute("data-walks", "40000")
    page.get_by_role("button", name="Submit the job").click()
    job_id = submitted(page)

    # The page updates without reloading.
    page.evaluate("window.notReloaded = true")
    wait_for_iteration(page, 1)
    wait_for_iteration(page, shown_iteration(page) + 1)
    assert page.evaluate("window.notReloaded")
    expect(job_element(page)).to_have_attribute("data-stream", "open")

    page.get_by_role("button", name="Pause").click()
    expect_state(page, "paused")
    committed = server.wait_for(job_id, "paused")["iterations"]
    expect(job_element(page)).to_have_attribute("data-iteration", str(committed - 1))

    page.reload()
    expect_state(page, "paused")
    expect(job_element(page)).to_have_attribute("data-iteration", str(committed - 1))
    assert server.job(job_id)["iterations"] == committed

    page.get_by_role("button", name="Resume").click()
    wait_for_iteration(page, committed + 1)
    expect_state(page, "running")

    # Cancelling requires confirmation.
    choose(page, "Cancel…")
    page.get_by_role("button", name="Back").click()
    assert server.job(job_id)["state"] == "running"
    choose(page, "Cancel…")
    page.get_by_role("button", name="Cancel the job").click()
    expect_state(page, "cancelled")
    assert server.job(job_id)["state"] == "cancelled"


@pytest.mark.thorough("test_a_job_is_submitted_watched_paused_reloaded_and_resumed, by keyboard")
def test_a_job_is_submitted_and_followed_by_keyboard_alone(
    server: ServerProcess, visit: Callable[..., Visit]
) -> None:
    page = visit(server.url).go("/jobs")
    new_job = page.get_by_role("link", name="New job").first
    expect(new_job).to_be_visible()

    press_until_focused(page, "New job")
    page.keyboard.press("Enter")
    expect(page.get_by_label("Name", exact=True)).to_be_visible()
    press_until_focused(page, "Name")
    page.keyboard.type("by keyboard")
    press_until_focused(page, "Advanced")
    page.keyboard.press("Enter")
    for field in ("Particles", "Iterations"):
        press_until_focused(page, field)
        page.keyboard.press("ControlOrMeta+a")
        page.keyboard.type("2")
    page.keyboard.press("Enter")
    submitted(page)
    expect(page.get_by_role("heading", name="by keyboard")).to_be_visible()
    wait_for_iteration(page, 1)
    expect_state(page, "succeeded")

    for link in ("Details", "Iterations"):
        press_until_focused(page, link)
        page.keyboard.press("Enter")
    expect(page.get_by_role("table", name="Iterations")).to_be_visible()
    press_until_focused(page, "0")
    page.keyboard.press("Enter")
    expect(page.get_by_role("table", name="Designs of iteration 0")).to_be_visible()


FOCUSED = """() => {
    const element = document.activeElement
    const label = element.labels?.[0] ?? element
    return (element.getAttribute('aria-label') ?? label.textContent).trim()
}"""


def press_until_focused(page: Page, name: str) -> None:
    """Press Tab until the element whose name starts with `name` has the focus."""
    seen: list[str] = []
    for _ in range(150):
        page.keyboard.press("Tab")
        seen.append(page.evaluate(FOCUSED))
        if re.match(rf"{name}\b", seen[-1]):
            return
    raise AssertionError(f"{name} was not reached: {seen}")


def test_a_job_is_extended(server: ServerProcess, visit: Callable[..., Visit]) -> None:
    job_id = server.submit(SMALL_JOB | {"iterations": 1})
    done = server.wait_for(job_id, "succeeded")["iterations"]
    page = visit(server.url).go(f"/jobs/{job_id}")

    choose(page, "Extend…")
    page.get_by_label("Evaluations in total").fill(str(8 * done + 16))
    page.get_by_role("button", name=f"Run {8 * done + 16} evaluations in total").click()
    wait_for_iteration(page, done + 1)
    expect_state(page, "succeeded")


@pytest.mark.thorough("test_a_result_is_shown_in_words_figures_and_charts_before_anything_else")
def test_a_job_in_single_precision_shows_its_best_in_double_precision_too(
    server: ServerProcess, visit: Callable[..., Visit]
) -> None:
    page = visit(server.url).go("/jobs/new")
    fill_in(page, "in single", iterations=2)
    expect(page.get_by_label("Precision")).to_have_value("double")
    page.get_by_label("Precision").select_option("single")
    page.get_by_role("button", name="Submit the job").click()

    job_id = submitted(page)
    best = server.wait_for(job_id, "succeeded")["best"]
    expect_state(page, "succeeded")
    page.goto(f"{page.url}/summary")
    figures = page.get_by_role("region", name="Summary").locator("dl")
    expect(figures.locator("div", has_text=re.compile("^Precision"))).to_contain_text("single")
    expect(figures).to_contain_text("Best fitness (double precision)")
    expect(figures).to_contain_text(f"{best['fitness']:.7g}")
    searched = figures.locator("div", has_text="Fitness in the search (single precision)")
    expect(searched).to_contain_text(f"{best['search']['fitness']:.7g}")
    expect(searched).to_contain_text("%")


def test_a_result_is_shown_in_words_figures_and_charts_before_anything_else(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit]
) -> None:
    job = server.job(finished_job)
    verdict = server.client.get(f"/v1/jobs/{finished_job}/verdict").json()
    page = visit(server.url).go(f"/jobs/{finished_job}")
    header = page.get_by_role("region", name="Job summary")
    expect(header).to_contain_text(f"{job['evaluations']} evaluations in {job['iterations']} iter")
    better = f"{100 * verdict['gain']:#.2g}".rstrip(".")
    card = page.get_by_role("region", name="Verdict")
    heading = card.get_by_role("heading", name=f"{better}\xa0% better than published A")
    expect(heading).to_be_visible()
    for sentence in verdict["sentences"][:-1]:
        expect(card).to_contain_text(sentence)

    # Each figure is judged by a word and a mark, not by its colour alone.
    for name in ("speed", "energy", "peak_current", "torque", "acceleration"):
        figure = card.locator(f"[data-figure={name}]")
        (quantity,) = (each for each in verdict["quantities"] if each["name"] == name)
        judged = figure.locator(".judged")
        expect(judged).to_have_attribute("data-tone", quantity["judgement"])
        mark = {"better": "✓", "same": "=", "worse": "✗"}[quantity["judgement"]]
        expect(judged).to_contain_text(mark)

    # One primary button in view: the next step.
    primary = page.get_by_role("main").locator(".primary")
    expect(primary).to_have_text("Widen and run again" if verdict["widen"] else "Certify")

    chart = page.get_by_role("img", name=re.compile("^Convergence over 6 iterations"))
    expect(chart).to_have_attribute("aria-label", re.compile("published A"))
    walked = page.locator("[data-dots]")
    expect(walked).to_contain_text("designs")
    assert 0 < int(walked.get_attribute("data-dots") or 0) <= job["evaluations"]
    page.get_by_label("bands").check()
    expect(page).to_have_url(re.compile("bands=yes$"))
    expect(page.get_by_text("5 % to 95 %")).to_be_visible()

    best = page.get_by_role("region", name="Best design")
    expect(best.get_by_role("img")).to_have_count(len(job["best"]["design"]))
    best.get_by_role("button", name=re.compile("^Show as table.*Best design")).click()
    rows = best.get_by_role("table", name="Best design and search bounds").locator("tbody tr")
    expect(rows).to_have_count(len(job["best"]["design"]))

    # Terms are explained, and the link of the view is copied.
    definition = page.get_by_role("note").filter(has_text="What a search minimizes")
    expect(definition).to_be_hidden()
    term = page.get_by_role("button", name="fitness", exact=True)
    term.focus()
    page.keyboard.press("Enter")
    expect(definition).to_be_visible()
    below = definition.bounding_box()
    button = term.bounding_box()
    assert below and button and 0.0 <= below["y"] - button["y"] < 60.0
    page.keyboard.press("Escape")
    expect(definition).to_be_hidden()

    page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    page.get_by_role("button", name="Copy link").click()
    expect(page.get_by_role("button", name="Copy link")).to_have_text("Copied")
    assert page.evaluate("navigator.clipboard.readText()") == page.url
    page.context.clear_permissions()

    # The replay is neither loaded nor played until it is requested.
    assert page.locator("canvas[data-engine]").count() == 0
    page.get_by_role("button", name="Play the walk").click()
    expect(page.get_by_role("img", name="Replay of the best design")).to_be_visible()
    expect(page.locator("[data-stage]")).to_have_attribute("data-playing", "false")
    page.get_by_role("button", name="Play", exact=True).click()
    expect(page.locator("[data-stage]")).to_have_attribute("data-playing", "true")

    # A click on the convergence opens the iteration.
    plot = page.locator(".u-over").first
    expect(page.locator(".uplot").first).to_have_attribute("data-range", "0 5")
    box = plot.bounding_box()
    assert box is not None
    plot.click(position={"x": 0.6 * box["width"], "y": box["height"] / 2})
    expect(page).to_have_url(re.compile("/iterations/3$"))
    expect(page.get_by_role("table", name="Designs of iteration 3")).to_be_visible()


def test_scenarios_are_compared_with_the_reference_of_the_job_by_speed(
    server: ServerProcess, visit: Callable[..., Visit]
) -> None:
    job_id = server.submit(SMALL_JOB | {"preference": "C", "seed": 3})
    job = server.wait_for(job_id, "succeeded")
    page = visit(server.url).go(f"/jobs/{job_id}")
    expect(page.get_by_label("Compare with")).to_have_value("fuzzy-pi, C")
    table = page.get_by_role("table", name="Objectives of the winner by scenario")
    heads = table.locator("thead th")
    expect(heads).to_contain_text(["speed [m/s]"])
    limits = page.get_by_role("region", name="Limiting factors", exact=True)
    expect(limits.get_by_role("columnheader", name="Speed")).to_be_visible()
    column = heads.all_inner_texts().index("speed [m/s]")
    for name, result in job["best"]["scenarios"].items():
        cell = table.locator("tbody tr", has_text=name).locator("th, td").nth(column)
        speed = 1.0 / result["objectives"]["reciprocal_speed"]
        expect(cell).to_contain_text(f"{speed:#.4g}")
        change = cell.locator("[data-tone]")
        faster = "+" in change.inner_text()
        expect(change).to_have_attribute("data-tone", "better" if faster else "worse")
        expect(change).to_contain_text("✓" if faster else "✗")


def test_former_addresses_lead_to_sections_and_activity_is_filtered_by_level(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit]
) -> None:
    visited = visit(server.url)
    for old, new in (
        ("/scenarios?against=none", "?against=none"),
        ("?tab=variables", "/variables"),
        ("?tab=overview", ""),
    ):
        page = visited.go(f"/jobs/{finished_job}{old}")
        expect(page).to_have_url(f"{server.url}/jobs/{finished_job}{new}")
    tabs = page.get_by_role("navigation", name="Parts of the job")
    expect(tabs.get_by_role("link")).to_have_text(
        ["Result", "Walk", "Explore", "Robustness", "Details"]
    )

    # Activity is filtered by level, in the address.
    page.get_by_role("link", name="Details").click()
    page.get_by_role("link", name="Activity").click()
    expect(page.get_by_role("img", name=re.compile("^Timeline of"))).to_be_visible()
    machines = page.get_by_role("table", name="Workers of the job").locator("tbody tr")
    expect(machines).to_have_count(1)
    page.get_by_label("Minimum level").select_option("error and above")
    expect(page).to_have_url(re.compile("level=ERROR$"))
    page.reload()
    expect(page.get_by_label("Minimum level")).to_have_value("ERROR")


def in_few_worlds(route: Route) -> None:
    """Submit the page's certificate with 12 worlds in place of 1000."""
    if route.request.method == "POST":
        route.continue_(post_data=json.loads(route.request.post_data or "") | {"worlds": 12})
    else:
        route.continue_()


def test_the_best_design_is_certified_with_one_click(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit]
) -> None:
    page = visit(server.url).go(f"/jobs/{finished_job}/robustness")
    card = page.get_by_role("region", name="Certificate")
    expect(card).to_contain_text("There is none yet.")
    page.route("**/v1/jobs", in_few_worlds)
    card.get_by_role("button", name="Certify").click()
    expect(page.get_by_role("heading", name="certificate of small")).to_be_visible()
    page.unroute("**/v1/jobs")
    certificate = page.url.rpartition("/")[2]
    server.wait_for(certificate, "succeeded")
    # A certificate opens with its verdict.
    expect(page.get_by_role("heading", name=re.compile("^Fails in at most .* %"))).to_be_visible()
    expect(page.get_by_role("img", name=re.compile("^Worlds by fitness"))).to_be_visible()

    page.goto(f"{server.url}/jobs/{finished_job}/robustness")
    expect(card.get_by_role("heading", name=re.compile("^Fails in at most"))).to_be_visible()
    expect(card.get_by_role("link")).to_have_attribute("href", f"/jobs/{certificate}")


def test_a_clone_has_the_same_spec(
    start_server: Callable[..., Server], visit: Callable[..., Visit]
) -> None:
    server = start_server()
    window = {"name": "fir_window", "kind": "categorical", "choices": ["hamming", "moving_average"]}
    job_id = server.submit(
        SMALL_JOB
        | {
            "name": "all settings",
            "robot": "szabadka2",
            "controller": "pi",
            "scenarios": ["stuck-leg", "drop", "backward"],
            "variables": ["P", "I", window],
            "fixed": {"duty_phase": "swing"},
            "preference": "chapter-3",
            "optimizer": "pso-falling-inertia",
            "iterations": 1,
            "precision": "single",
        }
    )
    page = visit(server.url).go(f"/jobs/{job_id}")

    choose(page, "Clone")
    expect(page.get_by_label("Name", exact=True)).to_have_value("all settings")
    page.get_by_role("button", name="Submit the job").click()

    assert server.job(submitted(page))["spec"] == server.job(job_id)["spec"]


@pytest.mark.thorough("test_a_job_is_submitted_watched_paused_reloaded_and_resumed")
def test_the_form_offers_robots_and_collapses_conventions(
    server: ServerProcess, visit: Callable[..., Visit]
) -> None:
    robots = [robot["name"] for robot in server.client.get("/v1/robots").json()["items"]]
    page = visit(server.url).go("/jobs/new")

    picker = page.get_by_label("Shipped robot")
    expect(picker.locator("option")).to_have_text(robots)
    expect(picker).to_have_value(robots[0])
    open_advanced(page)
    conventions = page.locator("details").filter(has_text="Conventions").last
    expect(conventions.locator("table")).to_be_hidden()
    conventions.locator("summary").click()
    expect(conventions.locator("table")).to_be_visible()
