"""Ground contact of a point foot and its friction laws, as symbols (thesis 2.2.6)"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

import casadi as ca

from gaitswarm.sim.kernel.dynamics.articulated_body import LinkState
from gaitswarm.sim.kernel.dynamics.spatial import (
    Matrix,
    Scalar,
    Vector,
    add,
    cross,
    dot,
    mirrored,
    outer,
    plus,
    scale,
    subtract,
)
from gaitswarm.sim.robot.bounds import ContactLaw

InternalState = tuple[Scalar, ...]
"""State that a law carries for one foot from step to step; empty for most laws."""


@dataclass(frozen=True, slots=True)
class Foot:
    """A foot in its link's frame."""

    at: Vector  # the tibia's end [m]
    up: Vector  # the ground's normal
    # along the ground: the world's x and y axes, on uneven ground turned with it
    ahead: Vector
    left: Vector
    velocity: Vector  # of the tibia's end [m/s]
    rising: Scalar  # part of the velocity along `up` [m/s]
    normal: Scalar  # force of the ground's spring [N]
    touching: Scalar  # 1 on the ground, 0 in the air
    damping: Scalar  # of the normal force, while it is not clamped at zero [N s/m]
    penetration: Scalar  # of the sole into the ground, negative in the air [m]
    mobility: Scalar  # upper bound of the foot's acceleration under a force [1/kg]
    squared_slip: Scalar  # squared speed along the ground, may be rounded below zero [m2/s2]

    def lands_within(self, time: float) -> Scalar:
        """Whether the foot may touch down within a time [s]."""
        return (1.0 - self.touching) * (self.penetration > self.rising * time)

    def sliding(self, drag: Scalar, timestep: Scalar) -> Scalar:
        """Confidence that a foot with this friction per speed still slides after a step [1]."""
        return ca.fmax(1.0 - drag * (timestep * self.mobility), 0.0)

    def resisting(self, sideways: Scalar, further: Scalar = 0.0) -> Matrix:
        """-dF/dv in the link's frame, with the damping along `up`, symmetric [N s/m].

        `sideways` [N s/m] acts along the ground, `further` along the slip, per its square [N
        s3/m3].
        """
        resistance = outer(scale(self.damping - sideways, self.up), self.up)
        even = ((sideways, 0.0, 0.0), (0.0, sideways, 0.0), (0.0, 0.0, sideways))
        resistance = plus(resistance, even)
        if not isinstance(further, float):
            slip = subtract(self.velocity, scale(self.rising, self.up))
            resistance = plus(resistance, outer(scale(further, slip), slip))
        return mirrored(resistance)


@dataclass(frozen=True, slots=True)
class Reaction:
    """Reaction of the ground on a foot, in the link's frame."""

    force: Vector  # on the foot [N]
    resistance: Matrix  # -dF/dv, symmetric [N s/m]
    internal_state: InternalState = ()  # after the step


Friction = Callable[[Foot, Mapping[str, Scalar], InternalState, Scalar], Reaction]
"""A friction law: (foot, ground, internal state, timestep) -> reaction. Its resistance omits how
friction follows the normal force, which is not symmetric."""


def foot_on_ground(
    link: LinkState,
    at: Vector,
    ground: Mapping[str, Scalar],
    mobility: Scalar,
    patch: tuple[Scalar, ...] = (),
) -> Foot:
    """F_z = k p - c dz/dt while the sole touches (eq. 2.13), never pulling.

    The sole's spring extends from the tibia's end, `at` in its frame [m], along the ground's
    normal. `patch` is the tangent plane of uneven ground: height [m] below the tibia's end and
    slopes along the world's x and y.
    """
    velocity = add(link.velocity.linear, cross(link.velocity.angular, at))
    up, ahead, left = link.up, link.ahead, cross(link.up, link.ahead)
    distance = link.height + dot(up, at)
    if patch:
        height, along, across = patch
        run = 1.0 + along * along
        level, shorter = 1.0 / ca.sqrt(run + across * across), 1.0 / ca.sqrt(run)
        tilted = subtract(up, add(scale(along, ahead), scale(across, left)))
        ahead = scale(shorter, add(ahead, scale(along, up)))
        distance, up = level * (distance - height), scale(level, tilted)
        left = cross(up, ahead)
    penetration = ground["sole"] - distance
    rising = dot(up, velocity)
    touching = penetration > 0.0
    elastic = ground["stiffness"] * penetration - ground["damping"] * rising
    return Foot(
        at=at,
        up=up,
        ahead=ahead,
        left=left,
        velocity=velocity,
        rising=rising,
        normal=ca.fmax(elastic, 0.0) * touching,
        touching=touching,
        damping=ground["damping"] * ((elastic > 0.0) * touching),
        penetration=penetration,
        mobility=mobility,
        squared_slip=dot(velocity, velocity) - rising * rising,
    )


