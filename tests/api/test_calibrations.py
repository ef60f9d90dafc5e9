"""Calibrations over HTTP: submitted, run, and asked about as any job."""

from __future__ import annotations

import json
import struct
from typing import Any

import httpx2

from gaitswarm.services.optimizer.store import Store
from gaitswarm.services.runtime import open_evaluator, run_embedded
from tests.calibration.conftest import WALKS

SPEC: dict[str, Any] = {
    "kind": "calibration",
    "robots": ["szabadka2", "szabadka2-identified"],
    "walks": WALKS,
    "targets": [
        {"walk": "stiff", "quantity": "speed", "value": 0.15, "tolerance": 0.1},
        {"walk": "fuzzy", "quantity": "energy", "value": 60.0, "tolerance": 0.2},
        {"walk": "fuzzy", "quantity": "F", "value": 5.0, "tolerance": 0.5, "use": "predict"},
    ],
    "variables": ["robot", "contact_law"],
    "fixed": {"energy": "positive"},
    "optimizer": {"particles": 3},
    "iterations": 2,
}


def test_it_is_asked_about_as_any_job(client: httpx2.Client, store: Store) -> None:
    estimate = client.post("/v1/estimates", json=SPEC)
    assert estimate.status_code == 200
    assert estimate.json()["walks"] == 12
    answer = client.post("/v1/jobs", json=SPEC)
    assert answer.status_code == 202
    path = f"/v1/jobs/{answer.json()['id']}"
    evaluator = open_evaluator("in-process", cpus=2)
    try:
        run_embedded(store, evaluator, answer.json()["id"])
    finally:
        evaluator.close()

    job = client.get(path).json()
    assert (job["kind"], job["state"], job["scenarios"]) == (
        "calibration",
        "succeeded",
        ["stiff", "fuzzy"],
    )
    assert job["spec"]["robot"] == "szabadka2"
    assert job["spec"]["fixed"] == {"energy": "positive"}
    assert job["best"]["design"]["robot"] in SPEC["robots"]
    assert {o["name"] for o in job["objectives"]} >= {"torque", "height_loss", "peak_current"}
    assert job["provenance"][0]["provenance"]["simulation"]["robot"] == ", ".join(SPEC["robots"])

    (first, _) = client.get(f"{path}/iterations").json()["items"]
    evaluations = client.get(f"{path}/iterations/{first['index']}/evaluations").json()["items"]
    assert {e["design"]["energy"] for e in evaluations} == {"positive"}
    exported = client.get(f"{path}/export", params={"format": "csv"})
    assert "design.contact_law" in exported.text.splitlines()[0]
    content = client.get(f"{path}/particles").content
    (length,) = struct.unpack_from("<I", content)
    columns = {column["name"]: column for column in json.loads(content[4 : 4 + length])["columns"]}
    assert columns["robot"]["choices"] == SPEC["robots"]
    assert client.get(f"{path}/distribution").status_code == 200

    reached = client.get(f"{path}/targets", params={"leave_out": "walk"}).json()
    assert reached["fitness"] == job["best_fitness"]
    assert [target["use"] for target in reached["targets"]] == ["fit", "fit", "predict"]
    assert reached["targets"][0]["left_out"]["simulated"] > 0.0
    robot, law = client.get(f"{path}/parameters").json()["parameters"]
    assert robot["best"] in SPEC["robots"]
    assert min(c["fitness"] for c in law["choices"] if c["fitness"]) == job["best_fitness"]


def test_what_makes_no_sense_is_refused_by_field(client: httpx2.Client) -> None:
    bad: dict[str, dict[str, Any]] = {
        "targets.0.walk": {"targets": [SPEC["targets"][0] | {"walk": "unknown"}]},
        "targets.0.tolerance": {"targets": [SPEC["targets"][0] | {"tolerance": 0}]},
        "walks.0": {"walks": [WALKS[0] | {"design": {"P": 1.0}}, WALKS[1]]},
        "variables": {"variables": ["hat"]},
        "fixed": {"fixed": {"energy": "negative"}},
        "robots": {"robots": ["szabadka2"]},
        "robots.1": {"robots": ["szabadka2", "szabadka3"]},
    }
    for field, change in bad.items():
        answer = client.post("/v1/jobs", json=SPEC | change)
        assert answer.status_code == 422
        assert field in [error["field"] for error in answer.json()["errors"]], answer.json()


def test_only_a_calibration_has_targets(client: httpx2.Client) -> None:
    job = client.post("/v1/jobs", json={"controller": "pi", "iterations": 1}).json()
    answer = client.get(f"/v1/jobs/{job['id']}/targets")
    assert answer.status_code == 422
    assert "only a calibration has targets" in answer.json()["detail"]
