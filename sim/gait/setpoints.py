"""Angles for position-controlled servos: a start from the stance, a cycle to repeat, a stop."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.controllers.fixed_point import CONTROL_PERIOD
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.gait.trajectory import desired_angles, stance_angles
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.scenario import Scenario

FEWEST_ROWS: Final = 8
"""Rows of a cycle below which steps would be cut short."""

MOST_ROWS: Final = 50_000

_APPROACH: Final = 2.0
"""Time that a ROS 2 controller has to move the joints to the stance [s]."""

_DIGITS: Final = 6
"""Decimals of seconds, and of radians: a thousandth of a servo's step."""


@dataclass(frozen=True, slots=True, eq=False)
class Setpoints:
    """Desired angles by row [rad], of all joints of legs and of held ones.

    `cycle` follows `start` and itself; `stop`, whose last row is the stance, follows either.
    """

    joints: tuple[str, ...]
    step: float  # time between rows [s]
    start: Floats  # (S, J), from the stance
    cycle: Floats  # (R, J)
    stop: Floats  # (S + 1, J)
    cycles: int  # of the scenario
    speeds: tuple[tuple[str, float, float], ...]  # joint, largest and motor's without load [rad/s]

    @property
    def parts(self) -> dict[str, Floats]:
        return {"start": self.start, "cycle": self.cycle, "stop": self.stop}

    @property
    def walk(self) -> Floats:
        return np.concatenate([self.start, *[self.cycle] * self.cycles, self.stop])

    @property
    def velocities(self) -> Floats:
        """Of `walk`, by central differences; at rest at both ends [rad/s]."""
        speeds = np.gradient(self.walk, self.step, axis=0)
        speeds[[0, -1]] = 0.0
        return speeds


def setpoints(robot: Robot, scenario: Scenario, rate: float, *, held: bool = True) -> Setpoints:
    """Sample a reachable gait at a rate [Hz], changed so that a cycle has a whole number of rows.

    The amplitude of angles about the stance grows over a cycle, or over the low-pass filter's
    length if that is longer, and falls likewise: there are no jumps, and limits are kept.

    Args:
        held: Whether held joints have columns as well.
    """
    cycle_time, rows = scenario.cycle_time, round(scenario.cycle_time * rate)
    ramp = max(1, math.ceil(1e-3 * scenario.fir_ms / cycle_time))
    cycles = math.ceil(scenario.cycles)
    if not FEWEST_ROWS <= rows <= MOST_ROWS // (cycles + 2 * ramp):
        raise SimulationInputError(
            f"a cycle of {scenario.name} would have {rows} rows; choose a rate of"
            f" {FEWEST_ROWS / cycle_time:.3g} Hz to"
            f" {MOST_ROWS / (cycles + 2 * ramp) / cycle_time:.3g} Hz"
        )
    planned = desired_angles(robot, scenario.model_copy(update={"cycles": ramp + 1.5})).angles
    # Targets that are held between updates turn by the mean speed over that time.
    held_ticks = math.ceil(1.0 / (CONTROL_PERIOD * scenario.trajectory_rate) - 1e-9)
    ticks = CONTROL_PERIOD * np.arange(len(planned))
    times = cycle_time / rows * np.arange((ramp + 1) * rows)
    gait = np.stack([np.interp(times, ticks, angles) for angles in planned.T], axis=1)
    stance, cycle = stance_angles(robot, scenario), gait[ramp * rows :]
    s = np.linspace(0.0, 1.0, ramp * rows + 1)[:, None]
    growth = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
    start = stance + growth[:-1] * (gait[: ramp * rows] - stance)
    stop = stance + growth[::-1] * (np.concatenate([*[cycle] * ramp, cycle[:1]]) - stance)
    fixed = robot.description.held_joints if held else {}
    start, cycle, stop = (
        np.hstack([part, np.tile(np.array([*fixed.values()]), (len(part), 1))])
        for part in (start, cycle, stop)
    )
    largest = np.abs(planned[held_ticks:] - planned[:-held_ticks]).max(axis=0)
    largest /= CONTROL_PERIOD * held_ticks
    limits = robot.no_load_speeds.tolist()
    speeds = tuple(zip(robot.joint_names, largest.tolist(), limits, strict=True))
    joints = (*robot.joint_names, *fixed)
    return Setpoints(joints, cycle_time / rows, start, cycle, stop, cycles, speeds)


def trajectory_files(points: Mapping[str, Setpoints]) -> dict[str, bytes]:
    """Write the files of all scenarios by name."""
    files = {}
    for name, of in points.items():
        for part, rows in of.parts.items():
            timed = (_texts(np.insert(row, 0, k * of.step)) for k, row in enumerate(rows))
            files[f"{name}-{part}.csv"] = _csv_text(("time", *of.joints), timed).encode()
        files[f"{name}.yaml"] = _joint_trajectory_yaml(of).encode()
    speeds = [
        (name, joint, *_texts(np.array(values)))
        for name, of in points.items()
        for joint, *values in of.speeds
    ]
    files["speeds.csv"] = _csv_text(("scenario", "joint", "largest", "no_load"), speeds).encode()
    return files


def _csv_text(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(heads)
    writer.writerows(rows)
    return file.getvalue()


def _joint_trajectory_yaml(points: Setpoints) -> str:
    """Write a walk as a ROS 2 message, trajectory_msgs/msg/JointTrajectory.

    It keeps the rules of ros2_control's joint_trajectory_controller (validate_trajectory_msg): all
    joints in all points, increasing times, and rest at the end.
    """
    lines = [f"joint_names: {json.dumps(points.joints)}", "points:"]
    for number, (row, speeds) in enumerate(zip(points.walk, points.velocities, strict=True)):
        nanoseconds = round(1e9 * (_APPROACH + number * points.step))
        sec, nanosec = divmod(nanoseconds, 10**9)
        lines.append(
            f"- {{positions: [{', '.join(_texts(row))}], velocities: [{', '.join(_texts(speeds))}],"
            f" time_from_start: {{sec: {sec}, nanosec: {nanosec}}}}}"
        )
    return "\n".join([*lines, ""])


def _texts(values: Floats) -> list[str]:
    # Not in powers of ten, which YAML 1.1 reads as text; 0.0 makes -0 a 0.
    return [f"{value:.{_DIGITS}f}" for value in (values.round(_DIGITS) + 0.0).tolist()]
