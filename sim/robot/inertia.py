"""Inertias of rigid bodies."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitswarm.sim.arrays import Floats


@dataclass(frozen=True, slots=True, eq=False)
class BodyInertia:
    """Inertia of a rigid body in some frame."""

    mass: float  # [kg]
    centre: Floats  # of mass, (3,) [m]
    rotational: Floats  # about the centre of mass, (3, 3) [kg m2]

    def seen_from(self, rotation: Floats, position: Floats) -> BodyInertia:
        """Transform to another frame by rotation (3, 3) and position (3,) [m] of this one."""
        # A ball's inertia is invariant. Pinocchio makes the same exception, so both round alike.
        ball = self.rotational[2, 2] * np.eye(3)
        turned = product(product(rotation, self.rotational - ball), rotation.T) + ball
        return BodyInertia(self.mass, product(rotation, self.centre) + position, turned)

    def joined(self, other: BodyInertia) -> BodyInertia:
        mass = self.mass + other.mass
        per_mass = 1.0 / max(mass, float(np.finfo(np.float64).eps))
        reduced = self.mass * other.mass * per_mass
        return BodyInertia(
            mass,
            self.centre * (self.mass * per_mass) + (other.mass * per_mass) * other.centre,
            self.rotational
            + other.rotational
            + reduced * parallel_axis(self.centre - other.centre),
        )


NO_INERTIA: Final = BodyInertia(0.0, np.zeros(3), np.zeros((3, 3)))
"""Inertia of a link without `<inertial>`."""


def parallel_axis(offset: Floats) -> Floats:
    """Rotational inertia (3, 3) [m2] of a unit point mass at an offset (3,) [m] (Steiner)."""
    x, y, z = offset.tolist()
    squared = float(x * x + y * y + z * z)
    return squared * np.eye(3) - np.outer(offset, offset)


def product(rotation: Floats, other: Floats) -> Floats:
    """Multiply a rotation (3, 3) by (3,) or (3, 3), rounding alike on every machine."""
    x, y, z = (np.multiply.outer(rotation[:, k], other[k]) for k in range(3))
    return np.asarray(x + y + z)
