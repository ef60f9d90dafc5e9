"""Static stability of planned gaits: the margin, and which gaits have one."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from gaitswarm.sim.gait.stability import static_stability, support_margin
from gaitswarm.sim.robot import load_robot
from gaitswarm.sim.robot.limbs import feet_and_centre_of_mass, feet_in_body
from gaitswarm.sim.robot.robot import Robot
from tests.examples.walks import quadruped_files, short_walk

SQUARE = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
QUADRUPED = {"radius": 0.22, "hip_height": 0.16, "stride": 0.08, "height": 0.03}


@pytest.fixture(scope="module")
def quadruped() -> Robot:
    return load_robot(quadruped_files())


@pytest.mark.parametrize(
    ("feet", "point", "margin"),
    [
        (SQUARE, [0.0, 0.0], 1.0),
        (SQUARE, [0.75, 0.1], 0.25),
        (SQUARE, [2.0, 2.0], -np.sqrt(2.0)),
        (SQUARE[[2, 0, 1, 3, 0]], [0.0, -0.5], 0.5),
        (SQUARE[:3], [0.5, -0.5], -np.sqrt(0.5)),
        (SQUARE[[0, 2]], [0.0, 0.0], 0.0),
        (SQUARE[[0, 2]], [1.0, -1.0], -np.sqrt(2.0)),
        (SQUARE[:1], [1.0, 0.0], -1.0),
    ],
)
def test_the_margin_is_the_distance_from_the_edge_of_the_feets_hull(
    feet: np.ndarray, point: list[float], margin: float
) -> None:
    assert support_margin(feet, np.array(point)) == pytest.approx(margin)


@pytest.mark.parametrize("name", ["szabadka2", "szabadka2-identified", "quadruped"])
def test_feet_and_centre_of_mass_are_pinocchios(name: str, quadruped: Robot) -> None:
    robot = quadruped if name == "quadruped" else load_robot(name)
    joints = np.random.default_rng(1).uniform(-1.0, 1.0, (3, robot.n_joints))
    feet, centre = feet_and_centre_of_mass(robot, joints, load=0.0)
    model = pin.buildModelFromXML(robot.urdf.text, pin.JointModelFreeFlyer())
    masses = np.array([inertia.mass for inertia in model.inertias])
    data, q = model.createData(), pin.neutral(model)
    for angles, of_feet, at in zip(joints, feet, centre, strict=True):
        np.testing.assert_allclose(of_feet, feet_in_body(robot, angles), atol=1e-12)
        for joint, angle in zip(robot.joint_names, angles, strict=True):
            q[model.joints[model.getJointId(joint)].idx_q] = angle
        pin.centerOfMass(model, data, q)
        # Its body may have another mass than the URDF's.
        moment = data.com[0] * masses.sum() + (robot.mass - masses.sum()) * robot.body.centre
        np.testing.assert_allclose(at, moment / robot.mass, atol=1e-12)


def test_a_load_moves_the_centre_of_mass_towards_where_it_lies(quadruped: Robot) -> None:
    joints = np.zeros((1, quadruped.n_joints))
    (bare,), (laden,) = (feet_and_centre_of_mass(quadruped, joints, load)[1] for load in (0.0, 2.0))
    at = np.array([0.0, 0.0, quadruped.description.load_height])
    np.testing.assert_allclose(
        laden, (quadruped.mass * bare + 2.0 * at) / (quadruped.mass + 2.0), atol=1e-12
    )


@pytest.mark.parametrize(
    ("gait", "duty", "feet"), [("tripod", 0.56, 3), ("ripple", 0.7, 4), ("wave", 0.85, 5)]
)
def test_gaits_of_a_hexapod_are_statically_stable(gait: str, duty: float, feet: int) -> None:
    found = static_stability(load_robot("szabadka2"), short_walk(gait=gait, duty_factor=duty))
    assert found.stable and found.fewest_feet == feet
    assert found.duty_factor == pytest.approx(duty)


def test_more_feet_on_the_ground_hold_a_hexapod_better() -> None:
    tripod, wave = (
        static_stability(load_robot("szabadka2"), short_walk(gait=gait, duty_factor=duty)).margin
        for gait, duty in (("tripod", 0.56), ("wave", 0.85))
    )
    assert tripod is not None and wave is not None and wave > tripod


def test_of_a_quadruped_only_the_crawl_can_be_statically_stable(quadruped: Robot) -> None:
    for gait in ("trot", "pace", "bound"):
        found = static_stability(quadruped, short_walk(**QUADRUPED, gait=gait, duty_factor=0.55))
        assert not found.stable and found.fewest_feet == 2
    crawl = short_walk(**QUADRUPED, gait="crawl", duty_factor=0.9)
    assert static_stability(quadruped, crawl).stable


def crawl_margin(quadruped: Robot, **sway: float) -> float:
    crawl = short_walk(**QUADRUPED, gait="crawl", duty_factor=0.9, **sway)
    margin = static_stability(quadruped, crawl).margin
    assert margin is not None
    return margin


def test_a_crawl_is_held_better_by_a_body_that_sways_away_from_the_foot_in_the_air(
    quadruped: Robot,
) -> None:
    # In the middle of the right legs' swings the body is furthest left.
    begin = 0.5 + (0.9 - 0.75) / 2.0
    still = crawl_margin(quadruped)
    aside = crawl_margin(quadruped, sway_lateral=0.03, sway_phase=begin)
    both = crawl_margin(quadruped, sway_lateral=0.03, sway_longitudinal=0.02, sway_phase=begin)
    assert still < aside - 0.005 < both - 0.01
    assert crawl_margin(quadruped, sway_lateral=-0.03, sway_phase=begin) < still
    assert crawl_margin(quadruped, sway_longitudinal=-0.02, sway_phase=begin) < still


def test_on_a_slope_the_body_leans_out_of_its_feet(quadruped: Robot) -> None:
    level = short_walk(**QUADRUPED, gait="crawl", duty_factor=0.8, sway_lateral=0.03)
    uphill, downhill = (
        static_stability(quadruped, level.model_copy(update={"slope": slope})).margin
        for slope in (25.0, -25.0)
    )
    margin = static_stability(quadruped, level).margin
    assert margin is not None and uphill is not None and downhill is not None
    assert max(uphill, downhill) < margin


def test_a_gait_with_a_flight_phase_has_no_margin(quadruped: Robot) -> None:
    bound = short_walk(**QUADRUPED, gait="bound", duty_factor=0.4)
    found = static_stability(quadruped, bound)
    assert (found.margin, found.fewest_feet, found.stable) == (None, 0, False)
