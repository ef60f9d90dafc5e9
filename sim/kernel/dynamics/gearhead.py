"""Gearheads as symbols: backlash (thesis: gearlash) and static friction.

The thesis calls their absence the model's largest errors. With backlash the motor side (rotor,
gearhead, encoder) is a second inertia that touches the link at either end of the play through a
stiff, damped shaft.
"""

from __future__ import annotations

import casadi as ca

from gaitswarm.sim.kernel.dynamics.spatial import Scalar
from gaitswarm.sim.kernel.parameters import STATIC_FRICTION_RATE


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


def static_friction(rate: Scalar, friction: Scalar) -> Scalar:
    """Torque against the motion, whatever its speed; linear in a narrow zone, so it never drives.

    Args:
        rate: Of the gearhead's output, at the joint [rad/s].
        friction: From `STATIC_FRICTION_RATE` on [N m].

    Returns:
        Torque [N m].
    """
    return -friction * ca.fmin(ca.fmax(rate * (1.0 / STATIC_FRICTION_RATE), -1.0), 1.0)


def static_friction_slope(rate: Scalar, friction: Scalar) -> Scalar:
    """How `static_friction` grows with the rate, where it does.

    Args:
        rate: Of the gearhead's output, at the joint [rad/s].
        friction: From `STATIC_FRICTION_RATE` on [N m].

    Returns:
        -d torque / d rate [N m s/rad].
    """
    return friction * (ca.fabs(rate) < STATIC_FRICTION_RATE) * (1.0 / STATIC_FRICTION_RATE)
