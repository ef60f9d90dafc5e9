"""Foot curve of 2011 with a straight support phase and a quadratic spline as swing.

Appendix .2.1, eq. 1-3, with the weights (1-a)^2, 2a(1-a), a^2.
"""

from __future__ import annotations

import numpy as np

from gaitswarm.sim.arrays import Floats


def quadratic_spline(
    phase: Floats, *, stride: float, height: float, duty_factor: float
) -> tuple[Floats, Floats]:
    """Foot position, see `half_ellipse`."""
    supporting = phase < duty_factor
    support = phase / duty_factor
    a = np.clip((phase - duty_factor) / (1.0 - duty_factor), 0.0, 1.0)
    rear, front = (1.0 - a) ** 2, a**2
    forward = np.where(supporting, 0.5 - support, 0.5 * (front - rear)) * stride
    lift = np.where(supporting, 0.0, 2.0 * a * (1.0 - a) * 2.0 * height)
    return forward, lift
