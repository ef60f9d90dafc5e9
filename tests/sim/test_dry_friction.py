"""Dry friction in gears: it holds, yields at its limit, and only dissipates."""

from __future__ import annotations

import numpy as np
import pytest

from gaitswarm.sim.kernel.dynamics.physics_step import physics_model
from gaitswarm.sim.kernel.native import native_kernel
from gaitswarm.sim.kernel.parameters import HOLDING_FREQUENCY, Layout, pack_parameters
from gaitswarm.sim.robot import load_robot
from gaitswarm.sim.robot.description import DryFriction
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.scenario import SCENARIOS
from gaitswarm.sim.simulate import simulate
from tests.examples.robots import changed
from tests.examples.walks import short_walk, torque_quadruped_files, walk
from tests.sim.pinocchio_oracle import Oracle

PI = {"P": 0.45, "I": 0.1}
BRIEF = short_walk(cycle_time=0.25)
FULL = {"coulomb_friction": 0.1, "stribeck_friction": 0.1, "load_friction": 0.05}
TIMESTEP = 4e-4


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("szabadka2")


def loaded(robot: Robot, **friction: float) -> Robot:
    """The robot with this dry friction, and no other, in every actuator or gearhead."""
    table = "actuators" if robot.is_torque_controlled else "gearheads"
    return changed(robot, **{table: DryFriction().model_dump() | friction})


def servos(**friction: float) -> Robot:
    files = torque_quadruped_files()
    toml = files.toml.replace("viscous_friction = 0.02", "")
    return loaded(load_robot(files.model_copy(update={"toml": toml})), **friction)


def test_friction_at_the_joint_is_the_outputs_behind_the_bevel_gear(robot: Robot) -> None:
    friction = {"coulomb_friction": 0.2, "stribeck_speed": 0.1, "load_friction": 0.3}
    a = loaded(robot, **friction).actuators()
    assert a.coulomb_friction[:3].tolist() == [0.2, 0.4, 0.2]
    assert a.stribeck_speed[:3].tolist() == [0.1, 0.05, 0.1]
    assert a.load_friction[:3].tolist() == [0.3] * 3
    assert not robot.has_dry_friction


def test_a_robot_stands_on_its_gears_alone_and_does_not_creep() -> None:
    """No motor gives torque; the friction alone carries the weight for 3 s."""
    standing = short_walk(cycle_time=3.0, stride=1e-9, height=0.0)
    names, nothing = ["Kp", "Kd", "feed_forward"], np.zeros((1, 3))
    held, slack = (
        simulate(standing, "joint-pd", names, nothing, robot=machine, log=True).logs[0]
        for machine in (servos(coulomb_friction=10.0), servos(coulomb_friction=1e-6))
    )
    assert held is not None and slack is not None
    one, end = (np.array(held.joint_angle[k]) for k in (500, -1))
    np.testing.assert_allclose(end, one, rtol=0.0, atol=2e-8)
    assert np.abs(end - held.joint_angle[0]).max() < 1e-3
    assert np.nanmin(slack.base_position[:, 2]) < held.base_position[-1, 2] - 0.03


def end_of_flight(
    robot: Robot, timestep: float, *, from_motor: float = 0.0, from_link: float = 0.0
) -> tuple[float, float]:
    """Angle and rate of the first joint after 0.1 s, at first at rest without gravity.

    Torques [N m] of its motor and on its link grow for 0.05 s, then stay. The one on the link is an
    obstacle's that is far away.
    """
    q = np.concatenate([[0, 0, 9.0, 0, 0, 0, 1], np.tile([0.0, -0.2, -1.6], len(robot.legs))])
    model, n, at = physics_model(robot), robot.n_joints, Layout(robot).slices
    p = pack_parameters(robot, SCENARIOS[0], timestep)
    p[at["gravity"]] = 0.0
    v, memory, none = np.zeros(6 + n), np.zeros(2 * n), np.zeros(n)
    first, far = np.eye(n)[0], 1e6
    p[at["jam_angle"]] = far * first
    for step in range(round(0.1 / timestep)):
        share = min(1.0, step * timestep / 0.05)
        p[at["jam_stiffness"]] = share * from_link / far * first
        duty = share * from_motor / max(robot.actuators().torque_limit[0], 1e-9) * first
        q, memory = (np.array(x).ravel() for x in model.drift(q, v, memory, 0.5 * timestep))
        v, memory = (np.array(x).ravel() for x in model.kick(q, v, memory, duty, none, p)[:2])
        q, memory = (np.array(x).ravel() for x in model.drift(q, v, memory, 0.5 * timestep))
    return float(q[7]), float(v[6])


