"""Preferences with robust winners over HTTP."""

from __future__ import annotations

from typing import Any

import httpx2
import pytest

from gaitswarm.api.routes import MOST_RANKED
from gaitswarm.services.optimizer.jobs.job import Job
from tests.api.conftest import Commit, Serve

pytestmark = pytest.mark.slow


def test_winners_are_listed_from_what_is_stored(
    client: httpx2.Client, job: Job, commit: Commit
) -> None:
    commit(job, 2)
    path = f"/v1/jobs/{job.id}/preferences"
    view = client.post(path, json={"drawn": 64, "seed": 3}).json()
    assert (view["drawn"], view["seed"], view["samples"]) == (64, 3, 0)
    # The results are made up: one particle is the best in every objective.
    (only,) = view["candidates"]
    assert (only["particle"], only["named"], only["share"]) == (1, ["A", "B", "C"], 1.0)
    assert only["index"] is None


def test_the_winner_walks_on_request(client: httpx2.Client, job: Job, commit: Commit) -> None:
    commit(job, 1)
    asked = {"drawn": 4, "samples": 48}
    view = client.post(f"/v1/jobs/{job.id}/preferences", json=asked).json()
    (only,) = view["candidates"]
    design = {
        "design": only["design"],
        "scenarios": ["normal-fast", "turn-right-fast"],
        "samples": 48,
    }
    own = client.post("/v1/robustness", json=design).json()
    assert only["index"] == own["index"] is not None


@pytest.mark.parametrize(
    ("asked", "field"),
    [
        ({"drawn": 0}, "drawn"),
        ({"candidates": 0}, "candidates"),
        ({"samples": 9}, "samples"),
        ({"radius": 0.9}, "radius"),
        ({"precision": "half"}, "precision"),
        ({"tolerance": 1}, "tolerance"),
        ({"drawn": MOST_RANKED}, "drawn"),
    ],
)
def test_what_makes_no_sense_is_refused_by_field(
    client: httpx2.Client, job: Job, commit: Commit, asked: dict[str, Any], field: str
) -> None:
    commit(job, 1)
    answer = client.post(f"/v1/jobs/{job.id}/preferences", json=asked)
    assert answer.status_code == 422
    assert [error["field"] for error in answer.json()["errors"]] == [field]


def test_what_takes_too_long_is_refused(
    serve: Serve, job: Job, commit: Commit, monkeypatch: pytest.MonkeyPatch
) -> None:
    commit(job, 1)
    server = serve(api_max_sampled_seconds=100.0)
    path = f"/v1/jobs/{job.id}/preferences"
    walked = server.client.post(path, json={"samples": 48})
    assert walked.status_code == 422
    (error,) = walked.json()["errors"]
    assert error["field"] == "samples" and "more than the 100 s allowed" in error["message"]
    monkeypatch.setattr("gaitswarm.api.routes.MOST_RANKED", 400)
    ranked = server.client.post(path, json={"drawn": 101})
    assert "drawn: must be at most 100 for the 4 evaluations" in ranked.json()["detail"]
    assert server.client.post(path, json={"drawn": 100}).status_code == 200


def test_a_job_has_no_winners_before_its_first_iteration(client: httpx2.Client, job: Job) -> None:
    assert client.post(f"/v1/jobs/{job.id}/preferences", json={}).status_code == 409
    assert client.post("/v1/jobs/nosuchjob/preferences", json={}).status_code == 404
