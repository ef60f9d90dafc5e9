"""`gaitswarm.simulate`: designs walk here and now."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gaitswarm
from gaitswarm.services.optimizer.jobs.designs import SimulationRequest
from gaitswarm.sim.outcome import MEASUREMENT_NAMES, OBJECTIVE_NAMES
from gaitswarm.simulation import run_simulation
from tests.examples.paths import QUADRUPED

pytestmark = pytest.mark.slow

PI = {"P": 0.45, "I": 0.1}
GAINS = (0.2, 0.45, 0.9)
FAST = "normal-fast"


def simulate(designs: Any = PI, **options: Any) -> gaitswarm.SimulationResult:
    return gaitswarm.simulate(designs, **{"controller": "pi", "scenarios": FAST, **options})


def test_one_design_is_worth_what_a_request_says() -> None:
    result = simulate(scenarios=[FAST, "6"], preference="B")
    request = SimulationRequest(
        controller="pi", design=PI, scenarios=(FAST, "turn-right-fast"), preference="B"
    )
    view = run_simulation(request)
    assert result.scenarios == tuple(view.scenarios)
    assert result.fitness.tolist() == [view.fitness]
    for k, walk in enumerate(view.scenarios.values()):
        assert result.utilities[0, k] == walk.utility
        assert dict(zip(OBJECTIVE_NAMES, result.objectives[0, k], strict=True)) == walk.objectives
        measured = dict(zip(MEASUREMENT_NAMES, result.measurements[0, k], strict=True))
        assert measured == dict(walk.measurements)


def test_by_the_preference_of_chapter_3_a_design_has_a_figure_of_merit() -> None:
    result = simulate(preference="chapter-3")
    f1, f2, f3, f4, f5, f6 = result.objectives[0, 0].tolist()
    merit = 1e5 / (f1 * f2 * f3 * f4 * f5**2 * (abs(f6) + 0.03))
    assert result.figure_of_merit.tolist() == pytest.approx([merit])
    request = SimulationRequest(
        controller="pi", design=PI, scenarios=(FAST,), preference="chapter-3"
    )
    assert run_simulation(request).figure_of_merit == pytest.approx(merit)
    assert np.isnan(simulate(preference="A").figure_of_merit).all()


def test_without_a_choice_a_design_walks_in_all_six_scenarios() -> None:
    published = gaitswarm.CONTROLLERS["fuzzy-pi"].published["A"]
    result = gaitswarm.simulate(published)
    assert result.scenarios == tuple(scenario.name for scenario in gaitswarm.SCENARIOS)
    assert result.objectives.shape == (1, 6, 6)


MANY = {
    "arrays": {"P": np.array(GAINS), "I": 0.1},
    "mappings": [{"P": gain, "I": 0.1} for gain in GAINS],
    "table": gaitswarm.Table({"P": np.array(GAINS), "I": np.full(3, 0.1)}),
}


@pytest.mark.parametrize("designs", MANY.values(), ids=MANY)
def test_many_designs_are_worth_what_each_is_worth_alone(designs: Any) -> None:
    together = simulate(designs)
    alone = [simulate({"P": gain, "I": 0.1}) for gain in GAINS]
    assert together.variables == ("P", "I")
    assert together.designs.tolist() == [[gain, 0.1] for gain in GAINS]
    assert together.objectives.tolist() == [one.objectives.tolist()[0] for one in alone]
    assert together.measurements.tolist() == [one.measurements.tolist()[0] for one in alone]
    assert together.fitness.tolist() == [one.fitness.tolist()[0] for one in alone]


def test_a_log_has_the_walk_at_500_hz_and_changes_no_number() -> None:
    result = simulate({"P": GAINS, "I": 0.1}, log=True)
    assert np.array_equal(result.objectives, simulate({"P": GAINS, "I": 0.1}).objectives)
    logs = result[FAST].logs
    assert len(logs) == 3
    log = logs[1]
    assert log is not None and log.time[1] == 0.002
    assert log.joint_angle.shape == (len(log.time), 18)
    walked = log.base_position[-1, 0] - log.base_position[0, 0]
    reciprocal_speed = result[FAST].objectives["reciprocal_speed"][1]
    assert walked / 4.5 == pytest.approx(1.0 / reciprocal_speed, rel=0.02)


def test_a_gait_out_of_reach_is_a_status_of_its_design_alone() -> None:
    result = simulate({**PI, "stride": [0.16, 0.9]}, log=True)
    walks = result[FAST]
    assert walks.statuses == (gaitswarm.Status.OK, gaitswarm.Status.UNREACHABLE)
    assert np.isnan(result.fitness).tolist() == [False, True]
    assert np.isnan(walks.utility).tolist() == [False, True]
    assert walks.logs[1] is None


def test_the_table_has_a_row_for_every_walk() -> None:
    result = simulate({"P": GAINS, "I": 0.1}, scenarios=[FAST, "2"])
    table = result.table()
    assert len(table) == 6
    assert table["design"].tolist() == [0, 0, 1, 1, 2, 2]
    assert table["scenario"].tolist() == [FAST, "normal-slow"] * 3
    assert table["design.P"].tolist() == [0.2, 0.2, 0.45, 0.45, 0.9, 0.9]
    assert table["status"].tolist() == ["ok"] * 6
    assert table["energy"].tolist() == result.objectives[:, :, 3].ravel().tolist()
    assert table["speed"].tolist() == result.measurements[:, :, 4].ravel().tolist()
    assert table["utility"].tolist() == result.utilities.ravel().tolist()


def test_a_scenario_of_ones_own_walks_as_object_and_as_document() -> None:
    steep = gaitswarm.SCENARIOS[0].model_copy(update={"name": "steep", "slope": 15.0})
    as_object, as_document = (simulate(scenarios=s) for s in (steep, steep.model_dump()))
    assert as_object.scenarios == ("steep",)
    assert as_object.objectives.tolist() == as_document.objectives.tolist()
    assert as_object.objectives.tolist() != simulate().objectives.tolist()


def test_a_robot_is_a_name_a_variant_or_a_folder() -> None:
    crawl = json.loads((QUADRUPED / "crawl.json").read_text(encoding="utf-8"))
    by_path, by_name = (
        simulate(robot=robot, scenarios=crawl) for robot in (QUADRUPED, str(QUADRUPED))
    )
    assert by_path.objectives.tolist() == by_name.objectives.tolist()
    variant = simulate(robot=gaitswarm.RobotVariant(contact_law="karnopp"))
    assert variant.objectives.tolist() != simulate().objectives.tolist()


MISTAKES: dict[str, tuple[Any, dict[str, Any], str]] = {
    "unknown variable": ({**PI, "D": 1.0}, {}, "design"),
    "missing variable": ({"P": 0.4}, {}, "design"),
    "no number": ({**PI, "P": "much"}, {}, "designs"),
    "NaN in one of many": ({**PI, "P": [0.4, float("nan")]}, {}, "designs"),
    "no design": ([], {}, "designs"),
    "arrays of different length": ({"P": [1, 2], "I": [1, 2, 3]}, {}, "designs"),
    "a matrix": ({"P": [[0.4]], "I": 0.1}, {}, "designs"),
    "designs of different variables": ([PI, {"P": 1.0}], {}, "designs"),
    "text": ("published:A", {}, "designs"),
    "a number": (3, {}, "designs"),
    "a value that cannot be compiled": ({"P": -1e9, "I": 0.1}, {}, "designs"),
    "unknown scenario": (PI, {"scenarios": "moon"}, "scenarios"),
    "a scenario twice": (PI, {"scenarios": ["1", FAST]}, "scenarios"),
    "unknown controller": (PI, {"controller": "bang-bang"}, "controller"),
    "unknown preference": (PI, {"preference": "Z"}, "preference"),
    "unknown robot": (PI, {"robot": "spot"}, "robot"),
    "a folder without a robot": (PI, {"robot": Path(__file__).parent}, "robot"),
    "no processor": (PI, {"cpus": 0}, "cpus"),
}


@pytest.mark.parametrize(("designs", "options", "field"), MISTAKES.values(), ids=MISTAKES)
def test_a_mistake_is_an_error_that_names_the_argument(
    designs: Any, options: dict[str, Any], field: str
) -> None:
    with pytest.raises(gaitswarm.InvalidRequest) as raised:
        simulate(designs, **options)
    assert raised.value.field.split(".")[0] == field
    assert str(raised.value).startswith(field)


def test_a_scenario_that_was_not_walked_is_a_key_error_that_says_which_were() -> None:
    with pytest.raises(KeyError, match="normal-fast"):
        simulate()["loaded-slow"]
