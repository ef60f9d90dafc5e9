"""Foot curve with a straight support phase and a composite cycloid as swing.

Sakakibara, Kan, Hosoda, Hattori and Fujie, "Foot trajectory for a quadruped walking machine", IROS
1990: zero velocity and acceleration at lift-off and touchdown.
"""

from __future__ import annotations

import numpy as np

from gaitswarm.sim.arrays import Floats


def cycloid(
    phase: Floats, *, stride: float, height: float, duty_factor: float
) -> tuple[Floats, Floats]:
    """Foot position, see `half_ellipse`."""
    supporting = phase < duty_factor
    support = phase / duty_factor
    swing = np.clip((phase - duty_factor) / (1.0 - duty_factor), 0.0, 1.0)
    travelled = swing - np.sin(2.0 * np.pi * swing) / (2.0 * np.pi)
    half = 1.0 - np.abs(1.0 - 2.0 * swing)  # up to 1 in mid-swing
    lifted = half - np.sin(2.0 * np.pi * half) / (2.0 * np.pi)
    forward = np.where(supporting, 0.5 - support, travelled - 0.5) * stride
    return forward, np.where(supporting, 0.0, np.maximum(0.0, lifted)) * height
