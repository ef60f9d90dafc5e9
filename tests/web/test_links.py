"""What is seen is in the address: a link shows it again, a broken one still shows the page."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest
from playwright.sync_api import expect

from tests.examples.servers import ServerProcess
from tests.web.visit import Visit

pytestmark = pytest.mark.slow


def test_a_link_shows_what_was_seen(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit]
) -> None:
    page = visit(server.url).go(f"/jobs/{finished_job}/variables?brush=FI1R:1500:3000,none:1:2")
    # An axis that is not there changes nothing, and is told.
    expect(page.get_by_text("is ignored")).to_contain_text("brush=none:1:2")
    some = int(page.locator("[data-selected]").get_attribute("data-selected") or 0)
    assert 0 < some < 48
    page.get_by_text("Select by numbers").click()
    page.get_by_label("FI1R to").fill("2500")
    page.get_by_label("FI1R to").blur()
    expect(page).to_have_url(re.compile(r"brush=FI1R%3A1500%3A2500$"))
    seen = page.locator("[data-selected]").get_attribute("data-selected")
    page.reload()
    expect(page.locator("[data-selected]")).to_have_attribute("data-selected", str(seen))
    expect(page.get_by_text("is ignored")).to_have_count(0)

    crumbs = page.get_by_role("navigation", name="Breadcrumbs")
    expect(crumbs.get_by_role("listitem")).to_have_text(["All jobs", "small", "Variables"])
    page.goto(f"/jobs/{finished_job}/iterations?sort=-worst")
    expect(page.get_by_role("columnheader", name="Worst")).to_have_attribute(
        "aria-sort", "descending"
    )
    page.get_by_role("button", name="Failed").click()
    expect(page).to_have_url(re.compile("sort=failed$"))
