"""Static friction in the gearheads: against the motion, never driving."""

from __future__ import annotations

import numpy as np
import pytest

from gaitswarm.sim.kernel.dynamics.physics_step import physics_model
from gaitswarm.sim.kernel.native import native_kernel
from gaitswarm.sim.kernel.parameters import STATIC_FRICTION_RATE, pack_parameters
from gaitswarm.sim.robot import Robot, load_robot
from gaitswarm.sim.scenario import SCENARIOS
from tests.examples.robots import changed
from tests.examples.walks import short_walk, walk

PI = {"P": 0.45, "I": 0.1}
BRIEF = short_walk(cycle_time=0.25)


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("szabadka2")


def rough(robot: Robot, friction: float = 0.2) -> Robot:
    return changed(robot, gearheads={"static_friction": friction})


def test_friction_at_the_joint_is_the_outputs_times_the_bevels_ratio(robot: Robot) -> None:
    coxa, femur, tibia = rough(robot).actuators().static_friction[:3]
    assert (coxa, femur, tibia) == (0.2, 0.4, 0.2)
    assert not robot.has_static_friction


@pytest.mark.variants("0.25", "-1.0")
@pytest.mark.parametrize("rate", [0.0, 0.25, -0.5, 1.0, -1.0, 20.0])
def test_it_is_linear_in_a_narrow_zone_and_full_against_the_motion_beyond(
    robot: Robot, rate: float
) -> None:
    """rate: of all joints, in units of the zone."""
    q = np.concatenate([[0, 0, 1.0, 0, 0, 0, 1], np.tile([0.0, -0.2, -1.6], 6)])
    v = np.concatenate([np.zeros(6), np.full(18, rate * STATIC_FRICTION_RATE)])
    still = np.zeros(18)
    reaction = {}
    for machine in (robot, rough(robot)):
        p = pack_parameters(machine, SCENARIOS[0], 2e-4)
        _, _, load, _, _, acceleration = physics_model(machine).observe(q, v, [], still, still, p)
        # M_L + J r^2 domega is what motor and friction give: current's, viscous and static part.
        inertia = machine.actuators().armature
        joints = np.array(acceleration).ravel()[6:]
        reaction[machine.has_static_friction] = np.array(load).ravel() + inertia * joints
    expected = -rough(robot).actuators().static_friction * np.clip(rate, -1.0, 1.0)
    np.testing.assert_allclose(reaction[True] - reaction[False], expected, atol=1e-9)


@pytest.mark.variants
@pytest.mark.parametrize("backlash", [0.0, 0.02])
def test_kernels_agree_with_static_friction(robot: Robot, backlash: float) -> None:
    machine = changed(rough(robot), actuators={"backlash": backlash})
    fast, slow = (
        walk(BRIEF, PI, "pi", robot=machine, backend=backend) for backend in ("native", "reference")
    )
    np.testing.assert_allclose(fast.outcome.objectives, slow.outcome.objectives, rtol=1e-7)
    np.testing.assert_allclose(fast.measurements.array(), slow.measurements.array(), rtol=1e-7)


def test_friction_costs_current_and_robots_that_differ_in_its_size_share_a_kernel(
    robot: Robot,
) -> None:
    assert native_kernel(rough(robot, 0.1)) is native_kernel(rough(robot))
    none, little, much = (
        walk(SCENARIOS[0], PI, "pi", robot=machine).measurements.mean_current[0]
        for machine in (robot, rough(robot, 0.1), rough(robot))
    )
    assert none < little < much
