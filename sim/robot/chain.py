"""Joint chains of legs in a URDF: three revolute joints from the body to a foot."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.near_names import nearest
from gaitswarm.sim.robot.description import Leg
from gaitswarm.sim.robot.elements import MOST_TURNED, Joint
from gaitswarm.sim.robot.inertia import BodyInertia, product
from gaitswarm.sim.robot.urdf import Place, Urdf

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
