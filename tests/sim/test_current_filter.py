"""The analog low-pass of the motors' current before its converter."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from gaitswarm.sim.assembly import control_steps, plan_walk
from gaitswarm.sim.controllers.base import ControlLaw, LookupTable
from gaitswarm.sim.kernel.native import native_kernel
from gaitswarm.sim.kernel.observation import sensed_currents, walk_log
from gaitswarm.sim.kernel.reference import reference_kernel
from gaitswarm.sim.kernel.walk import Coding, current_smoothing
from gaitswarm.sim.robot import load_robot
from gaitswarm.sim.robot.robot import Robot
from tests.examples.robots import changed
from tests.examples.walks import short_walk, walk

BRIEF = short_walk(cycle_time=0.25)


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("szabadka2")


def filtered(robot: Robot, seconds: float) -> Robot:
    return changed(robot, sensors={"current_filter": seconds})


def test_a_filters_time_constant_is_that_of_a_first_order_low_pass() -> None:
    assert current_smoothing(0.0, 2e-4) == 1.0
    share = current_smoothing(0.005, 2e-4)
    # A step of the current is followed to 1 - 1/e after 5 ms, 25 physics steps of 0.2 ms.
    assert 1.0 - (1.0 - share) ** 25 == pytest.approx(1.0 - math.exp(-1.0), rel=1e-12)


def test_as_many_shorter_steps_follow_a_current_as_far_as_one_step(robot: Robot) -> None:
    plan = plan_walk(filtered(robot, 0.005), BRIEF, 2e-4)
    assert plan is not None
    setup = plan(softer_by_current())
    left = 1.0 - setup.smoothing(16)
    assert left**16 == pytest.approx(1.0 - setup.smoothing(1), rel=1e-12)
    assert setup.smoothing(1) == current_smoothing(0.005, 2e-4) > setup.smoothing(16)
    assert dataclasses.replace(setup, current_smoothing=1.0).smoothing(16) == 1.0


def softer_by_current() -> ControlLaw:
    """PWM of the error's sign that falls by 3 counts with every 32 counts of current."""
    soft = np.arange(127, -1, -1, dtype=np.int8)
    values = np.stack([-soft, soft]).reshape(2, 128, 1)
    table = LookupTable(values, output_gain=3 << 16, error_gain=1 << 16, current_gain=1 << 11)
    return ControlLaw(proportional_gain=0, integral_gain=0, derivative_gain=0, direct=table)


@pytest.mark.parametrize("kind", ["native", "reference"])
def test_the_controller_reads_the_filtered_absolute_current(robot: Robot, kind: str) -> None:
    """With a control tick at every physics step, the log tells every current that is filtered."""
    kernel = native_kernel(robot) if kind == "native" else reference_kernel(robot)
    plan = plan_walk(robot, BRIEF, 2e-4)
    assert kernel is not None
    assert plan is not None
    setup = plan(softer_by_current())
    # Errors, and with them the currents, change sign every 20 physics steps.
    side = np.where(np.arange(100) // 20 % 2, -1, 1)[:, None]
    desired = setup.desired[:100] + 20_000 * side.astype(np.int32)
    setup = dataclasses.replace(setup, desired=desired, current_smoothing=0.1)
    coding = Coding.of(robot, 1)
    (result,) = kernel.walk([setup], coding, log=True)
    assert result.states is not None
    log, actuators = walk_log(robot, setup, result.states), robot.actuators()
    # The currents of a step are those of its middle.
    faster = 0.5 * np.diff(log.joint_velocity, axis=0)
    signed = log.current[:-1] - actuators.torque * faster / actuators.resistance
    assert signed.min() < -0.1 < 0.1 < signed.max()
    current = np.abs(signed)
    sensed = np.zeros_like(log.current)
    for tick in range(1, len(sensed)):
        sensed[tick] = sensed[tick - 1] + 0.1 * (current[tick - 1] - sensed[tick - 1])
    code = np.floor((np.rint(sensed * 2079.0) + 8.0) / 16.0) * 16.0
    counts = side * 3.0 * (127.0 - np.floor(code / 32.0 + 0.5))
    duty = result.states[:, -robot.n_joints :]
    np.testing.assert_allclose(duty / coding.duty_per_count, counts, atol=1e-6)
    assert np.ptp(counts) > 100.0


def test_logged_currents_are_those_that_the_controller_reads(robot: Robot) -> None:
    """A log has the currents of every control tick; the filter saw all those in between."""
    slow_sensor = filtered(robot, 0.02)
    kernel, plan = native_kernel(slow_sensor), plan_walk(slow_sensor, BRIEF, 2e-4)
    assert kernel is not None
    assert plan is not None
    setup = plan(softer_by_current())
    side = np.where(np.arange(setup.ticks) // 8 % 2, -1, 1)[:, None]
    desired = setup.desired + 20_000 * side.astype(np.int32)
    setup, coding = dataclasses.replace(setup, desired=desired), Coding.of(slow_sensor, 10)
    (result,) = kernel.walk([setup], coding, log=True)
    assert result.states is not None
    log = walk_log(slow_sensor, setup, result.states)
    sensed = sensed_currents(slow_sensor, log.current, log.voltage)
    duty = result.states[:, -robot.n_joints :]
    # Each 32 counts of current, which is 0.87 A on average, take 3 from the output.
    read = (127.0 - np.abs(duty) / coding.duty_per_count / 3.0) * 32.0 / 2079.0
    np.testing.assert_allclose(sensed, read, atol=0.06)
    assert np.abs(np.abs(log.current) - read).mean() > 0.4
    unfiltered = sensed_currents(robot, log.current, log.voltage)
    np.testing.assert_array_equal(unfiltered, np.abs(log.current))


def test_kernels_agree_on_a_current_that_is_filtered_while_feet_come_down(robot: Robot) -> None:
    slow_sensor = filtered(robot, 0.01)
    kernel, (coding, timestep) = native_kernel(slow_sensor), control_steps(slow_sensor)
    plan = plan_walk(slow_sensor, BRIEF.model_copy(update={"drop": 0.002}), timestep)
    assert kernel is not None
    assert plan is not None
    setup = plan(softer_by_current())
    brief = dataclasses.replace(setup, desired=setup.desired[:40] + 2000)
    fast, slow = (
        k.walk([brief], coding, log=True) for k in (kernel, reference_kernel(slow_sensor))
    )
    assert fast.lane_use.walked == slow.lane_use.walked > brief.ticks
    ours, theirs = (np.asarray(results[0].states)[:, -robot.n_joints :] for results in (fast, slow))
    np.testing.assert_allclose(ours, theirs, rtol=1e-12)


def test_a_filter_changes_a_fuzzy_walk_and_none_that_ignores_currents(robot: Robot) -> None:
    slow_sensor = filtered(robot, 0.01)
    assert native_kernel(slow_sensor) is native_kernel(robot)
    filtered_walk, plain = (walk(BRIEF, robot=r).outcome.objectives for r in (slow_sensor, robot))
    assert (filtered_walk != plain).all()
    stiff = {"P": 0.45, "I": 0.1}
    ignoring, unfiltered = (
        walk(BRIEF, stiff, "pi", robot=r).outcome.objectives for r in (slow_sensor, robot)
    )
    np.testing.assert_array_equal(ignoring, unfiltered)
