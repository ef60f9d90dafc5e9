"""The robot's body in a physics step, as symbols: before and after its limbs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import casadi as ca

from gaitswarm.sim.kernel.dynamics.articulated_body import LinkState, free_acceleration
from gaitswarm.sim.kernel.dynamics.spatial import (
    Force,
    Inertia,
    Motion,
    RigidBody,
    Scalar,
    Vector,
    add,
    angular_acceleration_tensor,
    apply,
    cross,
    dot,
    rotation_of,
    scale,
    subtract,
    transpose,
)

Scalars = tuple[Scalar, ...]


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
