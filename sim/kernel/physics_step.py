"""One physics step of a whole robot as a CasADi function."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Final

import numpy as np

from sim.kernel.articulated_body import (
    BASE,
    Acceleration,
    Force,
    Inertia,
    Link,
    LinkState,
    Motion,
    articulated_body,
    kinematics,
    links_of,
)
from sim.kernel.contact import Ground, linear_zone
from sim.kernel.drive import Electrical, electrical
from sim.kernel.parameters import BodyInertia, Layout
from sim.kernel.spatial import (
    Matrix,
    Scalar,
    Vector,
    add,
    apply,
    cross,
    dot,
    multiply,
    rotation_of,
    transpose,
    vector,
)
from sim.robot import Robot

TERMS: Final = ("torque", "acceleration", "angular_acceleration", "power", "forward_speed")
"""Rates that the driver accumulates: squared gear torque sum [N2 m2], squared accelerations
[m2/s4], [rad2/s4], electrical power [W], speed along the heading [m/s]."""


@dataclass(frozen=True, slots=True, eq=False)
class PhysicsModel:
    """CasADi functions of one robot, and the body's own inertia.

    step: (q, v, duty, p) -> (q', v', current, terms); observe: (q, v, duty, p) ->
    (current (J), voltage (J), load torque (J), foot force (3 L) in the world, supply (1),
    acceleration (6+J) as `pinocchio.aba` gives it).
    q (7+J): position, quaternion x y z w, joint angles; v (6+J): base twist in its own frame,
    joint rates; duty (J): motor voltage per supply voltage; p: see `parameters.Layout`.
    """

    step: Any
    observe: Any
    body: BodyInertia
    total_mass: float
    layout: Layout


@dataclass(frozen=True, slots=True)
class _Symbols:
    q: list[Scalar]
    v: list[Scalar]
    duty: list[Scalar]
    p: dict[str, list[Scalar]]
    inputs: tuple[Any, ...]


@dataclass(frozen=True, slots=True)
class _Dynamics:
    attitude: Matrix
    electrical: Electrical
    feet: dict[int, Force]
    axes: list[Matrix]
    acceleration: Acceleration


@lru_cache(maxsize=8)
def physics_model(robot: Robot) -> PhysicsModel:
    """Derive the step from the robot's URDF. Imports CasADi and Pinocchio, hence slow to begin."""
    import casadi as ca  # noqa: PLC0415
    import pinocchio as pin  # noqa: PLC0415

    model = pin.buildModelFromXML(robot.urdf, pin.JointModelFreeFlyer())
    layout = Layout(robot.n_joints, len(robot.legs))
    s = _symbols(ca, robot.n_joints, layout)
    dynamics = _dynamics(ca, robot, model, s)
    step = [*_integrate(s, dynamics), *_measures(ca, robot, s, dynamics)]
    observe = _observations(robot, dynamics)
    own = model.inertias[BASE]
    return PhysicsModel(
        step=_function(ca, "step", s, step),
        observe=_function(ca, "observe", s, observe),
        body=BodyInertia(float(own.mass), np.array(own.lever), np.array(own.inertia)),
        total_mass=float(pin.computeTotalMass(model)),
        layout=layout,
    )


def _symbols(ca: Any, n_joints: int, layout: Layout) -> _Symbols:
    inputs = (
        ca.SX.sym("q", 7 + n_joints),
        ca.SX.sym("v", 6 + n_joints),
        ca.SX.sym("duty", n_joints),
        ca.SX.sym("p", layout.size),
    )
    q, v, duty, p = ([x[k] for k in range(x.numel())] for x in inputs)
    fields = {name: p[where] for name, where in layout.slices.items()}
    return _Symbols(q, v, duty, fields, inputs)


def _dynamics(ca: Any, robot: Robot, model: Any, s: _Symbols) -> _Dynamics:
    links = links_of(model, robot.joint_names)
    attitude = rotation_of(s.q[3:7])
    rates = s.v[6:]
    base = LinkState(
        velocity=Motion(_triple(s.v[0:3]), _triple(s.v[3:6])), up=attitude[2], height=s.q[2]
    )
    angles = s.q[7:]
    states, rotations = kinematics(
        links, base, [ca.sin(x) for x in angles], [ca.cos(x) for x in angles], rates
    )
    drive = robot.drives()
    motors = electrical(
        drive, s.duty, rates, s.p["viscous"], s.p["supply_voltage"][0], s.p["supply_resistance"][0]
    )
    feet, axes = {}, []
    for n, leg in enumerate(robot.description.legs):
        frame = model.frames[model.getFrameId(leg.foot)]
        index = 1 + robot.joint_names.index(model.names[frame.parentJoint])
        ground = Ground(
            *(
                s.p[name][n]
                for name in ("stiffness", "damping", "sole", "friction", "slip_velocity")
            )
        )
        feet[index] = linear_zone(ca, states[index], vector(frame.placement.translation), ground)
        axes.append(_to_world(attitude, index, links, rotations))
    xx, yy, zz, xy, xz, yz = s.p["base_inertia"]
    acceleration = articulated_body(
        links,
        Inertia.of_body(
            s.p["base_mass"][0],
            _triple(s.p["base_moment"]),
            ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz)),
        ),
        states,
        rotations,
        rates,
        motors.torques,
        drive.armature.tolist(),
        feet,
        _to_body(attitude, _triple(s.p["gravity"])),
    )
    return _Dynamics(attitude, motors, feet, axes, acceleration)


