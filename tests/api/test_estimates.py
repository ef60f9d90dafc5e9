"""Estimates over HTTP."""

from __future__ import annotations

import httpx2
import pytest

from gaitswarm.services.optimizer.store import Store
from tests.examples.jobs import SMALL_SPEC
from tests.examples.walks import SHORT_WALK

pytestmark = pytest.mark.slow


def test_an_estimate_counts_walks_and_stores_nothing(client: httpx2.Client, store: Store) -> None:
    answer = client.post("/v1/estimates", json=SMALL_SPEC)
    assert answer.status_code == 200
    found = answer.json()
    assert (found["evaluations"], found["walks"]) == (6, 6)
    assert found["simulated_seconds"] == pytest.approx(6.0)
    assert found["seconds"] > 0.0
    assert "measured" in found["basis"]
    assert store.jobs().items == ()


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"iterations": 0}, "iterations"),
        ({"variables": [{"name": "I", "low": -5.0, "high": -1.0}], "fixed": {}}, "variables"),
        ({"scenarios": [{**SHORT_WALK, "hip_height": 0.5}]}, "scenarios.0"),
    ],
)
def test_a_job_that_cannot_be_submitted_cannot_be_estimated(
    client: httpx2.Client, change: dict[str, object], field: str
) -> None:
    answers = [client.post(path, json=change) for path in ("/v1/estimates", "/v1/jobs")]
    assert [answer.status_code for answer in answers] == [422, 422]
    problems = [answer.json() for answer in answers]
    assert problems[0]["errors"] == problems[1]["errors"]
    assert [error["field"] for error in problems[0]["errors"]] == [field]
