"""Measurements of a walk besides its objectives, from currents to slip."""

from __future__ import annotations

import dataclasses
from typing import get_args

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gaitswarm.sim.assembly import Backend, control_steps, measure, plan_walk
from gaitswarm.sim.controllers import CONTROLLERS
from gaitswarm.sim.kernel.native import native_kernel
from gaitswarm.sim.kernel.observation import WalkLog, walk_log
from gaitswarm.sim.kernel.walk import Coding, WalkSetup
from gaitswarm.sim.outcome import MEASUREMENT_NAMES, Measurements, Status
from gaitswarm.sim.replay import replay
from gaitswarm.sim.robot import load_robot
from gaitswarm.sim.robot.description import EnergyConvention
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.scenario import SCENARIOS, Scenario
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
    peak, mean, heat, power, forward, *_ = measure(setup, result, 1, 2e-4)
    assert peak == pytest.approx(np.abs(current).max(), rel=1e-9)
    assert mean == pytest.approx(np.abs(current).mean(), rel=1e-9)
    lost = (actuators.resistance * current**2).sum(axis=1)
    assert heat == pytest.approx(lost.mean(), rel=1e-9)
    powers = voltage * current
    counted = {"signed": powers, "positive": powers.clip(min=0.0), "absolute": np.abs(powers)}
    assert power == pytest.approx(powers.sum(axis=1).mean(), rel=1e-9)
    for convention in get_args(EnergyConvention):
        changed_setup = dataclasses.replace(setup, energy=convention)
        assert measure(changed_setup, result, 1, 2e-4)[3] == pytest.approx(
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
    speed = measure(setup, results[0], coding.substeps, timestep)[4]
    way = float(results[0].end[0])
    assert speed == pytest.approx(way / (setup.ticks * coding.substeps * timestep), rel=0.01)


def attitudes(log: WalkLog) -> NDArray[np.float64]:
    """Roll and pitch (T, 2) [deg] of a body that turned by yaw, pitch and roll."""
    return Rotation.from_quat(log.base_orientation).as_euler("ZYX", degrees=True)[:, :0:-1]


@pytest.mark.parametrize(
    "scenario", [BRIEF, SCENARIOS[4].model_copy(update={"cycles": 1.0})], ids=["level", "slope"]
)
def test_attitude_torque_and_feet_are_those_of_the_log(robot: Robot, scenario: Scenario) -> None:
    """The log shows every fifth step only, so that its extremes are a little smaller."""
    run = walk(scenario, robot=robot, log=True)
    (log,) = run.logs
    assert log is not None
    feet = replay(robot, log, rate=500).foot_position
    soles = robot.contacts()[0].sole
    heights = feet[:, :, 2] - soles
    cycles = np.array_split(heights, round(scenario.cycles))
    moves = np.linalg.norm(np.diff(feet[:, :, :2], axis=0), axis=2)
    slid = moves[(heights[:-1] < 0.0) & (heights[1:] < 0.0)].sum() / feet.shape[1]
    measured = run.measurements
    logged = [
        np.abs(log.load_torque).max(),
        *np.abs(attitudes(log)).max(axis=0),
        min(cycle.max(axis=0).min() for cycle in cycles),
        slid / (measured.speed[0] * scenario.duration),
    ]
    np.testing.assert_allclose(measured.array()[0, 5:], logged, rtol=0.07)
    assert (measured.array()[0, 5:9] > np.array(logged[:4]) - 1e-9).all()


def test_attitude_is_relative_to_the_ground_and_yaw_is_none() -> None:
    uphill, turning = (walk(SCENARIOS[k], robot="szabadka2").measurements for k in (4, 5))
    assert 0.1 < uphill.pitch[0] < 2.0
    assert 0.1 < turning.roll[0] < 2.0


def test_a_cycle_in_which_one_foot_stays_on_the_ground_has_no_clearance(robot: Robot) -> None:
    setup = planned(robot, SCENARIOS[0])
    still = setup.desired.copy()
    still[setup.cycle : 2 * setup.cycle, :3] = setup.desired[0, :3]
    stood = dataclasses.replace(setup, desired=still)
    high, low = (measured_of(robot, each)[8] for each in (setup, stood))
    assert high > 0.01
    assert low < 0.5 * high


def test_a_walk_shorter_than_a_cycle_has_no_clearance(robot: Robot) -> None:
    setup = planned(robot, BRIEF)
    shorter = dataclasses.replace(setup, desired=setup.desired[:-1])
    assert np.isfinite(measured_of(robot, setup)).all()
    assert np.isnan(measured_of(robot, shorter)).tolist() == [False] * 8 + [True, False]


def test_feet_of_a_robot_that_goes_nowhere_have_no_slip_per_metre() -> None:
    standing = walk(short_walk(stride=1e-9), PI, "pi", robot="szabadka2")
    assert standing.outcome.statuses.tolist() == [Status.STALLED]
    assert np.isnan(standing.measurements.array()[0]).tolist() == [False] * 9 + [True]


def planned(robot: Robot, scenario: Scenario) -> WalkSetup:
    plan = plan_walk(robot, scenario, control_steps(robot)[1])
    assert plan is not None
    return plan(CONTROLLERS["pi"].compile(PI))


def measured_of(robot: Robot, setup: WalkSetup) -> NDArray[np.float64]:
    (coding, timestep), kernel = control_steps(robot), native_kernel(robot)
    assert kernel is not None
    (result,) = kernel.walk([setup], coding, log=False)
    return measure(setup, result, coding.substeps, timestep)


def test_power_and_speed_are_those_of_the_objectives() -> None:
    run = walk(BRIEF, PI, "pi")
    _, _, _, energy, reciprocal_speed, _ = run.outcome.objectives[0]
    assert run.measurements.speed[0] == pytest.approx(1.0 / reciprocal_speed, rel=1e-12)
    assert run.measurements.power[0] == pytest.approx(energy / reciprocal_speed, rel=1e-12)


def test_measurements_are_an_array_and_back() -> None:
    rows = np.arange(20.0).reshape(2, 10)
    measurements = Measurements.of(rows)
    assert measurements.motor_heat.tolist() == [2.0, 12.0]
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
