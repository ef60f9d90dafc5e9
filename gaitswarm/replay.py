"""Replays of a design in one scenario: a JSON header, then numbers by frame."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.designs import WorldRequest
from gaitswarm.services.optimizer.views import StatusName, View, finite, framed
from gaitswarm.sim.kernel.parameters import gravity_on
from gaitswarm.sim.outcome import OBJECTIVE_NAMES, OBJECTIVES, Status
from gaitswarm.sim.replay import CONTROL_RATE, SAMPLED, Replay
from gaitswarm.sim.replay import replay as replayed
from gaitswarm.sim.robot import RobotFiles, load_robot
from gaitswarm.sim.robot.description import RobotDescription, TorqueActuator
from gaitswarm.sim.robot.meshes import urdf_digest
from gaitswarm.sim.robot.shapes import VisibleLink
from gaitswarm.sim.scenario import Scenario, ScenarioChoice, find_scenario
from gaitswarm.sim.worlds.walks import ground_of
from gaitswarm.simulation import QUANTITIES

VERSION: Final = 1

_CHANNELS: Final[dict[str, tuple[str, str]]] = {
    "time": QUANTITIES["time"],
    "link_pose": ("m, 1", "every link in the world: x, y, z, then quaternion x, y, z, w"),
    "foot_position": ("m", "lower end of every leg in the world: x, y, z"),
    **{name: QUANTITIES[name] for name in SAMPLED},
    "body_acceleration": ("m/s2", "of the body in its own frame, without gravity: x, y, z"),
    "body_velocity": ("m/s, rad/s", "of the body in its own frame: 3 linear, then 3 angular"),
    "supply": QUANTITIES["supply"],
}
"""Arrays of a `Replay` in the order of a frame: unit and description."""

MOST_POSES: Final = 1_000_000
"""Poses of links in a replay; one of 40 s at 500 Hz has half as many of a shipped robot."""


class ReplayRequest(WorldRequest):
    """A design and the scenario to replay."""

    scenario: ScenarioChoice = Field(default="normal-fast", examples=["normal-fast"])
    """Name or number of a preset (see /v1/scenarios), or your own."""
    rate: float = Field(default=50.0, ge=1.0, le=CONTROL_RATE)
    """Frames a second; each is the nearest tick of 2 ms, whose time is exact [Hz]."""


Vector = tuple[float, float, float]


class MovingRobotView(View):
    """The robot's links and shapes."""

    name: str = Field(description="Name of the robot.", examples=["szabadka2"])
    urdf: str | None
    """SHA-256 of its robot.urdf, which identifies its meshes; null for a shipped robot, which has
    none."""
    links: list[VisibleLink] = Field(description="All links, parents first; the body is the first.")
    joints: list[str] = Field(description="Joints in the order of channels.")
    legs: list[str] = Field(description="Legs in the order of channels.")
    mass: float = Field(description="Mass without load [kg].", examples=[4.05])
    torque_limits: list[float]
    """By joint, torque at the joint: nominal one of a gearhead, or largest one of a
    torque-controlled actuator [N m]."""
    current_limits: list[float]
    """By joint: stall current of a DC motor at the battery's voltage, or the current of a
    torque-controlled actuator's largest torque [A]."""


class HeightsView(View):
    """Uneven ground around a walk; between its points heights are bilinear."""

    x: list[float] = Field(description="Places of the rows [m].", examples=[[-0.5, 0.5]])
    y: list[float] = Field(description="Places of a row's heights [m].", examples=[[-0.5, 0.5]])
    z: list[list[float]] = Field(examples=[[[0.0, 0.01], [0.0, 0.02]]])
    """Heights by row [m]."""


class GroundView(View):
    """The ground; the world's z axis is normal to it, so gravity is tilted."""

    slope_deg: float = Field(description="Inclination, up positive [deg].", examples=[10.0])
    slope_direction_deg: float = Field(examples=[0.0])
    """Where it rises, from straight ahead towards the left [deg]."""
    normal: Vector = Field(default=(0.0, 0.0, 1.0), description="Its normal in the world [1].")
    heights: HeightsView | None = None
    """Its heights; null if it is flat."""


class ChannelView(View):
    """One quantity of a frame."""

    name: str = Field(description="Its name.", examples=["joint_angle"])
    unit: str = Field(description="Unit of its numbers.", examples=["rad"])
    description: str = Field(description="Its meaning.", examples=["angle of every joint"])
    shape: list[int] = Field(description="Shape of its numbers, the last axis the fastest.")
    offset: int = Field(description="Numbers of the frame that come before it.", examples=[212])
    labels: list[str] = Field(description="Names along its first axis; none for a single number.")


