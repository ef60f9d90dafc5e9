"""Chains that are built as a leg, but of which none can be made."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.robot.joints import TURNS, Joint
from gaitswarm.sim.robot.urdf import Urdf

Floats = NDArray[np.float64]

_ALIKE: Final = 0.01
"""Difference of two distances that are meant to be the same, as a share of the chain's length."""

_BY_HAND: Final = "or write robot.toml by hand, as docs/robots.md says, if it is no leg"


def check_look_alikes(urdf: Urdf, legs: Sequence[str]) -> None:
    """Check that no chain of joints is built as a leg is and yet is none.

    A robot with one leg that is held falls, and nothing but its author's mistake makes it so.
    """
    paths = {name: _path(urdf, name) for name in urdf.links}
    of_legs = [paths[link] for link in legs]
    distances = [_distances(path) for path in of_legs]
    on_legs = {joint.name for path in of_legs for joint in path if not joint.fixed}
    for path in paths.values():
        moved = [joint for joint in path if not joint.fixed]
        if not moved or on_legs & {joint.name for joint in moved}:
            continue
        for leg, its in zip(of_legs, distances, strict=True):
            if len(path) == len(leg) and _same(_distances(path), its):
                raise RobotFileError(_difference(path, leg))


def _path(urdf: Urdf, link: str) -> list[Joint]:
    """Joints from the body to a link."""
    carriers = {joint.child: joint for joint in urdf.joints}
    path: list[Joint] = []
    while link in carriers:
        path.insert(0, carriers[link])
        link = carriers[link].parent
    return path


def _distances(path: Sequence[Joint]) -> Floats:
    """Of each joint from the one before, (n,) [m]: the same for legs on any side."""
    return np.array([float(np.linalg.norm(joint.origin.xyz)) for joint in path])


def _same(one: Floats, other: Floats) -> bool:
    return bool((np.abs(one - other) <= _ALIKE * other.sum()).all())


def _difference(path: Sequence[Joint], leg: Sequence[Joint]) -> str:
    first = next(joint for joint in leg if not joint.fixed)
    for joint, its in zip(path, leg, strict=True):
        if joint.kind != its.kind and not (joint.kind in TURNS and its.kind in TURNS):
            return (
                f"robot.urdf: joint {joint.name!r} is {joint.kind}, but its chain is built as the"
                f" leg of joint {first.name!r}, where {its.name!r} is {its.kind}: make it so,"
                f" {_BY_HAND}"
            )
    own = next(joint for joint in path if not joint.fixed)
    return (
        f"robot.urdf: joint {own.name!r} begins a chain that is built as the leg of joint"
        f" {first.name!r}, but has other joints beyond that or does not reach as far down within"
        f" its limits; look at these, and at how it is turned, {_BY_HAND}"
    )
