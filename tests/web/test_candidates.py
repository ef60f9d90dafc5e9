"""Searches for preferences on the page: what each preference buys, and a job tuned by one."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from playwright.sync_api import expect

from tests.examples.preferences import DOCUMENT
from tests.examples.servers import ServerProcess
from tests.web.visit import Visit

pytestmark = pytest.mark.slow


def test_candidates_are_shown_against_the_reference_and_can_be_tuned_by(
    server: ServerProcess, visit: Callable[..., Visit]
) -> None:
    job_id = server.submit(DOCUMENT)
    server.wait_for(job_id, "succeeded")
    view = server.client.get(f"/v1/jobs/{job_id}/preferences").json()
    page = visit(server.url).go(f"/jobs/{job_id}")

    table = page.get_by_role("table", name="Preferences and their optima")
    names = [c["named"] or f"{c['iteration']}.{c['particle']}" for c in view["candidates"]]
    expect(table.get_by_role("rowheader")).to_have_text([*names, "reference"])
    expect(page.locator(f'[data-recommended="{names[0]}"]')).to_be_visible()
    change = 100.0 * view["candidates"][0]["changes"]["energy"]
    cell = page.locator(f'[data-candidate="{names[0]}"]')
    expect(cell).to_contain_text(f"{abs(change):.2g}")

    page.locator('[data-candidate="B"]').get_by_role("link", name="Tune by it").click()
    expect(page.get_by_role("heading", name="New job")).to_be_visible()
    expect(page.get_by_label("exponent of acceleration", exact=True)).to_have_value("0.6")


def test_a_search_is_submitted_from_the_job_that_it_tunes(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit]
) -> None:
    page = visit(server.url).go(f"/jobs/{finished_job}/robustness")
    page.get_by_role("button", name="Search for preferences").click()
    expect(page.get_by_role("heading", name="preferences of small")).to_be_visible()
    job_id = page.url.rpartition("/")[2]
    spec = server.client.get(f"/v1/jobs/{job_id}").json()["spec"]
    best = server.client.get(f"/v1/jobs/{finished_job}/best").json()["design"]
    assert (spec["kind"], spec["tuning"]["start"][0]) == ("preferences", best)
    server.client.post(f"/v1/jobs/{job_id}/cancel")
