"""Forks, evidence and verification on the page."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest
from playwright.sync_api import Route, expect

import gaitswarm
from tests.examples.servers import ServerProcess
from tests.web.visit import Visit

pytestmark = pytest.mark.slow


def test_a_fork_and_its_parent_link_to_each_other(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit]
) -> None:
    page = visit(server.url).go(f"/jobs/{finished_job}")
    expect(page.get_by_text("Computing time", exact=True)).to_be_visible()
    assert page.locator("[data-forks], [data-parent]").count() == 0

    page.goto(f"{server.url}/jobs/{finished_job}/iterations/1")
    page.get_by_label("Other iterations").get_by_role("button", name="Fork…").click()
    dialog = page.get_by_role("dialog", name="Fork the job")
    # The default is the iteration after the one shown.
    expect(dialog.get_by_label("First new iteration")).to_have_value("2")
    submit = dialog.get_by_role("button", name="Fork the job")
    budget = dialog.get_by_label("Iterations in total")
    budget.fill("2")
    expect(submit).to_be_disabled()
    budget.fill("3")
    dialog.get_by_label("Name").fill("another way")
    dialog.get_by_label("Method").select_option("random")
    submit.click()
    expect(page).not_to_have_url(re.compile(finished_job))
    fork_id = page.url.rpartition("/")[2]
    server.wait_for(fork_id, "succeeded")
    parent = page.locator(f"[data-parent='{finished_job}']")
    expect(parent).to_contain_text("with another optimizer")
    expect(parent).to_contain_text("another search method")
    parent.get_by_role("link").click()
    expect(page).to_have_url(f"{server.url}/jobs/{finished_job}")
    forks = page.locator("[data-forks='1']")
    expect(forks).to_contain_text("from iteration 2")
    forks.get_by_role("link", name=fork_id).click()
    expect(page).to_have_url(f"{server.url}/jobs/{fork_id}")

    page.goto(f"{server.url}/jobs")
    row = page.get_by_role("row").filter(has_text="another way")
    expect(row).to_contain_text(f"fork of {finished_job}")


@pytest.mark.thorough("test_a_fork_and_its_parent_link_to_each_other")
def test_no_button_moves_when_the_forks_are_loaded(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit]
) -> None:
    (job,) = server.client.get("/v1/jobs", params={"search": finished_job}).json()["items"]
    lineage = {"from_iteration": 2, "changed": ["optimizer", "preference"]}
    forks = [job | {"id": f"fork{n}", "lineage": lineage} for n in range(12)]
    requests: list[Route] = []

    def hold(route: Route) -> None:
        requests.append(route)

    visited = visit(server.url)
    visited.page.route("**/v1/jobs?parent=*", hold)
    with visited.page.expect_request("**/v1/jobs?parent=*"):
        page = visited.go(f"/jobs/{finished_job}")
    button = page.get_by_role("button", name="Extend…")
    expect(page.get_by_text("Computing time", exact=True)).to_be_visible()
    before = button.bounding_box()

    requests[0].fulfill(json={"items": forks, "next": None})
    expect(page.locator("[data-forks='12']")).to_be_visible()
    assert button.bounding_box() == before is not None


def test_evidence_is_downloaded_and_verified(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit]
) -> None:
    page = visit(server.url).go(f"/jobs/{finished_job}/reproduce")
    evidence = page.get_by_role("region", name="Evidence")
    with page.expect_download() as download:
        evidence.get_by_role("link", name="Download").click()
    assert download.value.suggested_filename == f"{finished_job}.zip"
    assert gaitswarm.verify(download.value.path(), replay=1).verified


def test_the_history_is_verified(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit]
) -> None:
    page = visit(server.url).go(f"/jobs/{finished_job}/reproduce")
    card = page.get_by_role("region", name="Provenance")
    with gaitswarm.connect(server.url) as jobs:
        head = jobs.job(finished_job).head
    expect(card.locator(f"[data-head='{head}']")).to_contain_text(str(head)[:16])
    card.get_by_role("button", name="Verify").click()
    verified = card.locator("[data-verified='true']")
    expect(verified).to_contain_text("History verified: ")
    expect(verified).to_contain_text(f"iterations chained, head {head}")
