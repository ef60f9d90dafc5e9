"""Job page during network outages and after failures."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path

import pytest
from playwright.sync_api import expect

from gaitswarm.services.optimizer.jobs.job import JobState
from gaitswarm.services.runtime import open_store
from tests.examples.servers import Server, ServerProcess
from tests.web.conftest import SMALL_JOB
from tests.web.job_page import expect_state, job_element, shown_iteration, wait_for_iteration
from tests.web.proxy import CuttableProxy
from tests.web.visit import Visit

pytestmark = pytest.mark.slow

BROKEN = "ERR_CONNECTION|ERR_EMPTY_RESPONSE|ERR_INCOMPLETE_CHUNKED|ERR_SOCKET|ERR_NETWORK"


@pytest.fixture
def proxy(server: ServerProcess) -> Iterator[CuttableProxy]:
    proxy = CuttableProxy(server.url)
    yield proxy
    proxy.close()


def test_a_broken_stream_is_marked_stale_and_resumes_without_a_gap_or_errors(
    server: ServerProcess, proxy: CuttableProxy, visit: Callable[..., Visit]
) -> None:
    job_id = server.submit(SMALL_JOB | {"iterations": 5000})
    page = visit(proxy.url, allowed=BROKEN).go(f"/jobs/{job_id}")
    wait_for_iteration(page, 2)

    proxy.cut()

    expect(job_element(page)).to_have_attribute("data-stream", "stale")
    expect(page.get_by_text("stale since")).to_be_visible()
    last = shown_iteration(page)
    # The job continues meanwhile.
    while server.job(job_id)["iterations"] < last + 10:
        page.wait_for_timeout(50)
    assert shown_iteration(page) == last
    # Commands fail, and so does code that was not loaded before.
    page.get_by_role("button", name="Pause").click()
    expect(page.get_by_text("The command failed.")).to_be_visible()
    page.get_by_role("link", name="Explore").click()
    expect(page.get_by_text(re.compile("^Could not load"))).to_be_visible()

    proxy.mend()

    expect(page.locator("[data-selected]")).to_be_visible()
    expect(page.get_by_role("alert")).to_have_count(0)
    wait_for_iteration(page, last + 12)
    expect(job_element(page)).to_have_attribute("data-stream", "open")
    expect(page.get_by_text("stale since")).to_be_hidden()
    server.client.post(f"/v1/jobs/{job_id}/cancel")
    expect_state(page, "cancelled")
    committed = server.job(job_id)["iterations"]
    wait_for_iteration(page, committed - 1)
    assert shown_iteration(page) == committed - 1
    page.get_by_role("link", name="Details", exact=True).click()
    page.get_by_role("link", name="Iterations", exact=True).click()
    expect(page.get_by_text(f"{committed} of {committed}", exact=True)).to_be_visible()


def test_code_that_is_missing_after_a_reload_as_well_is_an_error(
    server: ServerProcess, visit: Callable[..., Visit]
) -> None:
    job_id = server.submit(SMALL_JOB)
    page = visit(server.url, allowed="ERR_FAILED").go(f"/jobs/{job_id}")
    expect(page.get_by_role("link", name="Explore")).to_be_visible()
    page.route("**/assets/panel-*", lambda route: route.abort())
    loads = []
    page.on("load", lambda _: loads.append("load"))
    with page.expect_event("load"):
        page.get_by_role("link", name="Explore").click()
    expect(page.get_by_text(re.compile("^Could not load the code"))).to_be_visible()
    page.wait_for_timeout(3000)
    assert len(loads) == 1


def test_a_failed_job_is_shown_with_its_reason(
    start_server: Callable[..., Server], tmp_path: Path, visit: Callable[..., Visit]
) -> None:
    server = start_server()
    job_id = server.submit(SMALL_JOB)
    page = visit(server.url).go(f"/jobs/{job_id}")
    expect_state(page, "queued")

    # Simulate a runner that claims the job and fails.
    with closing(open_store(str(tmp_path / "jobs.db"))) as store:
        claim = store.claim("test", lease_seconds=60.0, job_id=job_id)
        assert claim is not None
        expect_state(page, "running")
        store.release(claim, JobState.FAILED, error="the workers are away; start them, resume")

    expect_state(page, "failed")
    expect(page.get_by_role("alert")).to_contain_text("the workers are away; start them, resume")
    expect(page.get_by_role("button", name="Resume")).to_be_visible()
    page.goto("/jobs")
    row = page.locator(f'[data-job="{job_id}"]')
    expect(row).to_have_attribute("data-state", "failed")
    expect(row).to_contain_text("the workers are away")
