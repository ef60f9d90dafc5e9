"""A controller's surfaces against its own inference and the table that a walk looks up."""

from __future__ import annotations

import numpy as np
import pytest

from gaitswarm.sim.controllers import CONTROLLERS
from gaitswarm.sim.controllers.base import LookupTable
from gaitswarm.sim.controllers.fuzzy_pi import inference_system
from gaitswarm.sim.controllers.fuzzy_pi_3 import integral_system
from gaitswarm.sim.controllers.mamdani import Shape
from gaitswarm.sim.controllers.surface import Surface, surface
from tests.examples.walks import PUBLISHED_A

CHAPTER_3 = CONTROLLERS["fuzzy-pi-3"].published["fuzzy-pso-ps"]


@pytest.fixture(scope="module")
def fuzzy_p() -> Surface:
    (source,) = CONTROLLERS["fuzzy-pi"].inferences(PUBLISHED_A)
    return surface(source, error_points=65, current_points=33)


@pytest.fixture(scope="module")
def integral() -> Surface:
    _, source = CONTROLLERS["fuzzy-pi-3"].inferences(CHAPTER_3)
    return surface(source, error_points=33, current_points=17, velocity=6000.0)


def test_the_inference_is_that_of_the_normalised_system(fuzzy_p: Surface) -> None:
    system = inference_system(0.187, 0.961, 0.789, 0.927, Shape.GAUSS)
    error, current = (fuzzy_p.inputs[name].values for name in ("error", "current"))
    k, n = 50, 9
    alone = system.infer({"error": error[[k]] / 5837.0, "current": current[[n]] / 20111.0})
    assert fuzzy_p.inference[k, n] == pytest.approx(781.0 * alone[0, 0], rel=1e-12)


def test_the_table_is_that_of_the_drive_that_walks(fuzzy_p: Surface) -> None:
    table = CONTROLLERS["fuzzy-pi"].compile(PUBLISHED_A).direct
    assert isinstance(table, LookupTable)
    error, current = (fuzzy_p.inputs[name].values for name in ("error", "current"))
    for k, n in ((0, 0), (17, 30), (50, 9), (64, 32)):
        counts = [np.array([round(x)], dtype=np.int64) for x in (error[k], current[n], 0.0)]
        assert fuzzy_p.table[k, n] == table.respond(*counts)[0] / 65536


def test_the_grid_is_in_whole_counts_from_end_to_end(fuzzy_p: Surface) -> None:
    error, current = (fuzzy_p.inputs[name].values for name in ("error", "current"))
    assert (error[0], error[32], error[-1]) == (-5837.0, 0.0, 5837.0)
    assert (current[0], current[-1]) == (0.0, 20111.0)
    np.testing.assert_array_equal(error, np.rint(error))


def test_sets_cover_the_range(fuzzy_p: Surface) -> None:
    error, current = (fuzzy_p.inputs[name].degrees for name in ("error", "current"))
    np.testing.assert_allclose(np.sum(list(error.values()), axis=0), 1.0, atol=1e-12)
    assert error["zero"][32] == 1.0
    # Of 33 points the 4th is the last within a tenth of the range, up to which no current is large,
    # and the 17th is half the range, from which none is small.
    assert (current["small"][:16] > 0.0).all() and not current["small"][17:].any()
    assert (current["large"][4:] > 0.0).all() and not current["large"][:4].any()
    assert list(fuzzy_p.output.degrees) == [
        "null",
        "positive",
        "negative",
        "positive-extreme",
        "negative-extreme",
    ]


def test_a_table_differs_from_its_inference_by_a_few_hundredths_of_the_range(
    fuzzy_p: Surface,
) -> None:
    """Most where the output falls by all of its range within a quarter of the current's."""
    assert 0.0 < fuzzy_p.rms_difference < 0.03 * 781.0
    assert fuzzy_p.largest_difference < 0.12 * 781.0


def test_an_output_shows_all_of_its_universe(fuzzy_p: Surface) -> None:
    assert fuzzy_p.output.limits == (-3 * 781.0, 3 * 781.0)
    assert (fuzzy_p.output.values[0], fuzzy_p.output.values[-1]) == fuzzy_p.output.limits
    assert fuzzy_p.output.degrees["positive-extreme"].argmax() == 83
    assert fuzzy_p.inputs["current"].limits == (0.0, 20111.0)


def test_the_integrated_output_is_per_second_at_the_velocity_held(integral: Surface) -> None:
    system = integral_system(0.066, 0.996, 0.783, Shape.TRIANGLE)
    k, n = 20, 3
    error, current = (integral.inputs[name].values for name in ("error", "current"))
    alone = system.infer(
        {
            "error": error[[k]] / 5126.0,
            "current": current[[n]] / 4.4,
            "velocity": np.array([6000.0 / 11682.0]),
        }
    )
    assert integral.held == {"velocity": pytest.approx(6000.0)}
    assert integral.inference[k, n] == pytest.approx(2176.0 * alone[0, 0, 0], rel=1e-9)
    # Of a 6 x 4 x 6 bit table, whose current has 16 values.
    assert integral.rms_difference < 0.05 * 2176.0
    assert integral.largest_difference < 0.12 * 2176.0
    assert integral.inference.max() > 400.0


def test_controllers_without_rules_have_no_inference() -> None:
    for name in ("p", "pi", "pid"):
        assert CONTROLLERS[name].inferences({}) == ()
