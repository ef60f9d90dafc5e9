"""`gaitswarm simulate`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gaitswarm.cli.inputs import on_terrain
from gaitswarm.sim.outcome import MEASUREMENT_NAMES, OBJECTIVE_NAMES
from gaitswarm.sim.scenario import SCENARIOS, Scenario
from gaitswarm.sim.terrain import PLANE, Grid
from tests.cli.conftest import Finished, Gaitswarm, WriteJson
from tests.examples.walks import PUBLISHED_A, SHORT_WALK

pytestmark = pytest.mark.slow

FAST = ("--scenario", "normal-fast")


@pytest.mark.slow
def test_every_scenario_has_a_status_and_objectives(
    gaitswarm: Gaitswarm, write_json: WriteJson
) -> None:
    design = write_json(PUBLISHED_A)
    result = gaitswarm("simulate", "--design", design, "--scenario", "all", "--json")
    assert result.code == 0, result.err
    assert list(result.json["scenarios"]) == [scenario.name for scenario in SCENARIOS]
    for walk in result.json["scenarios"].values():
        assert walk["status"] == "ok"
        assert list(walk["objectives"]) == list(OBJECTIVE_NAMES)
        assert list(walk["measurements"]) == list(MEASUREMENT_NAMES)
        assert None not in walk["measurements"].values()
        assert "log" not in walk


def test_measurements_are_printed_in_their_units(
    gaitswarm: Gaitswarm, write_json: WriteJson
) -> None:
    design = write_json(PUBLISHED_A)
    result = gaitswarm("simulate", "--design", design, *FAST)
    view = gaitswarm("simulate", "--design", design, *FAST, "--json").json
    measurements = view["scenarios"]["normal-fast"]["measurements"]
    for name in MEASUREMENT_NAMES:
        assert name.replace("_", " ") in result.out
        assert f"{measurements[name]:.4g}" in result.out


def test_a_design_is_json_a_file_the_output_of_best_or_published(
    gaitswarm: Gaitswarm, write_json: WriteJson
) -> None:
    flat = write_json(PUBLISHED_A, "flat.json")
    best = write_json({"fitness": 1.0, "design": PUBLISHED_A}, "best.json")
    results = [
        gaitswarm("simulate", "--design", design, *FAST, "--json").json
        for design in (json.dumps(PUBLISHED_A), flat, best, "published:A")
    ]
    assert all(result == results[0] for result in results)


def test_the_best_of_a_job_walks_as_it_did_in_the_job(
    gaitswarm: Gaitswarm, finished: Finished
) -> None:
    best = gaitswarm("best", finished.id, "--db", finished.db, "--json").json
    walked = gaitswarm("simulate", "--design", f"job:{finished.id}", "--db", finished.db, "--json")
    objectives = [
        {name: found["objectives"] for name, found in result["scenarios"].items()}
        for result in (walked.json, best)
    ]
    assert objectives[0] == objectives[1]


def test_scenarios_are_chosen_by_name_and_number(gaitswarm: Gaitswarm) -> None:
    result = gaitswarm(
        "simulate", "--design", "published:A", "--scenario", "6,normal-fast", "--json"
    )
    assert list(result.json["scenarios"]) == ["turn-right-fast", "normal-fast"]


def test_the_controller_is_chosen(gaitswarm: Gaitswarm, write_json: WriteJson) -> None:
    design = write_json({"P": 0.25, "I": 0.0})
    result = gaitswarm("simulate", "--controller", "pi", "--design", design, *FAST, "--json")
    assert result.json["controller"] == "pi"
    assert result.json["scenarios"]["normal-fast"]["status"] == "ok"


def test_gait_parameters_come_from_the_design_or_from_a_trajectory_file(
    gaitswarm: Gaitswarm, write_json: WriteJson
) -> None:
    gait = {"cycle_time": 1.2, "stride": 0.12}
    apart = gaitswarm(
        "simulate", "--design", write_json(PUBLISHED_A, "d.json"),
        "--trajectory", write_json(gait, "t.json"), *FAST, "--json",
    )  # fmt: skip
    together = gaitswarm(
        "simulate", "--design", write_json(PUBLISHED_A | gait, "dt.json"), *FAST, "--json"
    )
    without = gaitswarm("simulate", "--design", "published:A", *FAST, "--json")
    assert apart.code == 0, apart.err
    assert apart.json["scenarios"] == together.json["scenarios"]
    assert apart.json["scenarios"] != without.json["scenarios"]


@pytest.mark.slow
def test_the_log_is_a_numpy_archive_of_the_walk_at_500_hz(
    gaitswarm: Gaitswarm, write_json: WriteJson, tmp_path: Path
) -> None:
    path, short = tmp_path / "walk.npz", write_json(SHORT_WALK)
    walk = ("simulate", "--design", "published:A", "--scenario", short)
    result = gaitswarm(*walk, "--log", path, "--json")
    assert result.code == 0, result.err
    with np.load(path) as log:
        ticks = len(log["time"])
        assert log["time"][1] - log["time"][0] == pytest.approx(0.002)
        assert log["joint_angle"].shape == (ticks, 18)
        assert log["base_orientation"].shape == (ticks, 4)
        assert log["foot_force"].shape == (ticks, 6, 3)
        walked = log["base_position"][-1, 0] - log["base_position"][0, 0]
    objectives = result.json["scenarios"]["short"]["objectives"]
    assert walked / 1.0 == pytest.approx(1.0 / objectives["reciprocal_speed"], rel=0.02)


def test_logs_of_several_scenarios_have_their_names(
    gaitswarm: Gaitswarm, write_json: WriteJson, tmp_path: Path
) -> None:
    path = tmp_path / "walks.npz"
    walks = [write_json(SHORT_WALK | {"name": name}, f"{name}.json") for name in ("one", "two")]
    scenarios = ",".join(map(str, walks))
    gaitswarm("simulate", "--design", "published:A", "--scenario", scenarios, "--log", path)
    with np.load(path) as log:
        assert {name.partition("/")[0] for name in log} == {"one", "two"}


def test_the_table_for_people_names_every_scenario(gaitswarm: Gaitswarm) -> None:
    result = gaitswarm("simulate", "--design", "published:A", "--scenario", "1,2")
    assert result.code == 0
    assert "normal-fast" in result.out
    assert "normal-slow" in result.out
    assert "fitness" in result.out


def _bad(change: dict[str, Any], drop: str = "") -> dict[str, Any]:
    return {name: value for name, value in {**PUBLISHED_A, **change}.items() if name != drop}


BAD_DESIGNS = {
    "NaN": (_bad({"FI1R": float("nan")}), "FI1R"),
    "text": (_bad({"FI1R": "much"}), "FI1R"),
    "unknown variable": (_bad({"FI9R": 1.0}), "FI9R"),
    "missing variable": (_bad({}, drop="FW4"), "FW4"),
    "unreachable pose": (_bad({"stride": 0.9}), "normal-fast"),
    "design that is no object": ({"design": 3}, "design"),
}


@pytest.mark.parametrize(("design", "field"), BAD_DESIGNS.values(), ids=BAD_DESIGNS)
def test_a_bad_design_is_exit_code_2_that_names_the_field(
    gaitswarm: Gaitswarm, write_json: WriteJson, tmp_path: Path, design: Any, field: str
) -> None:
    log = tmp_path / "log.npz"
    result = gaitswarm("simulate", "--design", write_json(design), *FAST, "--json", "--log", log)
    assert result.code == 2
    assert field in result.err
    assert result.out == ""
    assert not log.exists()


def test_an_unreachable_pose_names_scenario_leg_and_distance(
    gaitswarm: Gaitswarm, write_json: WriteJson
) -> None:
    result = gaitswarm("simulate", "--design", write_json(_bad({"stride": 0.9})), *FAST)
    assert result.code == 2
    assert "'normal-fast'" in result.err
    assert "leg" in result.err
    assert " mm" in result.err


@pytest.mark.parametrize(
    ("options", "named"),
    [
        (["--scenario", "moon"], "moon"),
        (["--scenario", "1,1"], "scenarios"),
        (["--controller", "bang-bang"], "bang-bang"),
        (["--design", "published:Q"], "'Q'"),
        (["--preference", "Z"], "preference"),
        (["--log", "no/such/folder/x.npz"], "no/such/folder"),
    ],
)
def test_an_option_that_makes_no_sense_is_exit_code_2(
    gaitswarm: Gaitswarm, options: list[str], named: str
) -> None:
    base = [] if "--design" in options else ["--design", "published:A"]
    scenario = [] if "--scenario" in options else FAST
    result = gaitswarm("simulate", *base, *scenario, *options)
    assert result.code == 2
    assert named in result.err


@pytest.mark.parametrize(
    ("trajectory", "named"),
    [({"stride": 0.1}, "trajectory.stride"), ({"FW1": 0.5}, "trajectory.FW1")],
    ids=["set in the design too", "no gait parameter"],
)
def test_a_trajectory_file_sets_gait_parameters_that_the_design_does_not(
    gaitswarm: Gaitswarm, write_json: WriteJson, trajectory: dict[str, float], named: str
) -> None:
    result = gaitswarm(
        "simulate", "--design", write_json(_bad({"stride": 0.12}), "d.json"),
        "--trajectory", write_json(trajectory, "t.json"), *FAST,
    )  # fmt: skip
    assert result.code == 2
    assert named in result.err


def test_a_design_walks_in_a_world_that_a_certificate_names(
    gaitswarm: Gaitswarm, write_json: WriteJson
) -> None:
    values = {"friction_factor": 0.8, "slope_added": 2.0}
    walk = ("simulate", "--design", "published:A", *FAST, "--json")
    file = write_json({"world": 3, "values": values}, "world.json")
    inline, named, model = (
        gaitswarm(*walk, *options).json
        for options in (("--world", json.dumps(values)), ("--world", file), ())
    )
    assert inline == named != model


@pytest.mark.parametrize(
    ("world", "said"),
    [
        ('{"friction_factor": 200}', "world.friction_factor: 200 must lie in 0 to 100"),
        ('{"gravity": 3}', "world.gravity: unknown perturbation; known are friction_factor"),
        ("{", "world: is not valid JSON"),
        ("nowhere.json", "world: cannot read nowhere.json"),
    ],
)
def test_a_world_that_cannot_be_is_refused(gaitswarm: Gaitswarm, world: str, said: str) -> None:
    result = gaitswarm("simulate", "--design", "published:A", "--world", world)
    assert result.code == 2
    assert said in result.err


@pytest.mark.parametrize(
    ("terrain", "kind"),
    [("rough:0.01:0.2:3", "rough"), ("stairs:0.02", "stairs"), ('{"kind": "plane"}', "plane")],
)
def test_terrain_of_the_option_is_that_of_every_scenario(terrain: str, kind: str) -> None:
    (scenario,) = on_terrain(["normal-fast"], terrain)
    found = Scenario.model_validate(scenario)
    assert found.terrain.kind == kind
    assert found.model_copy(update={"terrain": PLANE}) == SCENARIOS[0]


def test_heights_are_read_from_a_csv(tmp_path: Path) -> None:
    file = tmp_path / "heights.csv"
    file.write_text("0,0.01\n0.02,0\n", encoding="utf-8")
    (scenario,) = on_terrain(["normal-fast"], f"grid:{file}:0.5")
    assert Scenario.model_validate(scenario).terrain == Grid(
        kind="grid", cell=0.5, heights=((0.0, 0.01), (0.02, 0.0))
    )


@pytest.mark.parametrize("terrain", ["sand", "rough:a", "stairs:1:2:3:4", "grid:none.csv:1"])
def test_a_wrong_terrain_is_refused_by_its_field(terrain: str, gaitswarm: Gaitswarm) -> None:
    options = ("simulate", "--design", "published:A", "--scenario", "1", "--terrain", terrain)
    result = gaitswarm(*options)
    assert result.code == 2
    assert "terrain" in result.err
