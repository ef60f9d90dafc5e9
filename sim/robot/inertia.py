"""Inertias of rigid bodies, as numbers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class BodyInertia:
    """Inertia of a rigid body in some frame."""

    mass: float  # [kg]
    centre: Floats  # of mass, (3,) [m]
    rotational: Floats  # about the centre of mass, (3, 3) [kg m2]

    def seen_from(self, rotation: Floats, position: Floats) -> BodyInertia:
        """The same body in another frame.

        Args:
            rotation: from this frame to the other one, (3, 3).
            position: of this frame's origin in the other one, (3,) [m].
        """
        # A ball's inertia turns into itself. Pinocchio sets it apart too, and so rounds alike.
        ball = self.rotational[2, 2] * np.eye(3)
        turned = product(product(rotation, self.rotational - ball), rotation.T) + ball
        return BodyInertia(self.mass, product(rotation, self.centre) + position, turned)

    def joined(self, other: BodyInertia) -> BodyInertia:
        """Two bodies as one."""
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
"""Of a link that has none."""


def parallel_axis(offset: Floats) -> Floats:
    """Rotational inertia of a unit point mass (Steiner's theorem).

    Args:
        offset: of the mass from the axes' origin, (3,) [m].

    Returns:
        (3, 3) [m2], to be multiplied by the mass [kg].
    """
    x, y, z = offset.tolist()
    squared = float(x * x + y * y + z * z)
    return squared * np.eye(3) - np.outer(offset, offset)


def product(rotation: Floats, other: Floats) -> Floats:
    """Matrix product that rounds alike on every machine.

    NumPy's `@` is that of a BLAS library, which sums by other instructions on each kind of
    processor: a robot's inertias, and every walk with them, would differ in their last bits.

    Args:
        rotation: (3, 3).
        other: (3,) or (3, 3).
    """
    x, y, z = (np.multiply.outer(rotation[:, k], other[k]) for k in range(3))
    return np.asarray(x + y + z)
