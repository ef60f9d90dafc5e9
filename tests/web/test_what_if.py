"""What-if ranking under other preferences, and brushing of designs."""

from __future__ import annotations

import json
from collections.abc import Callable
from urllib.parse import parse_qs, urlsplit

import pytest
from playwright.sync_api import expect

from tests.examples.servers import ServerProcess
from tests.web.test_links import SOME_OF_48
from tests.web.visit import Visit

pytestmark = pytest.mark.slow

OBJECTIVES = ("torque", "acceleration", "angular acceleration", "energy", "time per metre")


@pytest.mark.thorough("test_another_preference_ranks_the_history_without_simulation")
def test_the_preference_of_chapter_3_weights_a_sixth_objective(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit]
) -> None:
    ranking = server.client.post(
        f"/v1/jobs/{finished_job}/ranking", json={"preference": "chapter-3"}
    ).json()
    winner = ranking["top"][0]
    page = visit(server.url).go(f"/jobs/{finished_job}/preferences")
    sixth = page.get_by_label("bias of height loss, number")
    expect(page.get_by_label("bias of torque, number")).to_be_visible()
    expect(sixth).to_have_count(0)
    page.get_by_role("button", name="chapter-3", exact=True).click()
    expect(sixth).to_have_value("0.03")
    expect(page.locator("[data-winner]")).to_have_attribute(
        "data-winner", f"{winner['iteration']}.{winner['particle']}"
    )
    page.get_by_role("link", name="Start a job from here").click()
    chosen = page.get_by_role("button", name="chapter-3 · speed")
    expect(chosen).to_have_attribute("aria-pressed", "true")
    page.get_by_role("button", name="pso-falling-inertia", exact=True).click()
    page.get_by_label("Name", exact=True).fill("as in chapter 3")
    page.get_by_role("button", name="Submit the job").click()
    expect(page.get_by_role("heading", name="as in chapter 3")).to_be_visible()
    spec = server.job(page.url.rpartition("/")[2])["spec"]
    assert spec["preference"]["bias"] == [0.0] * 5 + [0.03]
    assert (spec["optimizer"]["inertia_end"], spec["optimizer"]["particles"]) == (0.7, 8)
    page.get_by_role("link", name="Details").click()
    expect(page.get_by_text("Figure of merit F (eq. 3.1)")).to_be_visible(timeout=30_000)


def test_another_preference_ranks_the_history_without_simulation(
    server: ServerProcess,
    finished_job: str,
    visit: Callable[..., Visit],
) -> None:
    best = server.job(finished_job)["best"]
    bias = server.job(finished_job)["spec"]["preference"]["bias"]
    exponents = [0.0, 0.0, 0.0, 0.0, 1.0]
    other = {"bias": bias, "exponent": exponents}
    ranking = server.client.post(
        f"/v1/jobs/{finished_job}/ranking", json={"preference": other}
    ).json()
    winner = ranking["top"][0]
    assert (winner["iteration"], winner["particle"]) != (best["iteration"], best["particle"])

    visited = visit(server.url)
    page = visited.go(f"/jobs/{finished_job}/preferences")
    shown = page.locator("[data-winner]")
    expect(shown).to_have_attribute("data-winner", f"{best['iteration']}.{best['particle']}")
    expect(shown).to_have_attribute("data-evaluations", str(ranking["evaluations"]))
    before = len(visited.requested)
    # Only speed counts.
    for objective, exponent in zip(OBJECTIVES, exponents, strict=True):
        page.get_by_label(f"exponent of {objective}, number").fill(str(exponent))
        page.keyboard.press("Tab")

    expect(shown).to_have_attribute("data-winner", f"{winner['iteration']}.{winner['particle']}")
    expect(page.get_by_role("heading", name="New winner")).to_be_visible()
    paths = {urlsplit(url).path for url in visited.requested[before:]}
    assert f"/v1/jobs/{finished_job}/ranking" in paths
    assert not paths & {"/v1/simulations", "/v1/replays"}

    page.get_by_role("link", name="Start a job from here").click()
    query = parse_qs(urlsplit(page.url).query)
    assert query["clone"] == [finished_job]
    assert json.loads(query["preference"][0])["exponent"] == exponents
    page.get_by_label("Name", exact=True).fill("fast")
    page.get_by_role("button", name="Submit the job").click()
    expect(page.get_by_role("heading", name="fast")).to_be_visible()
    job_id = page.url.rpartition("/")[2]
    assert server.job(job_id)["spec"]["preference"]["exponent"] == exponents
    server.client.post(f"/v1/jobs/{job_id}/cancel")


def test_brushing_an_axis_selects_designs(
    server: ServerProcess,
    finished_job: str,
    visit: Callable[..., Visit],
) -> None:
    every = "48"
    page = visit(server.url).go(f"/jobs/{finished_job}/variables")
    selected = page.locator("[data-selected]")
    expect(selected).to_have_attribute("data-selected", every)

    page.locator(".axis").last.scroll_into_view_if_needed()
    axis = page.locator(".axis").last.bounding_box()
    assert axis is not None
    x, bottom = axis["x"] + axis["width"] / 2, axis["y"] + axis["height"]
    page.mouse.move(x, bottom - 1)
    page.mouse.down()
    page.mouse.move(x, bottom - axis["height"] / 2, steps=5)
    page.mouse.up()

    expect(selected).to_have_attribute("data-selected", SOME_OF_48)
    page.get_by_role("button", name="Select all").click()
    expect(selected).to_have_attribute("data-selected", every)
