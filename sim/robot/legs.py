"""Kinematics of one leg: where its foot is, for the thesis's legs and for any of three joints."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_MIDDLE: Final = 1e-6
"""Distance from the body's long axis within which a foot is on neither side [m]."""


class LegKinematics(Protocol):
    """What is known of every leg."""

    @property
    def name(self) -> str:
        """Of the leg."""

    @property
    def hip(self) -> tuple[float, float, float]:
        """Origin of the first joint in the body's frame [m]."""

    @property
    def side(self) -> float:
        """+1 for a leg on the left, -1 on the right, 0 in the middle."""

    @property
    def limits(self) -> Floats:
        """Least and largest angle of each joint, (3, 2) [rad]."""

    @property
    def lengths(self) -> tuple[float, float, float]:
        """Distances between the joints and from the last one to the foot [m]."""

    def foot(self, angles: Sequence[float]) -> tuple[float, float, float]:
        """Where the leg ends.

        Args:
            angles: Of the joints, (3,) [rad].

        Returns:
            The foot's position in the body's frame [m].
        """


@dataclass(frozen=True, slots=True, eq=False)
class KneeUpLeg:
    """A leg as the thesis's: coxa about z, femur and tibia about x, all frames parallel.

    Attributes:
        name: of the leg.
        hip: coxa axis in the body frame, (3,) [m].
        side: +1 left, -1 right.
        lengths: of coxa, femur and tibia [m].
        limits: of the joints, (3, 2) [rad].
    """

    name: str
    hip: tuple[float, float, float]
    side: float
    lengths: tuple[float, float, float]
    limits: Floats

    def foot(self, angles: Sequence[float]) -> tuple[float, float, float]:
        """Where the tibia ends, in the body's frame."""
        (x, y, z), (coxa, femur, tibia) = self.hip, self.lengths
        alpha, theta1, theta2 = angles
        outward = coxa + femur * math.cos(theta1) + tibia * math.cos(theta1 + theta2)
        return (
            x + outward * math.sin(alpha),
            y + self.side * outward * math.cos(alpha),
            z + femur * math.sin(theta1) + tibia * math.sin(theta1 + theta2),
        )


@dataclass(frozen=True, slots=True, eq=False)
class ChainLeg:
    """A leg of three revolute joints, however they are mounted.

    Attributes:
        name: of the leg.
        rotations: of each joint's frame in the one before it, the body's first, (3, 3, 3).
        offsets: of each joint's frame in the one before it, (3, 3) [m].
        axes: that the joints turn about, in their own frames, of unit length, (3, 3).
        end: the foot in the last joint's frame, (3,) [m].
        stance: angles at which the leg stands, (3,) [rad].
        limits: of the joints, (3, 2) [rad].
    """

    name: str
    rotations: Floats
    offsets: Floats
    axes: Floats
    end: Floats
    stance: Floats
    limits: Floats

    @property
    def hip(self) -> tuple[float, float, float]:
        """Origin of the first joint in the body's frame [m]."""
        x, y, z = self.offsets[0].tolist()
        return x, y, z

    @property
    def side(self) -> float:
        """Where the foot is when the leg stands: 1 left, -1 right, 0 in the middle."""
        lateral = self.foot(self.stance.tolist())[1]
        return 0.0 if abs(lateral) < _MIDDLE else math.copysign(1.0, lateral)

    @property
    def is_upright(self) -> bool:
        """Whether the first joint's axis is rather vertical than not."""
        return bool(abs((self.rotations[0] @ self.axes[0])[2]) > np.sqrt(0.5))

    @property
    def lengths(self) -> tuple[float, float, float]:
        """Distances between the joints and from the last one to the foot [m]."""
        first, second, third = (
            math.hypot(*part.tolist()) for part in (self.offsets[1], self.offsets[2], self.end)
        )
        return first, second, third

    def foot(self, angles: Sequence[float]) -> tuple[float, float, float]:
        """Where the leg ends, in the body's frame."""
        x, y, z = self.feet(np.asarray([angles], dtype=np.float64))[0][0].tolist()
        return x, y, z

    def feet(self, angles: Floats) -> tuple[Floats, Floats]:
        """Where the leg ends, and how that changes with the angles.

        Args:
            angles: (T, 3) [rad].

        Returns:
            The foot in the body's frame, (T, 3) [m]; and its derivatives by angle, (T, 3, 3) [m],
            a joint's in the last index.
        """
        point = np.broadcast_to(self.end, (len(angles), 3))
        # From the foot inwards: each joint turns all that is behind it.
        behind: list[Floats] = []
        for k in (2, 1, 0):
            axis, sine, cosine = self.axes[k], np.sin(angles[:, k]), np.cos(angles[:, k])
            behind = [turned(vector, axis, sine, cosine) for vector in behind]
            point = turned(point, axis, sine, cosine)
            behind.append(_across(axis, point))
            behind = [vector @ self.rotations[k].T for vector in behind]
            point = point @ self.rotations[k].T + self.offsets[k]
        return np.asarray(point), np.stack(behind[::-1], axis=-1)


def turned(vector: Floats, axis: Floats, sine: Floats, cosine: Floats) -> Floats:
    """Turn vectors about an axis, by Rodrigues' formula.

    Args:
        vector: (T, 3), or (3,).
        axis: Of unit length, (3,).
        sine: Of the angles, (T,).
        cosine: Of the angles, (T,).

    Returns:
        (T, 3).
    """
    along = (vector @ axis)[:, None] * axis
    across = _across(axis, vector)
    return np.asarray(along + cosine[:, None] * (vector - along) + sine[:, None] * across)


def _across(axis: Floats, vector: Floats) -> Floats:
    """Cross product of one vector and many: `numpy.cross` to the bit, but much faster."""
    (x, y, z), (a, b, c) = axis.tolist(), vector.T
    found = np.empty(vector.shape)
    found[..., 0] = y * c - z * b
    found[..., 1] = z * a - x * c
    found[..., 2] = x * b - y * a
    return found
