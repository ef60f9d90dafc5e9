"""Identification from a synthetic log, on the command line and over a server."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.cli.conftest import Gaitswarm, WriteJson
from tests.examples.commands import synthesize

pytestmark = pytest.mark.slow

WALK = ("--design", "published:A", "--scenario")
FIT = ("--evaluator", "in-process", "--particles", "4", "--iterations", "2")


@pytest.fixture
def scenario(write_json: WriteJson) -> Path:
    walk = {"name": "brief", "cycle_time": 0.8, "radius": 0.16, "hip_height": 0.15, "cycles": 2}
    return write_json(walk, "scenario.json")


@pytest.fixture
def log(scenario: Path, truth: Path, tmp_path: Path) -> Path:
    path = tmp_path / "twin.csv"
    made = synthesize(*WALK, scenario, "--parameters", truth, "-o", path)
    assert made.code == 0, made.err
    return path


@pytest.fixture
def truth(write_json: WriteJson) -> Path:
    return write_json({"body_mass": 4.5, "battery_voltage": 10.0}, "truth.json")


def test_a_log_is_recorded_once_fitted_and_judged(
    gaitswarm: Gaitswarm, scenario: Path, log: Path, truth: Path, db: Path, tmp_path: Path
) -> None:
    recorded = gaitswarm("record", log, *WALK, scenario, "--db", db)
    assert recorded.code == 0, recorded.err
    assert "SYNTHETIC recording of 18 currents over 1.6 s, 2 cycles" in recorded.err
    recording = recorded.out.strip()
    assert gaitswarm("record", log, *WALK, scenario, "--db", db).out.strip() == recording

    listed = gaitswarm("recordings", "--search", "BRIEF", "--db", db)
    assert all(part in listed.out for part in (recording, "brief", "SYNTHETIC", "18 over 1.6 s"))
    (entry,) = gaitswarm("recordings", "--db", db, "--json").json
    assert (entry["id"], entry["joints"], entry["seconds"]) == (recording, 18, 1.6)
    none = gaitswarm("recordings", "--search", "other", "--db", db)
    assert (none.code, none.out) == (0, "") and "no recording matches" in none.err

    fitted = gaitswarm(
        "identify", recording, "--variables", "body_mass,battery_voltage", "--runs", "2",
        "--truth", truth, "--db", db, *FIT,
    )  # fmt: skip
    assert fitted.code == 0, fitted.err
    assert "body_mass" in fitted.out and "4.5" in fitted.out
    jobs = [line.split()[1].rstrip(":") for line in fitted.out.splitlines() if "job " in line]
    assert len(jobs) == 2

    picture = tmp_path / "intervals.png"
    again = gaitswarm("parameters", *jobs, "--db", db, "--json", "-o", picture)
    assert again.code == 0, again.err
    assert again.json["jobs"] == jobs
    assert [p["name"] for p in again.json["parameters"]] == ["body_mass", "battery_voltage"]
    assert len(again.json["thresholds"]) == len(again.json["parameters"][0]["intervals"]) == 12
    assert picture.read_bytes().startswith(b"\x89PNG")

    shown = gaitswarm("best", jobs[0], "--db", db)
    assert "current link 1" in shown.out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--variables", "body_weight"), "unknown variable 'body_weight'"),
        (("--links", "4"), "links.0"),
        ((), "there is no recording"),
    ],
)
def test_unknown_parameters_are_refused_by_name(
    gaitswarm: Gaitswarm, db: Path, arguments: tuple[str, ...], message: str
) -> None:
    refused = gaitswarm("identify", "0" * 32, "--db", db, *FIT, *arguments)
    assert refused.code == 2
    assert message in refused.err


def test_a_twin_has_only_parameters_that_robots_have(write_json: WriteJson, tmp_path: Path) -> None:
    wrong = write_json({"body_weight": 4.5})
    path = tmp_path / "twin.csv"
    refused = synthesize(*WALK, "1", "--parameters", wrong, "-o", path)
    assert refused.code == 2 and "parameters.body_weight" in refused.err
    assert not path.exists()
