"""What a job's page lets people do to it, and what it says of that first."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest
from playwright.sync_api import Page, Route, expect

from tests.examples.jobs import SMALL_SPEC
from tests.examples.servers import Server, ServerProcess
from tests.web.conftest import SMALL_JOB
from tests.web.visit import Visit

pytestmark = pytest.mark.slow

SUBMITTED = re.compile(r"/jobs/(?!new)\w+$")
"""Address of a job's page."""


def named(page: Page, name: str) -> None:
    page.get_by_role("button", name=name, exact=True).click()


def answer_late(route: Route) -> None:
    """Let a page that asks for something meanwhile, as one does when the network is back, see that
    it is gone."""
    if route.request.method != "DELETE":
        route.continue_()
        return
    answer = route.fetch()
    page = route.request.frame.page
    page.evaluate("dispatchEvent(new Event('online'))")
    page.wait_for_timeout(200)
    route.fulfill(response=answer)


def test_a_job_is_deleted_after_its_page_has_said_what_is_lost_and_what_stays(
    server: ServerProcess, visit: Callable[..., Visit]
) -> None:
    job_id = server.submit(SMALL_JOB | {"name": "to be deleted"})
    job = server.wait_for(job_id, "succeeded")
    forked = server.client.post(
        f"/v1/jobs/{job_id}/fork", json={"from_iteration": 1, "name": "fork"}
    )
    fork = server.wait_for(forked.json()["id"], "succeeded")
    page = visit(server.url).go(f"/jobs/{job_id}")

    named(page, "Delete…")
    dialog = page.get_by_role("dialog")
    expect(dialog).to_contain_text(
        f"{job['iterations']} iterations with {job['evaluations']} evaluated designs are lost for"
        " good. Forks of the job keep their copies but lose their parent, and certificates of its"
        " designs stay as jobs of their own."
    )
    named(page, "Keep it")
    expect(dialog).to_be_hidden()
    assert server.job(job_id)["state"] == "succeeded"

    page.route(f"**/v1/jobs/{job_id}", answer_late)
    named(page, "Delete…")
    named(page, "Delete the job")
    expect(page).to_have_url(re.compile(r"/$"))
    expect(page.locator(f"a[href='/jobs/{fork['id']}']")).to_be_visible()
    expect(page.get_by_role("link", name="to be deleted")).to_have_count(0)
    assert server.client.get(f"/v1/jobs/{job_id}").status_code == 404
    left = server.client.get(f"/v1/jobs/{fork['id']}/iterations").json()["items"]
    assert len(left) == fork["iterations"]


def test_a_job_under_way_and_one_that_is_kept_offer_no_deletion(
    start_server: Callable[..., Server], visit: Callable[..., Visit]
) -> None:
    server = start_server()
    job_id = server.submit(SMALL_SPEC)
    page = visit(server.url).go(f"/jobs/{job_id}")
    expect(page.get_by_role("button", name="Cancel…")).to_be_visible()
    expect(page.get_by_role("button", name="Delete…")).to_have_count(0)

    named(page, "Cancel…")
    named(page, "Cancel the job")
    expect(page.get_by_role("button", name="Delete…")).to_be_visible()

    named(page, "Keep")
    expect(page.locator("[data-labels]")).to_have_text("kept")
    expect(page.get_by_role("button", name="Delete…")).to_have_count(0)
    assert server.job(job_id)["kept"]

    named(page, "Release")
    expect(page.get_by_role("button", name="Delete…")).to_be_visible()
    assert not server.job(job_id)["kept"]


STUB = """() => {
    window.notices = []
    window.Notification = class {
        static permission = 'default'
        static requestPermission = () => Promise.resolve('granted')
        constructor(title, { body }) { window.notices.push(`${title}; ${body}`) }
    }
}"""
"""A browser that allows notices, and keeps them: one without a screen refuses them all."""


