"""Validation and identification of torque-controlled robots, on synthetic logs."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from gaitswarm.sim.errors import MeasuredLogError
from gaitswarm.sim.identification import CurrentFit, record
from gaitswarm.sim.measurement.measured_files import parse_measured_log
from gaitswarm.sim.measurement.measured_log import (
    MeasuredLog,
    MeasuredWalk,
    Quantity,
    Synchronised,
    synchronise,
)
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.robot import load_robot
from gaitswarm.sim.robot.identifiable import identifiable_variables
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.validation import compare_synchronised
from scripts.measured_logs import format_measured_log
from scripts.synthesize import Instruments, Perturbation, synthetic_log
from tests.examples.walks import short_walk, torque_quadruped_files

pytestmark = pytest.mark.slow

FILES = torque_quadruped_files()
SCENARIO = short_walk(cycles=2, cycle_time=0.5)
DESIGN = {"Kp": 40.0, "Kd": 1.0, "feed_forward": 0.8}
TRUTH = {"body_mass": 5.0, "viscous_friction_left_front_femur": 0.3}


@dataclass(frozen=True, slots=True)
class Walked:
    robot: Robot
    simulated: MeasuredLog
    measured: MeasuredLog  # of the twin with TRUTH

    @property
    def pair(self) -> Synchronised:
        return synchronise(self.measured, self.simulated, SCENARIO.cycle_time)


@pytest.fixture(scope="module")
def walked() -> Walked:
    robot = load_robot(FILES)
    simulated = MeasuredWalk.of(robot, SCENARIO, "joint-pd", DESIGN).simulated()
    twin = Perturbation.of(TRUTH)
    log = synthetic_log(robot, SCENARIO, "joint-pd", DESIGN, seed=1, perturbation=twin)
    return Walked(robot, simulated, log)


def test_torques_stand_in_for_currents_and_no_voltage_is_needed(walked: Walked) -> None:
    log = replace(walked.measured, supply=None)
    lines = [line.split(",") for line in format_measured_log(log).splitlines() if line[0] != "#"]

    def without(*quantities: str) -> str:
        kept = [k for k, name in enumerate(lines[0]) if name.split(".")[0] not in quantities]
        return "\n".join(",".join(line[k] for k in kept) for line in lines)

    text = without("I_M")
    assert "U_P" not in text and "tau_M.left_rear_tibia [N m]" in text
    read = parse_measured_log(text, walked.robot)
    assert log.torque is not None
    constant = walked.robot.actuators().torque
    np.testing.assert_array_equal(read.current, np.abs(log.torque) / constant)
    np.testing.assert_array_equal(read.torque, log.torque)
    with pytest.raises(MeasuredLogError, match=r"column 'I_M.*is missing"):
        parse_measured_log(without("I_M", "tau_M"), walked.robot)


def test_a_simulated_walk_has_torques_of_currents_and_power_of_the_battery(walked: Walked) -> None:
    log = walked.simulated
    assert log.torque is not None and log.supply is not None and log.control_voltage is None
    constant = walked.robot.actuators().torque
    np.testing.assert_allclose(np.abs(log.torque) / constant, log.current, atol=1e-12)
    supply = walked.robot.description.supply
    assert log.battery_current is not None
    drop = (supply.voltage - log.supply[:, 0]) / supply.resistance
    np.testing.assert_allclose(log.battery_current[:, 0], drop, atol=0.02)


def test_the_verdict_is_of_angles_currents_and_supply(walked: Walked) -> None:
    judged = compare_synchronised(walked.pair)
    assert [gate.quantity for gate in judged.verdict.gates] == ["q_D", "q", "I_M", "U_S"]
    assert not judged.verdict.validated
    assert Quantity.TORQUE in [q.quantity for q in judged.quantities]
    exact = Instruments(current_noise=0.0, supply_noise=0.0)
    same = synthetic_log(
        walked.robot,
        SCENARIO,
        "joint-pd",
        DESIGN,
        seed=1,
        perturbation=Perturbation.of({}),
        instruments=exact,
    )
    pair = synchronise(same, walked.simulated, SCENARIO.cycle_time)
    assert compare_synchronised(pair).verdict.validated


def test_true_parameters_fit_currents_best(walked: Walked) -> None:
    names = {variable.name for variable in identifiable_variables(walked.robot)}
    assert names >= TRUTH.keys()
    recording = record(walked.pair, SCENARIO, "joint-pd", DESIGN)
    recording.check_reach(FILES)
    fit = CurrentFit("a walk", FILES, recording, tuple(TRUTH))
    described = [walked.robot.body.mass, 0.0]
    outcome = fit.run(np.array([list(TRUTH.values()), described]))
    assert outcome.statuses.tolist() == [Status.OK, Status.OK]
    true, wrong = outcome.objectives.mean(axis=1)
    assert true < 0.5 * wrong
    # Noise of 0.02 A and a converter's step of 0.008 A.
    assert true < 0.02
