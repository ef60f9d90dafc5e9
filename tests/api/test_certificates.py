"""Certificates over HTTP: submitted, run, and asked about as any job; worlds looked at."""

from __future__ import annotations

from typing import Any

import httpx2
import pytest

from gaitswarm.services.optimizer.store import Store
from gaitswarm.services.runtime import open_evaluator, run_embedded
from tests.certificate.examples import DOCUMENT, PI
from tests.examples.walks import SHORT_WALK


def finished(client: httpx2.Client, store: Store, **changes: Any) -> str:
    answer = client.post("/v1/jobs", json=DOCUMENT | changes)
    assert answer.status_code == 202, answer.text
    evaluator = open_evaluator("in-process", cpus=2)
    try:
        run_embedded(store, evaluator, answer.json()["id"])
    finally:
        evaluator.close()
    return f"/v1/jobs/{answer.json()['id']}"


def test_it_is_asked_about_as_any_job(client: httpx2.Client, store: Store) -> None:
    estimate = client.post("/v1/estimates", json=DOCUMENT).json()
    assert (estimate["evaluations"], estimate["walks"]) == (11, 22)
    path = finished(client, store)
    job = client.get(path).json()
    assert (job["kind"], job["state"], job["scenarios"]) == (
        "certificate",
        "succeeded",
        ["short", "uphill"],
    )
    assert (job["evaluations"], job["evaluations_planned"], job["iterations"]) == (11, 11, 3)
    assert (job["spec"]["worlds"], job["spec"]["design"]) == (10, PI)
    exported = client.get(f"{path}/export", params={"format": "csv"}).text.splitlines()
    assert "design.friction_factor" in exported[0] and len(exported) == 12

    found = client.get(f"{path}/certificate").json()
    (first, *_) = client.get(f"{path}/iterations/0/evaluations").json()["items"]
    assert found["fitness"]["nominal"] == first["fitness"]
    assert (found["worlds"], found["worlds_planned"], len(found["worst"])) == (10, 10, 5)
    few = client.get(f"{path}/certificate", params={"worlds": 3, "most": 0}).json()
    assert (few["worlds"], few["worst"]) == (3, [])
    longer = client.post(f"{path}/extend", json={"iterations": 4}).json()
    assert (longer["spec"]["worlds"], longer["evaluations_planned"]) == (15, 16)


@pytest.mark.slow
def test_other_engines_are_part_of_the_summary(client: httpx2.Client, store: Store) -> None:
    path = finished(client, store, scenarios=[SHORT_WALK], worlds=3, engines=["mujoco"])
    job = client.get(path).json()
    assert (job["evaluations"], job["spec"]["engines"]) == (5, ["mujoco"])
    found = client.get(f"{path}/certificate").json()
    items = client.get(f"{path}/iterations/0/evaluations").json()["items"]
    assert [item["design"]["engine"] for item in items[:3]] == ["gaitswarm", "mujoco", "gaitswarm"]
    engine = found["engines"]["mujoco"]
    assert engine["fitness"]["theirs"] == items[1]["fitness"]
    assert engine["fitness"]["ours"] == items[0]["fitness"] == found["fitness"]["nominal"]
    energy = engine["scenarios"]["short"]["objectives"]["energy"]
    assert abs(energy["difference"]) < 0.02
    assert found["worlds"] == 3 and "engine" not in found["worst"][0]["values"]


def test_a_world_is_looked_at_by_its_values(client: httpx2.Client, store: Store) -> None:
    path = finished(client, store, scenarios=[SHORT_WALK])
    (worst,) = client.get(f"{path}/certificate", params={"most": 1}).json()["worst"]
    walk: dict[str, Any] = {"controller": "pi", "design": PI, "world": worst["values"]}
    simulated = client.post("/v1/simulations", json=walk | {"scenarios": [SHORT_WALK]})
    assert simulated.json()["fitness"] == worst["fitness"]
    replays = [
        client.post("/v1/replays", json=request | {"scenario": SHORT_WALK})
        for request in (walk, walk | {"world": {}})
    ]
    assert [replay.status_code for replay in replays] == [200, 200]
    assert replays[0].content != replays[1].content


@pytest.mark.parametrize(
    ("world", "field", "words"),
    [
        ({"gravity": 3.0}, "world", "gravity: unknown perturbation; known are friction_factor"),
        ({"friction_factor": -1.0}, "world", "friction_factor: -1 must lie in 0 to 100"),
    ],
)
def test_a_world_that_cannot_be_names_what_is_wrong(
    client: httpx2.Client, world: dict[str, float], field: str, words: str
) -> None:
    request = {"controller": "pi", "design": PI, "world": world}
    for path in ("/v1/simulations", "/v1/replays"):
        answer = client.post(path, json=request)
        assert answer.status_code == 422
        assert words in answer.json()["detail"]
        assert answer.json()["errors"][0]["field"].startswith(field)


def test_only_a_certificate_has_worlds_and_only_after_the_first(client: httpx2.Client) -> None:
    tuning = client.post("/v1/jobs", json={"controller": "pi", "iterations": 1}).json()
    refused = client.get(f"/v1/jobs/{tuning['id']}/certificate")
    assert refused.status_code == 422
    assert "only a certificate has worlds" in refused.json()["detail"]
    queued = client.post("/v1/jobs", json=DOCUMENT).json()
    early = client.get(f"/v1/jobs/{queued['id']}/certificate")
    assert early.status_code == 409
    assert "no drawn world has been simulated yet" in early.json()["detail"]
