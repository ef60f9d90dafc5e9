"""Which axes of a URDF point up and ahead, where these are not z and x."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.proposal.xml_text import fixed_joint, with_elements
from gaitswarm.sim.robot.legs import ChainLeg
from gaitswarm.sim.robot.urdf import Urdf

Floats = NDArray[np.float64]

Axis = Literal["x", "y", "z", "-x", "-y", "-z"]
"""Of the frame of a URDF's first link."""

AXES: Final[tuple[Axis, ...]] = get_args(Axis)

_ROOT: Final = "robot_frame"
"""Link that is added before the first one of a URDF that is turned."""

_FLAT: Final = 3.0
"""Hips lie in a plane whose spread across it is that much less than their spread along z."""

_HANGS: Final = 0.1
"""Mean place of a foot over all angles, as a share of the leg's length, from which on it speaks for
the side that feet are on."""

_SIDEWAYS: Final = 1.5
"""Legs stand or swing that much more the one way than the other, if they speak for a side."""


@dataclass(frozen=True, slots=True)
class Frame:
    """Axes of a URDF's first link."""

    up: Axis | None = None  # that which points up; None for z, if the legs do not speak against it
    forward: Axis | None = None  # that which points ahead, at right angles to it; None for x

    @property
    def right_angled(self) -> bool:
        """Whether the two axes are not along the same line."""
        return (self.up or "z")[-1] != (self.forward or "x")[-1]


AS_IT_IS: Final = Frame()
"""Nothing is known of it but what legs speak for."""


def turned(urdf: str, root: str, links: Sequence[str], frame: Frame, level: float = 0.0) -> str:
    """A URDF with z up and x ahead: a first link is added whose frame has them so.

    Args:
        level: Of the new origin above the first link's [m].
    """
    up, ahead = _vector(frame.up or "z"), _vector(frame.forward or "x")
    turn = np.array([ahead, np.cross(up, ahead), up])
    if (turn == np.eye(3)).all() and level == 0.0:
        return urdf
    name = next(n for n in (_ROOT, *(f"{_ROOT}{k}" for k in range(len(links)))) if n not in links)
    rpy = " ".join(map(repr, _roll_pitch_yaw(turn)))
    joint = fixed_joint(f"{name}_fixed", name, root, f"0 0 {-level!r}", rpy)
    return with_elements(urdf, [f'  <link name="{name}"/>', *joint])


def check_upright(urdf: Urdf, hips: Floats, feet: Floats) -> None:
    """Check that z can point up: hips lie about level, and feet are below more than above.

    Args:
        hips: Of the legs, (n_legs, 3) [m].
        feet: From each hip, the mean over all angles of the joints, in units of the leg's length,
            (n_legs, 3).
    """
    spread, mean = np.ptp(hips, axis=0), feet.mean(axis=0)
    across = int(spread.argmin())
    level = len(hips) <= 2 or spread[2] <= _FLAT * spread[across]
    if level and mean[2] <= _HANGS:
        return
    axis = 2 if level else across
    seen = ("" if mean[axis] < 0.0 else "-") + "xyz"[axis]
    why = "feet reach above the hips" if level else f"hips lie in a plane across {'xyz'[axis]}"
    raise RobotFileError(
        f"robot.urdf: link {next(iter(urdf.links))!r}: {seen} points up in its frame, it seems, as"
        f" {why}; z must: name the axis that does as `up` (`--up={seen}`), or z if it does"
    )


def sideways(legs: Sequence[ChainLeg], stance: Sequence[Sequence[float]]) -> bool:
    """Whether a robot seems to face y, as its feet stand ahead of its hips and behind them.

    Legs that hang swing about their knees' axes, ahead; legs whose hips turn about an upright axis
    stand beside the body. Legs all round speak for nothing.

    Args:
        stance: Angles of each leg's joints [rad].
    """
    beside, ahead = 0.0, 0.0
    for leg, angles in zip(legs, stance, strict=True):
        if leg.is_upright:
            mounted = [float(np.clip(0.0, *leg.limits[0])), *angles[1:]]
            x, y = np.abs(np.array(leg.foot(mounted)) - leg.hip)[:2]
        else:
            _, slopes = leg.feet(np.array([angles]))
            y, x = np.abs(slopes[0, :2, 2])
        beside, ahead = beside + y, ahead + x
    return bool(ahead > _SIDEWAYS * beside)


def _vector(axis: Axis) -> Floats:
    vector = np.zeros(3)
    vector["xyz".index(axis[-1])] = -1.0 if axis.startswith("-") else 1.0
    return vector


def _roll_pitch_yaw(turn: Floats) -> tuple[float, float, float]:
    """About fixed axes, of a rotation by right angles, (3, 3) [rad]."""
    if turn[2, 0] == 0.0:
        return math.atan2(turn[2, 1], turn[2, 2]), 0.0, math.atan2(turn[1, 0], turn[0, 0])
    pitch = math.copysign(math.pi / 2.0, -turn[2, 0])
    return math.atan2(math.copysign(1.0, pitch) * turn[0, 1], turn[1, 1]), pitch, 0.0
