"""Backlash (thesis: gearlash), the play between gearhead and link, as symbols.

The thesis calls its absence the model's largest error. The motor side (rotor, gearhead, encoder) is
a second inertia that touches the link at either end of the play through a stiff, damped shaft.
"""

from __future__ import annotations

from typing import Any

from sim.kernel.spatial import Scalar


def shaft_torque(
    ca: Any, ahead: Scalar, rate: Scalar, play: Scalar, stiffness: float, damping: float
) -> Scalar:
    """Torque [N m] on the link.

    ahead: motor side's angle less the link's [rad], rate: its derivative [rad/s], play: end to
    end [rad]. It never pulls the link back into the play.
    """
    half = 0.5 * play
    drag = damping * rate
    forward = ca.fmax(stiffness * (ahead - half) + drag, 0.0) * (half < ahead)
    backward = ca.fmin(stiffness * (ahead + half) + drag, 0.0) * (ahead < -half)
    return forward + backward
