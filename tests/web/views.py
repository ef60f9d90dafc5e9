"""The main views of the page, by name."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from playwright.sync_api import Page, expect

from tests.web.visit import Visit

VIEWS: Final[Mapping[str, Mapping[str, str]]] = {
    "jobs": {
        "jobs": "/jobs",
        "new-job": "/jobs/new",
    },
    "other forms, and jobs compared": {
        "new-identification": "/jobs/new?kind=identification",
        "own-robot": "/jobs/new?robot=own",
        "compare": "/compare?jobs={job}",
    },
    "a job": {
        "job": "/jobs/{job}",
        "scenarios": "/jobs/{job}/scenarios",
        "robustness": "/jobs/{job}/robustness",
        "analysis": "/jobs/{job}/analysis",
        "variables": "/jobs/{job}/variables",
        "iterations": "/jobs/{job}/iterations",
        "particles": "/jobs/{job}/iterations/1",
    },
    "what a job leads to": {
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
    "nothing there": {
        "no-such-job": "/jobs/none",
        "no-such-page": "/walk/none",
    },
}
"""Paths by kind and name; {job} is a job that has ended well."""

_PATHS: Final = {name: path for views in VIEWS.values() for name, path in views.items()}


def open_view(visited: Visit, name: str, job: str) -> Page:
    """A view with all that it asks the server for."""
    page = visited.go(_PATHS[name].format(job=job))
    expect(page.get_by_role("main")).not_to_be_empty()
    page.wait_for_load_state("networkidle")
    return page
