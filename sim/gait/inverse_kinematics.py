"""Joint angles that put a foot where it is wanted (thesis appendix, eq. 4, misprints mended)."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class LinkLengths(Protocol):
    """What the solution depends on of a leg."""

    @property
    def coxa(self) -> float:
        """[m]."""

    @property
    def femur(self) -> float:
        """[m]."""

    @property
    def tibia(self) -> float:
        """[m]."""


def leg_angles(
    leg: LinkLengths, forward: Floats, lateral: Floats, vertical: Floats
) -> tuple[Floats, Floats]:
    """Knee-up solution for a tibia end relative to the coxa axis.

    Args:
        leg: Lengths of the leg.
        forward: (T,) [m].
        lateral: Outward, (T,) [m].
        vertical: Upward, (T,) [m].

    Returns:
        Angles (T, 3) [rad] (coxa forward, femur up, tibia up), and the miss (T,) [m] by which the
        target lies outside the leg's reach, 0 inside; angles of a missed target point towards it.
    """
    alpha = np.arctan2(forward, lateral)
    outward = np.hypot(forward, lateral) - leg.coxa
    distance = np.hypot(outward, vertical)
    longest, shortest = leg.femur + leg.tibia, abs(leg.femur - leg.tibia)
    miss = np.maximum(0.0, np.maximum(distance - longest, shortest - distance))
    # Cosine rule; the clip keeps a missed target's angles finite.
    cos_knee = (distance**2 - leg.femur**2 - leg.tibia**2) / (2.0 * leg.femur * leg.tibia)
    theta2 = -np.arccos(np.clip(cos_knee, -1.0, 1.0))
    theta1 = np.arctan2(vertical, outward) - np.arctan2(
        leg.tibia * np.sin(theta2), leg.femur + leg.tibia * np.cos(theta2)
    )
    return np.stack([alpha, theta1, theta2], axis=-1), miss
