"""Catalogues over HTTP."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import httpx2
import jsonschema
import pytest

from gaitswarm.services.optimizer.jobs.preference import PREFERENCES
from gaitswarm.services.optimizer.search.registry import METHODS, OPTIMIZERS
from gaitswarm.sim.catalogue import GAIT_VARIABLES
from gaitswarm.sim.controllers import CONTROLLERS
from gaitswarm.sim.robot import DEFAULT_ROBOT, SHIPPED, load_robot
from gaitswarm.sim.scenario import PRESETS, SCENARIOS
from tests.examples.api_document import api_document


def items(client: httpx2.Client, what: str) -> list[dict[str, Any]]:
    answer = client.get(f"/v1/{what}")
    assert answer.status_code == 200
    return answer.json()["items"]


def test_robots_are_those_that_ship_and_say_what_they_are(client: httpx2.Client) -> None:
    found = {item["name"]: item["description"] for item in items(client, "robots")}
    assert next(iter(found)) == DEFAULT_ROBOT
    assert sorted(found) == ["szabadka2", "szabadka2-identified", "szabadka2-reconstructed"]
    assert set(found) == set(SHIPPED)
    assert found == {name: load_robot(name).description.description for name in found}


def test_scenarios_are_the_presets_and_begin_with_those_of_the_table(client: httpx2.Client) -> None:
    found = items(client, "scenarios")

    assert [item["number"] for item in found] == list(range(1, len(PRESETS) + 1))
    assert [item["name"] for item in found] == [scenario.name for scenario in PRESETS]
    assert PRESETS[:6] == SCENARIOS
    assert found[2]["load"] == 2.0
    assert found[0]["simulated_seconds"] == SCENARIOS[0].duration


def test_a_job_walks_in_the_scenarios_of_the_table_unless_it_names_others(
    client: httpx2.Client,
) -> None:
    job = client.post("/v1/jobs", json={"controller": "pi"}).json()
    assert job["scenarios"] == [scenario.name for scenario in SCENARIOS]

    default = api_document()["components"]["schemas"]["JobSpec"]["properties"]["scenarios"][
        "default"
    ]
    assert default == job["scenarios"], "the page begins with it"


def test_preferences_have_their_biases_and_exponents(client: httpx2.Client) -> None:
    found = items(client, "preferences")

    assert [item["name"] for item in found] == list(PREFERENCES)
    assert found[1]["bias"] == [0.4, 0.7, 0.3, 0.4, 1.0]
    assert found[2]["exponent"] == [1.0] * 5
    assert found[3]["bias"] == [0.0, 0.0, 0.0, 0.0, 0.0, 0.03]


def test_optimizers_have_their_settings(client: httpx2.Client) -> None:
    found = {item["name"]: item for item in items(client, "optimizers")}

    assert list(found) == list(OPTIMIZERS)
    swarms = {name: found[name]["settings"] for name in ("pso", "pso-falling-inertia")}
    assert {name: (s["inertia_start"], s["inertia_end"]) for name, s in swarms.items()} == {
        "pso": (0.9, 0.9),
        "pso-falling-inertia": (0.9, 0.7),
    }
    assert all((s["cognitive"], s["social"]) == (0.5, 1.5) for s in swarms.values())
    for item in found.values():
        assert item["description"]
        jsonschema.validate(item["settings"], item["settings_schema"])


def test_a_method_says_what_would_have_to_be_installed_for_it(
    client: httpx2.Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    without = replace(METHODS["random"], libraries=("no-such-library",))
    monkeypatch.setitem(METHODS, "random", without)
    needs = {item["name"]: item["needs"] for item in items(client, "optimizers")}
    assert needs["random"] == "pip install no-such-library"
    assert needs["auto"] is needs["pso"] is None


def test_controllers_have_variables_with_bounds_units_and_published_designs(
    client: httpx2.Client,
) -> None:
    found = {item["name"]: item for item in items(client, "controllers")}

    assert set(found) == set(CONTROLLERS)
    fuzzy = found["fuzzy-pi"]
    ranges = {v["name"]: (v["low"], v["high"], v["unit"], v["kind"]) for v in fuzzy["variables"]}
    assert ranges["FI1R"] == (1500.0, 6000.0, "counts", "continuous")
    assert ranges["FOMF"] == (1.0, 3.0, "1", "integer")
    assert fuzzy["published"]["A"]["FI1R"] == 5837
    assert [v["name"] for v in fuzzy["gait_variables"]] == [v.name for v in GAIT_VARIABLES]
    assert all(item["description"] for item in found.values())


def test_a_job_can_name_whatever_the_catalogue_lists(client: httpx2.Client) -> None:
    spec = {
        "controller": items(client, "controllers")[0]["name"],
        "preference": items(client, "preferences")[-1]["name"],
        "optimizer": items(client, "optimizers")[-1]["name"],
        "scenarios": [str(item["number"]) for item in items(client, "scenarios")],
    }

    assert client.post("/v1/jobs", json=spec).status_code == 202


def test_a_job_searches_choices_of_the_gait_and_holds_them_by_name(client: httpx2.Client) -> None:
    window = {"name": "fir_window", "kind": "categorical", "choices": ["moving_average", "hamming"]}
    spec = {
        "controller": "pi",
        "variables": ["P", window, "start_phase"],
        "fixed": {"I": 0.1, "duty_factor": 0.45, "duty_phase": "swing"},
    }

    assert client.post("/v1/jobs", json=spec).status_code == 202

    spec["fixed"] = {"I": 0.1, "duty_phase": "flight"}
    refused = client.post("/v1/jobs", json=spec)
    assert refused.status_code == 422
    assert "duty_phase: 'flight' is not one of its choices support, swing" in refused.text
