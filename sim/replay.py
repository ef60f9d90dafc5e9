"""Replays: poses of all links over a walk, at a rate for display."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Final

import numpy as np

from gaitswarm.sim.arrays import Floats, Ints
from gaitswarm.sim.controllers.fixed_point import CONTROL_PERIOD
from gaitswarm.sim.kernel.observation import WalkLog
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.robot.shapes import VisibleLink, visible_links

CONTROL_RATE: Final = round(1.0 / CONTROL_PERIOD)
"""Ticks of a log per second [Hz], the highest rate of a replay."""

SAMPLED: Final = (
    "foot_force",
    "joint_angle",
    "desired_angle",
    "motor_angle",
    "current",
    "voltage",
    "load_torque",
)
"""Columns of a log that a replay has at its rate, besides time and supply."""


@dataclass(frozen=True, slots=True, eq=False)
class Replay:
    """A walk up to its end; arrays by frame: F frames of B links, J joints, L legs."""

    duration: float  # [s]
    links: tuple[VisibleLink, ...]  # in the order of `link_pose`
    time: Floats  # (F,) [s], exact
    # in the world, (F, B, 7): position [m], quaternion x y z w with continuous sign
    link_pose: Floats
    # the tibia's end, a sole's length above the ground where it stands, (F, L, 3) [m]
    foot_position: Floats
    foot_force: Floats  # in the world, (F, L, 3) [N]
    joint_angle: Floats  # of the links, (F, J) [rad]
    desired_angle: Floats  # (F, J) [rad]
    motor_angle: Floats  # (F, J) [rad]
    current: Floats  # (F, J) [A]
    voltage: Floats  # (F, J) [V]
    load_torque: Floats  # (F, J) [N m]
    body_acceleration: Floats  # in the body's frame, (F, 3) [m/s2]
    body_velocity: Floats  # in the body's frame, (F, 6) linear [m/s] and angular [rad/s]
    supply: Floats  # (F,) [V]


def replay(robot: Robot, log: WalkLog, *, rate: float, load: float = 0.0) -> Replay:
    """Sample a walk at a rate [Hz], at most `CONTROL_RATE`, with a load to be shown [kg]."""
    walked = log.until_end()
    ticks = ticks_at(rate, len(walked.time))
    links = visible_links(robot, load)
    poses, feet = _placements(
        robot,
        tuple(link.name for link in links),
        np.concatenate(
            [
                walked.base_position[ticks],
                walked.base_orientation[ticks],
                walked.joint_angle[ticks],
            ],
            axis=1,
        ),
    )
    return Replay(
        duration=len(walked.time) * CONTROL_PERIOD,
        links=links,
        link_pose=poses,
        foot_position=feet,
        body_acceleration=walked.body_acceleration()[ticks],
        body_velocity=walked.base_velocity[ticks],
        **{name: getattr(walked, name)[ticks] for name in ("time", *SAMPLED, "supply")},
    )


def ticks_at(rate: float, ticks: int) -> Ints:
    """Return control ticks (F,) below `ticks` that are nearest to multiples of 1 / rate [Hz]."""
    frames = np.rint(np.arange(ticks * rate / CONTROL_RATE + 1.0) * (CONTROL_RATE / rate))
    nearest: Ints = frames[frames < ticks].astype(np.int64)
    return nearest


def _placements(
    robot: Robot, links: tuple[str, ...], configurations: Floats
) -> tuple[Floats, Floats]:
    """Poses of links (F, B, 7) and positions of feet (F, L, 3) in the world at (F, 7+J)."""
    # Slow to import; a kernel from the cache does not need it.
    import pinocchio as pin  # noqa: PLC0415

    model = _model(robot)
    data = model.createData()
    order = [model.joints[model.getJointId(name)].idx_q for name in robot.joint_names]
    q = np.empty((len(configurations), model.nq))
    q[:, :7], q[:, order] = configurations[:, :7], configurations[:, 7:]
    q[:, 3:7] /= np.linalg.norm(q[:, 3:7], axis=1, keepdims=True)
    bodies = [model.getFrameId(name, pin.FrameType.BODY) for name in links]
    feet = [model.getFrameId(leg.foot) for leg in robot.description.legs]
    poses = np.empty((len(q), len(bodies), 7))
    positions = np.empty((len(q), len(feet), 3))
    for frame, configuration in enumerate(q):
        pin.framesForwardKinematics(model, data, configuration)
        for k, body in enumerate(bodies):
            poses[frame, k] = pin.SE3ToXYZQUAT(data.oMf[body])
        for k, foot in enumerate(feet):
            positions[frame, k] = data.oMf[foot].translation
    return _without_jumps(poses), positions


@lru_cache(maxsize=8)
def _model(robot: Robot) -> Any:
    """Shared by threads: their data are separate."""
    import pinocchio as pin  # noqa: PLC0415

    return pin.buildModelFromXML(robot.urdf.text, pin.JointModelFreeFlyer())


def _without_jumps(poses: Floats) -> Floats:
    """Choose the quaternions' signs continuously from frame to frame."""
    turns = poses[:, :, 3:]
    flips = np.sum(turns[1:] * turns[:-1], axis=-1) < 0.0
    turns[1:] *= np.cumprod(np.where(flips, -1.0, 1.0), axis=0)[:, :, np.newaxis]
    return poses