def test_the_browser_tells_that_a_job_has_ended_if_it_was_asked_to(
    start_server: Callable[..., Server], visit: Callable[..., Visit]
) -> None:
    server = start_server()
    told, untold = (server.submit(SMALL_SPEC | {"name": name}) for name in ("told", "untold"))
    page = visit(server.url).go("/jobs")
    page.evaluate(STUB)
    for name, job_id in (("untold", untold), ("told", told)):
        page.get_by_role("link", name=name, exact=True).click()
        if job_id == told:
            named(page, "Tell me when it ends")
            expect(page.get_by_text("as long as this page is open")).to_be_visible()
        expect(page.get_by_role("button", name="Cancel…")).to_be_visible()
        server.client.post(f"/v1/jobs/{job_id}/cancel")
        expect(page.get_by_role("status").get_by_text("cancelled", exact=True)).to_be_visible()
        page.get_by_role("link", name="All jobs").click()
    assert page.evaluate("window.notices") == [
        "told: cancelled; 0 iterations, no design walks in every scenario"
    ]


def test_a_webhook_is_named_in_the_form_and_one_that_is_not_allowed_is_refused_there(
    start_server: Callable[..., Server], visit: Callable[..., Visit]
) -> None:
    server = start_server(webhook_hosts="ci.example")
    page = visit(server.url, allowed="status of 422").go("/jobs/new")
    webhook = page.get_by_label("Webhook")
    webhook.fill("https://elsewhere.example/hook")
    named(page, "Submit the job")
    expect(webhook).to_have_attribute("aria-invalid", "true")
    assert server.client.get("/v1/jobs").json()["items"] == []

    webhook.fill("https://ci.example/hook")
    named(page, "Submit the job")
    expect(page).to_have_url(SUBMITTED)
    job_id = page.url.rpartition("/")[2]
    server.client.post(f"/v1/jobs/{job_id}/cancel")
    (told,) = server.client.get(f"/v1/jobs/{job_id}/notifications").json()
    assert told["host"] == "ci.example"


def test_a_job_has_a_priority_from_the_form_and_another_one_from_its_page(
    start_server: Callable[..., Server], visit: Callable[..., Visit]
) -> None:
    server = start_server()
    page = visit(server.url).go("/jobs/new")
    page.get_by_label(re.compile("^Priority")).fill("3")
    named(page, "Submit the job")
    expect(page).to_have_url(SUBMITTED)
    job_id = page.url.rpartition("/")[2]
    assert server.job(job_id)["priority"] == 3
    expect(page.get_by_role("region", name="The job")).to_contain_text("priority 3")

    named(page, "Priority…")
    wanted = page.get_by_role("dialog").get_by_label(re.compile("^Priority"))
    change = page.get_by_role("button", name="Change the priority")
    wanted.fill("11")
    expect(change).to_be_disabled()
    wanted.fill("-4")
    change.click()
    expect(page.get_by_role("region", name="The job")).to_contain_text("priority -4")
    assert server.job(job_id)["priority"] == -4

    page.goto(server.url)
    expect(page.get_by_role("row").filter(has_text=job_id)).to_contain_text("-4")


def test_an_answer_from_before_a_command_is_not_shown_after_it(
    start_server: Callable[..., Server], visit: Callable[..., Visit]
) -> None:
    server = start_server()
    job_id = server.submit(SMALL_SPEC)
    server.client.post(f"/v1/jobs/{job_id}/cancel").raise_for_status()
    visited = visit(server.url)
    asked: list[str] = []

    def answer_after_the_command(route: Route) -> None:
        asked.append(route.request.url)
        if len(asked) != 2:
            route.continue_()
            return
        answer = route.fetch()
        page = route.request.frame.page
        named(page, "Keep")
        expect(page.locator("[data-labels]")).to_have_text("kept")
        route.fulfill(response=answer)

    visited.page.route(f"**/v1/jobs/{job_id}", answer_after_the_command)
    page = visited.go(f"/jobs/{job_id}")
    expect(page.locator("[data-labels]")).to_have_text("kept")
    page.wait_for_timeout(300)
    assert len(asked) >= 2
    expect(page.locator("[data-labels]")).to_have_text("kept")
