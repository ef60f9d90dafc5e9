"""Ground forces on the feet, written anew from docs/model.md."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping

import mujoco
import numpy as np
from numpy.typing import NDArray

from sim.robot import Robot

Floats = NDArray[np.float64]


class Ground(ABC):
    """A clamped spring and damper along the ground's normal, and a law of friction.

    A law may remember the step before: one call is one physics step.
    """

    def __init__(self, robot: Robot, timestep: float) -> None:
        self._timestep = timestep
        self._contacts = robot.contacts()
        self._k, self._c = self._by_foot("stiffness"), self._by_foot("damping")
        self._sole, self._mu = self._by_foot("sole"), self._by_foot("friction")

    def __call__(self, position: Floats, velocity: Floats) -> Floats:
        """Feet's positions [m] and velocities [m/s], (L, 3) each -> forces (L, 3) [N]."""
        depth = self._sole - position[:, 2]
        touching = depth > 0.0
        normal = np.where(
            touching, np.maximum(self._k * depth - self._c * velocity[:, 2], 0.0), 0.0
        )
        force = np.empty_like(position)
        force[:, :2] = self.friction(touching, self._mu * normal, velocity[:, :2])
        force[:, 2] = normal
        return force

    @abstractmethod
    def friction(self, touching: NDArray[np.bool_], limit: Floats, slip: Floats) -> Floats:
        """Which feet touch (L,), mu F_z (L,) [N], velocities along the ground (L, 2) [m/s]
        -> forces (L, 2) [N]."""

    def _by_foot(self, name: str) -> Floats:
        return np.array([getattr(contact, name) for contact in self._contacts])


class LinearZone(Ground):
    """Friction against the slip, linear below a slip velocity."""

    def __init__(self, robot: Robot, timestep: float) -> None:
        super().__init__(robot, timestep)
        self._zone = self._by_foot("slip_velocity")

    def friction(self, touching: NDArray[np.bool_], limit: Floats, slip: Floats) -> Floats:
        """mu F_z v / max(|v|, v_lin), against the motion."""
        del touching
        speed = np.maximum(np.hypot(slip[:, 0], slip[:, 1]), self._zone)
        return slip * (-limit / speed)[:, None]


class Karnopp(Ground):
    """Full friction along each axis of the world that the foot moves along fast enough."""

    def __init__(self, robot: Robot, timestep: float) -> None:
        super().__init__(robot, timestep)
        self._threshold = self._by_foot("stick_velocity")

    def friction(self, touching: NDArray[np.bool_], limit: Floats, slip: Floats) -> Floats:
        """mu F_z along x, and again along y."""
        del touching
        slides = np.abs(slip) > self._threshold[:, None]
        return np.where(slides, -np.sign(slip) * limit[:, None], 0.0)


class DeadZone(Ground):
    """Friction against the slip: none below one velocity, full from another one on."""

    def __init__(self, robot: Robot, timestep: float) -> None:
        super().__init__(robot, timestep)
        self._none, self._full = self._by_foot("stick_velocity"), self._by_foot("slip_velocity")

    def friction(self, touching: NDArray[np.bool_], limit: Floats, slip: Floats) -> Floats:
        """The share of mu F_z grows linearly between the two, against the motion."""
        del touching
        speed = np.hypot(slip[:, 0], slip[:, 1])
        share = np.clip((speed - self._none) / (self._full - self._none), 0.0, 1.0)
        direction = np.divide(
            slip, speed[:, None], out=np.zeros_like(slip), where=speed[:, None] > 0.0
        )
        return -(share * limit)[:, None] * direction


class Stick(Ground):
    """A spring and damper along the ground that slips where it would pull more than mu F_z.

    elongation (L, 2): of the springs, along the world's axes [m]. It grows by the step's motion
    before it pulls, shrinks by the share by which a slipping foot's pull is cut, and is gone when
    the foot lifts off.
    """

    def __init__(self, robot: Robot, timestep: float) -> None:
        super().__init__(robot, timestep)
        self._spring, self._damper = (
            self._by_foot("stick_stiffness"),
            self._by_foot("stick_damping"),
        )
        self.elongation = np.zeros((len(self._mu), 2))

    def friction(self, touching: NDArray[np.bool_], limit: Floats, slip: Floats) -> Floats:
        """The springs' and dampers' pull, cut to mu F_z."""
        longer = np.where(touching[:, None], self.elongation + self._timestep * slip, 0.0)
        pull = -(self._spring[:, None] * longer + self._damper[:, None] * slip)
        size = np.hypot(pull[:, 0], pull[:, 1])
        slipping = size > limit
        share = np.divide(limit, size, out=np.ones_like(size), where=slipping)[:, None]
        self.elongation = share * longer
        return np.where(touching[:, None], share * pull, 0.0)


GROUNDS: Mapping[str, type[Ground]] = {
    "linear_zone": LinearZone,
    "karnopp": Karnopp,
    "stick": Stick,
    "dead_zone": DeadZone,
}


def ground_forces(
    m: mujoco.MjModel, d: mujoco.MjData, robot: Robot, ground: Ground
) -> Callable[[], Floats]:
    """A call adds a step's ground forces to qfrc_applied and returns them, (L, 3) [N]."""
    legs = len(robot.legs)
    bodies = [int(m.site_bodyid[m.site(leg.foot).id]) for leg in robot.description.legs]
    nothing = np.zeros(3)

    def push() -> Floats:
        seen = d.sensordata.reshape(2, legs, 3)
        forces = ground(seen[0], seen[1])
        for leg in np.flatnonzero(forces[:, 2]):
            mujoco.mj_applyFT(m, d, forces[leg], nothing, seen[0, leg], bodies[leg], d.qfrc_applied)
        return forces

    return push
