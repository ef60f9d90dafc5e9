"""Searches for preferences over HTTP: submitted, run, and read as any job; what candidates buy."""

from __future__ import annotations

import httpx2
import pytest

from gaitswarm.services.optimizer.store import Store
from gaitswarm.services.runtime import open_evaluator, run_embedded
from tests.examples.jobs import SMALL_SPEC
from tests.examples.preferences import DOCUMENT

pytestmark = pytest.mark.slow


def finished(client: httpx2.Client, store: Store) -> str:
    answer = client.post("/v1/jobs", json=DOCUMENT)
    assert answer.status_code == 202, answer.text
    evaluator = open_evaluator("in-process", cpus=2)
    try:
        run_embedded(store, evaluator, answer.json()["id"])
    finally:
        evaluator.close()
    return f"/v1/jobs/{answer.json()['id']}"


def test_candidates_are_listed_by_their_fitness_against_the_reference(
    client: httpx2.Client, store: Store
) -> None:
    path = finished(client, store)
    job = client.get(path).json()
    assert (job["kind"], job["state"], job["evaluations"]) == ("preferences", "succeeded", 4)
    view = client.get(f"{path}/preferences").json()
    candidates = view["candidates"]
    assert {c["named"] for c in candidates} == {"A", "B", "C", None}
    assert [c["recommended"] for c in candidates] == [True, False, False, False]
    fitness = [c["fitness"] for c in candidates]
    assert fitness == sorted(fitness) and fitness[0] == job["best_fitness"]
    assert (view["evaluated"], view["worlds"], view["samples"]) == (4, 3, 12)
    for candidate in candidates:
        assert set(candidate["design"]) == set(view["reference"]) == {"P", "I"}
        assert set(candidate["figures"]) == set(view["reference_figures"])
        for name, change in candidate["changes"].items():
            reference = view["reference_figures"][name]
            assert candidate["figures"][name] == pytest.approx(reference * (1.0 + change))


def test_the_estimate_counts_searches_samples_and_worlds(client: httpx2.Client) -> None:
    estimate = client.post("/v1/estimates", json=DOCUMENT).json()
    assert (estimate["evaluations"], estimate["walks"]) == (4, 4)
    # 8 designs and 14 of the sample in steps of 1.0 and 1.5 s, and 4 worlds in held-out ones, too.
    assert estimate["simulated_seconds"] > 4 * (8 + 14 + 4) * 2.5
    assert estimate["seconds"] > 0.0


def test_a_job_begins_with_the_best_designs_of_another_one(
    client: httpx2.Client, store: Store
) -> None:
    tuned = client.post("/v1/jobs", json=SMALL_SPEC).json()["id"]
    evaluator = open_evaluator("in-process", cpus=2)
    run_embedded(store, evaluator, tuned)
    evaluator.close()
    start = {"jobs": [tuned], "count": 2}
    tuning = {key: SMALL_SPEC[key] for key in ("scenarios", "optimizer")} | {"start": start}
    job = client.post("/v1/jobs", json=DOCUMENT | {"tuning": tuning, "samples": 36}).json()
    first, *_ = job["spec"]["tuning"]["start"]
    assert first == client.get(f"/v1/jobs/{tuned}/best").json()["design"]
    unknown = tuning | {"start": {"jobs": ["nothing"]}}
    refused = client.post("/v1/jobs", json=DOCUMENT | {"tuning": unknown, "samples": 36})
    assert refused.status_code == 422
    assert refused.json()["errors"][0]["field"] == "tuning.start.jobs.0"


def test_only_a_search_for_preferences_has_candidates(client: httpx2.Client) -> None:
    tuned = client.post("/v1/jobs", json=SMALL_SPEC).json()["id"]
    refused = client.get(f"/v1/jobs/{tuned}/preferences")
    assert refused.status_code == 422
    assert "only a search for preferences has candidates" in refused.text
