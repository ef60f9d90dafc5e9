"""Articulated-body algorithm of a floating-base robot, as symbols.

Featherstone's algorithm (Rigid Body Dynamics Algorithms, 2008, table 9.4), a limb at a time: what
a limb passes to the body, the body's acceleration, and what that makes of the limb. Spatial
quantities are pairs (linear, angular) in the frame of their own link, as in Pinocchio, which is the
oracle that this is tested against.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from sim.kernel.inertia import Force, Inertia, Motion
from sim.kernel.spatial import (
    Matrix,
    Scalar,
    Vector,
    add,
    apply,
    cross,
    dot,
    multiply,
    rotation_about,
    scale,
    transpose,
)


@dataclass(frozen=True, slots=True)
class Link:
    """One link of a chain and the revolute joint before it.

    Attributes:
        axis: unit axis in the link's frame.
        rotation: to the frame before it, at the joint's angle.
        offset: of the joint in the frame before it [m].
        inertia: in the link's frame.
        rate: of the joint [rad/s].
    """

    axis: Vector
    rotation: Matrix
    offset: Vector
    inertia: Inertia
    rate: Scalar


@dataclass(frozen=True, slots=True)
class LinkState:
    """Where a link is and how it moves: what external forces may depend on.

    Attributes:
        velocity: in the link's frame.
        up: the ground's normal in the link's frame.
        ahead: the world's x axis in the link's frame.
        height: of the link's origin over ground [m].
    """

    velocity: Motion
    up: Vector
    ahead: Vector
    height: Scalar

    def carries(self, link: Link) -> LinkState:
        """State of a link that hangs on this one.

        Args:
            link: The link.

        Returns:
            Its state.
        """
        inverse = transpose(link.rotation)
        v, w = self.velocity.linear, self.velocity.angular
        return LinkState(
            velocity=Motion(
                apply(inverse, add(v, cross(w, link.offset))),
                add(apply(inverse, w), scale(link.rate, link.axis)),
            ),
            up=apply(inverse, self.up),
            ahead=apply(inverse, self.ahead),
            height=self.height + dot(self.up, link.offset),
        )


@dataclass(frozen=True, slots=True)
class Passed:
    """What a joint's acceleration depends on, beside that of the frame before it.

    Attributes:
        column: articulated inertia times the joint's axis.
        pivot: inverse of the inertia about the joint [1/(kg m2)].
        free: acceleration of the joint while the frame before it does not accelerate [rad/s2].
        coriolis: acceleration of the link that comes with its velocity.
    """

    column: Force
    pivot: Scalar
    free: Scalar
    coriolis: Motion


def bias_force(inertia: Inertia, velocity: Motion) -> Force:
    """Force that keeps a body's velocity in its own frame.

    Args:
        inertia: Of the body.
        velocity: In its frame.

    Returns:
        v x* I v.
    """
    momentum = inertia.times(velocity)
    v, w = velocity.linear, velocity.angular
    return Force(
        cross(w, momentum.linear),
        add(cross(v, momentum.linear), cross(w, momentum.angular)),
    )


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
        links: Of the chain, from that frame on.
        states: Of the links.
        torques: At the joints [N m].
        armature: What resists each joint's acceleration beside the links [kg m2].
        resistance: What resists the last link's acceleration beside its inertia.
        external: Force on the last link in its frame.

    Returns:
        Articulated inertia and bias force that the carrying frame feels, and what `outward` needs.
    """
    inertia, force, passed = None, None, []
    for link, state, torque, rotor in reversed(
        list(zip(links, states, torques, armature, strict=True))
    ):
        bias = bias_force(link.inertia, state.velocity)
        if inertia is None or force is None:
            inertia, force = link.inertia.plus(resistance), bias.less(external)
        else:
            inertia, force = link.inertia.plus(inertia), bias.plus(force)
        turning = scale(link.rate, link.axis)
        coriolis = Motion(
            cross(state.velocity.linear, turning),
            cross(state.velocity.angular, turning),
        )
        column = Force(apply(inertia.coupling, link.axis), apply(inertia.angular, link.axis))
        pivot = 1.0 / (dot(link.axis, column.angular) + rotor)
        force = force.plus(inertia.times(coriolis))
        free = pivot * (torque - dot(link.axis, force.angular))
        passed.append(Passed(column, pivot, free, coriolis))
        # What the joint passes on, put together in the frame before it.
        above = column.in_parent(link.rotation, link.offset)
        scaled = Force(scale(pivot, above.linear), scale(pivot, above.angular))
        inertia = inertia.in_parent(link.rotation, link.offset).less_outer(scaled, above)
        driven = Force(scale(free, above.linear), scale(free, above.angular))
        force = force.in_parent(link.rotation, link.offset).plus(driven)
    assert inertia is not None  # noqa: S101 - a chain has links
    assert force is not None  # noqa: S101
    return inertia, force, tuple(reversed(passed))


