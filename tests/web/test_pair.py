"""Designs over two axes, linked to the other charts and the table."""

from __future__ import annotations

import re
from collections.abc import Callable
from itertools import product

import pytest
from playwright.sync_api import expect

from tests.examples.servers import ServerProcess
from tests.examples.walks import PUBLISHED_A
from tests.web.conftest import SMALL_JOB
from tests.web.test_links import SOME_OF_48
from tests.web.visit import Visit

pytestmark = pytest.mark.slow

MAP = re.compile("designs by .* and ")


@pytest.mark.thorough("test_brushing_an_axis_selects_designs")
def test_a_box_selects_in_all_charts_and_in_the_table(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit]
) -> None:
    page = visit(server.url).go(f"/jobs/{finished_job}/variables?x=FI1R&y=FI2R")
    chart = page.get_by_role("img", name=MAP)
    expect(chart).to_have_attribute("aria-label", "48 designs by FI1R and FI2R")
    chart.scroll_into_view_if_needed()
    box = chart.bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 0.1 * box["height"])
    page.mouse.down()
    page.mouse.move(box["x"] + 0.98 * box["width"], box["y"] + 0.9 * box["height"], steps=4)
    page.mouse.up()
    expect(page.locator("[data-selected]")).to_have_attribute("data-selected", SOME_OF_48)
    selected = int(page.locator("[data-selected]").get_attribute("data-selected") or 0)
    expect(chart).to_have_attribute("aria-label", f"{selected} designs by FI1R and FI2R")
    parallel = page.get_by_role("img", name=re.compile("^Parallel coordinates"))
    expect(parallel).to_have_attribute("aria-label", re.compile(f" {selected} of 48 designs"))
    page.get_by_text("Select by numbers").click()
    expect(page.get_by_label("FI1R from")).not_to_have_value("1500")
    rows = page.get_by_role("table", name="Designs", exact=True).locator("tbody tr")
    expect(rows).to_have_count(min(20, selected))
    page.get_by_role("button", name="Select all").first.click()
    expect(page.locator("[data-selected]")).to_have_attribute("data-selected", "48")


def test_ranks_are_shown_by_cell_and_axes_may_be_objectives(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit]
) -> None:
    page = visit(server.url).go(f"/jobs/{finished_job}/variables")
    page.get_by_label("objectives", exact=True).check()
    page.get_by_label("Across").select_option("energy")
    page.get_by_label("Up").select_option("torque")
    expect(page).to_have_url(re.compile("x=energy&(objectives=yes&)?y=torque"))
    expect(page.get_by_role("img", name=MAP)).to_have_attribute(
        "aria-label", "48 designs by energy and torque"
    )
    chart = page.locator(".pair-chart")
    expect(chart).to_contain_text("energy [J/m]")
    assert int(chart.locator("[data-ticks]").first.get_attribute("data-ticks") or 0) > 2
    page.get_by_label("mean rank by cell").check()
    expect(page).to_have_url(re.compile("as=ranks"))
    # The readout describes the cell under the pointer.
    box = chart.get_by_role("img").bounding_box()
    assert box is not None
    for across, up in product(range(14), range(14)):
        right, down = (across + 0.5) / 14, 1 - (up + 0.5) / 14
        page.mouse.move(box["x"] + box["width"] * right, box["y"] + box["height"] * down)
        if "mean rank" in chart.locator(".readout").inner_text():
            break
    else:
        raise AssertionError("no cell was described")
    # Few designs hardly ever fill four adjacent cells.
    page.get_by_label("isolines").check()
    expect(page).to_have_url(re.compile("isolines=yes"))
    expect(page.locator("[data-isolines], .isolines-none")).to_be_visible()
    page.get_by_role("button", name=re.compile("^Show as table.*Two axes")).click()
    cells = page.get_by_role("table", name="Designs by cell").locator("tbody tr")
    expect(cells.first).to_contain_text(" to ")


@pytest.mark.thorough("test_the_front_is_drawn_over_any_two_objectives_chosen_from_and_listed")
def test_a_clicked_design_is_highlighted_in_the_table(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit]
) -> None:
    page = visit(server.url).go(f"/jobs/{finished_job}/variables?x=FI1R&y=FI2R")
    chart = page.get_by_role("img", name=MAP)
    chart.scroll_into_view_if_needed()
    box = chart.bounding_box()
    assert box is not None
    marked = page.locator("[data-marked='true']")
    expect(marked).to_have_count(0)
    # There is a design somewhere along these lines.
    for share in (0.3, 0.5, 0.7):
        for step in range(1, 20):
            page.mouse.click(box["x"] + box["width"] * step / 20, box["y"] + box["height"] * share)
            if marked.count() == 1:
                return
    raise AssertionError("no click selected a design")


def test_the_best_selected_designs_are_distinct(
    server: ServerProcess, visit: Callable[..., Visit]
) -> None:
    # Three values of one variable for 48 designs.
    fixed = {name: value for name, value in PUBLISHED_A.items() if name != "FOMF"}
    job_id = server.submit(SMALL_JOB | {"variables": ["FOMF"], "fixed": fixed})
    job = server.wait_for(job_id, "succeeded")
    assert job["evaluations"] > 3
    page = visit(server.url).go(f"/jobs/{job_id}/variables")
    expect(page.locator("[data-selected]")).to_have_attribute(
        "data-selected", str(job["evaluations"])
    )
    table = page.get_by_role("table", name="Designs", exact=True)
    expect(table.locator("tbody tr")).not_to_have_count(0)
    values = table.locator("tbody tr").evaluate_all(
        "rows => rows.map((row) => [...row.cells].slice(1).map((cell) => cell.innerText).join())"
    )
    assert len(values) == len(set(values)) <= 3
