"""Ground forces on the feet in numbers, independent of the kernel's formulas (docs/model.md)."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.robot.description import ContactLaw


class Ground(ABC):
    """A clamped spring and damper along the ground's normal, and a friction law.

    Positions and velocities of feet are (L, 3), in [m] and [m/s]; `numbers` (L,) each, by the names
    of `gaitswarm.sim.robot.description.Contact`; `memory` (L, m) is the law's internal state.
    """

    def __init__(self, numbers: Mapping[str, Floats]) -> None:
        self.numbers = numbers
        self._k, self._c = numbers["stiffness"], numbers["damping"]
        self._sole, self._mu = numbers["sole"], numbers["friction"]
        self.memory: Floats = np.zeros((len(self._mu), 0))

    def press(self, position: Floats, velocity: Floats) -> tuple[NDArray[np.bool_], Floats]:
        """Which feet touch (L,), and F_z = k p - c dz/dt (L,) [N] on these, never pulling."""
        depth = self._sole - position[:, 2]
        touching = depth > 0.0
        elastic = self._k * depth - self._c * velocity[:, 2]
        return touching, np.where(touching, np.maximum(elastic, 0.0), 0.0)

    def landing(self, position: Floats, velocity: Floats, time: float) -> bool:
        """Whether a foot in the air, at this speed, is on the ground after a time [s]."""
        depth = self._sole - position[:, 2]
        return bool(((depth <= 0.0) & (depth > velocity[:, 2] * time)).any())

    def forces(self, position: Floats, velocity: Floats, timestep: float) -> tuple[Floats, Floats]:
        """Return forces on the feet (L, 3) [N], and the memory after the step."""
        touching, normal = self.press(position, velocity)
        rub, memory = self.friction(touching, self._mu * normal, velocity[:, :2], timestep)
        return np.concatenate([rub, normal[:, None]], axis=1), memory

    @abstractmethod
    def friction(
        self, touching: NDArray[np.bool_], limit: Floats, slip: Floats, timestep: float
    ) -> tuple[Floats, Floats]:
        """Return forces along the ground (L, 2) [N] up to `limit`, and the memory after it."""


class LinearZone(Ground):
    """Friction against the slip, linear below a slip velocity."""

    def friction(
        self, touching: NDArray[np.bool_], limit: Floats, slip: Floats, timestep: float
    ) -> tuple[Floats, Floats]:
        """mu F_z v / max(|v|, v_lin), against the motion."""
        del touching, timestep
        speed = np.hypot(slip[:, 0], slip[:, 1])
        drag = limit / np.maximum(speed, self.numbers["slip_velocity"])
        return -drag[:, None] * slip, self.memory


class Karnopp(Ground):
    """Full friction along each axis of the world along which the foot moves fast enough."""

    def friction(
        self, touching: NDArray[np.bool_], limit: Floats, slip: Floats, timestep: float
    ) -> tuple[Floats, Floats]:
        """mu F_z along x, and again along y."""
        del touching, timestep
        slides = np.abs(slip) > self.numbers["stick_velocity"][:, None]
        return np.where(slides, -np.sign(slip) * limit[:, None], 0.0), self.memory


class DeadZone(Ground):
    """Friction against the slip: none below one velocity, full above another."""

    def friction(
        self, touching: NDArray[np.bool_], limit: Floats, slip: Floats, timestep: float
    ) -> tuple[Floats, Floats]:
        """The share of mu F_z grows linearly between the two, against the motion."""
        del touching, timestep
        none, full = self.numbers["stick_velocity"], self.numbers["slip_velocity"]
        speed = np.maximum(np.hypot(slip[:, 0], slip[:, 1]), none)
        # Identified speeds may cross: the friction then jumps at the first.
        share = np.clip((speed - none) / np.maximum(full - none, 1e-9), 0.0, 1.0)
        return -(limit * share / speed)[:, None] * slip, self.memory


class Stick(Ground):
    """A spring and damper along the ground that slips where it would pull more than mu F_z.

    Its memory (L, 2) is the springs' elongation along the world's axes [m], 0 after lift-off.
    """

    def __init__(self, numbers: Mapping[str, Floats]) -> None:
        super().__init__(numbers)
        self.memory = np.zeros((len(self._mu), 2))

    def friction(
        self, touching: NDArray[np.bool_], limit: Floats, slip: Floats, timestep: float
    ) -> tuple[Floats, Floats]:
        spring, damper = self.numbers["stick_stiffness"], self.numbers["stick_damping"]
        longer = np.where(touching[:, None], self.memory + timestep * slip, 0.0)
        pull = -(spring[:, None] * longer + damper[:, None] * slip)
        size = np.hypot(pull[:, 0], pull[:, 1])
        share = np.divide(limit, size, out=np.ones_like(size), where=size > limit)[:, None]
        return np.where(touching[:, None], share * pull, 0.0), share * longer


GROUNDS: Final[Mapping[ContactLaw, type[Ground]]] = MappingProxyType(
    {"linear_zone": LinearZone, "karnopp": Karnopp, "stick": Stick, "dead_zone": DeadZone}
)
