"""Main views of the page."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from playwright.sync_api import Page, expect

from tests.web.visit import Visit

VIEWS: Final[Mapping[str, Mapping[str, str]]] = {
    "first run": {
        "first-run": "/",
    },
    "jobs": {
        "jobs": "/jobs",
        "new-job": "/jobs/new",
    },
    "other forms and comparison": {
        "new-job-in-full": "/jobs/new?clone={job}",
        "new-identification": "/jobs/new?kind=identification",
        "new-calibration": "/jobs/new?kind=calibration",
        "custom-robot": "/jobs/new?robot=own",
        "compare": "/compare?jobs={job},{other}",
    },
    "a job": {
        "job": "/jobs/{job}",
        "job-walk": "/jobs/{job}/walk",
        "robustness": "/jobs/{job}/robustness",
        "analysis": "/jobs/{job}/analysis",
        "variables": "/jobs/{job}/variables",
        "summary": "/jobs/{job}/summary",
        "iterations": "/jobs/{job}/iterations",
        "particles": "/jobs/{job}/iterations/1",
    },
    "more of a job": {
        "what-if": "/jobs/{job}/preferences",
        "trade-offs": "/jobs/{job}/trade-offs",
        "firmware": "/jobs/{job}/firmware",
        "activity": "/jobs/{job}/activity",
        "spec": "/jobs/{job}/reproduce",
    },
    "walks and controllers": {
        "walk": "/walk?job={job}",
        "two-walks": "/walk?job={job}&against=published:A",
        "controller": "/controller?job={job}",
        "linear-controller": "/controller?controller=pi",
    },
    "missing": {
        "no-such-job": "/jobs/none",
        "no-such-page": "/walk/none",
        "no-such-path": "/nosuch",
    },
}
"""Paths by group and name; {job} and {other} are succeeded jobs. The first run has no jobs."""

_PATHS: Final = {name: path for views in VIEWS.values() for name, path in views.items()}


def open_view(visited: Visit, name: str, job: str, other: str = "") -> Page:
    """Open a view and wait until it is loaded."""
    page = visited.go(_PATHS[name].format(job=job, other=other))
    expect(page.get_by_role("main")).not_to_be_empty()
    page.wait_for_load_state("networkidle")
    return page
