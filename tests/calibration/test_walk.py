"""Robots and conventions in one walk of a calibration."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gaitswarm.sim.calibration import CalibrationWalk, robot_variables
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.robot import RobotVariant, load_robot
from gaitswarm.sim.robot.identifiable import with_parameters
from gaitswarm.sim.scenario import Scenario
from tests.calibration.conftest import PI
from tests.examples.walks import short_walk, walk

(CONTACT_LAW,) = (v for v in robot_variables(["szabadka2"]) if v.name == "contact_law")


def case(*variables: str, scenario: Scenario | None = None, **more: float) -> CalibrationWalk:
    design = tuple(sorted((PI | more).items()))
    return CalibrationWalk("w", ("szabadka2",), "pi", design, scenario or short_walk(), variables)


@pytest.mark.variants("stick")
@pytest.mark.parametrize("law", CONTACT_LAW.choices)
def test_a_robot_walks_as_it_would_alone(law: Any) -> None:
    index = CONTACT_LAW.number(law)
    found = case("body_mass", "contact_law").run(np.array([[4.0, index], [2.5, index]]))
    for row, mass in enumerate((4.0, 2.5)):
        robot = with_parameters(
            load_robot(RobotVariant(name="szabadka2", contact_law=law)), {"body_mass": mass}
        )
        alone = walk(short_walk(), PI, "pi", robot=robot).outcome
        np.testing.assert_array_equal(found.objectives[row, :6], alone.objectives[0])


def test_a_design_does_not_depend_on_the_friction_laws_of_others() -> None:
    designs = np.array([[0.0], [1.0], [2.0], [0.0], [1.0], [2.0]])
    together = case("contact_law").run(designs)
    for row in range(3):
        alone = case("contact_law").run(designs[row : row + 1])
        np.testing.assert_array_equal(together.objectives[row], alone.objectives[0])
        np.testing.assert_array_equal(together.objectives[row + 3], alone.objectives[0])
    assert len(np.unique(together.objectives[:3, 3])) == 3


def test_what_a_walks_own_design_gives_is_not_varied() -> None:
    designs = np.array([[0.12], [0.16]])
    own, open_ = case("stride", stride=0.14).run(designs), case("stride").run(designs)
    assert own.objectives[0].tolist() == own.objectives[1].tolist()
    assert open_.objectives[0].tolist() != open_.objectives[1].tolist()
    with_own = walk(short_walk(stride=0.14), PI, "pi", robot="szabadka2").outcome
    np.testing.assert_array_equal(own.objectives[0, :6], with_own.objectives[0])


def test_a_walk_in_single_precision_is_nearly_that_in_double() -> None:
    double, masses = case("body_mass"), np.array([[4.0], [2.5]])
    single = replace(double, precision="single").run(masses).objectives
    assert not np.array_equal(single, double.run(masses).objectives)
    np.testing.assert_allclose(single[:, :5], double.run(masses).objectives[:, :5], rtol=1e-3)


def test_a_gait_out_of_reach_fails_alone() -> None:
    statuses = case("stride").run(np.array([[0.5], [0.12]])).statuses
    assert statuses.tolist() == [Status.UNREACHABLE, Status.OK]
