"""Backlash (thesis: gearlash), the play between gearhead and link, as symbols.

The thesis calls its absence the model's largest error. The motor side (rotor, gearhead, encoder) is
a second inertia that touches the link at either end of the play through a stiff, damped shaft.
"""

from __future__ import annotations

import casadi as ca

from sim.kernel.spatial import Scalar


def shaft_torque(
    ahead: Scalar, rate: Scalar, play: Scalar, stiffness: float, damping: float
) -> Scalar:
    """Torque of a stiff, damped shaft on the link; it pushes, but never pulls into the play.

    Args:
        ahead: Motor side's angle less the link's [rad].
        rate: Derivative of `ahead` [rad/s].
        play: End to end [rad].
        stiffness: Of the closed play [N m/rad].
        damping: Of the closed play [N m s/rad].

    Returns:
        Torque on the link [N m].
    """
    half = 0.5 * play
    drag = damping * rate
    forward = ca.fmax(stiffness * (ahead - half) + drag, 0.0) * (half < ahead)
    backward = ca.fmin(stiffness * (ahead + half) + drag, 0.0) * (ahead < -half)
    return forward + backward
