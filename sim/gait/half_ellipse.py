"""Foot curve with a straight support phase and a half-ellipse as swing (3.1.4, fig. 4.1)."""

from __future__ import annotations

import numpy as np

from gaitswarm.sim.arrays import Floats


def half_ellipse(
    phase: Floats, *, stride: float, height: float, duty_factor: float
) -> tuple[Floats, Floats]:
    """Forward distance and lift [m] at phases (...); duty_factor is support's share [1]."""
    supporting = phase < duty_factor
    support = phase / duty_factor
    swing = np.pi * (phase - duty_factor) / (1.0 - duty_factor)
    forward = np.where(supporting, 0.5 - support, -0.5 * np.cos(swing)) * stride
    lift = np.where(supporting, 0.0, np.sin(swing)) * height
    return forward, lift
