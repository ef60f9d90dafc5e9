"""One design walking on request: the real simulator behind HTTP."""

from __future__ import annotations

import math
from typing import Any

import httpx2
import numpy as np
import pytest

from sim.controllers import CONTROLLERS
from sim.outcome import OBJECTIVE_NAMES, Status
from sim.scenario import Scenario, find_scenario
from sim.simulate import simulate

pytestmark = pytest.mark.slow

DESIGN = dict(CONTROLLERS["fuzzy-pi"].published["A"])
REQUEST: dict[str, Any] = {"design": DESIGN, "scenarios": ["normal-fast"]}

SHORT = {"name": "short", "cycle_time": 1.5, "radius": 0.16, "hip_height": 0.15, "cycles": 1}


def simulated(client: httpx2.Client, **change: Any) -> dict[str, Any]:
    answer = client.post("/v1/simulations", json={**REQUEST, **change})
    assert answer.status_code == 200, answer.text
    view: dict[str, Any] = answer.json()
    return view


def refused(client: httpx2.Client, **change: Any) -> dict[str, Any]:
    answer = client.post("/v1/simulations", json={**REQUEST, **change})
    assert answer.status_code == 422, answer.text
    problem: dict[str, Any] = answer.json()
    return problem


def test_objectives_are_the_simulators_to_the_last_bit(client: httpx2.Client) -> None:
    view = simulated(client, scenarios=["1", "turn-right-fast"])

    values = np.array([list(DESIGN.values())])
    for name, result in view["scenarios"].items():
        outcome = simulate(find_scenario(name), "fuzzy-pi", tuple(DESIGN), values).outcome
        assert result["status"] == "ok"
        assert list(result["objectives"]) == list(OBJECTIVE_NAMES)
        assert list(result["objectives"].values()) == outcome.objectives[0].tolist()


def test_the_fitness_is_the_geometric_mean_of_the_utilities(client: httpx2.Client) -> None:
    view = simulated(client, scenarios=["1", "6"], preference="B")

    utilities = [result["utility"] for result in view["scenarios"].values()]
    assert view["fitness"] == pytest.approx(math.prod(utilities) ** 0.5, rel=1e-12)
    assert view["preference"]["bias"][0] == 0.4


def test_a_scenario_and_a_gait_of_ones_own_can_be_walked(client: httpx2.Client) -> None:
    design = {**DESIGN, "stride": 0.12}
    found = simulated(client, scenarios=[SHORT], design=design)["scenarios"]["short"]

    brief, values = Scenario.model_validate(SHORT), np.array([list(design.values())])
    walked = simulate(brief, "fuzzy-pi", tuple(design), values).outcome.objectives[0]
    assert list(found["objectives"].values()) == walked.tolist()
    usual = simulated(client, scenarios=[SHORT])["scenarios"]["short"]
    assert usual["objectives"]["reciprocal_speed"] < found["objectives"]["reciprocal_speed"]


def test_the_log_has_a_row_for_every_control_tick_with_units(client: httpx2.Client) -> None:
    result = simulated(client, log=True, scenarios=[SHORT])["scenarios"]["short"]

    columns = result["log"]["columns"]
    ticks = round(SHORT["cycle_time"] * result["log"]["rate"])
    assert result["log"]["rate"] == 500
    assert {len(column["values"]) for column in columns.values()} == {ticks}
    assert columns["joint_angle"]["unit"] == "rad"
    assert np.shape(columns["foot_force"]["values"]) == (ticks, 6, 3)
    steps = np.diff(columns["time"]["values"])
    assert steps == pytest.approx(np.full(ticks - 1, 0.002))


def test_there_is_no_log_unless_asked_for(client: httpx2.Client) -> None:
    assert simulated(client)["scenarios"]["normal-fast"]["log"] is None


def test_a_walk_that_fails_is_a_result_not_an_error(client: httpx2.Client) -> None:
    still = {
        "name": "overloaded",
        "cycle_time": 1.5,
        "radius": 0.16,
        "hip_height": 0.15,
        "load": 50,
    }

    view = simulated(client, scenarios=[still])

    result = view["scenarios"]["overloaded"]
    assert (result["status"], result["explanation"]) == ("fell", Status.FELL.phrase)
    assert result["utility"] is view["fitness"] is None
    assert result["objectives"] == dict.fromkeys(OBJECTIVE_NAMES)


@pytest.mark.parametrize(
    ("change", "field", "hint"),
    [
        ({"scenarios": ["on-the-moon"]}, "scenarios.0", "known are"),
        ({"scenarios": ["1", "1"]}, "scenarios", "named twice"),
        ({"design": {"I": 0.2}}, "design", "FI1R"),
        ({"design": {**DESIGN, "warp": 9.0}}, "design", "unknown variable 'warp'"),
        ({"design": {**DESIGN, "FI1R": -5.0}}, "design", "FI1R"),
        ({"design": {**DESIGN, "FI1R": "much"}}, "design.FI1R", "number"),
        ({"design": {**DESIGN, "stride": 0.9}}, "scenarios.0", "misses its foot trajectory"),
        ({"design": {**DESIGN, "cycle_time": 1e6}}, "scenarios", "300 s allowed"),
        ({"design": {**DESIGN, "cycle_time": -1.0}}, "scenarios.0", "cycle_time"),
        ({"scenarios": [], "log": True}, "scenarios", "at least 1"),
        ({"controller": "telepathy"}, "controller", "fuzzy-pi"),
    ],
)
def test_a_request_that_makes_no_sense_is_refused_by_field(
    client: httpx2.Client, change: dict[str, Any], field: str, hint: str
) -> None:
    problem = refused(client, **change)

    assert field in [error["field"] for error in problem["errors"]]
    assert hint in problem["detail"]


def test_logs_are_limited_more_than_walks(serve) -> None:
    client = serve(api_max_logged_seconds=1.0).client

    assert simulated(client, scenarios=[SHORT])["scenarios"]["short"]["status"] == "ok"
    problem = refused(client, scenarios=[SHORT], log=True)
    assert "1 s allowed with logs" in problem["detail"]
