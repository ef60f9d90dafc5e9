"""What holds for every view: for every eye, hand, width and theme, and for no other host."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from playwright.sync_api import expect

from tests.examples.paths import ROOT
from tests.examples.servers import ServerProcess
from tests.web.views import VIEWS, open_view
from tests.web.visit import Visit

pytestmark = pytest.mark.slow

AXE = ROOT / "web" / "node_modules" / "axe-core" / "axe.min.js"

RUN_AXE = """async () => {
    const found = await axe.run(document, { resultTypes: ['violations'] })
    return found.violations
        .filter(({ impact }) => impact === 'serious' || impact === 'critical')
        .map(({ id, help, nodes }) => `${id}: ${help}: ${nodes.map((n) => n.html).join(' | ')}`)
}"""

# Of a list of tabs or a group of radio buttons, Tab reaches the chosen one and arrows the others.
OUT_OF_REACH = """() => [
        ...document.querySelectorAll('a, button, input, select, textarea, summary')
    ].filter((e) => e.checkVisibility() && !e.disabled && e.tabIndex < 0 && e.role !== 'tab')
    .map((e) => e.outerHTML.slice(0, 120))"""

CHARTS_WITHOUT_TABLE = """() => [...document.querySelectorAll('canvas')]
    .filter((e) => e.checkVisibility() && !e.closest('.chart-frame, .player-stage'))
    .map((e) => e.parentElement.outerHTML.slice(0, 120))"""

AT_REST = "document.getAnimations().every(({ playState }) => playState !== 'running')"
"""Nothing is left of a change of colours."""

BACKGROUND = "getComputedStyle(document.body).backgroundColor"

MISSING = "status of 404"
"""What the console says of the view of a job that is not there."""

TOO_WIDE = """() => {
    const width = document.documentElement.clientWidth
    return document.documentElement.scrollWidth <= width ? [] : [...document.querySelectorAll('*')]
        .filter((element) => element.getBoundingClientRect().right > width + 1)
        .map((element) => element.outerHTML.slice(0, 120))
}"""


@pytest.mark.parametrize("name", VIEWS)
def test_no_serious_finding_of_accessibility(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit], name: str
) -> None:
    # The checker is no part of the page, whose policy would keep it out.
    visited = visit(server.url, color_scheme="light", bypass_csp=True, allowed=MISSING)
    page = open_view(visited, name, finished_job)
    page.add_script_tag(path=AXE)
    light = page.evaluate(BACKGROUND)
    assert page.evaluate(RUN_AXE) == []
    assert page.evaluate(OUT_OF_REACH) == []
    assert page.evaluate(CHARTS_WITHOUT_TABLE) == []

    page.get_by_role("button", name="Show in dark colours").click()
    page.wait_for_function(f"{BACKGROUND} !== '{light}' && {AT_REST}")
    assert page.evaluate(RUN_AXE) == []


@pytest.mark.parametrize("name", VIEWS)
def test_no_screen_has_to_be_scrolled_sideways(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit], name: str
) -> None:
    visited = visit(server.url, viewport={"width": 360, "height": 740}, allowed=MISSING)
    page = open_view(visited, name, finished_job)

    assert page.evaluate(TOO_WIDE) == []
    for width, height in ((768, 1024), (3840, 2160)):
        page.set_viewport_size({"width": width, "height": height})
        assert page.evaluate(TOO_WIDE) == []


def test_colours_follow_the_system_until_the_button_chooses(
    server: ServerProcess, visit: Callable[..., Visit]
) -> None:
    page = visit(server.url, color_scheme="light").go("/jobs")
    body = page.locator("body")
    light = page.evaluate(BACKGROUND)

    page.emulate_media(color_scheme="dark")
    expect(body).not_to_have_css("background-color", light)
    page.get_by_role("button", name="Show in light colours").click()
    expect(body).to_have_css("background-color", light)
    page.reload()
    expect(page.get_by_role("button", name="Show in dark colours")).to_be_visible()
    expect(body).to_have_css("background-color", light)


def test_the_documentation_of_the_api_runs_under_its_policy(
    server: ServerProcess, visit: Callable[..., Visit]
) -> None:
    page = visit(server.url).go("/docs")

    expect(page.get_by_role("heading", name="gaitswarm").first).to_be_visible()


def test_an_empty_store_says_what_to_do(
    start_server: Callable[..., ServerProcess], visit: Callable[..., Visit]
) -> None:
    page = visit(start_server("--no-runner").url).go("/")

    expect(page.get_by_role("heading", name="No jobs yet")).to_be_visible()
    page.get_by_role("link", name="Set up the first job").click()
    expect(page.get_by_role("heading", name="New job")).to_be_visible()
