"""One design walking on request: the real simulator behind HTTP."""

from __future__ import annotations

import math
from typing import Any

import httpx2
import numpy as np
import pytest

from sim.outcome import OBJECTIVE_NAMES, Status
from sim.scenario import find_scenario
from tests.examples.walks import PUBLISHED_A, SHORT_WALK, short_walk, walk

pytestmark = pytest.mark.slow

REQUEST: dict[str, Any] = {"design": PUBLISHED_A, "scenarios": ["normal-fast"]}


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

    for name, result in view["scenarios"].items():
        outcome = walk(find_scenario(name)).outcome
        assert result["status"] == "ok"
        assert list(result["objectives"]) == list(OBJECTIVE_NAMES)
        assert list(result["objectives"].values()) == outcome.objectives[0].tolist()


def test_the_fitness_is_the_geometric_mean_of_the_utilities(client: httpx2.Client) -> None:
    view = simulated(client, scenarios=["1", "6"], preference="B")

    utilities = [result["utility"] for result in view["scenarios"].values()]
    assert view["fitness"] == pytest.approx(math.prod(utilities) ** 0.5, rel=1e-12)
    assert view["preference"]["bias"][0] == 0.4


def test_a_scenario_and_a_gait_of_ones_own_can_be_walked(client: httpx2.Client) -> None:
    design = {**PUBLISHED_A, "stride": 0.12}
    found = simulated(client, scenarios=[SHORT_WALK], design=design)["scenarios"]["short"]

    walked = walk(short_walk(), design).outcome.objectives[0]
    assert list(found["objectives"].values()) == walked.tolist()
    usual = simulated(client, scenarios=[SHORT_WALK])["scenarios"]["short"]
    assert usual["objectives"]["reciprocal_speed"] < found["objectives"]["reciprocal_speed"]


def test_the_log_has_a_row_for_every_control_tick_with_units(client: httpx2.Client) -> None:
    result = simulated(client, log=True, scenarios=[SHORT_WALK])["scenarios"]["short"]

    columns = result["log"]["columns"]
    ticks = round(SHORT_WALK["cycle_time"] * result["log"]["rate"])
    assert result["log"]["rate"] == 500
    assert {len(column["values"]) for column in columns.values()} == {ticks}
    assert columns["joint_angle"]["unit"] == "rad"
    assert np.shape(columns["foot_force"]["values"]) == (ticks, 6, 3)
    steps = np.diff(columns["time"]["values"])
    assert steps == pytest.approx(np.full(ticks - 1, 0.002))


def test_there_is_no_log_unless_asked_for(client: httpx2.Client) -> None:
    assert simulated(client)["scenarios"]["normal-fast"]["log"] is None


def test_a_walk_that_fails_is_a_result_not_an_error(client: httpx2.Client) -> None:
    view = simulated(client, scenarios=[{**SHORT_WALK, "load": 50, "cycles": 3}])

    result = view["scenarios"]["short"]
    assert (result["status"], result["explanation"]) == ("fell", Status.FELL.phrase)
    assert result["utility"] is view["fitness"] is None
    assert result["objectives"] == dict.fromkeys(OBJECTIVE_NAMES)


@pytest.mark.parametrize(
    ("change", "field", "hint"),
    [
        ({"scenarios": ["on-the-moon"]}, "scenarios.0", "known are"),
        ({"scenarios": ["1", "1"]}, "scenarios", "named twice"),
        ({"design": {"I": 0.2}}, "design", "FI1R"),
        ({"design": {**PUBLISHED_A, "warp": 9.0}}, "design", "unknown variable 'warp'"),
        ({"design": {**PUBLISHED_A, "FI1R": -5.0}}, "design", "FI1R"),
        ({"design": {**PUBLISHED_A, "FI1R": "much"}}, "design.FI1R", "number"),
        ({"design": {**PUBLISHED_A, "stride": 0.9}}, "scenarios.0", "misses its foot trajectory"),
        ({"design": {**PUBLISHED_A, "cycle_time": 1e6}}, "scenarios", "300 s allowed"),
        ({"design": {**PUBLISHED_A, "cycle_time": -1.0}}, "scenarios.0", "cycle_time"),
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
    client = serve(api_max_logged_seconds=0.5).client

    assert simulated(client, scenarios=[SHORT_WALK])["scenarios"]["short"]["status"] == "ok"
    problem = refused(client, scenarios=[SHORT_WALK], log=True)
    assert "0.5 s allowed with logs" in problem["detail"]
