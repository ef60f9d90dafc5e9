"""Recorded walks and identification jobs over HTTP."""

from __future__ import annotations

from typing import Any

import httpx2
import numpy as np
import pytest

from gaitswarm.sim.identification import RecordedWalk
from gaitswarm.sim.measurement.measured_log import MeasuredLog, MeasuredWalk
from gaitswarm.sim.robot import load_robot
from scripts.measured_logs import format_measured_log
from tests.api.conftest import Serve
from tests.examples.walks import PUBLISHED_A, SHORT_WALK, short_walk

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


def test_recordings_are_listed_by_pages_without_their_numbers(client: httpx2.Client) -> None:
    ids = [
        client.post("/v1/recordings", json=WALK | {"first_tick": tick}).json()["id"]
        for tick in (30, 31)
    ]
    first = client.get("/v1/recordings", params={"search": ids[0][:20].upper()}).json()
    [item] = first["items"]
    assert first["next"] is None
    assert item.pop("created_at") and item.pop("size") > 1000
    assert item == {
        "id": ids[0],
        "scenario": SHORT_WALK["name"],
        "controller": "fuzzy-pi",
        "joints": 18,
        "rows": 10,
        "seconds": 0.02,
        "synthetic": False,
    }
    after, found = None, list[str]()
    while not found or after is not None:
        query = {"limit": 1} | ({} if after is None else {"after": after})
        page = client.get("/v1/recordings", params=query).json()
        found += [recording["id"] for recording in page["items"]]
        after = page["next"]
    assert set(ids) <= set(found) and len(set(found)) == len(found)
    refused = client.get("/v1/recordings?after=then")
    assert [error["field"] for error in refused.json()["errors"]] == ["after"]


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
            "message": "must be tuning, identification, calibration, certificate or preferences",
        }
    ]


def test_parameters_of_a_job_without_results_are_a_conflict(client: httpx2.Client) -> None:
    spec = {"kind": "identification", "recordings": [kept(client)], "variables": ["body_mass"]}
    job_id = client.post("/v1/jobs", json=spec).json()["id"]
    answer = client.get(f"/v1/jobs/{job_id}/parameters")
    assert answer.status_code == 409
    assert "no successful design yet" in answer.json()["detail"]


@pytest.fixture(scope="module")
def log() -> MeasuredLog:
    """Of the short walk, ten rows after it began."""
    walk = MeasuredWalk.of(load_robot("szabadka2"), short_walk(cycles=2), "fuzzy-pi", PUBLISHED_A)
    return walk.simulated().rows(10, 1000)


@pytest.fixture(scope="module")
def measured(log: MeasuredLog) -> dict[str, Any]:
    scenario = SHORT_WALK | {"cycles": 2}
    return {"design": PUBLISHED_A, "scenario": scenario, "log": format_measured_log(log)}


def test_a_measured_log_is_read_and_its_whole_cycles_are_recorded(
    client: httpx2.Client, measured: dict[str, Any], log: MeasuredLog
) -> None:
    # Larger than other bodies may be: blank lines are left out.
    answer = client.post(
        "/v1/measured-walks", json=measured | {"log": measured["log"] + "\n" * 600_000}
    )
    assert answer.status_code == 201, answer.text
    read = answer.json()
    glance = read["recording"]
    assert (read["rows"], read["seconds"], read["cycles"]) == (990, 1.98, 1)
    assert (read["offset"], glance["rows"], glance["walk"]["cycles"]) == (-0.02, 500, 2.0)
    assert read["correlation"] == pytest.approx(1.0)
    channels = {signal["name"]: signal["channels"] for signal in read["signals"]}
    assert channels["I_M"] == 18 and channels["U_S"] == 6 and channels["a_BODY"] == 3
    # The default robot is not the one of the log; its gait is.
    assert read["verdict"]["validated"] is False
    assert [g["passed"] for g in read["verdict"]["gates"] if g["quantity"] == "q_D"] == [True]
    kept = RecordedWalk.model_validate(client.get(answer.headers["Location"]).json())
    assert kept.first_tick == 500
    assert kept.amperes == pytest.approx(log.current[490:], abs=1e-5)
    assert glance["peak_current"] == kept.amperes.max()


@pytest.mark.parametrize(
    ("change", "field", "message"),
    [
        ({"log": "a" * 200_000}, "log", "line 1: no headings"),
        ({"log": "time [s],warp [1]\n"}, "log", "line 1, column 'warp [1]': unknown"),
        ({"scenario": SHORT_WALK | {"stride": 0.4}}, "scenario", "misses its foot trajectory"),
        ({"scenario": SHORT_WALK | {"cycles": 90}}, "scenario", "more than the 40 s allowed"),
        ({"scenario": SHORT_WALK | {"cycle_time": 4.0}}, "log", "walking cycle of 4 s"),
        ({"design": {"P": 1.0}}, "design", "P"),
    ],
)
def test_a_measured_log_that_cannot_be_read_names_field_and_line(
    client: httpx2.Client,
    measured: dict[str, Any],
    change: dict[str, Any],
    field: str,
    message: str,
) -> None:
    answer = client.post("/v1/measured-walks", json=measured | change)
    assert answer.status_code == 422, answer.text
    (error,) = answer.json()["errors"]
    assert error["field"].startswith(field)
    assert message in error["message"]


def test_currents_that_no_motor_draws_make_no_recording(
    client: httpx2.Client, measured: dict[str, Any], log: MeasuredLog
) -> None:
    log.current[700, 3] += 2000.0
    text = format_measured_log(log)
    log.current[700, 3] -= 2000.0
    answer = client.post("/v1/measured-walks", json=measured | {"log": text})
    assert answer.status_code == 422
    assert "current.210.3" in answer.json()["errors"][0]["message"]


def test_a_log_over_its_own_limit_is_refused_with_a_remedy(serve: Serve) -> None:
    client = serve(api_max_body_bytes=1000, api_max_log_bytes=2000).client
    answer = client.post("/v1/measured-walks", json={"log": "x" * 2000})
    assert answer.status_code == 413
    assert "leave out cycles" in answer.json()["detail"]
    assert client.post("/v1/measured-walks", json={"log": "x" * 1500}).status_code == 422
    assert client.post("/v1/jobs", json={"name": "x" * 1500}).status_code == 413
