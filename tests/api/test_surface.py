"""A fuzzy controller's surfaces, over HTTP."""

from __future__ import annotations

from typing import Any

import httpx2
import numpy as np
import pytest

from gaitswarm.sim.controllers import CONTROLLERS
from tests.examples.walks import PUBLISHED_A

CHAPTER_3 = dict(CONTROLLERS["fuzzy-pi-3"].published["fuzzy-pso-ps"])

pytestmark = pytest.mark.slow


def surface(client: httpx2.Client, controller: str, **body: Any) -> dict[str, Any]:
    answer = client.post(f"/v1/controllers/{controller}/surface", json=body)
    assert answer.status_code == 200, answer.text
    view: dict[str, Any] = answer.json()
    return view


def test_fuzzy_pi_has_one_output_over_error_and_current(client: httpx2.Client) -> None:
    view = surface(client, "fuzzy-pi", design=PUBLISHED_A)
    assert view["controller"] == "fuzzy-pi"
    assert view["velocity_error"] is None
    assert [i["name"] for i in view["inputs"]] == ["error", "current"]
    assert [i["range"] for i in view["inputs"]] == [[-5837.0, 5837.0], [0.0, 20111.0]]
    assert [len(i["values"]) for i in view["inputs"]] == [65, 33]
    assert [m["name"] for m in view["inputs"][1]["memberships"]] == ["small", "large"]
    (output,) = view["outputs"]
    assert (output["name"], output["unit"]) == ("FO", "PWM counts")
    assert np.shape(output["inference"]) == np.shape(output["table"]) == (65, 33)
    assert {len(m["degrees"]) for m in output["memberships"]} == {len(output["values"])} == {101}


def test_rules_are_those_of_table_4_3_with_the_designs_weights(client: httpx2.Client) -> None:
    (output,) = surface(client, "fuzzy-pi", design=PUBLISHED_A)["outputs"]
    assert len(output["rules"]) == 6
    assert output["rules"][0] == {"if": {"error": "zero"}, "then": "null", "weight": 0.187}
    assert output["rules"][5] == {
        "if": {"error": "positive", "current": "large"},
        "then": "negative-extreme",
        "weight": 0.927,
    }


def test_quantisation_says_what_the_table_costs_and_keeps(client: httpx2.Client) -> None:
    (output,) = surface(
        client, "fuzzy-pi", design=PUBLISHED_A, error_points=129, current_points=65
    )["outputs"]
    facts = output["quantisation"]
    difference = np.subtract(output["table"], output["inference"])
    assert facts["largest_difference"] == pytest.approx(np.abs(difference).max())
    assert facts["rms_difference"] == pytest.approx(np.sqrt(np.mean(difference**2)))
    assert 0.0 < facts["rms_difference"] < facts["largest_difference"] < 0.15 * 781.0
    bits = {name: facts[f"{name}_bits"] for name in ("error", "current", "velocity", "output")}
    assert bits == {"error": 10, "current": 6, "velocity": None, "output": 8}
    assert facts["bytes"] == 64 * 1024


def test_chapter_3_has_two_outputs_and_holds_the_velocity(client: httpx2.Client) -> None:
    view = surface(client, "fuzzy-pi-3", design=CHAPTER_3, velocity_error=6100.0)
    units = {i["name"]: i["unit"] for i in view["inputs"]}
    assert units == {"error": "counts", "current": "A", "velocity": "counts/s"}
    assert [o["name"] for o in view["outputs"]] == ["FzzP", "FzzI"]
    # 12.2 counts a tick are 12.
    assert view["velocity_error"] == pytest.approx(6000.0)
    assert [o["quantisation"]["velocity_bits"] for o in view["outputs"]] == [None, 6]


def test_gait_variables_of_a_design_do_not_matter(client: httpx2.Client) -> None:
    usual = surface(client, "fuzzy-pi", design=PUBLISHED_A)
    assert surface(client, "fuzzy-pi", design={**PUBLISHED_A, "stride": 0.12}) == usual


@pytest.mark.parametrize(
    ("controller", "change", "status", "hint"),
    [
        ("p", {"design": {"P": 0.25}}, 422, "p has no fuzzy surface"),
        ("pid", {}, 422, "pid has no fuzzy surface"),
        ("telepathy", {}, 404, "known are fuzzy-pi"),
        ("fuzzy-pi", {"design": {"I": 0.2}}, 422, "FW1: missing"),
        ("fuzzy-pi", {"design": {**PUBLISHED_A, "FOMF": 7}}, 422, "FOMF"),
        ("fuzzy-pi", {"design": {**PUBLISHED_A, "warp": 9.0}}, 422, "unknown variable 'warp'"),
        ("fuzzy-pi", {"error_points": 130}, 422, "error_points"),
        ("fuzzy-pi", {"current_points": 1}, 422, "current_points"),
    ],
)
def test_a_request_that_makes_no_sense_is_refused(
    client: httpx2.Client, controller: str, change: dict[str, Any], status: int, hint: str
) -> None:
    body = {"design": PUBLISHED_A, **change}
    answer = client.post(f"/v1/controllers/{controller}/surface", json=body)
    assert answer.status_code == status, answer.text
    assert hint in answer.json()["detail"]
