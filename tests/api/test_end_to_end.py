"""A whole job over HTTP: real runner, real simulator, real database."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import httpx2
import pytest

from gaitswarm.services.optimizer.run.runner import Runner
from gaitswarm.services.optimizer.store import Store
from gaitswarm.services.worker.dispatch import InProcessEvaluator
from tests.examples.jobs import SMALL_SPEC


@pytest.fixture
def runner(store: Store) -> Iterator[Runner]:
    evaluator = InProcessEvaluator()
    runner = Runner(store, evaluator, poll_seconds=0.02)
    runner.start()
    yield runner
    runner.stop()
    evaluator.close()


def streamed(client: httpx2.Client, job_id: str) -> list[dict[str, Any]]:
    """Data of every iteration until the stream ends with the job."""
    answer = client.get(f"/v1/jobs/{job_id}/events", timeout=60.0)
    blocks = [
        block.split("\n") for block in answer.text.split("\n\n") if "event: iteration" in block
    ]
    return [json.loads(block[1].removeprefix("data: ")) for block in blocks]


@pytest.mark.slow
def test_a_submitted_job_is_run_to_its_end_and_its_best_can_be_walked_again(
    client: httpx2.Client, runner: Runner
) -> None:
    job_id = client.post("/v1/jobs", json=SMALL_SPEC).json()["id"]

    iterations = streamed(client, job_id)

    view = client.get(f"/v1/jobs/{job_id}").json()
    assert view["state"] == "succeeded"
    assert (view["iterations"], view["evaluations"]) == (2, 6)
    assert [iteration["index"] for iteration in iterations] == [0, 1]
    listed = client.get(f"/v1/jobs/{job_id}/iterations").json()["items"]
    assert iterations == listed
    best = client.get(f"/v1/jobs/{job_id}/best").json()
    assert best["fitness"] == view["best_fitness"] == listed[-1]["best_so_far"]
    again = client.post(
        "/v1/simulations", json={"design": best["design"], "scenarios": SMALL_SPEC["scenarios"]}
    ).json()
    assert again["fitness"] == best["fitness"]
    walked = again["scenarios"]["short"]
    assert walked["objectives"] == best["scenarios"]["short"]["objectives"]
    particles = client.get(f"/v1/jobs/{job_id}/iterations/1/evaluations").json()["items"]
    assert len(particles) == 3


@pytest.mark.slow
def test_the_same_spec_gives_the_same_bits(client: httpx2.Client, runner: Runner) -> None:
    ids = [client.post("/v1/jobs", json=SMALL_SPEC).json()["id"] for _ in range(2)]
    for job_id in ids:
        streamed(client, job_id)

    histories = [
        [client.get(f"/v1/jobs/{job_id}/iterations/{k}/evaluations").json() for k in range(2)]
        for job_id in ids
    ]

    assert histories[0] == histories[1]
