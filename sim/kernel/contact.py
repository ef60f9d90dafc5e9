"""Ground contact of a point foot and its laws of friction, as symbols (thesis 2.2.6).

What a law reads and carries from step to step, as data: `sim.kernel.parameters.CONTACT_LAWS`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

import casadi as ca

from sim.kernel.articulated_body import LinkState
from sim.kernel.inertia import Force
from sim.kernel.spatial import Scalar, Vector, add, cross, dot, scale
from sim.robot.description import ContactLaw

InternalState = tuple[Scalar, ...]
"""What a law carries of one foot from step to step; for most laws nothing."""


@dataclass(frozen=True, slots=True)
class Foot:
    """A foot in its link's frame.

    Attributes:
        at: the tibia's end [m].
        up: the ground's normal.
        ahead: the world's x axis.
        left: the world's y axis.
        velocity: of the tibia's end [m/s].
        rising: part of the velocity along `up` [m/s].
        normal: force of the ground's spring [N].
        touching: 1 on the ground, 0 in the air.
    """

    at: Vector
    up: Vector
    ahead: Vector
    left: Vector
    velocity: Vector
    rising: Scalar
    normal: Scalar
    touching: Scalar

    def on_link(self, force: Vector) -> Force:
        """A force at the foot as a spatial force on its link.

        Args:
            force: In the link's frame [N].

        Returns:
            The same about the link's origin.
        """
        return Force(force, cross(self.at, force))


Friction = Callable[
    [Foot, Mapping[str, Scalar], InternalState, Scalar], tuple[Force, InternalState]
]
"""A law of friction: (foot, ground, internal state, timestep) -> (force on the link, internal state
after the step)."""


def foot_on_ground(link: LinkState, at: Vector, ground: Mapping[str, Scalar]) -> Foot:
    """F_z = k p - c dz/dt while the sole touches (eq. 2.13), never pulling.

    The sole's spring hangs below the tibia's end along the ground's normal.

    Args:
        link: State of the tibia.
        at: The tibia's end in its frame [m].
        ground: Parameters of the foot by the names of `sim.robot.description.Contact`.

    Returns:
        The foot.
    """
    velocity = add(link.velocity.linear, cross(link.velocity.angular, at))
    penetration = ground["sole"] - (link.height + dot(link.up, at))
    rising = dot(link.up, velocity)
    touching = penetration > 0.0
    elastic = ground["stiffness"] * penetration - ground["damping"] * rising
    return Foot(
        at=at,
        up=link.up,
        ahead=link.ahead,
        left=cross(link.up, link.ahead),
        velocity=velocity,
        rising=rising,
        normal=ca.fmax(elastic, 0.0) * touching,
        touching=touching,
    )


def linear_zone(
    foot: Foot, ground: Mapping[str, Scalar], internal_state: InternalState, timestep: Scalar
) -> tuple[Force, InternalState]:
    """F_t = -mu F_z v / max(|v|, v_lin) (table 2.6).

    Args:
        foot: The foot.
        ground: Its `friction` and `slip_velocity`.
        internal_state: Nothing.
        timestep: Not needed.

    Returns:
        Force on the link; nothing.
    """
    del internal_state, timestep
    zone = ground["slip_velocity"]
    # |v_t|^2 can be rounded below zero at rest; the linear zone's bound covers that.
    squared = dot(foot.velocity, foot.velocity) - foot.rising * foot.rising
    slip = ca.sqrt(ca.fmax(squared, zone * zone))
    drag = ground["friction"] * foot.normal / slip
    force = add(scale(foot.normal + drag * foot.rising, foot.up), scale(-drag, foot.velocity))
    return foot.on_link(force), ()


def karnopp(
    foot: Foot, ground: Mapping[str, Scalar], internal_state: InternalState, timestep: Scalar
) -> tuple[Force, InternalState]:
    """Full friction against the motion along each axis of the ground, none below v_d (eq. 2.14).

    Args:
        foot: The foot.
        ground: Its `friction` and `stick_velocity`.
        internal_state: Nothing.
        timestep: Not needed.

    Returns:
        Force on the link; nothing.
    """
    del internal_state, timestep
    threshold, limit = ground["stick_velocity"], ground["friction"] * foot.normal
    force = scale(foot.normal, foot.up)
    for axis in (foot.ahead, foot.left):
        speed = dot(axis, foot.velocity)
        sign = (threshold < speed) - (speed < -threshold)
        force = add(force, scale(-limit * sign, axis))
    return foot.on_link(force), ()


def stick(
    foot: Foot, ground: Mapping[str, Scalar], internal_state: InternalState, timestep: Scalar
) -> tuple[Force, InternalState]:
    """Spring and damper along the ground from where the foot came down, saturated at mu F_z.

    Args:
        foot: The foot.
        ground: Its `friction`, `stick_stiffness` and `stick_damping`.
        internal_state: The spring's elongation along the world's x and y [m].
        timestep: Of the physics [s].

    Returns:
        Force on the link; the elongation after the step, which shrinks when the foot slips, and is
        gone when it lifts off.
    """
    k, c = ground["stick_stiffness"], ground["stick_damping"]
    stretched, wanted = [], []
    for axis, elongation in zip((foot.ahead, foot.left), internal_state, strict=True):
        speed = dot(axis, foot.velocity)
        longer = (elongation + timestep * speed) * foot.touching
        stretched.append(longer)
        wanted.append(-(k * longer + c * speed))
    limit = ground["friction"] * foot.normal
    squared = wanted[0] * wanted[0] + wanted[1] * wanted[1]
    # A foot in the air wants nothing and may have nothing: the bound keeps 0 / 0 away.
    share = limit / ca.sqrt(ca.fmax(ca.fmax(squared, limit * limit), 1e-18))
    force = scale(foot.normal, foot.up)
    for axis, component in zip((foot.ahead, foot.left), wanted, strict=True):
        force = add(force, scale(share * component, axis))
    return foot.on_link(force), tuple(share * longer for longer in stretched)


def dead_zone(
    foot: Foot, ground: Mapping[str, Scalar], internal_state: InternalState, timestep: Scalar
) -> tuple[Force, InternalState]:
    """F_t = -mu F_z min(1, (|v| - v_d) / (v_lin - v_d)) v / |v|, none below v_d (table 2.6).

    Args:
        foot: The foot.
        ground: Its `friction`, `stick_velocity` v_d and `slip_velocity` v_lin.
        internal_state: Nothing.
        timestep: Not needed.

    Returns:
        Force on the link; nothing.
    """
    del internal_state, timestep
    threshold = ground["stick_velocity"]
    # Identified speeds may cross: the friction then jumps at v_d.
    width = ca.fmax(ground["slip_velocity"] - threshold, 1e-9)
    squared = dot(foot.velocity, foot.velocity) - foot.rising * foot.rising
    slip = ca.sqrt(ca.fmax(squared, threshold * threshold))
    share = ca.fmin((slip - threshold) / width, 1.0)
    drag = ground["friction"] * foot.normal * share / slip
    force = add(scale(foot.normal + drag * foot.rising, foot.up), scale(-drag, foot.velocity))
    return foot.on_link(force), ()


FRICTION: Final[Mapping[ContactLaw, Friction]] = MappingProxyType(
    {"linear_zone": linear_zone, "karnopp": karnopp, "stick": stick, "dead_zone": dead_zone}
)
"""By name."""
