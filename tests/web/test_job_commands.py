"""Commands on the page of a job."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest
from playwright.sync_api import Page, Route, expect

from tests.examples.jobs import SMALL_SPEC
from tests.examples.servers import Server
from tests.web.job_page import choose, command
from tests.web.visit import Visit

pytestmark = pytest.mark.slow

SUBMITTED = re.compile(r"/jobs/(?!new)\w+$")
"""Address of a submitted job."""


def click_button(page: Page, name: str) -> None:
    page.get_by_role("button", name=name, exact=True).click()


def respond_late(route: Route) -> None:
    """Delay the response to a deletion while the page polls, as after a network outage."""
    if route.request.method != "DELETE":
        route.continue_()
        return
    answer = route.fetch()
    page = route.request.frame.page
    page.evaluate("dispatchEvent(new Event('online'))")
    page.wait_for_timeout(200)
    route.fulfill(response=answer)


def test_a_deleted_job_is_restored_from_the_list_and_from_its_page(
    start_server: Callable[..., Server], visit: Callable[..., Visit]
) -> None:
    server = start_server()
    job_id, other = (server.submit(SMALL_SPEC | {"name": name}) for name in ("deleted", "other"))
    server.client.post(f"/v1/jobs/{job_id}/cancel").raise_for_status()
    page = visit(server.url, allowed="status of 404").go(f"/jobs/{job_id}")

    page.route(f"**/v1/jobs/{job_id}", respond_late)
    choose(page, "Delete")
    expect(page).to_have_url(re.compile(r"/$"))
    expect(page.locator(f"a[href='/jobs/{other}']")).to_be_visible()
    listed = page.get_by_role("link", name="deleted", exact=True)
    expect(listed).to_have_count(0)
    assert server.client.get(f"/v1/jobs/{job_id}").status_code == 404
    expect(page.get_by_text("1 job deleted. They can be restored for 24 hours.")).to_be_visible()
    click_button(page, "Undo")
    expect(listed).to_be_visible()
    assert server.job(job_id)["state"] == "cancelled"

    server.client.delete(f"/v1/jobs/{job_id}")
    page.goto(f"/jobs/{job_id}")
    click_button(page, "Restore the deleted job")
    expect(page.get_by_role("heading", name="deleted")).to_be_visible()


def test_active_and_protected_jobs_cannot_be_deleted(
    start_server: Callable[..., Server], visit: Callable[..., Visit]
) -> None:
    server = start_server()
    job_id = server.submit(SMALL_SPEC)
    page = visit(server.url).go(f"/jobs/{job_id}")
    expect(command(page, "Cancel…")).to_have_count(1)
    expect(command(page, "Delete")).to_have_count(0)

    choose(page, "Cancel…")
    click_button(page, "Cancel the job")
    expect(command(page, "Delete")).to_have_count(1)

    choose(page, "Keep")
    expect(page.locator("[data-labels]")).to_have_text("kept")
    expect(command(page, "Delete")).to_have_count(0)
    assert server.job(job_id)["kept"]

    choose(page, "Release")
    expect(command(page, "Delete")).to_have_count(1)
    assert not server.job(job_id)["kept"]


STUB = """() => {
    window.notices = []
    window.Notification = class {
        static permission = 'default'
        static requestPermission = () => Promise.resolve('granted')
        constructor(title, { body }) { window.notices.push(`${title}; ${body}`) }
    }
}"""
"""Records notifications, which a headless browser blocks."""


def test_the_browser_notifies_of_the_end_of_a_job_on_request(
    start_server: Callable[..., Server], visit: Callable[..., Visit]
) -> None:
    server = start_server()
    notified, silent = (
        server.submit(SMALL_SPEC | {"name": name}) for name in ("notified", "silent")
    )
    page = visit(server.url).go("/jobs")
    page.evaluate(STUB)
    for name, job_id in (("silent", silent), ("notified", notified)):
        page.get_by_role("link", name=name, exact=True).click()
        if job_id == notified:
            click_button(page, "Notify me when it ends")
            expect(page.get_by_text("while this page is open")).to_be_visible()
        expect(command(page, "Cancel…")).to_have_count(1)
        server.client.post(f"/v1/jobs/{job_id}/cancel")
        expect(page.get_by_role("status").get_by_text("cancelled", exact=True)).to_be_visible()
        page.get_by_role("link", name="All jobs").click()
    assert page.evaluate("window.notices") == [
        "notified: cancelled; 0 evaluations, no design walks in every scenario"
    ]


@pytest.mark.thorough(
    "test_the_priority_is_set_in_the_form_and_changed_on_the_page, with another field"
)
def test_a_webhook_is_set_in_the_form_unless_its_host_is_not_allowed(
    start_server: Callable[..., Server], visit: Callable[..., Visit]
) -> None:
    server = start_server(webhook_hosts="ci.example")
    page = visit(server.url, allowed="status of 422").go("/jobs/new")
    page.get_by_text("Priority and webhook").click()
    webhook = page.get_by_label("Webhook")
    webhook.fill("https://elsewhere.example/hook")
    click_button(page, "Submit the job")
    expect(webhook).to_have_attribute("aria-invalid", "true")
    assert server.client.get("/v1/jobs").json()["items"] == []

    webhook.fill("https://ci.example/hook")
    click_button(page, "Submit the job")
    expect(page).to_have_url(SUBMITTED)
    job_id = page.url.rpartition("/")[2]
    server.client.post(f"/v1/jobs/{job_id}/cancel")
    (notification,) = server.client.get(f"/v1/jobs/{job_id}/notifications").json()
    assert notification["host"] == "ci.example"


def test_the_priority_is_set_in_the_form_and_changed_on_the_page(
    start_server: Callable[..., Server], visit: Callable[..., Visit]
) -> None:
    server = start_server()
    page = visit(server.url).go("/jobs/new")
    page.get_by_text("Priority and webhook").click()
    page.get_by_label(re.compile("^Priority")).fill("3")
    click_button(page, "Submit the job")
    expect(page).to_have_url(SUBMITTED)
    job_id = page.url.rpartition("/")[2]
    assert server.job(job_id)["priority"] == 3
    expect(page.get_by_role("region", name="Job summary")).to_contain_text("priority 3")

    choose(page, "Priority…")
    priority = page.get_by_role("dialog").get_by_label(re.compile("^Priority"))
    change = page.get_by_role("button", name="Change priority")
    priority.fill("11")
    expect(change).to_be_disabled()
    priority.fill("-4")
    change.click()
    expect(page.get_by_role("region", name="Job summary")).to_contain_text("priority -4")
    assert server.job(job_id)["priority"] == -4

    page.goto(server.url)
    expect(page.get_by_role("row").filter(has_text=job_id)).to_contain_text("-4")


@pytest.mark.thorough("test_the_priority_is_set_in_the_form_and_changed_on_the_page")
def test_a_response_older_than_a_command_is_ignored(
    start_server: Callable[..., Server], visit: Callable[..., Visit]
) -> None:
    server = start_server()
    job_id = server.submit(SMALL_SPEC)
    server.client.post(f"/v1/jobs/{job_id}/cancel").raise_for_status()
    visited = visit(server.url)
    requested: list[str] = []

    def respond_after_the_command(route: Route) -> None:
        requested.append(route.request.url)
        if len(requested) != 2:
            route.continue_()
            return
        answer = route.fetch()
        page = route.request.frame.page
        choose(page, "Keep")
        expect(page.locator("[data-labels]")).to_have_text("kept")
        route.fulfill(response=answer)

    visited.page.route(f"**/v1/jobs/{job_id}", respond_after_the_command)
    page = visited.go(f"/jobs/{job_id}")
    expect(page.locator("[data-labels]")).to_have_text("kept")
    page.wait_for_timeout(300)
    assert len(requested) >= 2
    expect(page.locator("[data-labels]")).to_have_text("kept")
