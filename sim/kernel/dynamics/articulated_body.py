"""Articulated-body algorithm of a floating-base robot, as symbols.

Featherstone's algorithm (Rigid Body Dynamics Algorithms, 2008, table 9.4), limb by limb: what a
limb passes to the body, the body's acceleration, and the limb's accelerations that follow. Velocity
terms are carried from the body to the feet first, as in the recursive Newton-Euler algorithm
(ibid., table 5.1); the rest is linear in the accelerations of body and joints. Linear accelerations
are those of points, not spatial ones. Pinocchio is the oracle in the tests.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import casadi as ca

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
    rotation_of,
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


def body_state(q: Sequence[Scalar], v: Sequence[Scalar], gravity: Sequence[Scalar]) -> LinkState:
    """State of the body; gravity is in the world [m/s2]."""
    attitude = rotation_of(q[3:7])
    w, nothing = _triple(v[3:6]), (0.0, 0.0, 0.0)
    return LinkState(
        velocity=Motion(_triple(v[0:3]), w),
        up=attitude[2],
        ahead=attitude[0],
        gravity=apply(transpose(attitude), _triple(gravity)),
        height=q[2],
        bias=Motion(nothing, nothing),
        tensor=angular_acceleration_tensor(w, nothing),
    )


def body_of(p: Mapping[str, Sequence[Scalar]]) -> RigidBody:
    """The body with its load."""
    xx, yy, zz, xy, xz, yz = p["base_inertia"]
    tensor = ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))
    return RigidBody(p["base_mass"][0], _triple(p["base_moment"]), tensor)


def pushed(state: LinkState, push: Sequence[Scalar]) -> Vector:
    """Contribution to the bias force, in the body's frame, of a push along the world's axes [N]."""
    force = add(
        add(scale(push[0], state.ahead), scale(push[1], cross(state.up, state.ahead))),
        scale(push[2], state.up),
    )
    return scale(-1.0, force)


def solved(state: LinkState, inertia: Inertia, force: Force) -> tuple[Motion, Motion]:
    """Acceleration of the body with all limbs: relative to free fall, and in its own axes."""
    falling = free_acceleration(inertia, force)
    v, w = state.velocity.linear, state.velocity.angular
    return falling, Motion(
        subtract(add(falling.linear, state.gravity), cross(w, v)), falling.angular
    )


def body_integrands(
    state: LinkState, acceleration: Motion, timestep: Scalar
) -> tuple[Scalar, Scalar, Scalar]:
    """Squared acceleration [m2/s4], [rad2/s4] and forward speed [m/s] at mid-step."""
    half = 0.5 * timestep
    v = add(state.velocity.linear, scale(half, acceleration.linear))
    w = add(state.velocity.angular, scale(half, acceleration.angular))
    # The twist is in the body's own frame, so the material acceleration adds omega x v.
    linear = add(acceleration.linear, cross(w, v))
    ahead_x, ahead_y = state.ahead[0], cross(state.up, state.ahead)[0]
    world_x, world_y = dot(state.ahead, v), dot(cross(state.up, state.ahead), v)
    forward = (world_x * ahead_x + world_y * ahead_y) / ca.sqrt(
        ahead_x * ahead_x + ahead_y * ahead_y
    )
    return dot(linear, linear), dot(acceleration.angular, acceleration.angular), forward


def body_lean(state: LinkState) -> tuple[Scalar, Scalar]:
    """Absolute tangent of the roll and absolute sine of the pitch against the ground [1]."""
    return ca.fabs(state.up[1] / state.up[2]), ca.fabs(state.up[0])


def drifted(q: Sequence[Scalar], v: Sequence[Scalar], time: Scalar) -> list[Scalar]:
    """Positions after some time [s] at constant velocities."""
    turn = scale(time, _triple(v[3:6]))
    along = scale(time, _triple(v[0:3]))
    bent = add(along, scale(0.5, cross(turn, along)))
    position = add(_triple(q[0:3]), apply(rotation_of(q[3:7]), bent))
    angles = [angle + time * rate for angle, rate in zip(q[7:], v[6:], strict=True)]
    return [*position, *_turned(q[3:7], turn), *angles]


def _turned(quaternion: Sequence[Scalar], turn: Vector) -> list[Scalar]:
    """Quaternion times the exponential of a small rotation vector [rad], renormalised."""
    x, y, z, w = quaternion
    half = scale(0.5, turn)
    square = dot(half, half)
    a, b, c = (component * (1.0 - square * (1.0 / 6.0)) for component in half)
    e = 1.0 - square * (0.5 - square * (1.0 / 24.0))
    product = [
        w * a + x * e + y * c - z * b,
        w * b - x * c + y * e + z * a,
        w * c + x * b - y * a + z * e,
        w * e - x * a - y * b - z * c,
    ]
    length = sum(component * component for component in product)
    correction = 1.5 - 0.5 * length
    return [component * correction for component in product]


def _triple(values: Sequence[Scalar]) -> Vector:
    x, y, z = values
    return x, y, z