class ReplayHeaderView(View):
    """Header of a replay: the meaning of its frames."""

    version: int = Field(default=VERSION, description="Of this format.", examples=[VERSION])
    rate: float = Field(description="Frames per second, as requested [Hz].", examples=[50.0])
    frames: int = Field(description="Number of frames.", examples=[225])
    duration: float = Field(description="Simulated time, up to a fall if there was one [s].")
    status: StatusName = Field(description="Status of the simulation; only `ok` is a success.")
    explanation: str = Field(description="The status in a sentence, with what to do about it.")
    objectives: dict[str, float | None] = Field(examples=[{"torque": 8.71}])
    """Raw objectives f1..f6 of table 4.1 by name; null after a failure."""
    objective_units: dict[str, str] = Field(examples=[{"torque": "N m"}])
    """Unit of each of them."""
    scenario: Scenario
    """The scenario in full, with the gait parameters of the design."""
    robot: MovingRobotView = Field(description="Links and shapes of the robot.")
    ground: GroundView = Field(description="The ground.")
    gravity: Vector = Field(description="In the world [m/s2].", examples=[[0.0, 0.0, -9.81]])
    load_kg: float = Field(description="Mass carried on the body [kg].", examples=[2.0])
    channels: list[ChannelView] = Field(description="Channels of a frame, in order.")


def run_replay(request: ReplayRequest) -> bytes:
    """Simulate the design and encode its replay."""
    scenario = find_scenario(request.scenario)
    request.check_design()
    request.check_reach(scenario, field="scenario")
    robot = load_robot(request.robot)
    poses = request.rate * request.simulated_seconds([scenario]) * len(robot.urdf.links)
    if poses > MOST_POSES:
        raise InvalidRequest(
            f"the replay would have {poses:.3g} poses of links, more than {MOST_POSES}; choose"
            " fewer frames a second or cycles",
            field="rate",
        )
    outcome = request.walk(scenario, log=True)
    (log,) = outcome.logs
    if log is None:
        raise AssertionError("a gait within reach was not simulated")
    walk = replayed(robot, log, rate=request.rate, load=scenario.load)
    status = Status(outcome.outcome.statuses[0])
    objectives = map(finite, outcome.outcome.objectives[0].tolist())
    legs = [leg.name for leg in robot.legs]
    torques, currents = zip(*_limits(robot.description), strict=True)
    channels = _channels(walk, robot.joint_names, legs)
    frames = _frames([getattr(walk, channel.name) for channel in channels])
    x, y, z = gravity_on(scenario.slope, scenario.slope_direction).tolist()
    header = ReplayHeaderView(
        rate=request.rate,
        frames=len(frames),
        duration=walk.duration,
        status=status.label,
        explanation=status.phrase,
        objectives=dict(zip(OBJECTIVE_NAMES, objectives, strict=True)),
        objective_units={objective.name: objective.unit for objective in OBJECTIVES},
        scenario=request.walked(scenario),
        robot=MovingRobotView(
            name=robot.description.name,
            urdf=urdf_digest(request.robot.urdf) if isinstance(request.robot, RobotFiles) else None,
            links=list(walk.links),
            joints=list(robot.joint_names),
            legs=legs,
            mass=robot.mass,
            torque_limits=list(torques),
            current_limits=list(currents),
        ),
        ground=GroundView(
            slope_deg=scenario.slope,
            slope_direction_deg=scenario.slope_direction,
            heights=_heights(request, scenario, walk),
        ),
        gravity=(x, y, z),
        load_kg=scenario.load,
        channels=channels,
    )
    return framed(header, frames)


def _limits(robot: RobotDescription) -> Iterator[tuple[float, float]]:
    """Yield each joint's limits of torque [N m] and current [A]."""
    for actuator in (robot.actuators[name] for leg in robot.legs for name in leg.actuators):
        if isinstance(actuator, TorqueActuator):
            per_ampere = actuator.gear_ratio * actuator.torque_constant
            yield actuator.torque_limit, actuator.torque_limit / per_ampere
        else:
            gear, motor = robot.gearheads[actuator.gearhead], robot.motors[actuator.motor]
            stall = robot.supply.voltage / motor.resistance
            yield gear.nominal_torque * actuator.bevel, stall


_MARGIN: Final = 0.4
"""Distance from the feet to which uneven ground is shown [m]."""

_MOST_ROWS: Final = 200


def _heights(request: ReplayRequest, scenario: Scenario, walk: Replay) -> HeightsView | None:
    world = request.world or {}
    seed = round(world.get("world_seed", 0.0))
    ground = ground_of(scenario, world.get("roughness", 0.0), seed)
    if ground is None:
        return None
    axes = []
    for axis, cells in enumerate(ground.cells):
        feet = walk.foot_position[:, :, axis]
        low, high = float(feet.min()) - _MARGIN, float(feet.max()) + _MARGIN
        rows = min(2 + math.ceil((high - low) / ground.cell) * (cells > 1), _MOST_ROWS)
        axes.append(np.linspace(low, high, rows).round(4))
    x, y = axes
    z = ground.height(*np.meshgrid(x, y, indexing="ij")).round(4)
    return HeightsView(x=x.tolist(), y=y.tolist(), z=z.tolist())


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
        offset += math.prod(shape)
    return channels


def _frames(columns: Sequence[NDArray[np.float64]]) -> NDArray[np.float32]:
    """(F, floats): by frame all columns (F, ...), up to where a diverging walk leaves float32."""
    with np.errstate(over="ignore"):
        rows = np.concatenate([c.reshape(len(c), -1) for c in columns], axis=1).astype("<f4")
    usable = np.isfinite(rows).all(axis=1)
    return rows if usable.all() else rows[: int(np.argmin(usable))]
