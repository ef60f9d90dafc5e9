"""Ground contact of a point foot, law `linear_zone` (thesis 2.2.6, table 2.6)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from sim.kernel.articulated_body import Force, LinkState
from sim.kernel.spatial import Scalar, Vector, add, cross, dot, scale


@dataclass(frozen=True, slots=True)
class Ground:
    """Parameters of one foot: see `sim.robot.description.Contact`."""

    stiffness: Scalar
    damping: Scalar
    sole: Scalar
    friction: Scalar
    slip_velocity: Scalar


def linear_zone(ca: Any, link: LinkState, foot: Vector, ground: Ground) -> Force:
    """Force of the ground on a link, in the link's frame.

    foot: the tibia's end in the link's frame [m]; the sole's spring hangs below it, along the
    ground's normal. F_z = k p - c dz/dt while the sole touches (eq. 2.13), never pulling;
    F_t = -mu F_z v / max(|v|, v_lin).
    """
    v = add(link.velocity.linear, cross(link.velocity.angular, foot))
    penetration = ground.sole - (link.height + dot(link.up, foot))
    rising = dot(link.up, v)
    elastic = ground.stiffness * penetration - ground.damping * rising
    normal = ca.fmax(elastic, 0.0) * (penetration > 0.0)
    # |v_t|^2 can be rounded below zero at rest; the linear zone's bound covers that.
    slip = ca.sqrt(
        ca.fmax(dot(v, v) - rising * rising, ground.slip_velocity * ground.slip_velocity)
    )
    drag = ground.friction * normal / slip
    force = add(scale(normal + drag * rising, link.up), scale(-drag, v))
    return Force(force, cross(foot, force))
