"""Analysis tab: variable importance and active bounds."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any
from urllib.parse import parse_qs, urlsplit

import pytest
from playwright.sync_api import expect

from tests.examples.servers import Server, ServerProcess
from tests.web.conftest import SMALL_JOB
from tests.web.visit import Visit

pytestmark = pytest.mark.slow


def importance_of(server: ServerProcess, job_id: str) -> Any:
    return server.client.get(f"/v1/jobs/{job_id}/importance").json()


@pytest.mark.thorough("test_active_bounds_are_widened_in_the_form, with a longer job")
def test_variables_are_sorted_by_importance_for_the_chosen_output(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit]
) -> None:
    importance = importance_of(server, finished_job)
    page = visit(server.url).go(f"/jobs/{finished_job}")
    page.get_by_role("link", name="Explore").click()
    page.get_by_role("link", name="Importance").click()
    bars = page.locator("[data-output] [data-variable]")
    expect(bars).to_have_count(len(importance["variables"]))
    for output in ("fitness", "energy"):
        page.get_by_role("main").get_by_role("combobox").select_option(output)
        expect(page.locator(f"[data-output='{output}']")).to_be_visible()
        values = {
            v["name"]: v["fitness"] if output == "fitness" else v["objectives"][output]
            for v in importance["variables"]
        }
        most = max(values, key=lambda name: values[name]["value"])
        expect(bars.first).to_have_attribute("data-variable", most)
        expect(bars.first).to_contain_text("%")
    assert parse_qs(urlsplit(page.url).query)["of"] == ["energy"]

    page.get_by_role("button", name=re.compile("^Show as table.*Variable importance")).click()
    table = page.get_by_role("table", name="Importance of every variable")
    expect(table.locator("tbody tr")).to_have_count(len(importance["variables"]))
    expect(table.get_by_role("columnheader", name="energy")).to_be_visible()


def test_active_bounds_are_widened_in_the_form(
    server: ServerProcess, visit: Callable[..., Visit]
) -> None:
    # All designs are at the upper bound of P.
    narrow = SMALL_JOB | {
        "controller": "pi",
        "variables": [{"name": "P", "low": 0.05, "high": 0.1}, "I"],
        "start": [{"P": 0.1, "I": 0.2}, {"P": 0.1, "I": 0.5}],
        "optimizer": {"name": "pso", "particles": 2},
        "iterations": 1,
    }
    job_id = server.submit(narrow)
    server.wait_for(job_id, "succeeded")
    importance = {v["name"]: v for v in importance_of(server, job_id)["variables"]}
    assert importance["P"]["at"] == "high"
    page = visit(server.url).go(f"/jobs/{job_id}/analysis")
    active = page.locator("[data-active-bounds]")
    expect(active).to_have_attribute("data-active-bounds", re.compile(r"\bP\b"))
    row = page.get_by_role("table", name="Variables with the winner at a bound").get_by_role(
        "row", name="P "
    )
    expect(row).to_contain_text("0.05 to 0.1")
    page.get_by_role("link", name="Widen and run again").click()
    expect(page.get_by_label("Upper bound of P")).to_have_value(
        str(importance["P"]["widened"]["high"])
    )
    expect(page.get_by_label("Lower bound of P")).to_have_value("0.05")


@pytest.mark.thorough("test_a_queued_job_has_no_front, on another tab")
def test_before_the_first_iteration_there_is_nothing_to_analyse(
    start_server: Callable[..., Server], visit: Callable[..., Visit]
) -> None:
    server = start_server()
    page = visit(server.url).go(f"/jobs/{server.submit(SMALL_JOB)}/analysis")
    expect(page.get_by_role("heading", name="Nothing to analyse yet")).to_be_visible()


def test_an_error_can_be_retried(
    server: ServerProcess, finished_job: str, visit: Callable[..., Visit]
) -> None:
    visited = visit(server.url, allowed="status of 503")
    problem = '{"type": "about:blank", "title": "Busy", "status": 503, "detail": "too many"}'
    broken = {"status": 503, "content_type": "application/problem+json", "body": problem}
    visited.page.route("**/importance", lambda route: route.fulfill(**broken))
    page = visited.go(f"/jobs/{finished_job}/analysis")
    expect(page.get_by_role("alert")).to_contain_text("Could not load the variable importance.")
    visited.page.unroute("**/importance")
    page.get_by_role("button", name="Try again").click()
    expect(page.locator("[data-output='fitness']")).to_be_visible()
