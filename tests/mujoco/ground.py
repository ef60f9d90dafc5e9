"""Ground forces on the feet, written anew from docs/model.md."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from sim.robot import Robot
from tests.mujoco.export import model

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Friction:
    """What a law of friction says of all feet.

    force (L, 2): along the ground [N].
    drag (L,): how it falls with a velocity in any direction [N s/m].
    further (L,): what is added to that along the slip, over the slip's square [N s3/m3].
    memory: of the law, after the step.
    """

    force: Floats
    drag: Floats
    further: Floats
    memory: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Reaction:
    """The ground's answer to all feet.

    force (L, 3): on them [N].
    damping (L, 3, 3): minus its derivative by their velocities, without that by which friction
        follows the normal force [N s/m].
    memory: of the law of friction, after the step.
    """

    force: Floats
    damping: Floats
    memory: Floats


class Ground(ABC):
    """A clamped spring and damper along the ground's normal, and a law of friction.

    memory: what the law knows of the steps before.
    """

    def __init__(self, robot: Robot) -> None:
        self._contacts = robot.contacts()
        self._k, self._c = self._by_foot("stiffness"), self._by_foot("damping")
        self._sole, self._mu = self._by_foot("sole"), self._by_foot("friction")
        self._mobility = mobility(robot)
        self.memory = np.zeros((len(self._mu), 0))

    def __call__(self, position: Floats, velocity: Floats, timestep: float) -> Reaction:
        """Feet's positions [m] and velocities [m/s], (L, 3) each, and the step's length [s]."""
        depth = self._sole - position[:, 2]
        touching = depth > 0.0
        elastic = self._k * depth - self._c * velocity[:, 2]
        normal = np.where(touching, np.maximum(elastic, 0.0), 0.0)
        slip = velocity[:, :2]
        friction = self.friction(touching, self._mu * normal, slip, timestep)
        damping = np.zeros((len(depth), 3, 3))
        damping[:, 2, 2] = np.where(touching & (elastic > 0.0), self._c, 0.0)
        damping[:, :2, :2] = friction.drag[:, None, None] * np.eye(2)
        damping[:, :2, :2] += np.einsum("l,li,lj->lij", friction.further, slip, slip)
        return Reaction(np.column_stack([friction.force, normal]), damping, friction.memory)

    def landing(self, position: Floats, velocity: Floats, time: float) -> bool:
        """Whether a foot in the air, at this speed, is on the ground after a time [s]."""
        depth = self._sole - position[:, 2]
        return bool(((depth <= 0.0) & (depth > velocity[:, 2] * time)).any())

    @abstractmethod
    def friction(
        self, touching: NDArray[np.bool_], limit: Floats, slip: Floats, timestep: float
    ) -> Friction:
        """Which feet touch (L,), mu F_z (L,) [N], velocities along the ground (L, 2) [m/s]."""

    def sliding(self, limit: Floats, speed: Floats, timestep: float) -> Floats:
        """1 for feet that friction cannot stop within the step, down to 0 for those it can."""
        share: Floats = np.maximum(1.0 - limit * timestep * self._mobility / speed, 0.0)
        return share

    def without_memory(self, force: Floats, drag: Floats, further: Floats) -> Friction:
        """Of a law that has none."""
        return Friction(force, drag, further, self.memory)

    def _by_foot(self, name: str) -> Floats:
        return np.array([getattr(contact, name) for contact in self._contacts])


class LinearZone(Ground):
    """Friction against the slip, linear below a slip velocity."""

    def __init__(self, robot: Robot) -> None:
        super().__init__(robot)
        self._zone = self._by_foot("slip_velocity")

    def friction(
        self, touching: NDArray[np.bool_], limit: Floats, slip: Floats, timestep: float
    ) -> Friction:
        """mu F_z v / max(|v|, v_lin), against the motion."""
        del touching
        speed = np.hypot(slip[:, 0], slip[:, 1])
        bound = np.maximum(speed, self._zone)
        drag = limit / bound
        full = np.where(speed > self._zone, self.sliding(limit, bound, timestep), 0.0)
        return self.without_memory(-drag[:, None] * slip, drag, -full * drag / bound**2)


class Karnopp(Ground):
    """Full friction along each axis of the world that the foot moves along fast enough."""

    def __init__(self, robot: Robot) -> None:
        super().__init__(robot)
        self._threshold = self._by_foot("stick_velocity")

    def friction(
        self, touching: NDArray[np.bool_], limit: Floats, slip: Floats, timestep: float
    ) -> Friction:
        """mu F_z along x, and again along y."""
        del touching, timestep
        slides = np.abs(slip) > self._threshold[:, None]
        none = np.zeros_like(limit)
        force = np.where(slides, -np.sign(slip) * limit[:, None], 0.0)
        return self.without_memory(force, none, none)


class DeadZone(Ground):
    """Friction against the slip: none below one velocity, full from another one on."""

    def __init__(self, robot: Robot) -> None:
        super().__init__(robot)
        self._none, self._full = self._by_foot("stick_velocity"), self._by_foot("slip_velocity")

    def friction(
        self, touching: NDArray[np.bool_], limit: Floats, slip: Floats, timestep: float
    ) -> Friction:
        """The share of mu F_z grows linearly between the two, against the motion."""
        del touching
        speed = np.hypot(slip[:, 0], slip[:, 1])
        width = self._full - self._none
        bound = np.maximum(speed, self._none)
        drag = limit * np.clip((bound - self._none) / width, 0.0, 1.0) / bound
        grows = (speed > self._none) & (speed < self._full)
        slope = np.where(grows, limit / width, 0.0) - drag
        further = self.sliding(limit, bound, timestep) * slope / bound**2
        return self.without_memory(-drag[:, None] * slip, drag, further)


class Stick(Ground):
    """A spring and damper along the ground that slips where it would pull more than mu F_z.

    memory (L, 2): elongation of the springs, along the world's axes [m]. It grows by the step's
    motion before it pulls, shrinks by the share by which a slipping foot's pull is cut, and is gone
    when the foot lifts off.
    """

    def __init__(self, robot: Robot) -> None:
        super().__init__(robot)
        self._spring, self._damper = (
            self._by_foot("stick_stiffness"),
            self._by_foot("stick_damping"),
        )
        self.memory = np.zeros((len(self._mu), 2))

    def friction(
        self, touching: NDArray[np.bool_], limit: Floats, slip: Floats, timestep: float
    ) -> Friction:
        """The springs' and dampers' pull, cut to mu F_z."""
        longer = np.where(touching[:, None], self.memory + timestep * slip, 0.0)
        pull = -(self._spring[:, None] * longer + self._damper[:, None] * slip)
        size = np.hypot(pull[:, 0], pull[:, 1])
        slipping = size > limit
        share = np.divide(limit, size, out=np.ones_like(size), where=slipping)
        force = np.where(touching[:, None], share[:, None] * pull, 0.0)
        drag = np.where(touching, share * self._damper, 0.0)
        return Friction(force, drag, np.zeros_like(drag), share[:, None] * longer)


GROUNDS: Mapping[str, type[Ground]] = {
    "linear_zone": LinearZone,
    "karnopp": Karnopp,
    "stick": Stick,
    "dead_zone": DeadZone,
}


def mobility(robot: Robot) -> Floats:
    """Acceleration per force of every foot against the rotors' inertia, the leg stretched and the
    body held, (L,) [1/kg]; so much or less a force accelerates it."""
    exported, actuators = model(robot), robot.actuators()
    rotors = dict(zip(robot.joint_names, actuators.armature.tolist(), strict=True))
    found = []
    for leg in robot.description.legs:
        reach = float(np.linalg.norm(exported.site(leg.foot).pos))
        total = 0.0
        for name in reversed(leg.joints):
            total += reach**2 / rotors[name]
            body = exported.jnt_bodyid[exported.joint(name).id]
            reach += float(np.linalg.norm(exported.body_pos[body]))
        found.append(total)
    return np.array(found)


def feet_of(d: mujoco.MjData) -> tuple[Floats, Floats]:
    """Feet's positions and velocities, (L, 3) each, by MuJoCo's sensors."""
    position, velocity = d.sensordata.reshape(2, -1, 3)
    return position, velocity


def apply_forces(m: mujoco.MjModel, d: mujoco.MjData, robot: Robot, forces: Floats) -> None:
    """Add forces on the feet (L, 3) [N] to qfrc_applied."""
    position, _ = feet_of(d)
    nothing = np.zeros(3)
    for leg in np.flatnonzero(forces[:, 2]).tolist():
        body = int(m.site_bodyid[m.site(robot.description.legs[leg].foot).id])
        mujoco.mj_applyFT(m, d, forces[leg], nothing, position[leg], body, d.qfrc_applied)
