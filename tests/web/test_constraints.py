"""Constraints of a new job: entered as text, refused by name, kept by a copy of the job."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest
from playwright.sync_api import expect

from gaitswarm.services.optimizer.jobs.constraints import Constraint
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from tests.examples.servers import Server, ServerProcess
from tests.web.conftest import SMALL_JOB
from tests.web.test_job import fill_in, submitted
from tests.web.visit import Visit

pytestmark = pytest.mark.slow


def test_the_default_constraints_are_replaced_by_text_and_kept_by_a_copy_of_the_job(
    start_server: Callable[..., Server], visit: Callable[..., Visit]
) -> None:
    server = start_server()
    page = visit(server.url, allowed="status of 422").go("/jobs/new")
    fill_in(page, "by default", iterations=1)
    page.get_by_text("Weights of the scenarios, all 1").click()
    page.get_by_label(re.compile("^Weight of ")).fill("2")
    page.get_by_role("button", name="Submit the job").click()
    job_id = submitted(page)
    spec = server.job(job_id)["spec"]
    # The gait is searched too, and no objective may be worse than the published design's.
    (constraint,) = spec["constraints"]
    assert (constraint["quantity"], constraint["relative_to"]) == ("*", "published:A")
    expected = JobSpec(
        constraints=(Constraint(quantity="*", relative_to="published:A", max=1.0),)
    ).with_gait_searched()
    searched = {v["name"]: (v["low"], v["high"]) for v in spec["variables"]}
    assert searched == {v.name: (v.low, v.high) for v in expected.design_space().variables}
    assert list(spec["scenario_weights"].values()) == [2.0]

    page.goto(f"/jobs/new?clone={job_id}")
    constraints = page.get_by_label(re.compile("^Constraints"))
    expect(constraints).to_have_value("*<=1*published:A")
    constraints.fill("sped>=0.05")
    page.get_by_role("button", name="Submit the job").click()
    expect(constraints).to_have_attribute("aria-invalid", "true")
    expect(page.get_by_text(re.compile("^0.quantity: unknown quantity 'sped'"))).to_be_visible()
    constraints.fill("speed>=0.001\n*<=3*published:A")
    page.get_by_role("button", name="Submit the job").click()

    speed, published = server.job(submitted(page))["spec"]["constraints"]
    assert (speed["quantity"], speed["min"], speed["relative_to"]) == ("speed", 0.001, None)
    assert (published["relative_to"], published["max"]) == ("published:A", 3.0)


def test_a_job_without_a_feasible_design_says_what_stands_in_the_way_and_what_to_do(
    server: ServerProcess, visit: Callable[..., Visit]
) -> None:
    job_id = server.submit(SMALL_JOB | {"iterations": 1, "constraints": ["speed>=0.5"]})
    server.wait_for(job_id, "succeeded")
    page = visit(server.url).go(f"/jobs/{job_id}")
    expect(page.get_by_role("status").locator(".badge")).to_have_text("no design found")
    card = page.get_by_role("region", name="Verdict")
    expect(card).to_contain_text("no design met the constraints; closest is")
    expect(card).to_contain_text("instead of at least 0.5 m/s")
    expect(card).to_contain_text(f"gaitswarm fork {job_id} --from 1 --iterations 2 --constraint")
    # There is no convergence to draw.
    chart = page.get_by_role("region", name="Convergence")
    expect(chart.get_by_role("heading", name="No design with a fitness yet")).to_be_visible()
    expect(chart.locator(".uplot")).to_have_count(0)