@pytest.mark.variants("from_motor-stribeck", "from_link-load")
@pytest.mark.parametrize(
    "friction",
    [
        {"coulomb_friction": 0.4},
        {"coulomb_friction": 0.3, "stribeck_friction": 0.1},
        {"coulomb_friction": 0.3, "load_friction": 0.25},
    ],
    ids=["coulomb", "stribeck", "load"],
)
@pytest.mark.parametrize("side", ["from_motor", "from_link"])
def test_a_joint_breaks_away_at_the_limit_from_either_side(
    friction: dict[str, float], side: str
) -> None:
    """0.4 = 0.3 + 0.1 = 0.3 + 0.25 x 0.4 N m."""
    robot, limit = servos(**friction), 0.4
    held, moved = (
        end_of_flight(robot, TIMESTEP, **{side: share * limit}) for share in (0.97, 1.03)
    )
    stretched = limit / (robot.actuators().armature[0] * HOLDING_FREQUENCY**2)
    assert abs(held[0]) < 2.0 * stretched
    assert abs(held[1]) < 1e-6
    assert moved[0] > 10.0 * stretched


def test_energy_is_only_dissipated() -> None:
    """Free flight from violent rates: motion and springs lose energy until all joints hold."""
    robot = servos(**FULL)
    oracle, rng, n = Oracle(robot), np.random.default_rng(3), robot.n_joints
    model, p = physics_model(robot), pack_parameters(robot, SCENARIOS[0], TIMESTEP)
    p[Layout(robot).slices["gravity"]] = 0.0
    q = np.concatenate([[0, 0, 9.0, 0, 0, 0, 1], np.tile([0.0, -0.2, -1.6], len(robot.legs))])
    v = np.concatenate([np.zeros(6), 0.4 * rng.normal(size=n)])
    memory, still = np.zeros(2 * n), np.zeros(n)
    stiffness = robot.actuators().armature * HOLDING_FREQUENCY**2
    energies = []
    for _ in range(750):
        q, memory = (np.array(x).ravel() for x in model.drift(q, v, memory, 0.5 * TIMESTEP))
        moving = oracle.kinetic_energy(q, v)
        energies.append(float(moving + (memory[:n] ** 2 / stiffness).sum() / 2.0))
        v, memory = (np.array(x).ravel() for x in model.kick(q, v, memory, still, still, p)[:2])
        q, memory = (np.array(x).ravel() for x in model.drift(q, v, memory, 0.5 * TIMESTEP))
    gains = np.diff(energies)
    assert gains.max() < 1e-4 * energies[0]
    assert energies[-1] < 0.1 * energies[0]
    assert np.abs(v[6:]).max() < 1e-4


def test_halved_steps_converge() -> None:
    """Where a joint is that a growing torque tears away."""
    machine = servos(**FULL)
    ends = [end_of_flight(machine, step, from_link=1.0)[0] for step in (8e-4, 4e-4, 2e-4)]
    assert abs(ends[1] - ends[2]) < 0.7 * abs(ends[0] - ends[2])
    assert ends[1] == pytest.approx(ends[2], rel=0.01)


@pytest.mark.variants
@pytest.mark.parametrize("backlash", [0.0, 0.02])
def test_kernels_agree_with_dry_friction(robot: Robot, backlash: float) -> None:
    machine = changed(loaded(robot, **FULL), actuators={"backlash": backlash})
    fast, slow = (
        walk(BRIEF, PI, "pi", robot=machine, backend=backend) for backend in ("native", "reference")
    )
    np.testing.assert_allclose(fast.outcome.objectives, slow.outcome.objectives, rtol=1e-7)
    np.testing.assert_allclose(fast.measurements.array(), slow.measurements.array(), rtol=1e-7)


def test_friction_costs_current_and_robots_that_differ_in_its_size_share_a_kernel(
    robot: Robot,
) -> None:
    little, much = (loaded(robot, coulomb_friction=size) for size in (0.1, 0.2))
    assert native_kernel(little) is native_kernel(much)
    currents = [
        walk(SCENARIOS[0], PI, "pi", robot=machine).measurements.mean_current[0]
        for machine in (robot, little, much)
    ]
    assert currents == sorted(currents)
