"""Servos on a pendulum against Rhoban's BAM, the simulator that their friction was identified with.

    git clone https://github.com/Rhoban/bam && python -m benchmarks.servos --bam bam

BAM simulates its richest model of a servo (M6) and its simplest (M1: Coulomb and viscous friction)
with steps of 0.5 ms and control at every step; gaitswarm the same pendulum, voltage, P and
trajectory. The table has root mean squares over six seconds [mrad]: of gaitswarm's difference from
BAM, of the difference between M1 and M6, and of BAM's following error. Trajectories that switch the
motor off are left out: gaitswarm's servos are always on.
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
from gaitswarm.sim.controllers.fixed_point import CONTROL_PERIOD
from gaitswarm.sim.robot.library import listed_actuator
from tests.examples.pendulum import SECONDS, TRAJECTORIES, Pendulum, bench, swing, times

STEP: Final = 5e-4
"""Of BAM [s]."""

CASES: Final = {
    "mx64": (15.0, Pendulum(1.0, 0.2, 0.15)),
    "mx106": (15.0, Pendulum(2.0, 0.2, 0.15)),
    "xl320": (7.5, Pendulum(0.1, 0.03, 0.1)),
    "xl330": (7.5, Pendulum(0.15, 0.03, 0.1)),
}
"""Voltage [V] and pendulum by servo."""


def simulated_by_bam(models: ModuleType, case: str, model: str, trajectory: str) -> Floats:
    """Angles [rad] at gaitswarm's control ticks."""
    volts, pendulum = CASES[case]
    servo = listed_actuator(case).servo
    assert servo is not None
    chosen = models.load_model(motor_name=case, model=model)
    chosen.q_offset.value = 0.0
    log = {"mass": pendulum.mass, "arm_mass": pendulum.arm_mass, "length": pendulum.length}
    chosen.actuator.load_log({**log, "kp": servo.default_p, "vin": volts})
    simulator: Any = importlib.import_module("bam.simulate").Simulator(chosen)
    desired = TRAJECTORIES[trajectory](np.arange(round(SECONDS / STEP)) * STEP)
    angles = []
    for target in desired.tolist():
        angles.append(float(simulator.q))
        control = chosen.actuator.compute_control(target, simulator.q, simulator.dq, STEP)
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
        servo = listed_actuator(case).servo
        assert servo is not None
        for trajectory, desired_at in TRAJECTORIES.items():
            rich, simple = (
                simulated_by_bam(models, case, model, trajectory) for model in ("m6", "m1")
            )
            desired = desired_at(times())
            mine = swing(robot, desired, servo.default_p)
            shown = [
                1000.0 * float(np.sqrt(np.mean(difference**2)))
                for difference in (mine - rich, simple - rich, desired - rich)
            ]
            print(f"| {case} | {trajectory} | " + " | ".join(f"{x:.1f}" for x in shown) + " |")


if __name__ == "__main__":
    main()
