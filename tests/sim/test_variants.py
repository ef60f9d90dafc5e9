"""Laws of friction, backlash, noise, and slopes in any direction."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from pydantic import ValidationError

from gaitswarm.sim.assembly import plan_walk
from gaitswarm.sim.controllers import CONTROLLERS
from gaitswarm.sim.kernel.dynamics.physics_step import physics_model
from gaitswarm.sim.kernel.native import native_kernel
from gaitswarm.sim.kernel.observation import walk_log
from gaitswarm.sim.kernel.parameters import internal_state_size, pack_parameters
from gaitswarm.sim.kernel.walk import Coding
from gaitswarm.sim.noise import LinkNoise
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.robot import DEFAULT_ROBOT, RobotVariant, load_robot
from gaitswarm.sim.robot.bounds import ContactLaw
from gaitswarm.sim.scenario import SCENARIOS, Scenario
from gaitswarm.sim.simulate import simulate
from tests.examples.robots import changed

pytestmark = pytest.mark.slow

PI = np.array([[0.45, 0.1]])
BRIEF = SCENARIOS[0].model_copy(update={"cycles": 1.0, "cycle_time": 0.3})
KARNOPP = RobotVariant(name="szabadka2", contact_law="karnopp")
DEAD_ZONE = RobotVariant(name="szabadka2", contact_law="dead_zone")
STICK = RobotVariant(name="szabadka2", contact_law="stick")
LASH = RobotVariant(name="szabadka2", backlash=(2.5, 1.0, 1.0))
VARIANTS = pytest.mark.parametrize("variant", [KARNOPP, STICK, DEAD_ZONE, LASH], ids=str)


@pytest.mark.variants
@VARIANTS
def test_kernels_agree_on_every_variant(variant: RobotVariant) -> None:
    fast, slow = (
        simulate(BRIEF, "pi", ["P", "I"], PI, robot=variant, backend=backend, log=True)
        for backend in ("native", "reference")
    )
    assert fast.outcome.statuses.tolist() == slow.outcome.statuses.tolist() == [Status.OK]
    np.testing.assert_allclose(fast.outcome.objectives, slow.outcome.objectives, rtol=1e-7)
    ours, theirs = (run.logs[0] for run in (fast, slow))
    assert ours is not None
    assert theirs is not None
    np.testing.assert_allclose(ours.motor_angle, theirs.motor_angle, atol=1e-9)


@pytest.mark.variants
@VARIANTS
@pytest.mark.parametrize("scenario", SCENARIOS, ids=lambda s: s.name)
def test_every_variant_walks_every_scenario(variant: RobotVariant, scenario: Scenario) -> None:
    outcome = simulate(scenario, "pi", ["P", "I"], PI, robot=variant).outcome
    plain = simulate(scenario, "pi", ["P", "I"], PI, robot="szabadka2").outcome
    assert outcome.statuses.tolist() == [Status.OK]
    # Uphill the plain law creeps back by a tenth of these strides; one that sticks does not, and
    # backlash costs as much again.
    near = 0.15 if scenario.slope and (variant is STICK or variant.backlash) else 0.1
    assert outcome.objectives[0, 4] == pytest.approx(plain.objectives[0, 4], rel=near)
    assert (outcome.objectives != plain.objectives).all()


def test_karnopp_is_full_friction_against_each_axis_beyond_its_threshold() -> None:
    robot = load_robot(KARNOPP)
    model, rng = physics_model(robot), np.random.default_rng(2)
    p = pack_parameters(robot, SCENARIOS[0], 2e-4)
    still, seen = np.zeros(18), set()
    for _ in range(50):
        q = np.concatenate([[0, 0, 0.138, 0, 0, 0, 1], np.tile([0.0, -0.2, -1.6], 6)])
        v = np.concatenate([rng.choice([0.0, 0.004, 0.3, -0.3], 2), np.zeros(22)])
        forces = np.array(model.observe(q, v, [], still, still, p)[3]).reshape(6, 3)
        sign = np.where(np.abs(v[:2]) > 0.005, np.sign(v[:2]), 0.0)
        np.testing.assert_allclose(forces[:, :2], -np.outer(forces[:, 2], sign), atol=1e-9)
        assert (forces[:, 2] > 0).all()
        seen.add(tuple(sign))
    assert len(seen) > 4


def test_dead_zone_is_friction_that_rises_between_two_speeds_against_the_motion() -> None:
    robot = load_robot(DEAD_ZONE)
    model, rng = physics_model(robot), np.random.default_rng(2)
    p = pack_parameters(robot, SCENARIOS[0], 2e-4)
    still = np.zeros(18)
    for speed in (0.0, 0.001, 0.005, 0.006, 0.0275, 0.049, 0.05, 0.3):
        angle = rng.uniform(0.0, 2.0 * np.pi)
        slip = speed * np.array([np.cos(angle), np.sin(angle)])
        q = np.concatenate([[0, 0, 0.138, 0, 0, 0, 1], np.tile([0.0, -0.2, -1.6], 6)])
        v = np.concatenate([slip, np.zeros(22)])
        forces = np.array(model.observe(q, v, [], still, still, p)[3]).reshape(6, 3)
        share = min(max((speed - 0.005) / (0.05 - 0.005), 0.0), 1.0)
        expected = -share * slip / speed if speed else slip
        np.testing.assert_allclose(forces[:, :2], np.outer(forces[:, 2], expected), atol=1e-9)
        assert (forces[:, 2] > 0).all()


def test_a_dead_zone_that_reaches_beyond_the_linear_one_is_refused() -> None:
    robot = load_robot("szabadka2")
    wide = {"stick_velocity": 0.06}
    assert changed(robot, contact=wide).description.contact.stick_velocity == 0.06
    with pytest.raises(ValidationError, match=r"contact\.stick_velocity: must be less than"):
        changed(robot, contact_law="dead_zone", contact=wide)


def resting_creep(law: ContactLaw) -> float:
    """Distance [m] that a robot standing on a slope of 20 degrees slides in the second second."""
    robot = load_robot(RobotVariant(name="szabadka2", contact_law=law))
    kernel = native_kernel(robot)
    assert kernel is not None
    steep = SCENARIOS[0].model_copy(update={"slope": 20.0})
    plan = plan_walk(robot, steep, 2e-4)
    assert plan is not None
    setup = plan(CONTROLLERS["pi"].compile({"P": 1.0, "I": 1.0}))
    still = dataclasses.replace(setup, desired=np.repeat(setup.desired[:1], 1000, axis=0))
    (result,) = kernel.walk([still], Coding.of(robot, 10), log=True)
    assert result.status is Status.OK
    assert result.states is not None
    log = walk_log(robot, still, result.states)
    limit = log.foot_force[..., 2] + 1e-9
    assert (np.hypot(log.foot_force[..., 0], log.foot_force[..., 1]) <= limit).all()
    return float(np.linalg.norm(log.base_position[-1, :2] - log.base_position[500, :2]))


@pytest.mark.thorough("test_driven_on_the_ground_both_engines_accelerate_alike")
def test_stick_holds_where_the_linear_zone_creeps() -> None:
    creep, hold = resting_creep("linear_zone"), resting_creep("stick")
    assert creep > 0.01
    assert hold < 1e-3


def test_gravity_of_a_slope_points_down_it() -> None:
    ahead = SCENARIOS[0].model_copy(update={"slope": 10.0, "cycles": 1.0})
    left = ahead.model_copy(update={"slope_direction": 90.0})
    runs = [simulate(s, "pi", ["P", "I"], PI, log=True) for s in (ahead, left)]
    pulls = []
    for run in runs:
        (log,) = run.logs
        assert log is not None
        pulls.append(log.foot_force.sum(axis=1).mean(axis=0))
    # The feet hold against m g sin(10 deg), uphill.
    downhill = load_robot(DEFAULT_ROBOT).mass * 9.81 * math.sin(math.radians(10.0))
    assert pulls[0][0] == pytest.approx(downhill, abs=1.5)
    assert pulls[1][1] == pytest.approx(downhill, abs=1.5)


def test_backlash_lets_motor_and_link_part_by_no_more_than_the_play() -> None:
    robot = load_robot(LASH)
    assert internal_state_size(robot) == 36
    (log,) = simulate(BRIEF, "pi", ["P", "I"], PI, robot=LASH, log=True).logs
    assert log is not None
    gap = np.abs(log.motor_angle - log.joint_angle)
    for kind, degrees in enumerate((2.5, 1.0, 1.0)):
        widest = gap[:, kind::3].max()
        half = math.radians(degrees) / 2
        # Beyond the play the shaft yields by torque over its 500 Nm/rad.
        assert half < widest < half + 0.03
    inside = gap[:, ::3] < 0.99 * math.radians(2.5) / 2
    assert inside.any()
    assert not log.load_torque[:, ::3][inside].any()


def test_backlash_shakes_the_body() -> None:
    shaken, firm = (
        simulate(BRIEF, "pi", ["P", "I"], PI, robot=robot).outcome.objectives[0]
        for robot in (LASH, "szabadka2")
    )
    assert shaken[2] > 1.5 * firm[2]


@pytest.mark.variants
@pytest.mark.parametrize("link", [1, 2, 3])
def test_noise_on_a_link_costs_torque(link: int) -> None:
    calm_walk = SCENARIOS[0].model_copy(update={"cycles": 1.0})
    noise = LinkNoise(link=link, deviation=10.0)
    noisy = simulate(calm_walk, "pi", ["P", "I"], PI, noise=noise).outcome.objectives[0]
    calm = simulate(calm_walk, "pi", ["P", "I"], PI).outcome.objectives[0]
    assert noisy[0] > 1.1 * calm[0]
    again = simulate(calm_walk, "pi", ["P", "I"], PI, noise=noise).outcome.objectives[0]
    np.testing.assert_array_equal(noisy, again)
    torques = noise.samples(50, 18)
    assert set(np.flatnonzero(torques.any(axis=0)) % 3) == {link - 1}


def test_robots_that_differ_in_run_time_parameters_share_a_kernel() -> None:
    robot = load_robot("szabadka2")
    supply = robot.description.supply.model_copy(update={"voltage": 9.22})
    weak = dataclasses.replace(
        robot, description=robot.description.model_copy(update={"supply": supply})
    )
    assert native_kernel(weak) is native_kernel(robot)
    assert physics_model(weak) is physics_model(robot)
    slow, fast = (
        simulate(BRIEF, "pi", ["P", "I"], PI, robot=r).outcome.objectives[0, 4]
        for r in (weak, robot)
    )
    assert slow > fast


def test_a_heavier_body_costs_energy() -> None:
    robot = load_robot("szabadka2")
    heavy = dataclasses.replace(
        robot, description=robot.description.model_copy(update={"body_mass": 5.0})
    )
    laden = simulate(BRIEF, "pi", ["P", "I"], PI, robot=heavy, log=True)
    free = simulate(BRIEF, "pi", ["P", "I"], PI, robot=robot)
    assert laden.outcome.objectives[0, 0] > free.outcome.objectives[0, 0]
    (carried,) = laden.logs
    assert carried is not None
    assert carried.foot_force[0, :, 2].sum() == pytest.approx((6.76 + 1.75) * 9.81, rel=0.02)


def test_derivative_gain_damps_by_the_change_of_error() -> None:
    law = CONTROLLERS["pid"].compile({"P": 0.4, "I": 0.1, "D": 0.004})
    # 0.004 counts s/count over a tick of 2 ms: two PWM counts per count of change.
    assert law.derivative_gain == 2 << 16
    results = [
        simulate(BRIEF, "pid", ["P", "I", "D"], np.array([[0.4, 0.1, 0.004]]), backend=backend)
        for backend in ("native", "reference")
    ]
    np.testing.assert_allclose(
        results[0].outcome.objectives, results[1].outcome.objectives, rtol=1e-9
    )
