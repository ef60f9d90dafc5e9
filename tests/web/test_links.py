"""Links reproduce the view; invalid parts are ignored."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from urllib.parse import quote

import pytest
from playwright.sync_api import expect

from tests.examples.servers import Server, ServerProcess
from tests.web.visit import Visit

pytestmark = pytest.mark.slow

SOME_OF_48 = re.compile(r"^([1-9]|[123]\d|4[0-7])$")
"""Number of selected designs of the finished job, neither none nor all."""


def test_a_link_reproduces_the_view(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit]
) -> None:
    page = visit(server.url).go(f"/jobs/{finished_job}/variables?brush=FI1R:1500:3000,none:1:2")
    # An unknown axis is ignored with a notice.
    expect(page.get_by_text("was ignored")).to_contain_text("brush=none:1:2")
    selected = page.locator("[data-selected]")
    expect(selected).to_have_attribute("data-selected", SOME_OF_48)
    before = str(selected.get_attribute("data-selected"))
    page.get_by_text("Select by numbers").click()
    field = page.get_by_label("FI1R to")
    field.fill("2500")
    # Typed text survives renders, such as those caused by a running job.
    redrawn = page.get_by_label("objectives", exact=True)
    for shown in (True, False):
        redrawn.evaluate("box => box.click()")
        expect(redrawn).to_be_checked(checked=shown)
        expect(field).to_have_value("2500")
    field.blur()
    expect(page).to_have_url(re.compile(r"brush=FI1R%3A1500%3A2500$"))
    expect(selected).not_to_have_attribute("data-selected", before)
    narrowed = str(selected.get_attribute("data-selected"))
    page.reload()
    expect(selected).to_have_attribute("data-selected", narrowed)
    expect(page.get_by_text("was ignored")).to_have_count(0)

    # Trade-offs shows the same selection.
    page.get_by_role("link", name="Trade-offs", exact=True).click()
    expect(selected).to_have_attribute("data-selected", narrowed)
    expect(page.get_by_text(f"{narrowed} selected in Variables")).to_be_visible()
    page.get_by_role("link", name="Variables", exact=True).click()
    expect(selected).to_have_attribute("data-selected", narrowed)
    crumbs = page.get_by_role("navigation", name="Breadcrumbs")
    expect(crumbs.get_by_role("listitem")).to_have_text(["All jobs", "small", "Variables"])
    page.goto(f"/jobs/{finished_job}/iterations?sort=-worst")
    expect(page.get_by_role("columnheader", name="Worst")).to_have_attribute(
        "aria-sort", "descending"
    )
    page.get_by_role("button", name="Failed").click()
    expect(page).to_have_url(re.compile("sort=failed$"))


def test_shortcuts_find_jobs_and_commands_and_can_be_disabled(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit]
) -> None:
    page = visit(server.url).go(f"/jobs/{finished_job}")
    expect(page.get_by_role("heading", name="Convergence")).to_be_visible()
    page.keyboard.press("Control+k")
    field = page.get_by_role("combobox", name="Find pages")
    expect(field).to_be_focused()
    # Only commands that the job allows are offered; an ended job cannot be paused.
    expect(page.get_by_role("option", name="Extend")).to_be_visible()
    expect(page.get_by_role("option", name="Pause")).to_have_count(0)
    field.fill(finished_job)
    job = page.get_by_role("option", name=f"job {finished_job}")
    expect(job).to_have_attribute("aria-selected", "true")
    field.fill("new job")
    first = page.get_by_role("option").first
    expect(first).to_have_accessible_name(re.compile("^new job", re.IGNORECASE))
    expect(first).to_have_attribute("aria-selected", "true")
    page.keyboard.press("Enter")
    expect(page).to_have_url(re.compile("/jobs/new$"))
    # Fields receive letters.
    page.get_by_label("Name", exact=True).first.press("w")
    expect(page).to_have_url(re.compile("/jobs/new$"))
    page.get_by_role("main").focus()
    page.keyboard.press("?")
    page.get_by_label("enable single-key shortcuts").uncheck()
    page.keyboard.press("Escape")
    expect(page.get_by_role("dialog")).to_have_count(0)
    page.keyboard.press("w")
    page.keyboard.press("Control+k")
    expect(field).to_be_visible()
    expect(page).to_have_url(re.compile("/jobs/new$"))


@pytest.mark.thorough("test_a_link_reproduces_the_view")
def test_a_link_shows_a_walk_at_a_time(server: ServerProcess, visit: Callable[..., Visit]) -> None:
    camera = "0.9:-1.3:0.6:0.1:0:0"
    page = visit(server.url).go(f"/walk?t=1.25&view=no-trail&zoom=0.5:1.5&camera={camera}")
    player = page.locator("[data-player]")
    expect(page.locator(".uplot").first).to_have_attribute("data-range", "0.5 1.5")
    expect(player).to_have_attribute("data-time", "1.2500")
    expect(page.get_by_label("Trail")).not_to_be_checked()
    page.get_by_role("button", name="Next frame").click()
    page.get_by_label("Forces").uncheck()
    query = re.compile(r"t=1\.26&view=no-forces%2Cno-trail&zoom=.+&camera=(.+)$")
    expect(page).to_have_url(query)
    # The camera of the link: rotating back and forth restores it.
    player.locator("canvas").press("Shift+ArrowLeft")
    expect(page).not_to_have_url(re.compile(quote(camera)))
    page.keyboard.press("Shift+ArrowRight")
    expect(page).to_have_url(re.compile(f"camera={re.escape(quote(camera))}$"))
    page.get_by_role("button", name="Reset view").click()
    expect(page).not_to_have_url(re.compile("camera="))


@pytest.mark.thorough("test_a_link_reproduces_the_view")
def test_the_manual_is_linked_if_available(
    start_server: Callable[..., Server], visit: Callable[..., Visit], tmp_path: Path
) -> None:
    server = start_server(manual_folder=tmp_path)
    page = visit(server.url).go("/jobs")
    expect(page.get_by_role("link", name="API", exact=True)).to_be_visible()
    page.wait_for_load_state("networkidle")
    expect(page.get_by_role("link", name="Manual", exact=True)).to_have_count(0)

    (tmp_path / "docs").mkdir()
    (tmp_path / "docs" / "index.html").write_text("<h1>The manual</h1>", encoding="utf-8")
    page.reload()
    # The shortcut works once the page is shown.
    expect(page.get_by_role("link", name="API", exact=True)).to_be_visible()
    page.wait_for_load_state("networkidle")
    page.keyboard.press("Control+k")
    page.get_by_role("combobox", name="Find pages").fill("manual")
    expect(page.get_by_role("option", name="Manual")).to_be_visible()
    page.keyboard.press("Escape")
    manual = page.get_by_role("link", name="Manual", exact=True)
    expect(manual).to_have_attribute("href", "/manual")
