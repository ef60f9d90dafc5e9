"""Forks, evidence and verification on the page."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest
from playwright.sync_api import expect

import gaitswarm
from tests.examples.servers import ServerProcess
from tests.web.visit import Visit

pytestmark = pytest.mark.slow


def test_a_fork_and_its_parent_link_to_each_other(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit]
) -> None:
    page = visit(server.url).go(f"/jobs/{finished_job}/iterations/1")
    page.get_by_label("Other iterations").get_by_role("button", name="Fork…").click()
    dialog = page.get_by_role("dialog", name="Fork the job")
    # The default is the iteration after the one shown.
    expect(dialog.get_by_label("First new iteration")).to_have_value("2")
    submit = dialog.get_by_role("button", name="Fork the job")
    budget = dialog.get_by_label("Evaluations in total")
    budget.fill("16")
    expect(submit).to_be_disabled()
    budget.fill("24")
    dialog.get_by_label("Name").fill("another way")
    dialog.get_by_label("Method").select_option("random")
    dialog.get_by_text("Weights of the scenarios, all 1").click()
    dialog.get_by_label("Weight of loaded").fill("2")
    submit.click()
    expect(page).not_to_have_url(re.compile(finished_job))
    fork_id = page.url.rpartition("/")[2]
    fork = server.wait_for(fork_id, "succeeded")
    assert fork["spec"]["scenario_weights"] == {"loaded": 2.0}
    assert fork["evaluations"] == 24
    page.get_by_role("link", name="Details", exact=True).click()
    parent = page.locator(f"[data-parent='{finished_job}']")
    expect(parent).to_contain_text("with another optimizer")
    expect(parent).to_contain_text("another search method")
    expect(page.locator("[data-forks]")).to_have_count(0)
    # By key: figures above the link come later and move it.
    parent.get_by_role("link").press("Enter")
    expect(page).to_have_url(f"{server.url}/jobs/{finished_job}")
    page.get_by_role("link", name="Details", exact=True).click()
    forks = page.locator("[data-forks='1']")
    expect(forks).to_contain_text("from iteration 2")
    expect(page.locator("[data-parent]")).to_have_count(0)
    expect(forks.get_by_role("link", name=fork_id)).to_have_attribute("href", f"/jobs/{fork_id}")

    page.get_by_role("link", name="All jobs").click()
    row = page.get_by_role("row").filter(has_text="another way")
    expect(row).to_contain_text(f"fork of {finished_job}")


def test_history_and_downloaded_evidence_are_verified(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit]
) -> None:
    page = visit(server.url).go(f"/jobs/{finished_job}/reproduce")
    evidence = page.get_by_role("region", name="Evidence")
    with page.expect_download() as download:
        evidence.get_by_role("link", name="Download").click()
    assert download.value.suggested_filename == f"{finished_job}.zip"
    assert gaitswarm.verify(download.value.path(), replay=1).verified

    card = page.get_by_role("region", name="Provenance")
    with gaitswarm.connect(server.url) as jobs:
        head = jobs.job(finished_job).head
    expect(card.locator(f"[data-head='{head}']")).to_contain_text(str(head)[:16])
    card.get_by_role("button", name="Verify").click()
    verified = card.locator("[data-verified='true']")
    expect(verified).to_contain_text("History verified: ")
    expect(verified).to_contain_text(f"iterations chained, head {head}")