def outward(links: Sequence[Link], passed: Sequence[Passed], carrier: Motion) -> tuple[Scalar, ...]:
    """Third pass over a chain: accelerations of its joints.

    Args:
        links: As for `inward`.
        passed: By `inward`.
        carrier: Acceleration of the frame that carries the chain, relative to free fall.

    Returns:
        By joint [rad/s2].
    """
    joints = []
    acceleration = carrier
    for link, by in zip(links, passed, strict=True):
        inverse = transpose(link.rotation)
        linear = apply(inverse, add(acceleration.linear, cross(acceleration.angular, link.offset)))
        angular = apply(inverse, acceleration.angular)
        joint = by.free - by.pivot * (
            dot(by.column.linear, linear) + dot(by.column.angular, angular)
        )
        acceleration = Motion(
            add(linear, by.coriolis.linear),
            add(angular, by.coriolis.angular, scale(joint, link.axis)),
        )
        joints.append(joint)
    return tuple(joints)


def rotation_at(rest: Matrix, axis: Vector, sine: Scalar, cosine: Scalar) -> Matrix:
    """Rotation of a link to the frame before it.

    Args:
        rest: At angle zero.
        axis: Constant unit axis.
        sine: Of the angle.
        cosine: Of the angle.

    Returns:
        At the angle.
    """
    return multiply(rest, rotation_about(axis, sine, cosine))


def free_acceleration(inertia: Inertia, force: Force) -> Motion:
    """Motion a with inertia a = -force, by an unrolled LDL^T factorisation.

    Args:
        inertia: Articulated inertia of the whole robot as its body feels it.
        force: Bias force, likewise.

    Returns:
        Acceleration of the body, relative to free fall.
    """
    rows: list[list[Scalar]] = [[*inertia.linear[i], *inertia.coupling[i]] for i in range(3)] + [
        [*transpose(inertia.coupling)[i], *inertia.angular[i]] for i in range(3)
    ]
    n = len(rows)
    lower: list[list[Scalar]] = [[0.0] * n for _ in range(n)]
    pivots: list[Scalar] = []
    inverses: list[Scalar] = []
    for j in range(n):
        pivot = rows[j][j]
        for k in range(j):
            pivot = pivot - lower[j][k] * lower[j][k] * pivots[k]
        pivots.append(pivot)
        inverses.append(1.0 / pivot)
        for i in range(j + 1, n):
            entry = rows[j][i]
            for k in range(j):
                entry = entry - lower[i][k] * lower[j][k] * pivots[k]
            lower[i][j] = entry * inverses[j]
    x = [-value for value in (*force.linear, *force.angular)]
    for i in range(n):
        for k in range(i):
            x[i] = x[i] - lower[i][k] * x[k]
    x = [value * inverse for value, inverse in zip(x, inverses, strict=True)]
    for i in reversed(range(n)):
        for k in range(i + 1, n):
            x[i] = x[i] - lower[k][i] * x[k]
    return Motion((x[0], x[1], x[2]), (x[3], x[4], x[5]))
