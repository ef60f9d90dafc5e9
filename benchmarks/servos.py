"""Servos on a pendulum against Rhoban's BAM, the simulator that their friction was identified with.

    git clone https://github.com/Rhoban/bam && python -m benchmarks.servos --bam bam

BAM simulates its richest model of a servo (M6) and its simplest (M1: Coulomb and viscous friction)
with steps of 0.5 ms and control at every step; gaitswarm the same pendulum, voltage, P and
trajectory. The table has root mean squares over six seconds [mrad]: of gaitswarm's difference from
BAM, of the difference between M1 and M6, and of BAM's following error. Trajectories that switch the
motor off are left out: gaitswarm's servos are always on. Of the STS3215 BAM has only M1; its limit
on the target's speed is off. The joint PD of eRobs damps the error of the speed in both simulators.
"""

from __future__ import annotations

import argparse
import importlib
import sys
from pathlib import Path
from types import ModuleType
from typing import Any, Final
from unittest.mock import MagicMock

import numpy as np

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.controllers.base import ControlLaw, JointPd
from gaitswarm.sim.controllers.fixed_point import CONTROL_PERIOD
from gaitswarm.sim.robot.description import listed_actuator
from tests.examples.pendulum import SECONDS, TRAJECTORIES, Pendulum, bench, swing, times

STEP: Final = 5e-4
"""Of BAM [s]."""

CASES: Final = {
    "mx64": (15.0, Pendulum(1.0, 0.2, 0.15)),
    "mx106": (15.0, Pendulum(2.0, 0.2, 0.15)),
    "xl320": (7.5, Pendulum(0.1, 0.03, 0.1)),
    "xl330": (7.5, Pendulum(0.15, 0.03, 0.1)),
    "sts3215": (7.4, Pendulum(0.3, 0.05, 0.12)),
    "erob80-50": (48.0, Pendulum(8.0, 1.0, 0.4)),
    "erob80-100": (48.0, Pendulum(14.0, 1.0, 0.5)),
}
"""Voltage [V] and pendulum by servo."""

NAMES: Final = {
    "sts3215": "feetech_sts3215_7_4V",
    "erob80-50": "erob80_50",
    "erob80-100": "erob80_100",
}
"""Of BAM's parameters, where they are not ours."""

CURRENT_GAIN: Final = 25.0
"""Of eRobs, one of those that BAM's parameters were identified with [A/rad]."""


def bam_model(models: ModuleType, case: str, model: str) -> Any:
    """A model of BAM on its pendulum."""
    volts, pendulum = CASES[case]
    servo = listed_actuator(case).servo
    chosen = models.load_model(motor_name=NAMES.get(case, case), model=model)
    chosen.q_offset.value = 0.0
    if case == "sts3215":
        chosen.max_velocity.value = np.inf
    log = {"mass": pendulum.mass, "arm_mass": pendulum.arm_mass, "length": pendulum.length}
    gain = CURRENT_GAIN if servo is None else servo.default_p
    chosen.actuator.load_log({**log, "kp": gain, "vin": volts})
    return chosen


def control_law(chosen: Any, case: str) -> ControlLaw:
    """The same law of gaitswarm."""
    servo = listed_actuator(case).servo
    if servo is not None:
        return ControlLaw(servo=servo.default_p)
    constant, damping = chosen.kt.value, chosen.actuator.damping * np.sqrt(CURRENT_GAIN)
    return ControlLaw(joint_pd=JointPd(constant * CURRENT_GAIN, constant * damping))


def simulated_by_bam(chosen: Any, case: str, trajectory: str) -> Floats:
    """Angles [rad] at gaitswarm's control ticks."""
    simulator: Any = importlib.import_module("bam.simulate").Simulator(chosen)
    desired = TRAJECTORIES[trajectory](np.arange(round(SECONDS / STEP)) * STEP)
    speeds = np.gradient(desired, STEP) * (listed_actuator(case).servo is None)
    angles = []
    for target, speed in zip(desired.tolist(), speeds.tolist(), strict=True):
        angles.append(float(simulator.q))
        control = chosen.actuator.compute_control(target, simulator.q, simulator.dq - speed, STEP)
        simulator.step(control, torque_enable=True, dt=STEP)
    return np.array(angles[:: round(CONTROL_PERIOD / STEP)])


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--bam", type=Path, required=True, help="checkout of BAM")
    options = parser.parse_args()
    sys.path.insert(0, str(options.bam))
    sys.modules.setdefault("colorama", MagicMock())  # only colours its messages
    models = importlib.import_module("bam.model")
    print("| servo | trajectory | gaitswarm - BAM | M1 - M6 of BAM | following error |")
    print("| --- | --- | --- | --- | --- |")
    for case, (volts, pendulum) in CASES.items():
        robot = bench(case, volts, pendulum)
        rich, simple = (
            bam_model(models, case, "m1" if case == "sts3215" else model) for model in ("m6", "m1")
        )
        for trajectory, desired_at in TRAJECTORIES.items():
            desired = desired_at(times())
            reference = simulated_by_bam(rich, case, trajectory)
            differences = (
                swing(robot, desired, control_law(rich, case)) - reference,
                simulated_by_bam(simple, case, trajectory) - reference,
                desired - reference,
            )
            shown = [f"{1000.0 * float(np.sqrt(np.mean(of**2))):.1f}" for of in differences]
            if case == "sts3215":
                shown[1] = "–"
            print(f"| {case} | {trajectory} | {' | '.join(shown)} |")


if __name__ == "__main__":
    main()
