"""Measurements of a walk besides its objectives: currents, heat, power and speed."""

from __future__ import annotations

import dataclasses
from typing import get_args

import numpy as np
import pytest

from gaitswarm.sim.assembly import Backend, control_steps, measure, plan_walk
from gaitswarm.sim.controllers import CONTROLLERS
from gaitswarm.sim.kernel.native import native_kernel
from gaitswarm.sim.kernel.observation import walk_log
from gaitswarm.sim.kernel.walk import Coding
from gaitswarm.sim.outcome import MEASUREMENT_NAMES, Measurements, Status
from gaitswarm.sim.robot import Robot, load_robot
from gaitswarm.sim.robot.description import EnergyConvention
from gaitswarm.sim.scenario import SCENARIOS
from gaitswarm.sim.simulate import Simulation, simulate
from tests.examples.robots import changed
from tests.examples.walks import short_walk, walk

PI = {"P": 0.45, "I": 0.1}
BRIEF = short_walk(cycle_time=0.5)


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("szabadka2")


def test_measurements_are_sums_over_every_physics_step(robot: Robot) -> None:
    """With a control tick at every physics step the log has the states before and after each."""
    kernel, plan = native_kernel(robot), plan_walk(robot, SCENARIOS[0], 2e-4)
    assert kernel is not None
    assert plan is not None
    longer = plan(CONTROLLERS["pi"].compile(PI))
    setup = dataclasses.replace(longer, desired=longer.desired[:-1])
    coding = Coding.of(robot, 1)
    result, beyond = kernel.walk([setup, longer], coding, log=True)
    assert beyond.states is not None
    log = walk_log(robot, longer, beyond.states)
    # The voltage is that of the step's beginning, the speed that of its middle.
    actuators, voltage = robot.actuators(), log.voltage[:-1]
    speed = 0.5 * (log.joint_velocity[:-1] + log.joint_velocity[1:])
    current = (voltage - actuators.torque * speed) / actuators.resistance
    assert not np.allclose(current, log.current[:-1], rtol=0.01)
    peak, mean, heat, power, forward = measure(setup, result, 1)
    assert peak == pytest.approx(np.abs(current).max(), rel=1e-9)
    assert mean == pytest.approx(np.abs(current).mean(), rel=1e-9)
    lost = (actuators.resistance * current**2).sum(axis=1)
    assert heat == pytest.approx(lost.mean(), rel=1e-9)
    powers = voltage * current
    counted = {"signed": powers, "positive": powers.clip(min=0.0), "absolute": np.abs(powers)}
    assert power == pytest.approx(powers.sum(axis=1).mean(), rel=1e-9)
    for convention in get_args(EnergyConvention):
        changed_setup = dataclasses.replace(setup, energy=convention)
        assert measure(changed_setup, result, 1)[3] == pytest.approx(
            counted[convention].sum(axis=1).mean(), rel=1e-9
        )
    assert forward == pytest.approx(result.end[0] / (setup.ticks * 2e-4), rel=0.01)


def test_shorter_steps_of_a_landing_count_by_their_share(robot: Robot) -> None:
    """Else the speed would not be that of the way that was gone."""
    (coding, timestep), kernel = control_steps(robot), native_kernel(robot)
    plan = plan_walk(robot, SCENARIOS[0], timestep)
    assert kernel is not None
    assert plan is not None
    setup = plan(CONTROLLERS["pi"].compile(PI))
    results = kernel.walk([setup], coding, log=False)
    # Counted in full, the shorter steps would make a tenth more.
    assert results.lane_use.walked > 1.1 * setup.ticks
    *_, speed = measure(setup, results[0], coding.substeps)
    way = float(results[0].end[0])
    assert speed == pytest.approx(way / (setup.ticks * coding.substeps * timestep), rel=0.01)


def test_power_and_speed_are_those_of_the_objectives() -> None:
    run = walk(BRIEF, PI, "pi")
    _, _, _, energy, reciprocal_speed, _ = run.outcome.objectives[0]
    assert run.measurements.speed[0] == pytest.approx(1.0 / reciprocal_speed, rel=1e-12)
    assert run.measurements.power[0] == pytest.approx(energy / reciprocal_speed, rel=1e-12)


def test_measurements_are_an_array_and_back() -> None:
    rows = np.arange(10.0).reshape(2, 5)
    measurements = Measurements.of(rows)
    assert measurements.motor_heat.tolist() == [2.0, 7.0]
    np.testing.assert_array_equal(measurements.array(), rows)


def test_a_failed_walk_has_no_measurements() -> None:
    beyond_reach = short_walk(hip_height=0.4)
    run = walk(beyond_reach, PI, "pi")
    assert run.outcome.statuses.tolist() == [Status.UNREACHABLE]
    for name in MEASUREMENT_NAMES:
        assert np.isnan(getattr(run.measurements, name)).tolist() == [True], name


def walked(robot: Robot, backend: Backend = "auto") -> Simulation:
    values = np.array([list(PI.values())])
    return simulate(BRIEF, "pi", list(PI), values, robot=robot, backend=backend)


@pytest.mark.variants
@pytest.mark.parametrize("convention", get_args(EnergyConvention))
def test_kernels_agree_on_measurements_under_every_convention(
    robot: Robot, convention: EnergyConvention
) -> None:
    counted = changed(robot, supply={"energy": convention})
    fast, slow = (walked(counted, backend) for backend in ("native", "reference"))
    np.testing.assert_allclose(
        fast.measurements.array(), slow.measurements.array(), rtol=1e-9, atol=0.0
    )
    np.testing.assert_allclose(fast.outcome.objectives, slow.outcome.objectives, rtol=1e-9)


def test_regenerated_energy_counts_by_the_convention_only(
    robot: Robot,
) -> None:
    signed, positive, absolute = (
        changed(robot, supply={"energy": convention}) for convention in get_args(EnergyConvention)
    )
    assert native_kernel(positive) is native_kernel(absolute) is native_kernel(robot)
    runs = [walked(machine) for machine in (robot, signed, positive, absolute)]
    default, *powers = (float(run.measurements.power[0]) for run in runs)
    assert default == powers[0] < powers[1] < powers[2]
    # P+ - P- , P+ and P+ + P-.
    assert powers[1] - powers[0] == pytest.approx(powers[2] - powers[1], rel=1e-9)
    others = [np.delete(run.outcome.objectives[0], 3) for run in runs]
    for other in others[1:]:
        np.testing.assert_array_equal(other, others[0])