def linear_zone(
    foot: Foot, ground: Mapping[str, Scalar], internal_state: InternalState, timestep: Scalar
) -> Reaction:
    """F_t = -mu F_z v / max(|v|, v_lin) (table 2.6)."""
    del internal_state
    zone = ground["slip_velocity"]
    # The bound of the linear zone covers a square below zero.
    squared = foot.squared_slip
    pace = 1.0 / ca.sqrt(ca.fmax(squared, zone * zone))
    limit = ground["friction"] * foot.normal
    drag = limit * pace
    force = add(scale(foot.normal + drag * foot.rising, foot.up), scale(-drag, foot.velocity))
    constant = (squared > zone * zone) * foot.sliding(drag, timestep)
    further = -constant * drag * (pace * pace)
    return Reaction(force, foot.resisting(drag, further))


def karnopp(
    foot: Foot, ground: Mapping[str, Scalar], internal_state: InternalState, timestep: Scalar
) -> Reaction:
    """Full friction against the motion along each axis of the ground, none below v_d (eq. 2.14)."""
    del internal_state, timestep
    threshold, limit = ground["stick_velocity"], ground["friction"] * foot.normal
    force = scale(foot.normal, foot.up)
    for axis in (foot.ahead, foot.left):
        speed = dot(axis, foot.velocity)
        sign = (threshold < speed) - (speed < -threshold)
        force = add(force, scale(-limit * sign, axis))
    return Reaction(force, foot.resisting(0.0))


def stick(
    foot: Foot, ground: Mapping[str, Scalar], internal_state: InternalState, timestep: Scalar
) -> Reaction:
    """Spring and damper along the ground from the touchdown point, saturated at mu F_z."""
    k, c = ground["stick_stiffness"], ground["stick_damping"]
    stretched, pull = [], []
    for axis, elongation in zip((foot.ahead, foot.left), internal_state, strict=True):
        speed = dot(axis, foot.velocity)
        longer = (elongation + timestep * speed) * foot.touching
        stretched.append(longer)
        pull.append(-(k * longer + c * speed))
    limit = ground["friction"] * foot.normal
    squared = pull[0] * pull[0] + pull[1] * pull[1]
    # The bound avoids 0 / 0 for a foot in the air.
    share = limit / ca.sqrt(ca.fmax(ca.fmax(squared, limit * limit), 1e-18))
    force = scale(foot.normal, foot.up)
    for axis, component in zip((foot.ahead, foot.left), pull, strict=True):
        force = add(force, scale(share * component, axis))
    after = tuple(share * longer for longer in stretched)
    return Reaction(force, foot.resisting(share * c * foot.touching), after)


def dead_zone(
    foot: Foot, ground: Mapping[str, Scalar], internal_state: InternalState, timestep: Scalar
) -> Reaction:
    """F_t = -mu F_z min(1, (|v| - v_d) / (v_lin - v_d)) v / |v|, none below v_d (table 2.6)."""
    del internal_state
    threshold = ground["stick_velocity"]
    # Identified speeds may cross: the friction then jumps at v_d.
    width = ca.fmax(ground["slip_velocity"] - threshold, 1e-9)
    squared = foot.squared_slip
    slip = ca.sqrt(ca.fmax(squared, threshold * threshold))
    pace, steepness = 1.0 / slip, 1.0 / width
    share = ca.fmin((slip - threshold) * steepness, 1.0)
    limit = ground["friction"] * foot.normal
    drag = limit * share * pace
    force = add(scale(foot.normal + drag * foot.rising, foot.up), scale(-drag, foot.velocity))
    steep = (squared > threshold * threshold) * (slip < threshold + width)
    slope = limit * steep * steepness - drag
    further = foot.sliding(limit * pace, timestep) * slope * (pace * pace)
    return Reaction(force, foot.resisting(drag, further))


FRICTION: Final[Mapping[ContactLaw, Friction]] = {
    "linear_zone": linear_zone,
    "karnopp": karnopp,
    "stick": stick,
    "dead_zone": dead_zone,
}
