"""Accessibility, layout and theme of every view."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import pytest
from playwright.sync_api import Page, ViewportSize, expect

from tests.examples.paths import ROOT
from tests.examples.servers import Server, ServerProcess
from tests.web.job_page import choose
from tests.web.views import VIEWS, open_view
from tests.web.visit import Visit

pytestmark = pytest.mark.slow

AXE = ROOT / "web" / "node_modules" / "axe-core" / "axe.min.js"

RUN_AXE = """async (rules) => {
    const only = rules && { runOnly: { type: 'rule', values: rules } }
    const results = await axe.run(document, { resultTypes: ['violations'], ...only })
    return results.violations
        .map(({ id, help, nodes }) => `${id}: ${help}: ${nodes.map((n) => n.html).join(' | ')}`)
}"""

RUN_AXE_IN_DIALOG = RUN_AXE.replace("axe.run(document", "axe.run('dialog[open]'")

RULES_OF_COLOURS: Final = ("color-contrast", "link-in-text-block")
"""Rules that depend on colours: the only ones checked of dialogs in dark colours."""

OUT_OF_REACH = """() => [
        ...document.querySelectorAll('a, button, input, select, textarea, summary')
    ].filter((e) => e.checkVisibility() && !e.disabled && e.tabIndex < 0)
    .map((e) => e.outerHTML.slice(0, 120))"""

CHARTS_WITHOUT_TABLE = """() => [...document.querySelectorAll('canvas')]
    .filter((e) => e.checkVisibility() && !e.closest('.chart-frame, .player-stage'))
    .map((e) => e.parentElement.outerHTML.slice(0, 120))"""

AT_REST = "document.getAnimations().every(({ playState }) => playState !== 'running')"
"""All colour transitions have finished."""

BACKGROUND = "getComputedStyle(document.body).backgroundColor"

PHONE: Final[ViewportSize] = {"width": 360, "height": 740}

REFUSED: Final = {
    "missing": "status of 404",
    "other forms and comparison": "status of 422",
}
"""Expected console errors by group of views."""

TOO_WIDE = """() => {
    const width = document.documentElement.clientWidth
    return document.documentElement.scrollWidth <= width ? [] : [...document.querySelectorAll('*')]
        .filter((element) => element.getBoundingClientRect().right > width + 1)
        .map((element) => element.outerHTML.slice(0, 120))
}"""


WIDTHS = ((768, 1024), (3840, 400))
"""Sizes of a tablet and of a very wide screen, which is low to save time."""


AXE_PHONE, AXE_LAPTOP = 390, 1440
"""Widths at which accessibility is checked [px]."""


def findings(page: Page) -> dict[str, list[str]]:
    """Violations in a view opened at phone size: offending elements by check."""
    violations = {"too wide at 360": page.evaluate(TOO_WIDE)}
    for width, height in WIDTHS:
        page.set_viewport_size({"width": width, "height": height})
        violations[f"too wide at {width}"] = page.evaluate(TOO_WIDE)
    page.add_script_tag(path=AXE)
    light = page.evaluate(BACKGROUND)
    page.set_viewport_size({"width": AXE_PHONE, "height": 800})
    violations["in light colours on a phone"] = page.evaluate(RUN_AXE)
    violations["out of reach of the keyboard"] = page.evaluate(OUT_OF_REACH)
    violations["charts without a table"] = page.evaluate(CHARTS_WITHOUT_TABLE)
    page.emulate_media(color_scheme="dark")
    page.wait_for_function(f"{BACKGROUND} !== '{light}' && {AT_REST}")
    page.set_viewport_size({"width": AXE_LAPTOP, "height": 800})
    violations["in dark colours on a laptop"] = page.evaluate(RUN_AXE)
    return {check: elements for check, elements in violations.items() if elements}


@pytest.mark.variants("jobs")
@pytest.mark.parametrize("kind", VIEWS)
def test_views_are_accessible_at_every_width(
    server: ServerProcess,
    start_server: Callable[..., Server],
    finished_job: str,
    other_job: str,
    visit: Callable[..., Visit],
    kind: str,
) -> None:
    url = start_server().url if kind == "first run" else server.url
    # The content security policy would block the injected checker.
    visited = visit(url, viewport=PHONE, bypass_csp=True, allowed=REFUSED.get(kind, "$^"))
    violations = {}
    for name in VIEWS[kind]:
        # Avoids redrawing the previous view.
        visited.go("about:blank")
        visited.page.set_viewport_size(PHONE)
        visited.page.emulate_media(color_scheme="light")
        if of_view := findings(open_view(visited, name, finished_job, other_job)):
            violations[name] = of_view
    assert violations == {}


DIALOGS: Final = ("Extend…", "Label…", "Fork…")
"""Buttons of an ended job that open dialogs."""


def test_palette_and_dialogs_are_accessible(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit]
) -> None:
    # A tab without charts, which would be redrawn for each theme.
    visited = visit(server.url, viewport=PHONE, bypass_csp=True)
    page = visited.go(f"/jobs/{finished_job}/reproduce")
    commands = page.get_by_role("region", name="Job summary", exact=True)
    dialog = page.get_by_role("dialog")
    expect(commands.get_by_role("button", name="Actions")).to_be_visible()
    page.add_script_tag(path=AXE)
    violations = {}
    for name in ("Control+k", "?", *DIALOGS):
        page.emulate_media(color_scheme="light")
        if name in DIALOGS:
            choose(page, name)
        else:
            page.get_by_role("main").focus()
            page.keyboard.press(name)
        expect(dialog).to_be_visible()
        page.wait_for_function(AT_REST)
        violations[f"{name} in light colours"] = page.evaluate(RUN_AXE_IN_DIALOG)
        violations[f"{name} too wide"] = page.evaluate(TOO_WIDE)
        page.emulate_media(color_scheme="dark")
        page.wait_for_function(AT_REST)
        violations[f"{name} in dark colours"] = page.evaluate(RUN_AXE_IN_DIALOG, RULES_OF_COLOURS)
        page.keyboard.press("Escape")
        expect(dialog).to_have_count(0)
    assert {check: elements for check, elements in violations.items() if elements} == {}


@pytest.mark.thorough("the other theme")
def test_the_theme_follows_the_system_until_it_is_chosen(
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


@pytest.mark.thorough("two pages that are not ours")
def test_the_api_documentation_complies_with_its_content_security_policy(
    server: ServerProcess, visit: Callable[..., Visit]
) -> None:
    page = visit(server.url).go("/docs")

    expect(page.get_by_role("heading", name="gaitswarm").first).to_be_visible()
    expect(page.locator("html")).to_have_attribute("lang", "en")
