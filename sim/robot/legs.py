"""Legs: three revolute joints of a URDF from the body to a foot, and their kinematics."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Final, Protocol

import numpy as np

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.near_names import nearest
from gaitswarm.sim.robot.description import Leg
from gaitswarm.sim.robot.urdf import MOST_TURNED, BodyInertia, Joint, Place, Urdf, product

_NAMED: Final = 6

_MOST_DEGREES: Final = 720.0
"""Larger limits mean a joint without limits; smaller ones may be degrees by mistake."""


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    """Pose of a joint, and inertia of the link beyond it."""

    axis: Floats  # (3,)
    rotation: Floats  # relative to the previous frame, (3, 3)
    offset: Floats  # in the previous frame, (3,) [m]
    inertia: BodyInertia  # of the link beyond the joint


@dataclass(frozen=True, slots=True, eq=False)
class Chain:
    """A leg's joints and its foot."""

    placements: tuple[Placement, ...]  # of the joints, from the body outwards
    foot: Floats  # in the last link's frame, (3,) [m]
    limits: Floats  # least and largest angle of each joint, (3, 2) [rad]


def chain_of(urdf: Urdf, leg: Leg) -> Chain:
    named = {joint.name: joint for joint in urdf.joints}
    before, placements, limits = next(iter(urdf.links)), [], []
    for name in leg.joints:
        joint = named.get(name)
        if joint is None:
            raise RobotFileError(
                f"robot.toml: leg {leg.name!r}: robot.urdf has no joint {name!r}"
                f"{_meant(name, named)}; name the leg's three joints under `joints`"
            )
        if joint.kind != "revolute":
            raise RobotFileError(
                f"robot.urdf: joint {name!r} of leg {leg.name!r} is {joint.kind},"
                " not revolute; a leg needs three revolute joints"
            )
        if joint.follows is not None:
            raise RobotFileError(
                f"robot.urdf: joint {name!r} of a leg mimics joint {joint.follows!r}"
                f" (<mimic>), but legs with coupled joints cannot be simulated; remove <mimic> if"
                " the joint has an actuator of its own"
            )
        parent = urdf.place(joint.parent)
        if parent.body != before:
            raise RobotFileError(
                f"robot.urdf: leg {leg.name!r}: joint {name!r} comes before its parent, or another"
                " movable joint lies between them; list three joints, from the body to the foot"
            )
        placements.append(
            Placement(
                joint.axis,
                product(parent.rotation, joint.origin.matrix()),
                product(parent.rotation, joint.origin.xyz) + parent.position,
                urdf.bodies[joint.child],
            )
        )
        _check_limits(joint)
        limits.append(joint.limits)
        before = joint.child
    foot = _foot(urdf, leg)
    if foot.body != before:
        raise RobotFileError(
            f"robot.toml: leg {leg.name!r}: its `foot` {leg.foot!r} is not on its last link"
            f" {before!r}; name a link or a fixed joint there"
        )
    return Chain(tuple(placements), foot.position, np.array(limits))


def _foot(urdf: Urdf, leg: Leg) -> Place:
    try:
        return urdf.place(leg.foot)
    except RobotFileError as error:
        meant = _meant(leg.foot, urdf.links)
        raise RobotFileError(
            f"robot.toml: leg {leg.name!r}: robot.urdf has no link or fixed joint"
            f" {leg.foot!r}{meant}; name the leg's end under `foot`"
        ) from error


def _meant(name: str, known: Iterable[str]) -> str:
    near = nearest(name, known)
    return f" (did you mean {near!r}?)" if near else ""


def _check_limits(joint: Joint) -> None:
    """Reject limits in degrees; even larger ones mean a joint without limits."""
    if any(MOST_TURNED < abs(limit) <= _MOST_DEGREES for limit in joint.limits):
        lower, upper = joint.limits
        raise RobotFileError(
            f"robot.urdf: joint {joint.name!r}: its limits {lower:g} and {upper:g} seem to be"
            " in degrees; a URDF uses radians (45 degrees are 0.7854); a joint without limits has"
            ' type="continuous"'
        )


def check_owners(legs: tuple[Leg, ...]) -> None:
    owned = [name for leg in legs for name in leg.joints]
    twice = sorted({name for name in owned if owned.count(name) > 1})
    if twice:
        raise RobotFileError(
            f"robot.toml: joint {twice[0]!r} belongs to more than one leg; list it in one"
        )


def check_joints(urdf: Urdf, legs: tuple[Leg, ...]) -> None:
    owned = {name for leg in legs for name in leg.joints}
    others = [joint.name for joint in urdf.joints if not joint.fixed and joint.name not in owned]
    if others:
        more = f" and {len(others) - _NAMED} more" if len(others) > _NAMED else ""
        raise RobotFileError(
            "robot.urdf: these movable joints belong to no leg:"
            f" {', '.join(map(repr, others[:_NAMED]))}{more}; list them under [held_joints] of"
            " robot.toml, each with the angle [rad] at which it is held"
        )


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

    @classmethod
    def of(cls, name: str, chain: Chain, end: Floats, stance: Floats) -> ChainLeg:
        rotations, offsets, axes = (
            np.array([getattr(place, part) for place in chain.placements])
            for part in ("rotation", "offset", "axis")
        )
        return cls(name, rotations, offsets, axes, end, stance, chain.limits)

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
