"""Jobs that start from the best designs of others, over HTTP."""

from __future__ import annotations

import httpx2
import pytest

from gaitswarm.services.optimizer.jobs.job import Job
from tests.api.conftest import Commit

pytestmark = pytest.mark.slow

BODY = {"scenarios": ["normal-fast", "turn-right-fast"], "iterations": 2, "seed": 9}


def test_a_job_starts_from_the_best_of_another_and_keeps_the_designs(
    client: httpx2.Client, job: Job, commit: Commit
) -> None:
    commit(job, 3)
    best = client.get(f"/v1/jobs/{job.id}/best").json()["design"]
    answer = client.post("/v1/jobs", json={**BODY, "start": {"jobs": [job.id], "count": 2}})
    assert answer.status_code == 202, answer.text
    stored = client.get(answer.headers["Location"]).json()["spec"]["start"]
    assert len(stored) == 2
    assert stored[0] == best


def test_a_start_that_does_not_fit_names_its_field(client: httpx2.Client) -> None:
    for start, field in (
        ({"jobs": ["nothing"]}, "start.jobs.0"),
        ({"jobs": []}, "start.jobs"),
        ([{"I": 0.5}], "start.0.FI1R"),
        ([{"I": "half"}], "start.0.I"),
        ("best", "start"),
    ):
        answer = client.post("/v1/jobs", json={**BODY, "start": start})
        assert answer.status_code == 422
        assert [error["field"] for error in answer.json()["errors"]] == [field]
