"""Logs that are quick to make and easy to reason about: every signal is a sum of sines."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from importlib import resources

import numpy as np

from gaitswarm.sim.measurement.measured_log import MeasuredLog, synchronise
from gaitswarm.sim.robot import load_robot
from gaitswarm.sim.robot.robot import Robot, parse_robot
from gaitswarm.sim.validation import Comparison, compare_synchronised

CYCLE_TIME = 0.5
CYCLE = 250
"""Rows of a walking cycle."""


def szabadka() -> Robot:
    return load_robot("szabadka2")


def renamed_robot() -> Robot:
    """The same robot with other names of legs, and thus of joints."""
    folder = resources.files("gaitswarm.sim.robot") / "szabadka2"
    toml, urdf = (
        (folder / name).read_text(encoding="utf-8").replace("right_", "R-").replace("left_", "L-")
        for name in ("robot.toml", "robot.urdf")
    )
    return parse_robot(toml, urdf)


def walking_log(robot: Robot, *, rows: int = 3 * CYCLE, standing: int = 0) -> MeasuredLog:
    """A gait that starts at row `standing`; each joint has a phase and an amplitude of its own."""
    n, legs = robot.n_joints, len(robot.legs)
    since = np.maximum(np.arange(rows) - standing, 0)[:, None] * (2.0 * np.pi / CYCLE)
    phase, size = np.arange(n) * 0.7, 0.2 + 0.01 * np.arange(n)
    swing = size * (np.sin(since + phase) + 0.3 * np.cos(2.0 * since))
    return MeasuredLog(
        joints=robot.joint_names,
        legs=tuple(leg.name for leg in robot.legs),
        time=0.5 + np.arange(rows, dtype=np.float64) * 0.002,
        desired_angle=swing,
        control_voltage=5.0 * swing,
        joint_angle=0.9 * swing,
        current=np.abs(swing),
        supply=11.0 + 0.1 * swing[:, :legs],
        potentiometer_joints=robot.joint_names[:3] + robot.joint_names[6:9],
        potentiometer=swing[:, [0, 1, 2, 6, 7, 8]],
        body_acceleration=0.1 * swing[:, :3],
        body_rate=0.2 * swing[:, 3:6],
        battery_current=0.8 * np.abs(swing).sum(axis=1, keepdims=True),
        metadata={"robot": robot.description.name},
    )


def without_supplements(log: MeasuredLog) -> MeasuredLog:
    return replace(
        log,
        potentiometer_joints=(),
        potentiometer=None,
        body_acceleration=None,
        body_rate=None,
        battery_current=None,
    )


def compare(
    measured: MeasuredLog,
    simulated: MeasuredLog,
    cycle_time: float,
    *,
    repeats: Sequence[MeasuredLog] = (),
) -> Comparison:
    """Synchronise two logs, and compare all quantities that were measured."""
    pair = synchronise(measured, simulated, cycle_time)
    others = [synchronise(repeat, simulated, cycle_time).measured for repeat in repeats]
    return compare_synchronised(pair, others)
