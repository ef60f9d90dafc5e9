"""History of a job over HTTP."""

from __future__ import annotations

import math

import httpx2
import pytest

from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.store import Store
from gaitswarm.sim.outcome import OBJECTIVE_NAMES
from tests.api.conftest import Commit

pytestmark = pytest.mark.slow


def test_iterations_come_in_pages_without_gap_or_repeat(
    client: httpx2.Client, job: Job, commit: Commit
) -> None:
    commit(job, 3)
    where = f"/v1/jobs/{job.id}/iterations"

    first = client.get(where, params={"limit": 2}).json()
    second = client.get(where, params={"limit": 2, "after": first["next"]}).json()

    assert [item["index"] for item in first["items"] + second["items"]] == [0, 1, 2]
    assert second["next"] is None


def test_an_iteration_summarizes_the_swarm(client: httpx2.Client, job: Job, commit: Commit) -> None:
    commit(job, 2)

    (item,) = client.get(f"/v1/jobs/{job.id}/iterations", params={"after": 0}).json()["items"]

    assert item["index"] == 1
    assert (item["best"], item["median"], item["worst"]) == (100.0, 101.0, 102.0)
    assert item["mean"] == pytest.approx(101.0)
    assert item["best_so_far"] == 100.0
    assert item["failed"] == 1
    assert item["evaluate_seconds"] == 0.5


def test_evaluations_give_every_particle_in_full_precision(
    client: httpx2.Client, store: Store, job: Job, commit: Commit
) -> None:
    commit(job, 1)

    items = client.get(f"/v1/jobs/{job.id}/iterations/0/evaluations").json()["items"]

    stored = store.evaluations(job.id, 0)
    names = job.spec.design_space().names
    assert [item["particle"] for item in items] == [0, 1, 2, 3]
    for item, evaluation in zip(items, stored, strict=True):
        assert list(item["design"]) == list(names)
        assert list(item["design"].values()) == evaluation.design.tolist()
        assert set(item["scenarios"]) == {"normal-fast", "turn-right-fast"}


def test_a_walk_that_failed_has_a_status_and_nulls(
    client: httpx2.Client, job: Job, commit: Commit
) -> None:
    commit(job, 1)

    fallen = client.get(f"/v1/jobs/{job.id}/iterations/0/evaluations").json()["items"][0]

    assert fallen["fitness"] is None
    assert fallen["scenarios"]["normal-fast"]["status"] == "ok"
    result = fallen["scenarios"]["turn-right-fast"]
    assert result["status"] == "fell"
    assert "sank" in result["explanation"]
    assert result["utility"] is None
    assert result["objectives"] == dict.fromkeys(OBJECTIVE_NAMES)


def test_the_utility_is_the_bias_weighted_product(
    client: httpx2.Client, job: Job, commit: Commit
) -> None:
    commit(job, 1)

    second = client.get(f"/v1/jobs/{job.id}/iterations/0/evaluations").json()["items"][1]

    bias, exponent = (0.9, 0.8, 0.24, 0.5, 0.8), (0.1, 0.7, 0.3, 0.3, 0.1)
    expected = math.prod((b + 11.0) ** e for b, e in zip(bias, exponent, strict=True))
    assert second["scenarios"]["normal-fast"]["utility"] == pytest.approx(expected, rel=1e-12)


def test_an_iteration_not_committed_is_not_found(
    client: httpx2.Client, job: Job, commit: Commit
) -> None:
    commit(job, 1)

    answer = client.get(f"/v1/jobs/{job.id}/iterations/1/evaluations")

    assert answer.status_code == 404
    assert "iteration 1" in answer.json()["detail"]


def test_the_best_is_the_evaluation_of_least_fitness(
    client: httpx2.Client, job: Job, commit: Commit
) -> None:
    commit(job, 3)

    best = client.get(f"/v1/jobs/{job.id}/best").json()

    assert (best["iteration"], best["particle"], best["fitness"]) == (2, 1, 99.0)
    assert list(best["design"]) == list(job.spec.design_space().names)
    assert set(best["scenarios"]["normal-fast"]["objectives"]) == set(OBJECTIVE_NAMES)
    assert client.get(f"/v1/jobs/{job.id}").json()["best"] == best


def test_there_is_no_best_while_every_design_fails(
    client: httpx2.Client, job: Job, commit: Commit
) -> None:
    commit(job, 1, failed=True)

    answer = client.get(f"/v1/jobs/{job.id}/best")

    assert answer.status_code == 404
    assert "no feasible design yet" in answer.json()["detail"]


@pytest.mark.parametrize(
    "what", ["iterations", "iterations/0/evaluations", "best", "events?follow=false"]
)
def test_an_unknown_job_has_no_history(client: httpx2.Client, what: str) -> None:
    answer = client.get(f"/v1/jobs/bcdfghjkmnpq/{what}")

    assert answer.status_code == 404
    assert answer.headers["content-type"] == "application/problem+json"
