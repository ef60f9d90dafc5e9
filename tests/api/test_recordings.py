"""Recorded walks and identification jobs over HTTP."""

from __future__ import annotations

import httpx2
import numpy as np

from sim.robot import load_robot
from tests.examples.walks import PUBLISHED_A, SHORT_WALK

WALK = {
    "scenario": SHORT_WALK,
    "controller": "fuzzy-pi",
    "design": PUBLISHED_A,
    "first_tick": 20,
    "joints": load_robot("szabadka2").joint_names,
    "current": np.full((10, 18), 0.125).tolist(),
}


def kept(client: httpx2.Client) -> str:
    return str(client.post("/v1/recordings", json=WALK).json()["id"])


def test_a_recording_is_kept_and_can_be_looked_at(client: httpx2.Client) -> None:
    answer = client.post("/v1/recordings", json=WALK)
    assert answer.status_code == 201
    glance = answer.json()
    assert answer.headers["Location"] == f"/v1/recordings/{glance['id']}"
    assert (glance["rows"], glance["joints"], glance["mean_current"]) == (10, 18, 0.125)
    again = client.get(answer.headers["Location"]).json()
    assert again["current"] == WALK["current"]
    assert client.get(f"{answer.headers['Location']}/summary").json() == glance


def test_the_same_recording_again_is_the_same(client: httpx2.Client) -> None:
    assert kept(client) == kept(client)


def test_an_unknown_recording_is_not_found(client: httpx2.Client) -> None:
    assert client.get(f"/v1/recordings/{'0' * 32}").status_code == 404


def test_a_recording_that_makes_no_sense_names_the_field(client: httpx2.Client) -> None:
    answer = client.post("/v1/recordings", json={**WALK, "current": [[0.1, 0.2]]})
    assert answer.status_code == 422
    assert answer.json()["errors"] == [{"field": "current.0", "message": "2 numbers for 18 joints"}]


def test_an_identification_is_submitted_and_says_what_it_minimizes(client: httpx2.Client) -> None:
    spec = {"kind": "identification", "recordings": [kept(client)], "variables": ["body_mass"]}
    answer = client.post("/v1/jobs", json=spec)
    assert answer.status_code == 202
    job = answer.json()
    assert job["kind"] == job["spec"]["kind"] == "identification"
    assert [(o["name"], o["unit"]) for o in job["objectives"]] == [
        (f"current_link_{link}", "A") for link in (1, 2, 3)
    ]
    assert job["spec"]["variables"][0]["unit"] == "kg"


def test_a_job_names_recordings_that_exist(client: httpx2.Client) -> None:
    spec = {"kind": "identification", "recordings": [kept(client), "0" * 32]}
    answer = client.post("/v1/jobs", json=spec)
    assert answer.status_code == 422
    assert [error["field"] for error in answer.json()["errors"]] == ["recordings.1"]


def test_an_unknown_kind_names_those_there_are(client: httpx2.Client) -> None:
    answer = client.post("/v1/jobs", json={"kind": "guess"})
    assert answer.status_code == 422
    assert answer.json()["errors"] == [
        {
            "field": "kind",
            "message": "must be tuning, identification, calibration, tournament or certificate",
        }
    ]


def test_parameters_of_a_job_without_results_are_a_conflict(client: httpx2.Client) -> None:
    spec = {"kind": "identification", "recordings": [kept(client)], "variables": ["body_mass"]}
    job_id = client.post("/v1/jobs", json=spec).json()["id"]
    answer = client.get(f"/v1/jobs/{job_id}/parameters")
    assert answer.status_code == 409
    assert "no design yet" in answer.json()["detail"]
