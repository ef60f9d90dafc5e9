"""Leg kinematics: legs as in the thesis, and legs of any three revolute joints."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Final, Protocol

import numpy as np

from gaitswarm.sim.arrays import Floats

_MIDDLE: Final = 1e-6
"""Distance from the body's long axis within which a foot is on neither side [m]."""


class LegKinematics(Protocol):
    """Kinematics of a leg."""

    @property
    def name(self) -> str:
        """Name of the leg."""

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
        """Return the foot in the body's frame [m] at joint angles (3,) [rad]."""


@dataclass(frozen=True, slots=True, eq=False)
class KneeUpLeg:
    """A leg as in the thesis: coxa about z, femur and tibia about x, all frames parallel."""

    name: str  # of the leg
    hip: tuple[float, float, float]  # coxa axis in the body frame, (3,) [m]
    side: float  # +1 left, -1 right
    lengths: tuple[float, float, float]  # of coxa, femur and tibia [m]
    limits: Floats  # of the joints, (3, 2) [rad]

    def foot(self, angles: Sequence[float]) -> tuple[float, float, float]:
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
    """A leg of three revolute joints with any axes."""

    name: str  # of the leg
    rotations: Floats  # of each joint's frame in the one before it, the body's first, (3, 3, 3)
    offsets: Floats  # of each joint's frame in the one before it, (3, 3) [m]
    axes: Floats  # of rotation in the joints' own frames, of unit length, (3, 3)
    end: Floats  # the foot in the last joint's frame, (3,) [m]
    stance: Floats  # angles of the stance, (3,) [rad]
    limits: Floats  # of the joints, (3, 2) [rad]

    @property
    def hip(self) -> tuple[float, float, float]:
        x, y, z = self.offsets[0].tolist()
        return x, y, z

    @property
    def side(self) -> float:
        """Side of the foot in the stance: 1 left, -1 right, 0 in the middle."""
        lateral = self.stand[1]
        return 0.0 if abs(lateral) < _MIDDLE else math.copysign(1.0, lateral)

    @property
    def is_upright(self) -> bool:
        """Whether the first joint's axis is closer to vertical than to horizontal."""
        return bool(abs((self.rotations[0] @ self.axes[0])[2]) > np.sqrt(0.5))

    @property
    def lengths(self) -> tuple[float, float, float]:
        first, second, third = (
            math.hypot(*part.tolist()) for part in (self.offsets[1], self.offsets[2], self.end)
        )
        return first, second, third

    @property
    def stand(self) -> tuple[float, float, float]:
        """Foot in the stance, in the body's frame [m]."""
        return _stand_of(self)

    def foot(self, angles: Sequence[float]) -> tuple[float, float, float]:
        x, y, z = self.ends(np.asarray([angles], dtype=np.float64))[0].tolist()
        return x, y, z

    def ends(self, angles: Floats) -> Floats:
        return np.asarray(self._moved(angles, slopes=False)[0])

    def feet(self, angles: Floats) -> tuple[Floats, Floats]:
        """Return the foot in the body's frame (T, 3) [m] and its derivatives (T, 3, 3) [m]."""
        moved = self._moved(angles, slopes=True)
        return moved[0], np.stack(tuple(moved[:0:-1]), axis=-1)

    def _moved(self, angles: Floats, *, slopes: bool) -> Floats:
        """Return the foot (1, T, 3) [m], followed by its slopes from last joint to first."""
        sines, cosines = np.sin(angles), np.cos(angles)
        moved = np.empty((1 + slopes * len(self.axes), len(angles), 3))
        seen = np.broadcast_to(self.end, moved[:1].shape)
        # From the foot inwards: each joint rotates everything beyond it.
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
    """Rotate vectors (..., T, 3) by angles (T,) about a unit axis (3,): Rodrigues' formula."""
    # Scalar factors: numpy is slow on a last axis of three.
    sine, cosine = (np.repeat(factor, 3).reshape(-1, 3) for factor in (sine, cosine))
    along = (vector @ axis)[..., None] * axis
    turned = cosine * (vector - along)
    turned += along
    turned += sine * _across(axis, vector)
    return turned


def _across(axis: Floats, vector: Floats) -> Floats:
    """Cross product of one vector with many: bit for bit `numpy.cross`, but much faster."""
    x, y, z = axis.tolist()
    a, b, c = vector[..., 0], vector[..., 1], vector[..., 2]
    found = np.empty(vector.shape)
    found[..., 0] = y * c - z * b
    found[..., 1] = z * a - x * c
    found[..., 2] = x * b - y * a
    return found
