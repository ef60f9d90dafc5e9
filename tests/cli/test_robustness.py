"""`gaitswarm robustness`."""

from __future__ import annotations

import pytest

from tests.cli.conftest import Finished, Gaitswarm, WriteJson
from tests.examples.walks import PUBLISHED_A, SHORT_WALK, UPHILL_WALK

pytestmark = pytest.mark.slow

OBJECTIVES = ["torque", "acceleration", "angular_acceleration", "energy", "reciprocal_speed"]


def test_a_published_design_has_an_index_by_scenario_objective_and_variable(
    gaitswarm: Gaitswarm, write_json: WriteJson
) -> None:
    walks = f"{write_json(SHORT_WALK, 'short.json')},{write_json(UPHILL_WALK, 'uphill.json')}"
    asked = ("robustness", "published:A", "--scenarios", walks, "--samples", 36)
    result = gaitswarm(*asked, "--json")
    assert result.code == 0, result.err
    view = result.json
    assert view["design"] == PUBLISHED_A
    assert (view["samples"], view["radius"], view["seed"]) == (36, 0.02, 1)
    assert view["held"] == ["FOMF"]
    assert list(view["scenarios"]) == ["short", "uphill"]
    for part in (view, *view["scenarios"].values()):
        assert 0.0 < part["index"]["low"] <= part["index"]["value"] <= part["index"]["high"]
        assert list(part["by_objective"]) == OBJECTIVES
        assert list(part["by_variable"]) == [name for name in PUBLISHED_A if name != "FOMF"]
    # The integrator's gain matters more than the weight of a rule that hardly fires.
    assert view["by_variable"]["I"] > 10.0 * view["by_variable"]["FW56"]

    other = gaitswarm(*asked, "--seed", 2, "--json").json
    assert other["index"]["value"] != view["index"]["value"]
    # The same seed draws the same samples.
    text = gaitswarm(*asked).out
    assert f"{view['index']['value']:.3g}" in text
    assert "fixed: FOMF" in text


def test_a_jobs_best_is_walked_as_its_job_walked_it(
    gaitswarm: Gaitswarm, finished: Finished
) -> None:
    view = gaitswarm("robustness", finished.id, "--db", finished.db, "--samples", 40, "--json").json
    assert view["design"] == finished.job["best"]["design"]
    assert list(view["scenarios"]) == ["short"]
    assert view["robot"] == finished.job["spec"]["robot"]
    elsewhere = gaitswarm(
        "robustness", finished.id, "--db", finished.db, "--samples", 40, "--json",
        "--robot", "szabadka2", "--scenarios", "normal-fast",
    ).json  # fmt: skip
    assert (elsewhere["robot"], list(elsewhere["scenarios"])) == ("szabadka2", ["normal-fast"])


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--radius", "0"), "radius: must be greater than 0"),
        (("--samples", "20"), "samples: 8 variables require at least 36"),
        (("--scenarios", "moon"), "unknown scenario 'moon'"),
        (("--robot", "spot"), "unknown robot 'spot'"),
    ],
)
def test_invalid_input_is_named(gaitswarm: Gaitswarm, options: tuple[str, str], said: str) -> None:
    result = gaitswarm("robustness", "published:A", *options)
    assert result.code == 2
    assert said in result.err


def test_an_unknown_job_is_exit_code_3(gaitswarm: Gaitswarm, finished: Finished) -> None:
    assert gaitswarm("robustness", "nowhere", "--db", finished.db).code == 3
