"""Numbers and frames of URDF elements, and errors that name their line."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final
from xml.etree import ElementTree as ET
from xml.parsers import expat

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.memory import require_room_for_scipy
from gaitswarm.sim.robot.bounds import LARGEST, shortened

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

_PART: Final = re.compile(
    r"""robot\.urdf: (?P<part>(?P<tag>link|joint)\ (?P<name>'(?:[^'\\]|\\.)*'|"(?:[^"\\]|\\.)*"))"""
)
_INNER: Final = re.compile(r"(?P<attribute>\w+)=(?P<value>'[^']*'|\"[^\"]*\") of <(?P<tag>\w+)>")


@contextmanager
def by_line(text: str) -> Iterator[None]:
    """Add line numbers to errors that name a link or a joint of a URDF."""
    try:
        yield
    except RobotFileError as error:
        message = with_line(text, str(error))
        if message == str(error):
            raise
        raise RobotFileError(message) from (error.__cause__ or error)


def with_line(text: str, message: str) -> str:
    """Add the line number to a message that begins with a link or a joint of a URDF."""
    line = _line(text, message)
    if line is None:
        return message
    return message.replace("robot.urdf: ", f"robot.urdf, line {line}: ", 1)


def _line(text: str, message: str) -> int | None:
    """Find the line of the last part with that name, the duplicate of two, or of its attribute."""
    part = _PART.match(message)
    if part is None:
        return None
    inner = _INNER.search(message, part.end())
    depth, inside, line = 0, False, None
    parser = expat.ParserCreate()

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth, inside, line
        depth += 1
        if depth == 2:
            inside = tag == part["tag"] and repr(attributes.get("name", "")) == part["name"]
        found = inside and (
            depth == 2
            or (
                inner is not None
                and tag == inner["tag"]
                and repr(attributes.get(inner["attribute"], "")) == inner["value"]
            )
        )
        if found:
            line = parser.CurrentLineNumber

    def end(_tag: str) -> None:
        nonlocal depth
        depth -= 1

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.Parse(text, True)
    return line


Floats = NDArray[np.float64]

MOST_TURNED: Final = 4.0 * math.pi
"""Largest plausible angle: two turns [rad]. Larger ones are degrees, or mean no limit."""


@dataclass(frozen=True, slots=True, eq=False)
class Origin:
    """Pose of a frame in another one."""

    xyz: Floats  # position, (3,) [m]
    rpy: Floats  # roll, pitch and yaw about the other frame's fixed axes, (3,) [rad]

    def matrix(self) -> Floats:
        """Rotation matrix to the other frame, (3, 3); exact without rotation."""
        return self._rotation().as_matrix() if self.rpy.any() else np.eye(3)

    def quaternion(self) -> Floats:
        """Rotation to the other frame as quaternion x y z w, (4,)."""
        return self._rotation().as_quat()

    def _rotation(self) -> Rotation:
        # Slow to import, and seldom needed.
        require_room_for_scipy()
        from scipy.spatial.transform import Rotation  # noqa: PLC0415

        return Rotation.from_euler("xyz", self.rpy)


def origin_of(element: ET.Element, whose: str) -> Origin:
    origin = element.find("origin")
    if origin is None:
        return Origin(np.zeros(3), np.zeros(3))
    xyz, rpy = (numbers_of(origin, name, whose, "0 0 0") for name in ("xyz", "rpy"))
    if (np.abs(rpy) > MOST_TURNED).any():
        raise RobotFileError(
            f"robot.urdf: {whose}: rpy={shortened(origin.get('rpy', ''))!r} of <origin> seems to be"
            " in degrees; a URDF uses radians: 90 degrees are 1.5708"
        )
    return Origin(xyz, rpy)


def numbers_of(
    element: ET.Element, attribute: str, whose: str, default: str = "", largest: float = LARGEST
) -> Floats:
    """Read an attribute's numbers, (3,) of xyz, rpy and size, else (1,), in URDF's units."""
    text = element.get(attribute, default)
    count = 3 if attribute in ("xyz", "rpy", "size") else 1
    try:
        values = np.array([float(part) for part in text.split()])
    except ValueError:
        values = np.empty(0)
    if len(values) != count or not (np.abs(values) <= largest).all():
        raise RobotFileError(
            f"robot.urdf: {whose}: {attribute}={shortened(text)!r} of <{element.tag}> is not"
            f" {'three numbers' if count == 3 else 'a number'} of {LARGEST:g} at most"
        )
    return values
