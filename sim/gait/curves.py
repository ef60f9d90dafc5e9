"""Foot curves: a straight support phase at constant speed, and swings of several shapes."""

from __future__ import annotations

from typing import Final

import numpy as np

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.scenario import CurveName


def foot_curve(
    curve: CurveName, phase: Floats, *, stride: float, height: float, duty_factor: float
) -> tuple[Floats, Floats]:
    """Forward distance and lift [m] at phases (...); duty_factor is support's share [1]."""
    supporting = phase < duty_factor
    forward, lift = _SWINGS[curve](phase - duty_factor, 1.0 - duty_factor)
    forward = np.where(supporting, 0.5 - phase / duty_factor, forward) * stride
    return forward, np.where(supporting, 0.0, lift) * height


def _half_ellipse(time: Floats, duration: float) -> tuple[Floats, Floats]:
    """Thesis 3.1.4, fig. 4.1."""
    angle = np.pi * time / duration
    return -0.5 * np.cos(angle), np.sin(angle)


def _quadratic_spline(time: Floats, duration: float) -> tuple[Floats, Floats]:
    """Curve of 2011: appendix .2.1, eq. 1-3, with the weights (1-a)^2, 2a(1-a), a^2."""
    a = np.clip(time / duration, 0.0, 1.0)
    return 0.5 * (a**2 - (1.0 - a) ** 2), 2.0 * a * (1.0 - a) * 2.0


def _cycloid(time: Floats, duration: float) -> tuple[Floats, Floats]:
    """Composite cycloid, with zero velocity and acceleration at lift-off and touchdown.

    Sakakibara, Kan, Hosoda, Hattori and Fujie, "Foot trajectory for a quadruped walking machine",
    IROS 1990.
    """
    swing = np.clip(time / duration, 0.0, 1.0)
    half = 1.0 - np.abs(1.0 - 2.0 * swing)  # up to 1 in mid-swing
    travelled, lifted = (x - np.sin(2.0 * np.pi * x) / (2.0 * np.pi) for x in (swing, half))
    return travelled - 0.5, np.maximum(0.0, lifted)


_SWINGS: Final = {
    "half_ellipse": _half_ellipse,
    "quadratic_spline": _quadratic_spline,
    "cycloid": _cycloid,
}
