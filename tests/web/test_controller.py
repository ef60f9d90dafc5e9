"""Controller page: surface and its values."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
import pytest
from playwright.sync_api import expect

from tests.examples.servers import ServerProcess
from tests.web.pixels import colourful, painted
from tests.web.visit import Visit

pytestmark = pytest.mark.slow


SHIFTS = """() => new Promise((resolve) => {
    let sum = 0
    const add = (list) => { for (const { value } of list.getEntries()) sum += value }
    new PerformanceObserver(add).observe({ type: 'layout-shift', buffered: true })
    setTimeout(() => resolve(sum), 200)
})"""
"""Cumulative layout shift since the page was opened."""


def test_the_surface_is_drawn_with_the_values_of_the_api(
    server: ServerProcess, visit: Callable[..., Visit]
) -> None:
    controllers = server.client.get("/v1/controllers").json()["items"]
    design = next(c["published"]["A"] for c in controllers if c["name"] == "fuzzy-pi")
    grid = {"error_points": 65, "current_points": 33}
    surface = server.client.post(
        "/v1/controllers/fuzzy-pi/surface", json=grid | {"design": design}
    ).json()
    inference = np.array(surface["outputs"][0]["inference"])
    page = visit(server.url).go("/controller?published=A&camera=-1.5:-2.5:1.5:0:0:-0.04")

    drawn = page.locator("[data-surface]")
    expect(drawn.locator("canvas")).to_be_visible()
    expect(drawn).to_have_attribute("data-cells", str(inference.size))
    for name, value in (("min", inference.min()), ("max", inference.max())):
        assert float(drawn.get_attribute(f"data-{name}") or "nan") == pytest.approx(value)
    # Nothing moves while the surface loads.
    expect(page.get_by_role("table", name="Design values")).to_be_visible()
    assert page.evaluate(SHIFTS) < 0.05
    painted(drawn.locator("canvas"), colourful(200))

    # The camera of the link: rotating back and forth restores it.
    drawn.press("ArrowLeft")
    expect(page).not_to_have_url(re.compile("camera=-1.5"))
    drawn.press("ArrowRight")
    expect(page).to_have_url(re.compile(re.escape("camera=-1.5%3A-2.5%3A1.5%3A0%3A0%3A-0.04")))
    page.get_by_role("button", name="Reset view").click()
    expect(page).not_to_have_url(re.compile("camera="))

    heat = page.locator('canvas[data-layer="inference"]')
    painted(heat, colourful(50))
    box = page.get_by_role("application", name="Inference over error and current")
    before = heat.get_attribute("data-value")
    box.hover(position={"x": 80, "y": 60})
    expect(heat).not_to_have_attribute("data-value", before or "")
    under_pointer = heat.get_attribute("data-value") or "nan"
    assert np.isclose(inference, float(under_pointer)).any()
    box.focus()
    page.keyboard.press("ArrowRight")
    expect(heat).not_to_have_attribute("data-value", under_pointer)


@pytest.mark.thorough("test_the_surface_is_drawn_with_the_values_of_the_api")
def test_a_controller_without_rules_is_shown_by_its_gains(
    server: ServerProcess, visit: Callable[..., Visit]
) -> None:
    page = visit(server.url).go("/controller?controller=pi")

    expect(page.locator('[data-linear="pi"]')).to_be_visible()
