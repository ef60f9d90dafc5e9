"""Designs in worlds that differ from the model, wherever they walk."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import gaitswarm
from tests.examples.walks import short_walk

pytestmark = pytest.mark.slow

PI = {"P": 0.45, "I": 0.1}
ASKED: dict[str, Any] = {"controller": "pi", "scenarios": short_walk()}
WORLD = {"friction_factor": 0.8, "slope_added": 2.0, "angle_noise": 1e-3, "world_seed": 7}


def test_a_world_differs_from_the_model() -> None:
    here = gaitswarm.simulate(PI, world=WORLD, **ASKED)
    assert not np.array_equal(here.objectives, gaitswarm.simulate(PI, **ASKED).objectives)


def test_many_designs_walk_in_a_world_as_each_alone() -> None:
    gains = np.array([0.2, 0.45])
    many = gaitswarm.simulate({"P": gains, "I": 0.1}, world=WORLD, **ASKED)
    for row, gain in enumerate(gains.tolist()):
        alone = gaitswarm.simulate({"P": gain, "I": 0.1}, world=WORLD, log=True, **ASKED)
        assert np.array_equal(many.objectives[[row]], alone.objectives)
        assert np.array_equal(many.measurements[[row]], alone.measurements)
        assert alone["short"].logs[0] is not None


@pytest.mark.parametrize(
    ("world", "field", "said"),
    [
        ({"gravity": 3.0}, "world.gravity", "unknown perturbation; known are friction_factor"),
        ({"friction_factor": -1.0}, "world.friction_factor", "-1 must lie in 0 to 100"),
        ({"slope_added": float("nan")}, "world.slope_added", "finite number"),
        ([0.8], "world", "must be an object"),
    ],
)
def test_a_world_that_cannot_be_is_refused_with_its_field(
    world: Any, field: str, said: str
) -> None:
    with pytest.raises(gaitswarm.InvalidRequest, match=said) as refused:
        gaitswarm.simulate(PI, world=world, **ASKED)
    assert refused.value.field == field
