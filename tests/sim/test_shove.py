"""A shove: a horizontal impulse on the body in mid-walk."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from gaitswarm.sim.assembly import control_steps, plan_walk
from gaitswarm.sim.controllers import control_law
from gaitswarm.sim.kernel.native import native_kernel
from gaitswarm.sim.kernel.walk import WalkResult
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.robot import RobotVariant, load_robot
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.scenario import Scenario, find_scenario
from tests.examples.walks import logged_walk, short_walk, walk

Floats = NDArray[np.float64]

PI = {"P": 0.45, "I": 0.1}

FALLING = {"drop": 0.3, "shove_at": 0.02, "cycle_time": 1.0}
"""Feet come down after a quarter of a second: until then nothing else pushes."""


def velocity(scenario: Scenario, tick: int) -> Floats:
    """Of the body along the world's axes, a foot being nowhere on the ground until then."""
    log = logged_walk(scenario, {"P": 1.0, "I": 0.0}, "pi", robot="szabadka2")
    assert not log.foot_force[: tick + 1].any()
    steps = np.diff(log.base_position, axis=0) / 0.002
    return np.asarray(steps[tick - 10 : tick].mean(axis=0))


@pytest.mark.variants("-90.0", "30.0")
@pytest.mark.parametrize("direction", [90.0, -90.0, 0.0, 180.0, 30.0])
def test_a_shove_moves_the_body_by_impulse_over_mass(direction: float) -> None:
    still, shoved = (
        velocity(short_walk(shove=impulse, shove_direction=direction, **FALLING), 110)
        for impulse in (0.0, 3.0)
    )
    speed = 3.0 / load_robot("szabadka2").mass
    towards = math.radians(direction)
    gained = speed * np.array([math.cos(towards), math.sin(towards), 0.0])
    # The legs' joints give way a little, and the force is not at the robot's centre of mass.
    np.testing.assert_allclose(shoved - still, gained, atol=0.12 * speed)


def test_a_shove_acts_for_a_tenth_of_a_second_in_mid_walk() -> None:
    straight, shoved = (
        logged_walk(short_walk(cycles=2.0, shove=impulse), PI, "pi") for impulse in (0.0, 4.0)
    )
    moved = shoved.base_position[:, 1] - straight.base_position[:, 1]
    begin, end = 500, 550
    assert not moved[: begin + 1].any()
    assert moved[begin + 2] > 0.0
    speed = np.gradient(moved, 0.002)
    assert begin < np.argmax(speed) <= end + 5
    assert moved[end] > 0.005
    assert moved[end:].min() > 0.0


@pytest.mark.parametrize(("share", "begin"), [(0.0, 0), (0.5, 250), (0.999, 450)])
def test_a_shove_is_whole_wherever_it_begins(robot: Robot, share: float, begin: int) -> None:
    scenario = short_walk(cycle_time=1.0, shove=1.0, shove_at=share)
    plan = plan_walk(robot, scenario, control_steps(robot)[1])
    assert plan is not None
    assert plan(control_law("pi", tuple(PI.items()))).shove_ticks == (begin, begin + 50)


def test_a_log_has_the_push_in_the_ticks_of_the_shove_alone() -> None:
    scenario = short_walk(shove=30.0, drop=0.3, shove_at=0.02)
    log = logged_walk(scenario, PI, "pi")
    quiet = logged_walk(short_walk(drop=0.3), PI, "pi")
    more = np.abs(log.load_torque - quiet.load_torque).sum(axis=1)
    # Before and after the push the robot falls, and only what the push has moved is another one.
    assert not more[:10].any()
    assert more[10] > 3.0
    assert abs(more[60] - more[59]) > 1.0


@pytest.mark.variants("variant0")
@pytest.mark.parametrize("variant", [RobotVariant(), RobotVariant(backlash=(2.5, 1.0, 1.0))])
def test_kernels_agree_on_a_shove(variant: RobotVariant) -> None:
    scenario = short_walk(
        shove=2.0, shove_direction=-60.0, shove_at=0.3, cycle_time=0.25, slope=5.0, drop=0.002
    )
    fast, slow = (
        walk(scenario, PI, "pi", robot=variant, backend=backend)
        for backend in ("native", "reference")
    )
    assert fast.outcome.statuses.tolist() == slow.outcome.statuses.tolist() == [Status.OK]
    np.testing.assert_allclose(fast.outcome.objectives, slow.outcome.objectives, rtol=1e-7)
    calm = walk(scenario.model_copy(update={"shove": 0.0}), PI, "pi", robot=variant)
    assert not np.allclose(fast.outcome.objectives, calm.outcome.objectives, rtol=1e-3)


def bits(result: WalkResult) -> bytes:
    return result.sums.tobytes() + result.end.tobytes()


@pytest.mark.variants
@pytest.mark.parametrize("precision", ["double", "single"])
def test_a_shove_does_not_affect_neighbours(robot: Robot, precision: str) -> None:
    kernel = native_kernel(robot, "single" if precision == "single" else "double")
    assert kernel is not None
    coding, timestep = control_steps(robot)
    law = control_law("pi", tuple(PI.items()))
    setups = []
    for impulse in (0.0, 1.0, 2.0):
        plan = plan_walk(robot, short_walk(shove=impulse, cycle_time=0.5), timestep)
        assert plan is not None
        setups.append(plan(law))
    company = kernel.walk([setups[k % 3] for k in range(2 * kernel.lanes + 1)], coding, log=False)
    alone = [bits(kernel.walk([setup], coding, log=False)[0]) for setup in setups]
    assert [bits(result) for result in company] == [alone[k % 3] for k in range(len(company))]
    assert len(set(alone)) == 3
    # A force that no tick has is none.
    never = replace(setups[2], shove_ticks=(0, 0))
    assert bits(kernel.walk([never], coding, log=False)[0]) == alone[0]


def test_the_published_optimum_survives_a_shove() -> None:
    shoved, straight = (find_scenario(name) for name in ("shove-fast", "straight"))
    pushed, calm = (walk(scenario, log=True) for scenario in (shoved, straight))
    assert pushed.outcome.statuses.tolist() == [Status.OK]
    ends = [log.base_position[-1, 1] for log in (*pushed.logs, *calm.logs) if log is not None]
    assert ends[0] - ends[1] > 0.015
