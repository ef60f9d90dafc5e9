"""Kinematics of one leg: where its foot is, for the thesis's legs and for any of three joints."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
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
    """A leg as the thesis's: coxa about z, femur and tibia about x, all frames parallel."""

    name: str  # of the leg
    hip: tuple[float, float, float]  # coxa axis in the body frame, (3,) [m]
    side: float  # +1 left, -1 right
    lengths: tuple[float, float, float]  # of coxa, femur and tibia [m]
    limits: Floats  # of the joints, (3, 2) [rad]

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
    """A leg of three revolute joints, however they are mounted."""

    name: str  # of the leg
    rotations: Floats  # of each joint's frame in the one before it, the body's first, (3, 3, 3)
    offsets: Floats  # of each joint's frame in the one before it, (3, 3) [m]
    axes: Floats  # that the joints turn about, in their own frames, of unit length, (3, 3)
    end: Floats  # the foot in the last joint's frame, (3,) [m]
    stance: Floats  # angles at which the leg stands, (3,) [rad]
    limits: Floats  # of the joints, (3, 2) [rad]

    @property
    def hip(self) -> tuple[float, float, float]:
        """Origin of the first joint in the body's frame [m]."""
        x, y, z = self.offsets[0].tolist()
        return x, y, z

    @property
    def side(self) -> float:
        """Where the foot is when the leg stands: 1 left, -1 right, 0 in the middle."""
        lateral = self.stand[1]
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

    @property
    def stand(self) -> tuple[float, float, float]:
        """Where the foot is when the leg stands, in the body's frame [m]."""
        return _stand_of(self)

    def foot(self, angles: Sequence[float]) -> tuple[float, float, float]:
        """Where the leg ends, in the body's frame."""
        x, y, z = self.ends(np.asarray([angles], dtype=np.float64))[0].tolist()
        return x, y, z

    def ends(self, angles: Floats) -> Floats:
        """Where the leg ends.

        Args:
            angles: (T, 3) [rad].

        Returns:
            The foot in the body's frame, (T, 3) [m].
        """
        return np.asarray(self._moved(angles, slopes=False)[0])

    def feet(self, angles: Floats) -> tuple[Floats, Floats]:
        """Where the leg ends, and how that changes with the angles.

        Args:
            angles: (T, 3) [rad].

        Returns:
            The foot in the body's frame, (T, 3) [m]; and its derivatives by angle, (T, 3, 3) [m],
            a joint's in the last index.
        """
        moved = self._moved(angles, slopes=True)
        return moved[0], np.stack(tuple(moved[:0:-1]), axis=-1)

    def _moved(self, angles: Floats, *, slopes: bool) -> Floats:
        """The foot, (1, T, 3) [m], and if asked for its derivatives by angle, the last joint's
        first, (4, T, 3) [m].
        """
        sines, cosines = np.sin(angles), np.cos(angles)
        moved = np.empty((1 + slopes * len(self.axes), len(angles), 3))
        seen = np.broadcast_to(self.end, moved[:1].shape)
        # From the foot inwards: each joint turns all that is behind it.
        for k in (2, 1, 0):
            behind = turned(seen, self.axes[k], sines[:, k], cosines[:, k])
            if slopes:
                behind = np.concatenate([behind, _across(self.axes[k], behind[:1])])
            seen = moved[: len(behind)]
            np.matmul(behind, self.rotations[k].T, out=seen)
            moved[0] += self.offsets[k]
        return moved


@lru_cache(maxsize=128)
def _stand_of(leg: ChainLeg) -> tuple[float, float, float]:
    return leg.foot(leg.stance.tolist())


def turned(vector: Floats, axis: Floats, sine: Floats, cosine: Floats) -> Floats:
    """Turn vectors about an axis, by Rodrigues' formula.

    Args:
        vector: (..., T, 3).
        axis: Of unit length, (3,).
        sine: Of the angles, (T,).
        cosine: Of the angles, (T,).

    Returns:
        (..., T, 3).
    """
    # One factor for each number: numpy is slow to take each of three numbers at a time.
    sine, cosine = (np.repeat(factor, 3).reshape(-1, 3) for factor in (sine, cosine))
    along = (vector @ axis)[..., None] * axis
    turned = cosine * (vector - along)
    turned += along
    turned += sine * _across(axis, vector)
    return turned


def _across(axis: Floats, vector: Floats) -> Floats:
    """Cross product of one vector and many: `numpy.cross` to the bit, but much faster."""
    x, y, z = axis.tolist()
    a, b, c = vector[..., 0], vector[..., 1], vector[..., 2]
    found = np.empty(vector.shape)
    found[..., 0] = y * c - z * b
    found[..., 1] = z * a - x * c
    found[..., 2] = x * b - y * a
    return found
