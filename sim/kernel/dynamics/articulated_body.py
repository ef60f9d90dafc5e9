"""Articulated-body algorithm of a floating-base robot, as symbols.

Featherstone's algorithm (Rigid Body Dynamics Algorithms, 2008, table 9.4), limb by limb: what a
limb passes to the body, the body's acceleration, and the limb's accelerations that follow. Velocity
terms are carried from the body to the feet first, as in the recursive Newton-Euler algorithm
(ibid., table 5.1); the rest is linear in the accelerations of body and joints. Linear accelerations
are those of points, not spatial ones. Pinocchio is the oracle in the tests.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from gaitswarm.sim.kernel.dynamics.spatial import (
    Force,
    Inertia,
    Matrix,
    Motion,
    RigidBody,
    Rotation,
    Scalar,
    Vector,
    add,
    angular_acceleration_tensor,
    apply,
    cross,
    dot,
    inverse,
    minus,
    mirrored,
    multiply,
    scale,
    subtract,
    transpose,
)


@dataclass(frozen=True, slots=True)
class Link:
    """One link of a chain and the revolute joint before it."""

    axis: Vector  # unit axis in the link's frame
    rotation: Rotation  # to the preceding frame, at the joint's angle
    offset: Vector  # of the joint in the preceding frame [m]
    body: RigidBody
    rate: Scalar  # of the joint [rad/s]


@dataclass(frozen=True, slots=True)
class LinkState:
    """Pose and motion of a link, on which external forces may depend; in the link's frame."""

    velocity: Motion
    up: Vector  # the ground's normal
    ahead: Vector  # the world's x axis
    gravity: Vector  # free-fall acceleration [m/s2]
    height: Scalar  # of the link's origin over ground [m]
    # acceleration of the link's origin, and alpha, while neither the body nor a joint accelerates
    bias: Motion
    tensor: Matrix  # [alpha]x + [omega]x^2 of the bias [1/s2]

    def carries(self, link: Link) -> LinkState:
        """State of a link attached to this one."""
        outwards = link.rotation.outwards
        v, w = self.velocity.linear, self.velocity.angular
        turning = scale(link.rate, link.axis)
        angular = add(outwards(w), turning)
        alpha = add(outwards(self.bias.angular), cross(angular, turning))
        return LinkState(
            velocity=Motion(outwards(add(v, cross(w, link.offset))), angular),
            up=outwards(self.up),
            ahead=outwards(self.ahead),
            gravity=outwards(self.gravity),
            height=self.height + dot(self.up, link.offset),
            bias=Motion(outwards(add(self.bias.linear, apply(self.tensor, link.offset))), alpha),
            tensor=angular_acceleration_tensor(angular, alpha),
        )

    def gain_at(self, point: Vector) -> Vector:
        """Rate of a point's velocity due to the bias, in the link's rotating axes [m/s2]."""
        v, w = self.velocity.linear, self.velocity.angular
        return subtract(add(self.bias.linear, cross(self.bias.angular, point)), cross(w, v))

    def force(self, body: RigidBody) -> Force:
        return body.force(self.velocity.angular, self.bias, self.tensor)


@dataclass(frozen=True, slots=True)
class Passed:
    """Dependence of a joint's acceleration on that of the preceding frame."""

    column: Force  # articulated inertia times the joint's axis, in the preceding frame
    pivot: Scalar  # inverse of the inertia about the joint [1/(kg m2)]
    free: Scalar  # acceleration of the joint while the preceding frame has only its bias [rad/s2]


def inward(
    links: Sequence[Link],
    states: Sequence[LinkState],
    torques: Sequence[Scalar],
    armature: Sequence[Scalar],
    resistance: Inertia,
    external: Force,
) -> tuple[Inertia, Force, tuple[Passed, ...]]:
    """Second pass: from a chain's last link to the frame that carries it."""
    inertia, force, passed = resistance, Force((0.0,) * 3, (0.0,) * 3).less(external), []
    for link, state, torque, rotor in reversed(
        list(zip(links, states, torques, armature, strict=True))
    ):
        inertia = link.body.inertia().plus(inertia)
        force = state.force(link.body).plus(force)
        column = Force(apply(inertia.coupling, link.axis), apply(inertia.angular, link.axis))
        pivot = 1.0 / (dot(link.axis, column.angular) + rotor)
        free = pivot * (torque - dot(link.axis, force.angular))
        # Inertia and force passed on, assembled in the preceding frame.
        above = column.in_parent(link.rotation, link.offset)
        passed.append(Passed(above, pivot, free))
        scaled = Force(scale(pivot, above.linear), scale(pivot, above.angular))
        inertia = inertia.in_parent(link.rotation, link.offset).less_outer(scaled, above)
        driven = Force(scale(free, above.linear), scale(free, above.angular))
        force = force.in_parent(link.rotation, link.offset).plus(driven)
    return inertia, force, tuple(reversed(passed))


def outward(links: Sequence[Link], passed: Sequence[Passed], carrier: Motion) -> tuple[Scalar, ...]:
    """Third pass: accelerations of a chain's joints [rad/s2]."""
    joints = []
    acceleration = carrier
    for link, by in zip(links, passed, strict=True):
        linear, angular = acceleration.linear, acceleration.angular
        joint = by.free - by.pivot * (
            dot(by.column.linear, linear) + dot(by.column.angular, angular)
        )
        outwards = link.rotation.outwards
        acceleration = Motion(
            outwards(add(linear, cross(angular, link.offset))),
            add(outwards(angular), scale(joint, link.axis)),
        )
        joints.append(joint)
    return tuple(joints)


def free_acceleration(inertia: Inertia, force: Force) -> Motion:
    """Solve inertia a = -force by blocks; the angular part comes from a Schur complement."""
    light = inverse(inertia.linear)
    ratio = multiply(light, inertia.coupling)
    coupled = transpose(inertia.coupling)
    about_centre = mirrored(minus(inertia.angular, multiply(coupled, ratio)))
    pushed = apply(light, force.linear)
    moment = subtract(apply(coupled, pushed), force.angular)
    angular = apply(inverse(about_centre), moment)
    x, y, z = add(pushed, apply(ratio, angular))
    return Motion((-x, -y, -z), angular)
