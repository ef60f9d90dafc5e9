"""Jobs from submission to the end."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest
from playwright.sync_api import Page, expect

from tests.examples.servers import ServerProcess
from tests.web.conftest import SMALL_JOB
from tests.web.job_page import (
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
    page.get_by_label(re.compile("^Iterations")).fill(str(iterations))
    page.get_by_label(re.compile("^particles", re.IGNORECASE)).fill("8")
    for scenario in OTHER_SCENARIOS:
        page.get_by_label(re.compile(f"^[1-6] {scenario}$")).uncheck()


def submitted(page: Page) -> str:
    """Id of the submitted job, from the address."""
    expect(page).to_have_url(re.compile(r"/jobs/(?!new)\w+$"))
    return page.url.rpartition("/")[2]


def test_a_job_is_submitted_watched_paused_reloaded_and_resumed(
    server: ServerProcess, visit: Callable[..., Visit]
) -> None:
    page = visit(server.url).go("/jobs/new")
    fill_in(page, "from the form", iterations=5000)
    # The API's estimate before submission.
    expect(page.locator("[data-walks]")).to_have_attribute("data-walks", "40000")
    page.get_by_role("button", name="Submit the job").click()
    job_id = submitted(page)

    # The page updates without reloading.
    page.evaluate("window.notReloaded = true")
    wait_for_iteration(page, 2)
    wait_for_iteration(page, shown_iteration(page) + 3)
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
    page.get_by_role("button", name="Cancel…").click()
    page.get_by_role("button", name="Back").click()
    assert server.job(job_id)["state"] == "running"
    page.get_by_role("button", name="Cancel…").click()
    page.get_by_role("button", name="Cancel the job").click()
    expect_state(page, "cancelled")
    assert server.job(job_id)["state"] == "cancelled"


def test_an_invalid_spec_is_not_submitted_and_its_field_is_marked(
    server: ServerProcess, visit: Callable[..., Visit]
) -> None:
    jobs_before = server.client.get("/v1/jobs").json()["items"]
    page = visit(server.url, allowed="status of 422").go("/jobs/new")
    fill_in(page, "wrong", iterations=0)

    page.get_by_role("button", name="Submit the job").click()

    iterations = page.get_by_label(re.compile("^Iterations"))
    expect(iterations).to_have_attribute("aria-invalid", "true")
    expect(iterations).to_be_focused()
    assert page.url.endswith("/jobs/new")
    assert server.client.get("/v1/jobs").json()["items"] == jobs_before


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
    for field in ("Particles", "Iterations"):
        press_until_focused(page, field)
        page.keyboard.press("ControlOrMeta+a")
        page.keyboard.type("2")
    page.keyboard.press("Enter")
    submitted(page)
    expect(page.get_by_role("heading", name="by keyboard")).to_be_visible()
    wait_for_iteration(page, 1)
    expect_state(page, "succeeded")

    press_until_focused(page, "Iterations")
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


def test_a_job_is_extended_and_cloned(server: ServerProcess, visit: Callable[..., Visit]) -> None:
    job_id = server.submit(SMALL_JOB)
    done = server.wait_for(job_id, "succeeded")["iterations"]
    page = visit(server.url).go(f"/jobs/{job_id}")

    page.get_by_role("button", name="Extend…").click()
    page.get_by_label(re.compile("^Iterations in total")).fill(str(done + 2))
    page.get_by_role("button", name=f"Run {done + 2} iterations in total").click()
    wait_for_iteration(page, done + 1)
    expect_state(page, "succeeded")

    page.get_by_role("link", name="Clone").click()
    expect(page.get_by_label("Name", exact=True)).to_have_value("small")
    expect(page.get_by_label(re.compile("^particles", re.IGNORECASE))).to_have_value("8")
    expect(page.locator("[data-custom]")).to_have_count(2)


@pytest.mark.thorough("test_a_jobs_headline_convergence_winner_and_walk")
def test_a_job_in_single_precision_shows_its_best_in_double_precision_too(
    server: ServerProcess, visit: Callable[..., Visit]
) -> None:
    page = visit(server.url).go("/jobs/new")
    expect(page.get_by_label("Precision")).to_have_value("double")
    fill_in(page, "in single", iterations=2)
    page.get_by_label("Precision").select_option("single")
    page.get_by_role("button", name="Submit the job").click()

    job_id = submitted(page)
    best = server.wait_for(job_id, "succeeded")["best"]
    expect_state(page, "succeeded")
    expect(page.locator(".job-header p").filter(has_text="single precision")).to_be_visible()
    figures = page.locator(".job-header dl")
    expect(figures).to_contain_text("Best fitness (double precision)")
    expect(figures).to_contain_text(f"{best['fitness']:.7g}")
    searched = figures.locator("div", has_text="Fitness in the search (single precision)")
    expect(searched).to_contain_text(f"{best['search']['fitness']:.7g}")
    expect(searched).to_contain_text("%")


def test_a_jobs_headline_convergence_winner_and_walk(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit]
) -> None:
    job = server.job(finished_job)
    page = visit(server.url).go(f"/jobs/{finished_job}")
    gain = page.locator(".job-header dl div", has_text="Gain over published A")
    expect(gain).to_contain_text("%")
    assert abs(float(re.split(r"\s", gain.inner_text().split("\n")[1].replace("\u2212", "-"))[0])
        - 100.0 * job["gain"]) < 0.06  # fmt: skip
    chart = page.get_by_role("img", name=re.compile("^Convergence over 6 iterations"))
    expect(chart).to_have_attribute("aria-label", re.compile("published A"))
    page.get_by_label("single designs").check()
    expect(page).to_have_url(re.compile("dots=yes$"))
    walked = page.locator("[data-dots]")
    expect(walked).to_contain_text("designs")
    assert 0 < int(walked.get_attribute("data-dots") or 0) <= job["evaluations"]

    verdict = server.client.get(f"/v1/jobs/{finished_job}/verdict").json()
    card = page.get_by_role("region", name="Verdict")
    for sentence in verdict["sentences"]:
        expect(card).to_contain_text(sentence)
    rows = card.get_by_role("table", name="Change against the reference").locator("tbody tr")
    expect(rows).to_have_count(len(job["scenarios"]))
    figures = [f for quantity in verdict["quantities"] for f in quantity["scenarios"].values()]
    better = [figure for figure in figures if figure["judgement"] == "better"]
    expect(rows.locator("[data-tone=better]")).to_have_count(len(better))

    winner = page.get_by_role("region", name="Winner")
    expect(winner.get_by_role("img")).to_have_count(len(job["best"]["design"]))
    winner.get_by_role("button", name=re.compile("^Show as table.*Winner")).click()
    rows = winner.get_by_role("table", name="Winner and search bounds").locator("tbody tr")
    expect(rows).to_have_count(len(job["best"]["design"]))

    page.get_by_role("link", name="Activity").click()
    expect(page.get_by_role("img", name=re.compile("^Timeline of"))).to_be_visible()
    machines = page.get_by_role("table", name="Workers of the job").locator("tbody tr")
    expect(machines).to_have_count(1)
    page.get_by_label("Minimum level").select_option("error and above")
    expect(page).to_have_url(re.compile("level=ERROR$"))
    page.reload()
    expect(page.get_by_label("Minimum level")).to_have_value("ERROR")
    page.go_back()

    # With reduced motion, the replay is neither loaded nor played automatically.
    page.get_by_role("button", name="Show the replay").click()
    expect(page.get_by_role("img", name="Replay of the best design")).to_be_visible()
    expect(page.locator("[data-stage]")).to_have_attribute("data-playing", "false")
    page.get_by_role("button", name="Play").click()
    expect(page.locator("[data-stage]")).to_have_attribute("data-playing", "true")


def test_a_clone_has_the_same_spec(server: ServerProcess, visit: Callable[..., Visit]) -> None:
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
    page = visit(server.url).go(f"/jobs/new?clone={job_id}")

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
    conventions = page.locator("details").filter(has_text="Conventions")
    expect(conventions.locator("table")).to_be_hidden()
    conventions.locator("summary").click()
    expect(conventions.locator("table")).to_be_visible()
