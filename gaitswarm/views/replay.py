"""Replays: a JSON header, then numbers by frame."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gaitswarm.services.optimizer.views import StatusName, View, finite, framed, unframed
from gaitswarm.sim.kernel.parameters import gravity_on
from gaitswarm.sim.outcome import OBJECTIVE_NAMES, OBJECTIVES, Status
from gaitswarm.sim.replay import Replay
from gaitswarm.sim.robot import Robot
from gaitswarm.sim.robot.shapes import Role, Shape, VisibleLink
from gaitswarm.sim.robot.urdf import SolidKind
from gaitswarm.sim.scenario import Scenario
from gaitswarm.views.robots import LinkMeshView
from gaitswarm.views.simulation import QUANTITIES

VERSION: Final = 1

_CHANNELS: Final[dict[str, tuple[str, str]]] = {
    "time": QUANTITIES["time"],
    "link_pose": ("m, 1", "every link in the world: x, y, z, then quaternion x, y, z, w"),
    "foot_position": ("m", "lower end of every leg in the world: x, y, z"),
    **{
        name: QUANTITIES[name]
        for name in (
            "foot_force",
            "joint_angle",
            "desired_angle",
            "motor_angle",
            "current",
            "voltage",
            "load_torque",
        )
    },
    "body_acceleration": ("m/s2", "of the body in its own frame, without gravity: x, y, z"),
    "body_velocity": ("m/s, rad/s", "of the body in its own frame: 3 linear, then 3 angular"),
    "supply": QUANTITIES["supply"],
}
"""Arrays of a `Replay` in the order of a frame: unit and description."""


class ShapeView(View):
    """A solid on a link."""

    type: SolidKind = Field(
        description="Kind of solid; cylinders and capsules lie along their own z axis."
    )
    size: tuple[float, ...] = Field(
        description="box: edges x, y, z; sphere: radius; cylinder: radius, length; capsule: radius,"
        " length between the centres of its hemispheres [m].",
        examples=[[0.012, 0.12]],
    )
    origin: tuple[float, float, float, float, float, float, float] = Field(
        description="Of the solid's centre in its link's frame: x, y, z [m], then quaternion x, y,"
        " z, w.",
        examples=[[0.0, 0.06, 0.0, 0.0, 0.0, 0.0, 1.0]],
    )
    role: Role = Field(description="Part of the robot that it shows.")

    @classmethod
    def from_shape(cls, shape: Shape) -> ShapeView:
        """Make a view of a solid."""
        return cls(type=shape.type, size=shape.size, origin=shape.origin, role=shape.role)


class LinkView(View):
    """A link of the robot's URDF."""

    name: str = Field(description="Its name.", examples=["body"])
    parent: str | None = Field(
        description="Link that carries it; null for the body.", examples=["body"]
    )
    shapes: list[ShapeView] = Field(description="What it looks like; it may be invisible.")
    meshes: list[LinkMeshView] = Field(
        description="What it looks like by the URDF's meshes; a robot may have none."
    )

    @classmethod
    def from_link(cls, link: VisibleLink) -> LinkView:
        """Make a view of a link."""
        shapes = [ShapeView.from_shape(shape) for shape in link.shapes]
        meshes = [LinkMeshView.from_mesh(mesh) for mesh in link.meshes]
        return cls(name=link.name, parent=link.parent, shapes=shapes, meshes=meshes)


class MovingRobotView(View):
    """The robot's links and shapes."""

    name: str = Field(description="Name of the robot.", examples=["szabadka2"])
    urdf: str | None = Field(
        description="SHA-256 of its robot.urdf, which identifies its meshes; null for a robot"
        " that ships, which has none.",
        examples=[None],
    )
    links: list[LinkView] = Field(description="All links, parents first; the body is the first.")
    joints: list[str] = Field(
        description="Joints in the order of channels.", examples=[["right_front_coxa"]]
    )
    legs: list[str] = Field(
        description="Legs in the order of channels.", examples=[["right_front"]]
    )


class GroundView(View):
    """The ground that is walked on; the world's z axis is normal to it, so gravity is tilted."""

    slope_deg: float = Field(description="Inclination, up positive [deg].", examples=[10.0])
    slope_direction_deg: float = Field(
        description="Where it rises, from straight ahead towards the left [deg].", examples=[0.0]
    )
    normal: tuple[float, float, float] = Field(
        default=(0.0, 0.0, 1.0), description="Its normal in the world [1]."
    )


class ChannelView(View):
    """One quantity of a frame."""

    name: str = Field(description="Its name.", examples=["joint_angle"])
    unit: str = Field(description="Unit of its numbers.", examples=["rad"])
    description: str = Field(description="What it is.", examples=["angle of every joint"])
    shape: list[int] = Field(
        description="Shape of its numbers, the last axis the fastest.", examples=[[18]]
    )
    offset: int = Field(description="Numbers of the frame that come before it [1].", examples=[212])
    labels: list[str] = Field(
        description="Names along its first axis; none where it is a single number.",
        examples=[["right_front_coxa"]],
    )


