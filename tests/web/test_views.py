"""What holds for every view: for every eye, hand, width and theme, and for no other host."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, Literal

import pytest
from playwright.sync_api import Page, ViewportSize, expect

from tests.examples.paths import ROOT
from tests.examples.servers import Server, ServerProcess
from tests.web.views import VIEWS, open_view
from tests.web.visit import Visit

pytestmark = pytest.mark.slow

AXE = ROOT / "web" / "node_modules" / "axe-core" / "axe.min.js"

RUN_AXE = """async (rules) => {
    const only = rules && { runOnly: { type: 'rule', values: rules } }
    const found = await axe.run(document, { resultTypes: ['violations'], ...only })
    return found.violations
        .filter(({ impact }) => impact === 'serious' || impact === 'critical')
        .map(({ id, help, nodes }) => `${id}: ${help}: ${nodes.map((n) => n.html).join(' | ')}`)
}"""

RUN_AXE_IN_DIALOG = RUN_AXE.replace("axe.run(document", "axe.run('dialog[open]'")

RULES_OF_COLOURS: Final = ("color-contrast", "link-in-text-block")
"""All others find the same in dark colours as in light ones."""

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

PHONE: Final[ViewportSize] = {"width": 360, "height": 740}

REFUSED: Final = {
    "nothing there": "status of 404",
    "other forms, and jobs compared": "status of 422",
}
"""What the console says by kind of view: of a job that is not there, and of one without a robot."""

TOO_WIDE = """() => {
    const width = document.documentElement.clientWidth
    return document.documentElement.scrollWidth <= width ? [] : [...document.querySelectorAll('*')]
        .filter((element) => element.getBoundingClientRect().right > width + 1)
        .map((element) => element.outerHTML.slice(0, 120))
}"""


WIDTHS = ((768, 1024), (3840, 400))
"""A tablet's and the widest, which is low: pixels cost time, and only its width is looked at."""


def findings(page: Page) -> dict[str, list[str]]:
    """What keeps somebody out of the view that a phone has opened: by check, elements; no check
    without any."""
    found = {"too wide at 360": page.evaluate(TOO_WIDE)}
    for width, height in WIDTHS:
        page.set_viewport_size({"width": width, "height": height})
        found[f"too wide at {width}"] = page.evaluate(TOO_WIDE)
    page.set_viewport_size({"width": 1280, "height": 800})
    page.add_script_tag(path=AXE)
    light = page.evaluate(BACKGROUND)
    found["in light colours"] = page.evaluate(RUN_AXE)
    found["out of reach of the keyboard"] = page.evaluate(OUT_OF_REACH)
    found["charts without a table"] = page.evaluate(CHARTS_WITHOUT_TABLE)
    page.emulate_media(color_scheme="dark")
    page.wait_for_function(f"{BACKGROUND} !== '{light}' && {AT_REST}")
    found["in dark colours"] = page.evaluate(RUN_AXE, RULES_OF_COLOURS)
    return {check: elements for check, elements in found.items() if elements}


@pytest.mark.variants("jobs", "nothing there")
@pytest.mark.parametrize("kind", VIEWS)
def test_every_eye_hand_and_width_can_use_it(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit], kind: str
) -> None:
    # The checker is no part of the page, whose policy would keep it out.
    visited = visit(server.url, viewport=PHONE, bypass_csp=True, allowed=REFUSED.get(kind, "$^"))
    found = {}
    for name in VIEWS[kind]:
        # The view before this one is not to be drawn once more for its sake.
        visited.go("about:blank")
        visited.page.set_viewport_size(PHONE)
        visited.page.emulate_media(color_scheme="light")
        if of_view := findings(open_view(visited, name, finished_job)):
            found[name] = of_view
    assert found == {}


DIALOGS: Final = ("Extend…", "Label…", "Fork…", "Delete…")
"""Buttons of a job that has ended, and the dialogs behind them."""


def test_every_eye_and_hand_can_use_the_palette_and_dialogs(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit]
) -> None:
    # A part of the job without charts, which would be drawn anew in each colour.
    visited = visit(server.url, viewport=PHONE, bypass_csp=True)
    page = visited.go(f"/jobs/{finished_job}/reproduce")
    commands = page.get_by_role("region", name="The job", exact=True)
    dialog = page.get_by_role("dialog")
    expect(commands.get_by_role("button", name="Extend…")).to_be_visible()
    page.add_script_tag(path=AXE)
    found = {}
    schemes: dict[Literal["light", "dark"], tuple[str, ...] | None]
    schemes = {"light": None, "dark": RULES_OF_COLOURS}
    for scheme, rules in schemes.items():
        page.emulate_media(color_scheme=scheme)
        page.wait_for_function(AT_REST)
        for name in ("Control+k", "?", *DIALOGS):
            if name in DIALOGS:
                commands.get_by_role("button", name=name, exact=True).click()
            else:
                page.get_by_role("main").focus()
                page.keyboard.press(name)
            expect(dialog).to_be_visible()
            found[f"{name} in {scheme} colours"] = page.evaluate(RUN_AXE_IN_DIALOG, rules)
            found[f"{name} too wide"] = page.evaluate(TOO_WIDE)
            page.keyboard.press("Escape")
            expect(dialog).to_have_count(0)
    assert {check: elements for check, elements in found.items() if elements} == {}


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
    start_server: Callable[..., Server], visit: Callable[..., Visit]
) -> None:
    page = visit(start_server().url).go("/")

    expect(page.get_by_role("heading", name="No jobs yet")).to_be_visible()
    page.get_by_role("link", name="Set up the first job").click()
    expect(page.get_by_role("heading", name="New job")).to_be_visible()
