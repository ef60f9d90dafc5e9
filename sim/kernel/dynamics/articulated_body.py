"""Articulated-body algorithm of a floating-base robot, as symbols.

Featherstone's algorithm (Rigid Body Dynamics Algorithms, 2008, table 9.4), a limb at a time: what
a limb passes to the body, the body's acceleration, and what that makes of the limb. What velocities
do to accelerations is carried from the body to the feet first, as in the recursive Newton-Euler
algorithm (ibid., table 5.1); what remains is linear in the accelerations of body and joints.
Spatial quantities are pairs (linear, angular) in the frame of their own link, as in Pinocchio,
which is the oracle that this is tested against; linear accelerations are those of points, though,
not what they seem to be in a moving frame.
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
    """One link of a chain and the revolute joint before it.

    Attributes:
        axis: unit axis in the link's frame.
        rotation: to the frame before it, at the joint's angle.
        offset: of the joint in the frame before it [m].
        body: in the link's frame.
        rate: of the joint [rad/s].
    """

    axis: Vector
    rotation: Rotation
    offset: Vector
    body: RigidBody
    rate: Scalar


@dataclass(frozen=True, slots=True)
class LinkState:
    """Where a link is and how it moves: what external forces may depend on.

    Attributes:
        velocity: in the link's frame.
        up: the ground's normal in the link's frame.
        ahead: the world's x axis in the link's frame.
        gravity: that of free fall, in the link's frame [m/s2].
        height: of the link's origin over ground [m].
        bias: acceleration of the link's origin, and alpha, while neither the body nor a joint
            accelerates.
        tensor: likewise [alpha]x + [omega]x^2: times a point's place in the link it is what the
            point's acceleration has beside the origin's [1/s2].
    """

    velocity: Motion
    up: Vector
    ahead: Vector
    gravity: Vector
    height: Scalar
    bias: Motion
    tensor: Matrix

    def carries(self, link: Link) -> LinkState:
        """State of a link that hangs on this one."""
        own = link.rotation.outwards
        v, w = self.velocity.linear, self.velocity.angular
        turning = scale(link.rate, link.axis)
        angular = add(own(w), turning)
        alpha = add(own(self.bias.angular), cross(angular, turning))
        return LinkState(
            velocity=Motion(own(add(v, cross(w, link.offset))), angular),
            up=own(self.up),
            ahead=own(self.ahead),
            gravity=own(self.gravity),
            height=self.height + dot(self.up, link.offset),
            bias=Motion(own(add(self.bias.linear, apply(self.tensor, link.offset))), alpha),
            tensor=angular_acceleration_tensor(angular, alpha),
        )

    def gain_at(self, point: Vector) -> Vector:
        """What the bias adds to a point's velocity as the link itself sees it.

        Args:
            point: In the link's frame [m].

        Returns:
            In the axes of the link, which turn with it [m/s2].
        """
        v, w = self.velocity.linear, self.velocity.angular
        return subtract(add(self.bias.linear, cross(self.bias.angular, point)), cross(w, v))

    def force(self, body: RigidBody) -> Force:
        """Force that the bias takes."""
        return body.force(self.velocity.angular, self.bias, self.tensor)


@dataclass(frozen=True, slots=True)
class Passed:
    """What a joint's acceleration depends on, beside that of the frame before it.

    Attributes:
        column: articulated inertia times the joint's axis, in the frame before it.
        pivot: inverse of the inertia about the joint [1/(kg m2)].
        free: acceleration of the joint while the frame before it has its bias only [rad/s2].
    """

    column: Force
    pivot: Scalar
    free: Scalar


def inward(
    links: Sequence[Link],
    states: Sequence[LinkState],
    torques: Sequence[Scalar],
    armature: Sequence[Scalar],
    resistance: Inertia,
    external: Force,
) -> tuple[Inertia, Force, tuple[Passed, ...]]:
    """Second pass over a chain: from its last link to the frame that carries it.

    Args:
        torques: At the joints [N m].
        armature: What resists each joint's acceleration beside the links [kg m2].
    """
    inertia, force, passed = resistance, Force((0.0,) * 3, (0.0,) * 3).less(external), []
    for link, state, torque, rotor in reversed(
        list(zip(links, states, torques, armature, strict=True))
    ):
        inertia = link.body.inertia().plus(inertia)
        force = state.force(link.body).plus(force)
        column = Force(apply(inertia.coupling, link.axis), apply(inertia.angular, link.axis))
        pivot = 1.0 / (dot(link.axis, column.angular) + rotor)
        free = pivot * (torque - dot(link.axis, force.angular))
        # What the joint passes on, put together in the frame before it.
        above = column.in_parent(link.rotation, link.offset)
        passed.append(Passed(above, pivot, free))
        scaled = Force(scale(pivot, above.linear), scale(pivot, above.angular))
        inertia = inertia.in_parent(link.rotation, link.offset).less_outer(scaled, above)
        driven = Force(scale(free, above.linear), scale(free, above.angular))
        force = force.in_parent(link.rotation, link.offset).plus(driven)
    return inertia, force, tuple(reversed(passed))


def outward(links: Sequence[Link], passed: Sequence[Passed], carrier: Motion) -> tuple[Scalar, ...]:
    """Third pass over a chain: accelerations of its joints.

    Returns:
        By joint [rad/s2].
    """
    joints = []
    acceleration = carrier
    for link, by in zip(links, passed, strict=True):
        linear, angular = acceleration.linear, acceleration.angular
        joint = by.free - by.pivot * (
            dot(by.column.linear, linear) + dot(by.column.angular, angular)
        )
        own = link.rotation.outwards
        acceleration = Motion(
            own(add(linear, cross(angular, link.offset))),
            add(own(angular), scale(joint, link.axis)),
        )
        joints.append(joint)
    return tuple(joints)


def free_acceleration(inertia: Inertia, force: Force) -> Motion:
    """Motion a with inertia a = -force, by blocks: the angular part from a Schur complement."""
    light = inverse(inertia.linear)
    ratio = multiply(light, inertia.coupling)
    coupled = transpose(inertia.coupling)
    about_centre = mirrored(minus(inertia.angular, multiply(coupled, ratio)))
    pushed = apply(light, force.linear)
    moment = subtract(apply(coupled, pushed), force.angular)
    angular = apply(inverse(about_centre), moment)
    x, y, z = add(pushed, apply(ratio, angular))
    return Motion((-x, -y, -z), angular)