class ReplayHeaderView(View):
    """Header of a replay: the meaning of its frames."""

    version: int = Field(default=VERSION, description="Of this format.", examples=[VERSION])
    rate: float = Field(description="Frames per second, as requested [Hz].", examples=[50.0])
    frames: int = Field(description="Number of frames [1].", examples=[225])
    duration: float = Field(
        description="Time walked, up to a fall if there was one [s].", examples=[4.5]
    )
    status: StatusName = Field(
        description="How the walk ended; everything but `ok` is a failed walk.", examples=["ok"]
    )
    explanation: str = Field(
        description="The status in a sentence, with what to do about it.",
        examples=["walked to the end"],
    )
    objectives: dict[str, float | None] = Field(
        description="Raw objectives f1..f6 of table 4.1 by name; null if the walk has none.",
        examples=[{"torque": 8.71}],
    )
    objective_units: dict[str, str] = Field(
        description="Unit of each of them.", examples=[{"torque": "N m"}]
    )
    scenario: Scenario = Field(
        description="The scenario in full, with the gait parameters of the design."
    )
    robot: MovingRobotView = Field(description="Links and shapes of the robot.")
    ground: GroundView = Field(description="The ground.")
    gravity: tuple[float, float, float] = Field(
        description="In the world [m/s2].", examples=[[0.0, 0.0, -9.81]]
    )
    load_kg: float = Field(description="Mass carried on the body [kg].", examples=[2.0])
    channels: list[ChannelView] = Field(description="Channels of a frame, in order.")


def encoded_replay(
    walk: Replay,
    robot: Robot,
    scenario: Scenario,
    *,
    rate: float,
    status: Status,
    objectives: NDArray[np.float64],
    urdf: str | None = None,
) -> bytes:
    """Encode a replay."""
    legs = [leg.name for leg in robot.legs]
    channels = _channels(walk, robot.joint_names, legs)
    frames = _frames([getattr(walk, channel.name) for channel in channels])
    x, y, z = gravity_on(scenario.slope, scenario.slope_direction).tolist()
    header = ReplayHeaderView(
        rate=rate,
        frames=len(frames),
        duration=walk.duration,
        status=status.label,
        explanation=status.phrase,
        objectives=dict(zip(OBJECTIVE_NAMES, map(finite, objectives.tolist()), strict=True)),
        objective_units={objective.name: objective.unit for objective in OBJECTIVES},
        scenario=scenario,
        robot=MovingRobotView(
            name=robot.description.name,
            urdf=urdf,
            links=[LinkView.from_link(link) for link in walk.links],
            joints=list(robot.joint_names),
            legs=legs,
        ),
        ground=GroundView(slope_deg=scenario.slope, slope_direction_deg=scenario.slope_direction),
        gravity=(x, y, z),
        load_kg=scenario.load,
        channels=channels,
    )
    return framed(header, frames)


@dataclass(frozen=True, slots=True, eq=False)
class WalkReplay:
    """A decoded replay of F frames.

    Attributes:
        header: Scenario, status, objectives, and the robot with its links and shapes.
        channels: Arrays (F, ...) by name, such as "link_pose" (F, links, 7) and "joint_angle"
            (F, joints); `header.channels` has their units and labels.
    """

    header: ReplayHeaderView
    channels: Mapping[str, NDArray[np.float32]]


def decoded_replay(content: bytes) -> WalkReplay:
    """Decode the result of `encoded_replay`."""
    text, numbers = unframed(content)
    header = ReplayHeaderView.model_validate_json(text)
    frames = numbers.reshape(header.frames, -1)
    channels = {
        channel.name: frames[:, channel.offset : channel.offset + math.prod(channel.shape)]
        for channel in header.channels
    }
    return WalkReplay(
        header,
        {c.name: channels[c.name].reshape(header.frames, *c.shape) for c in header.channels},
    )


def _channels(walk: Replay, joints: Sequence[str], legs: Sequence[str]) -> list[ChannelView]:
    labels = {
        "time": [],
        "link_pose": [link.name for link in walk.links],
        "foot_position": legs,
        "foot_force": legs,
        "body_acceleration": ["x", "y", "z"],
        "body_velocity": ["vx", "vy", "vz", "wx", "wy", "wz"],
        "supply": [],
    }
    channels, offset = [], 0
    for name, (unit, description) in _CHANNELS.items():
        shape = list(getattr(walk, name).shape[1:]) or [1]
        channels.append(
            ChannelView(
                name=name,
                unit=unit,
                description=description,
                shape=shape,
                offset=offset,
                labels=list(labels.get(name, joints)),
            )
        )
        offset += int(np.prod(shape))
    return channels


def _frames(columns: Sequence[NDArray[np.float64]]) -> NDArray[np.float32]:
    """(F, floats): by frame all columns (F, ...), up to where a diverging walk leaves float32."""
    with np.errstate(over="ignore"):
        rows = np.concatenate([c.reshape(len(c), -1) for c in columns], axis=1).astype("<f4")
    usable = np.isfinite(rows).all(axis=1)
    return rows if usable.all() else rows[: int(np.argmin(usable))]