def _integrate(s: _Symbols, d: _Dynamics) -> list[list[Scalar]]:
    """Semi-implicit Euler: velocities first, then positions with the new velocities."""
    dt = s.p["timestep"][0]
    rates = [*d.acceleration.base.linear, *d.acceleration.base.angular, *d.acceleration.joints]
    v = [old + dt * rate for old, rate in zip(s.v, rates, strict=True)]
    position = add(_triple(s.q[0:3]), apply(d.attitude, _triple([dt * x for x in v[0:3]])))
    quaternion = _turned(s.q[3:7], [dt * x for x in v[3:6]])
    joints = [angle + dt * rate for angle, rate in zip(s.q[7:], v[6:], strict=True)]
    return [[*position, *quaternion, *joints], v]


def _turned(quaternion: Sequence[Scalar], turn: Sequence[Scalar]) -> list[Scalar]:
    """Quaternion times the exponential of a small turn vector [rad], renormalised.

    Series in the squared angle (2e-3 rad at 10 rad/s) exact to rounding; one Newton step
    towards unit length instead of a square root.
    """
    x, y, z, w = quaternion
    half = [0.5 * component for component in turn]
    square = dot(_triple(half), _triple(half))
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


def _measures(ca: Any, robot: Robot, s: _Symbols, d: _Dynamics) -> list[list[Scalar]]:
    """Currents, and the rates of TERMS at the state before the step."""
    loads = _load_torques(robot.drives().armature.tolist(), d)
    torque = sum(ca.fabs(load) for load in loads)
    v, w = _triple(s.v[0:3]), _triple(s.v[3:6])
    # The base's twist is in its own frame, so the material acceleration adds omega x v.
    linear = add(d.acceleration.base.linear, cross(w, v))
    angular = d.acceleration.base.angular
    power = sum(
        voltage * current
        for voltage, current in zip(d.electrical.voltages, d.electrical.currents, strict=True)
    )
    world = apply(d.attitude, v)
    ahead_x, ahead_y = d.attitude[0][0], d.attitude[1][0]
    forward = (world[0] * ahead_x + world[1] * ahead_y) / ca.sqrt(
        ahead_x * ahead_x + ahead_y * ahead_y
    )
    terms = [torque * torque, dot(linear, linear), dot(angular, angular), power, forward]
    return [list(d.electrical.currents), terms]


def _observations(robot: Robot, d: _Dynamics) -> list[list[Scalar]]:
    forces = [
        component
        for axes, force in zip(d.axes, d.feet.values(), strict=True)
        for component in apply(axes, force.linear)
    ]
    base = d.acceleration.base
    return [
        list(d.electrical.currents),
        list(d.electrical.voltages),
        _load_torques(robot.drives().armature.tolist(), d),
        forces,
        [d.electrical.supply],
        [*base.linear, *base.angular, *d.acceleration.joints],
    ]


def _load_torques(armature: Sequence[float], d: _Dynamics) -> list[Scalar]:
    """M_L = r K_M I - B omega - J r^2 domega: what the gearhead passes on to the link."""
    return [
        torque - inertia * joint
        for torque, inertia, joint in zip(
            d.electrical.torques, armature, d.acceleration.joints, strict=True
        )
    ]


def _to_world(
    attitude: Matrix, index: int, links: Sequence[Link], rotations: Sequence[Matrix]
) -> Matrix:
    chain = rotations[index - 1]
    parent = links[index - 1].parent
    while parent:
        chain = multiply(rotations[parent - 1], chain)
        parent = links[parent - 1].parent
    return multiply(attitude, chain)


def _to_body(attitude: Matrix, world: Vector) -> Vector:
    return apply(transpose(attitude), world)


def _triple(values: Sequence[Scalar]) -> Vector:
    x, y, z = values
    return x, y, z


def _function(ca: Any, name: str, s: _Symbols, outputs: list[list[Scalar]]) -> Any:
    return ca.Function(name, list(s.inputs), [ca.vertcat(*o) for o in outputs], {"cse": True})
