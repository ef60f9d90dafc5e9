"""Axes of a URDF that point up and ahead, if these are not z and x, and elements added to it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal, get_args
from xml.parsers import expat
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.robot.legs import ChainLeg
from gaitswarm.sim.robot.urdf import Urdf


def fixed_joint(name: str, parent: str, child: str, xyz: str, rpy: str = "0 0 0") -> list[str]:
    """Return a fixed joint, with the child's position [m] and rotation [rad] in the parent."""
    return [
        f'  <joint name={quoteattr(name)} type="fixed">',
        f"    <parent link={quoteattr(parent)}/>",
        f"    <child link={quoteattr(child)}/>",
        f'    <origin xyz="{xyz}" rpy="{rpy}"/>',
        "  </joint>",
    ]


def with_elements(urdf: str, lines: Sequence[str]) -> str:
    """Add elements at the end of a URDF, so that all other lines keep their numbers."""
    # Offsets count UTF-8 bytes, whatever encoding the text declares.
    content, end = urdf.encode(), 0
    parser = expat.ParserCreate("utf-8")

    def closed(_tag: str) -> None:
        nonlocal end
        end = parser.CurrentByteIndex

    parser.EndElementHandler = closed
    parser.Parse(content, True)
    added = "".join(f"{line}\n" for line in ("", *lines))
    return (content[:end] + added.encode() + content[end:]).decode()


Floats = NDArray[np.float64]

Axis = Literal["x", "y", "z", "-x", "-y", "-z"]
"""Axis of the frame of a URDF's first link."""

AXES: Final[tuple[Axis, ...]] = get_args(Axis)

_ROOT: Final = "robot_frame"
"""Name of the first link that is added to a rotated URDF."""

_FLAT: Final = 3.0
"""How much less hips spread across their plane than along z."""

_HANGS: Final = 0.1
"""Mean position of a foot over all angles, relative to the leg's length, beyond which it indicates
the side that feet are on."""

_SIDEWAYS: Final = 1.5
"""How much farther legs that indicate a direction stand, swing or lie apart along it."""


@dataclass(frozen=True, slots=True)
class Frame:
    """Directions of a URDF's first link."""

    up: Axis | None = None  # None: z, unless the legs contradict it
    forward: Axis | None = None  # at right angles to `up`; None: x

    @property
    def right_angled(self) -> bool:
        return (self.up or "z")[-1] != (self.forward or "x")[-1]


AS_IT_IS: Final = Frame()
"""Unknown directions, to be inferred from the legs."""


def turned(urdf: str, root: str, links: Sequence[str], frame: Frame, level: float = 0.0) -> str:
    """Add a first link to a URDF that has z up and x ahead, its origin `level` higher [m]."""
    up, ahead = _vector(frame.up or "z"), _vector(frame.forward or "x")
    turn = np.array([ahead, np.cross(up, ahead), up])
    if (turn == np.eye(3)).all() and level == 0.0:
        return urdf
    name = next(n for n in (_ROOT, *(f"{_ROOT}{k}" for k in range(len(links)))) if n not in links)
    rpy = " ".join(map(repr, _roll_pitch_yaw(turn)))
    joint = fixed_joint(f"{name}_fixed", name, root, f"0 0 {-level!r}", rpy)
    return with_elements(urdf, [f'  <link name="{name}"/>', *joint])


def check_upright(urdf: Urdf, hips: Floats, feet: Floats) -> None:
    """Check that z can point up: hips are about level, and feet more below than above them.

    `hips` are (n_legs, 3) [m]; `feet` are means over all joint angles, relative to the hip in units
    of the leg's length, (n_legs, 3).
    """
    spread, mean = np.ptp(hips, axis=0), feet.mean(axis=0)
    across = int(spread.argmin())
    level = len(hips) <= 2 or spread[2] <= _FLAT * spread[across]
    if level and mean[2] <= _HANGS:
        return
    axis = 2 if level else across
    seen = ("" if mean[axis] < 0.0 else "-") + "xyz"[axis]
    why = (
        "feet reach above the hips"
        if level
        else f"the hips' plane is perpendicular to {'xyz'[axis]}"
    )
    raise RobotFileError(
        f"robot.urdf: link {next(iter(urdf.links))!r}: {seen} seems to point up in its frame, as"
        f" {why}; set `up` to the axis that does (`--up={seen}`), or to z"
    )


def sideways(legs: Sequence[ChainLeg], stance: Sequence[Sequence[float]]) -> bool:
    """Infer that a robot faces y, from feet ahead of and behind their hips in the stance [rad].

    Legs that turn about z and point along a body's length are believed.
    """
    length, width = np.ptp([leg.hip[:2] for leg in legs], axis=0)
    if length > _SIDEWAYS * width and all(leg.is_upright for leg in legs):
        return False
    sideways, ahead = 0.0, 0.0
    for leg, angles in zip(legs, stance, strict=True):
        if leg.is_upright:
            mounted = [float(np.clip(0.0, *leg.limits[0])), *angles[1:]]
            x, y = np.abs(np.array(leg.foot(mounted)) - leg.hip)[:2]
        else:
            _, slopes = leg.feet(np.array([angles]))
            y, x = np.abs(slopes[0, :2, 2])
        sideways, ahead = sideways + y, ahead + x
    return bool(ahead > _SIDEWAYS * sideways)


def _vector(axis: Axis) -> Floats:
    vector = np.zeros(3)
    vector["xyz".index(axis[-1])] = -1.0 if axis.startswith("-") else 1.0
    return vector


def _roll_pitch_yaw(turn: Floats) -> tuple[float, float, float]:
    """Angles about fixed axes of a rotation by right angles, (3, 3) [rad]."""
    if turn[2, 0] == 0.0:
        return math.atan2(turn[2, 1], turn[2, 2]), 0.0, math.atan2(turn[1, 0], turn[0, 0])
    pitch = math.copysign(math.pi / 2.0, -turn[2, 0])
    return math.atan2(math.copysign(1.0, pitch) * turn[0, 1], turn[1, 1]), pitch, 0.0
