"""Specs of calibrations and their judgement."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.documents import SPECS
from gaitswarm.sim.outcome import N_OBJECTIVES, RESULTS
from tests.calibration.conftest import PI, WALKS, spec
from tests.examples.walks import SHORT_WALK, UPHILL_WALK

# Table 3.6, Fuzzy-PI by PSO-PS.
OBJECTIVES = [8.71, 1.77, 16.09, 41.96, 1.0 / 0.156, -3.8e-3]
MEASURED = {
    "peak_current": 2.5,
    "mean_current": 0.4,
    "motor_heat": 1.5,
    "power": 6.5,
    "speed": 0.156,
    "peak_torque": 4.0,
    "roll": 0.5,
    "pitch": 0.4,
    "foot_clearance": 0.035,
    "slip": 0.15,
}
PUBLISHED = [*OBJECTIVES, *(MEASURED[result.name] for result in RESULTS[N_OBJECTIVES:])]


def target(quantity: str, value: float = 1.0, tolerance: float = 0.1, **more: Any) -> Any:
    return {
        "walk": "stiff",
        "quantity": quantity,
        "value": value,
        "tolerance": tolerance,
    } | more


def simulated(objectives: list[list[float]], *targets: Any) -> list[float]:
    """One design, K cases."""
    wanted = spec(targets=targets)
    rows = np.array([objectives])
    return wanted.simulated(rows, np.isnan(rows).any(axis=2))[0].tolist()


def test_every_quantity_follows_from_the_objectives_of_its_walk() -> None:
    names = ["torque", "height_loss", "speed", "power", "peak_current", "F"]
    row = simulated([PUBLISHED, [math.nan] * len(PUBLISHED)], *map(target, names))
    np.testing.assert_allclose(row, [8.71, -3.8e-3, 0.156, 6.5, 2.5, 6.92], rtol=1e-3)


def test_a_ratio_is_of_two_walks() -> None:
    other = [*PUBLISHED[:3], 20.98, *PUBLISHED[4:]]
    ratio = target("energy", walk="fuzzy", relative_to="stiff")
    assert simulated([PUBLISHED, other], ratio) == [0.5]


def test_a_difference_is_counted_in_tolerances() -> None:
    wanted = spec(
        targets=[
            target("speed", value=0.2, tolerance=0.25),
            target("height_loss", value=-0.002, tolerance=0.004),
        ]
    )
    found = wanted.differences(np.array([[0.25, 0.002], [0.16, -0.006], [math.nan, 0.0]]))
    np.testing.assert_allclose(found[:2], [[1.0, 1.0], [-1.0, -1.0]])
    assert found[2, 0] == math.inf


def test_fitness_is_the_root_mean_square_over_what_is_fitted() -> None:
    wanted = spec(
        targets=[
            target("torque", value=8.71 / 1.1**3),
            target("energy", value=41.96 * 1.1**4),
            target("speed", value=0.1, use="predict"),
            target("torque", value=8.71 / 1.1, walk="fuzzy"),
        ]
    )
    rows = np.array([[PUBLISHED, PUBLISHED]])
    found = wanted.judge(rows, np.zeros((1, 2), dtype=bool))
    assert found.fitness[0] == pytest.approx(math.sqrt((9 + 16 + 1) / 3))
    np.testing.assert_allclose(found.utilities[0], [math.sqrt(25 / 2), 1.0])


def test_a_failed_walk_is_infinitely_bad_unless_it_is_only_predicted() -> None:
    targets = [target("torque"), target("torque", walk="fuzzy", use="predict")]
    rows = np.array([[PUBLISHED, PUBLISHED]] * 2)
    found = spec(targets=targets).judge(rows, np.array([[True, False], [False, True]]))
    assert found.fitness[0] == math.inf
    assert math.isfinite(found.fitness[1])
    assert np.isinf(found.utilities).tolist() == [[True, False], [False, True]]


@pytest.mark.parametrize(("best", "square"), [(0.0, 2.0), (0.5, 2.25), (3.0, 9.0 + 18.0)])
def test_as_good_is_what_two_standard_deviations_explain(best: float, square: float) -> None:
    wanted = spec(
        targets=[target("torque"), target("energy"), target("speed", use="predict")],
    )
    assert wanted.as_good_as(best) == pytest.approx(math.sqrt(square))


def test_walks_that_are_the_same_are_walked_once() -> None:
    walks = [
        {"name": "all", "controller": "pi", "design": PI, "scenarios": [SHORT_WALK, UPHILL_WALK]},
        {"name": "level", "controller": "pi", "design": PI, "scenarios": [SHORT_WALK]},
    ]
    targets = [target("fitness:A", walk="all"), target("speed", walk="level")]
    wanted = spec(walks=walks, targets=targets)
    assert wanted.case_names == ("all.short", "all.uphill")
    assert wanted.layout().of_walk == {"all": (0, 1), "level": (0,)}


def test_a_stored_spec_reads_as_it_was_and_names_its_choices() -> None:
    asked = spec(variables=["body_mass"], fixed={"contact_law": 2})
    resolved = asked.resolved()
    assert resolved.fixed == {"contact_law": "stick"}
    assert SPECS.validate_json(resolved.model_dump_json()) == resolved


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"targets": [target("speed", walk="absent")]}, "targets.0.walk: no walk 'absent'"),
        ({"targets": [target("speed", relative_to="absent")]}, "relative_to: no walk 'absent'"),
        ({"targets": [target("speed", relative_to="stiff")]}, "the walk itself"),
        ({"targets": [target("height_loss", walk="fuzzy", relative_to="stiff")]}, "has no ratio"),
        ({"targets": [target("speed", value=-0.1)]}, "speed is greater than 0"),
        ({"targets": [target("speed", use="predict")]}, "at least one must be fitted"),
        ({"walks": [WALKS[0], WALKS[0]]}, "two of them have the same name"),
        (
            {"walks": [WALKS[0] | {"scenarios": [SHORT_WALK, UPHILL_WALK]}]},
            "speed requires one scenario; the walk stiff has 2",
        ),
        ({"walks": [WALKS[0] | {"design": {"P": 1.0}}]}, "I missing; pi needs it"),
        ({"walks": [WALKS[0] | {"design": PI | {"Q": 1.0}}]}, "unknown variable 'Q'"),
        ({"variables": ["P"]}, "unknown variable 'P'; known are efficiency, "),
        (
            {"walks": [WALKS[0] | {"design": PI | {"stride": 0.1}}], "variables": ["stride"]},
            "stride has no effect",
        ),
        ({"robots": ["szabadka2"]}, "at least two different ones"),
    ],
)
def test_inconsistent_specs_are_refused(change: dict[str, Any], message: str) -> None:
    with pytest.raises(ValidationError, match=message):
        spec(**change)


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"fixed": {"body_mass": -1.0}}, "fixed"),
        ({"walks": [WALKS[0] | {"scenarios": [SHORT_WALK | {"hip_height": 0.4}]}]}, "walks.0"),
        ({"walks": [WALKS[0] | {"design": {"P": 1e9, "I": 0.1}}]}, "walks.0.design"),
    ],
)
def test_what_cannot_be_simulated_is_refused_by_field(change: dict[str, Any], field: str) -> None:
    with pytest.raises(InvalidRequest) as refused:
        spec(**change).check_can_be_simulated()
    assert refused.value.field == field
