"""A design's robustness index, over HTTP."""

from __future__ import annotations

from typing import Any

import httpx2
import pytest

from tests.api.conftest import Serve
from tests.examples.walks import SHORT_WALK

pytestmark = pytest.mark.slow

PI = {"P": 0.45, "I": 0.1}
ASKED: dict[str, Any] = {
    "controller": "pi",
    "design": PI,
    "scenarios": [SHORT_WALK],
    "samples": 32,
}


def test_a_design_has_an_index_with_its_interval(client: httpx2.Client) -> None:
    answer = client.post("/v1/robustness", json=ASKED)
    assert answer.status_code == 200, answer.text
    view = answer.json()
    assert view["design"] == PI
    assert [variable["name"] for variable in view["variables"]] == ["P", "I"]
    short = view["scenarios"]["short"]
    assert (short["walked"], short["failed"]) == (33, 0)
    assert short["index"] == view["index"]
    assert set(short["jacobian"]["energy"]) == {"P", "I"}
    assert 0.0 <= view["index"]["low"] <= view["index"]["value"] <= view["index"]["high"]


def test_variables_may_have_bounds_of_their_own_and_be_those_of_a_gait(
    client: httpx2.Client,
) -> None:
    stride = {"name": "stride", "low": 0.05, "high": 0.07}
    asked = ASKED | {"design": PI | {"stride": 0.06}, "variables": ["P", stride]}
    view = client.post("/v1/robustness", json=asked).json()
    assert [variable["name"] for variable in view["variables"]] == ["P", "stride"]
    assert 0.0596 <= view["variables"][1]["least"] < view["variables"][1]["most"] <= 0.0604


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"samples": 8}, "samples"),
        ({"variables": ["Q"]}, "variables.0"),
        ({"variables": ["P", "stride"]}, "variables.1"),
        ({"variables": ["P", {"name": "P", "low": 0.0, "high": 1.0}]}, "variables.1"),
        ({"radius": 0.9}, "radius"),
        ({"world": {"friction_factor": 0.5}}, "world"),
        ({"design": {"P": 0.45}}, "design"),
        ({"scenarios": ["moon"]}, "scenarios.0"),
    ],
)
def test_what_makes_no_sense_is_refused_by_field(
    client: httpx2.Client, change: dict[str, Any], field: str
) -> None:
    answer = client.post("/v1/robustness", json=ASKED | change)
    assert answer.status_code == 422
    assert [error["field"] for error in answer.json()["errors"]] == [field]


def test_walks_that_last_too_long_together_are_refused(serve: Serve) -> None:
    server = serve(api_max_sampled_seconds=30.0)
    answer = server.client.post("/v1/robustness", json=ASKED)
    assert answer.status_code == 422
    (error,) = answer.json()["errors"]
    assert error["field"] == "samples"
    assert "33 s in total, more than the 30 s" in error["message"]
