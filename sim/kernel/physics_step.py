"""One physics step of a whole robot as a CasADi function."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache, reduce
from typing import Any, Final

import casadi as ca
import pinocchio as pin

from sim.kernel.articulated_body import (
    Acceleration,
    Link,
    LinkState,
    articulated_body,
    kinematics,
    links_of,
)
from sim.kernel.contact import FRICTION, Foot, InternalState, foot_on_ground
from sim.kernel.gearhead import shaft_torque, static_friction
from sim.kernel.inertia import Inertia, Motion
from sim.kernel.integration import integrated
from sim.kernel.motor import Electrical, electrical
from sim.kernel.parameters import CONTACT_LAWS, Layout, internal_state_size
from sim.kernel.spatial import (
    Matrix,
    Scalar,
    Vector,
    add,
    apply,
    cross,
    dot,
    rotation_of,
    transpose,
    vector,
)
from sim.robot import Robot

INTEGRANDS: Final = (
    "torque",
    "acceleration",
    "angular_acceleration",
    "power",
    "forward_speed",
    "absolute_power",
    "absolute_current",
    "heat",
)
"""Rates that the driver accumulates: squared gear torque sum [N2 m2], squared accelerations
[m2/s4], [rad2/s4], electrical power [W], speed along the heading [m/s]; over the motors, the sums
of the absolute electrical power [W], of the absolute current [A], and of the heat R I^2 [W]."""


@dataclass(frozen=True, slots=True, eq=False)
class PhysicsModel:
    """CasADi functions of one robot.

    Their inputs are q (7+J): position, quaternion x y z w, joint angles; v (6+J): base twist in its
    own frame, joint rates; internal_state (I), as `parameters.internal_state_size` says; duty (J):
    motor voltage per supply voltage; disturbance (J): torque on each link [N m], or, as the
    parameter `displaced` says, angle [rad] by which its gearhead is turned further; parameters (P),
    as `parameters.Layout` says.

    Attributes:
        step: to q, v and internal state after the step, current (J), integrands (8) and largest
            absolute current (1).
        observe: to current (J), voltage (J), load torque (J), foot force in the world (3 L), supply
            (1) and acceleration (6+J) as `pinocchio.aba` gives it.
        layout: of the parameters.
    """

    step: Any
    observe: Any
    layout: Layout


@dataclass(frozen=True, slots=True)
class _Symbols:
    q: list[Scalar]
    v: list[Scalar]
    internal_state: list[Scalar]
    duty: list[Scalar]
    disturbance: list[Scalar]
    p: dict[str, list[Scalar]]
    inputs: tuple[Any, ...]


@dataclass(frozen=True, slots=True)
class _Dynamics:
    """loads: torque that each gearhead passes to its link (J); internal_state: after the step."""

    attitude: Matrix
    electrical: Electrical
    loads: Sequence[Scalar]
    foot_forces: Sequence[Scalar]
    acceleration: Acceleration
    internal_state: Sequence[Scalar]


@lru_cache(maxsize=8)
def physics_model(robot: Robot) -> PhysicsModel:
    """Derive the step from a robot's URDF.

    Args:
        robot: The robot.

    Returns:
        Its functions.

    Raises:
        RobotFileError: The tree is not one that can be simulated.
    """
    model = pin.buildModelFromXML(robot.urdf.text, pin.JointModelFreeFlyer())
    layout = Layout(robot)
    s = _symbols(robot, layout)
    d = _dynamics(robot, model, s)
    rates = [
        *d.acceleration.base.linear,
        *d.acceleration.base.angular,
        *d.acceleration.joints,
    ]
    step = [
        *integrated(s.q, s.v, rates, d.attitude, s.p["timestep"][0]),
        list(d.internal_state),
        list(d.electrical.currents),
        _integrands(robot, s, d),
        [_largest([ca.fabs(current) for current in d.electrical.currents])],
    ]
    observe = [
        list(d.electrical.currents),
        list(d.electrical.voltages),
        list(d.loads),
        list(d.foot_forces),
        [d.electrical.supply],
        rates,
    ]
    return PhysicsModel(
        step=_function("step", s, step),
        observe=_function("observe", s, observe),
        layout=layout,
    )


def _symbols(robot: Robot, layout: Layout) -> _Symbols:
    n = robot.n_joints
    sizes = {
        "q": 7 + n,
        "v": 6 + n,
        "internal_state": internal_state_size(robot),
        "duty": n,
        "disturbance": n,
        "p": layout.size,
    }
    inputs = tuple(ca.SX.sym(name, size) for name, size in sizes.items())
    q, v, internal_state, duty, disturbance, p = ([s[k] for k in range(s.numel())] for s in inputs)
    fields = {name: p[where] for name, where in layout.slices.items()}
    return _Symbols(q, v, internal_state, duty, disturbance, fields, inputs)


def _dynamics(robot: Robot, model: Any, s: _Symbols) -> _Dynamics:
    """Kinematics, then the forces of actuators and ground, then accelerations."""
    links = links_of(model, robot.joint_names)
    attitude = rotation_of(s.q[3:7])
    states, rotations = link_states(links, s.q, s.v, attitude)
    actuation = _actuate(robot, s)
    feet, ground_forces, internal_state = _feet(robot, model, s, states)
    acceleration = articulated_body(
        links,
        base_inertia(s.p),
        states,
        rotations,
        s.v[6:],
        _with_obstacles(actuation.torques, s),
        actuation.armature,
        ground_forces,
        apply(transpose(attitude), _triple(s.p["gravity"])),
    )
    return _Dynamics(
        attitude,
        actuation.electrical,
        # M_L = r K_M I - B omega - J r^2 domega; behind backlash the rotor is not in the joint.
        [
            torque - inertia * joint
            for torque, inertia, joint in zip(
                actuation.torques, actuation.armature, acceleration.joints, strict=True
            )
        ],
        [
            dot(axis, force.linear)
            for foot, force in zip(feet, ground_forces.values(), strict=True)
            for axis in (foot.ahead, foot.left, foot.up)
        ],
        acceleration,
        [*actuation.internal_state, *internal_state],
    )


def link_states(
    links: Sequence[Link],
    q: Sequence[Scalar],
    v: Sequence[Scalar],
    attitude: Matrix,
) -> tuple[list[LinkState], list[Matrix]]:
    """Where every link is and how it moves.

    Args:
        links: Of the robot.
        q: Position, quaternion x y z w, joint angles (7+J).
        v: Base twist in its own frame, joint rates (6+J).
        attitude: Rotation of the base to the world.

    Returns:
        State of every link (the base first), and each joint's rotation to its parent.
    """
    base = LinkState(
        velocity=Motion(_triple(v[0:3]), _triple(v[3:6])),
        up=attitude[2],
        ahead=attitude[0],
        height=q[2],
    )
    sines, cosines = [ca.sin(x) for x in q[7:]], [ca.cos(x) for x in q[7:]]
    return kinematics(links, base, sines, cosines, v[6:])


def base_inertia(p: Mapping[str, Sequence[Scalar]]) -> Inertia:
    """Inertia of the body with its load.

    Args:
        p: Parameters by name, as `parameters.Layout` says.

    Returns:
        In the base's frame.
    """
    xx, yy, zz, xy, xz, yz = p["base_inertia"]
    tensor = ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))
    return Inertia.of_body(p["base_mass"][0], _triple(p["base_moment"]), tensor)


@dataclass(frozen=True, slots=True)
class _Actuation:
    """torques: on each link (J); armature: rotor inertia that turns with the link (J)."""

    electrical: Electrical
    torques: Sequence[Scalar]
    armature: Sequence[float]
    internal_state: Sequence[Scalar]


def _actuate(robot: Robot, s: _Symbols) -> _Actuation:
    n, data = robot.n_joints, robot.actuators()
    rotors = s.internal_state[n : 2 * n] if robot.has_backlash else s.v[6:]
    motors = electrical(
        data,
        s.duty,
        rotors,
        s.p["viscous"],
        s.p["supply_voltage"][0],
        s.p["supply_resistance"][0],
    )
    geared = list(motors.torques)
    for joint, friction in enumerate(s.p["static_friction"]):
        geared[joint] = geared[joint] + static_friction(rotors[joint], friction)
    if not robot.has_backlash:
        torques = [a + b for a, b in zip(geared, s.disturbance, strict=True)]
        return _Actuation(motors, torques, data.armature.tolist(), ())
    displaced = s.p["displaced"][0]
    shafts = [
        shaft_torque(motor - link + displaced * disturbance, rotor - rate, play, stiffness, damping)
        for motor, link, disturbance, rotor, rate, play, stiffness, damping in zip(
            s.internal_state[:n],
            s.q[7:],
            s.disturbance,
            rotors,
            s.v[6:],
            s.p["backlash"],
            data.shaft_stiffness.tolist(),
            data.shaft_damping.tolist(),
            strict=True,
        )
    ]
    dt = s.p["timestep"][0]
    faster = [
        rotor + dt * ((torque - shaft) * (1.0 / inertia))
        for rotor, torque, shaft, inertia in zip(
            rotors, geared, shafts, data.armature.tolist(), strict=True
        )
    ]
    further = [
        angle + dt * rotor for angle, rotor in zip(s.internal_state[:n], faster, strict=True)
    ]
    share = 1.0 - displaced
    torques = [a + share * b for a, b in zip(shafts, s.disturbance, strict=True)]
    return _Actuation(motors, torques, [0.0] * n, [*further, *faster])


def _with_obstacles(torques: Sequence[Scalar], s: _Symbols) -> list[Scalar]:
    """Torques on the links with those of a jammed leg's obstacle, which no gearhead passes on."""
    jams = zip(s.p["jam_stiffness"], s.p["jam_damping"], s.p["jam_angle"], strict=True)
    return [
        torque - (stiffness * (q - angle) + damping * v)
        for torque, q, v, (stiffness, damping, angle) in zip(
            torques, s.q[7:], s.v[6:], jams, strict=True
        )
    ]


def _feet(
    robot: Robot, model: Any, s: _Symbols, states: Sequence[LinkState]
) -> tuple[list[Foot], dict[int, Any], list[Scalar]]:
    """Every foot, the ground's force on its link (by the link's index), internal state."""
    law = CONTACT_LAWS[robot.description.contact_law]
    friction = FRICTION[robot.description.contact_law]
    start = 2 * robot.n_joints if robot.has_backlash else 0
    feet: list[Foot] = []
    forces: dict[int, Any] = {}
    internal_state: list[Scalar] = []
    for n, leg in enumerate(robot.description.legs):
        frame = model.frames[model.getFrameId(leg.foot)]
        index = 1 + robot.joint_names.index(model.names[frame.parentJoint])
        ground = {name: s.p[name][n] for name in law.parameters}
        foot = foot_on_ground(states[index], vector(frame.placement.translation), ground)
        begin = start + n * law.internal_state_size
        before: InternalState = tuple(s.internal_state[begin : begin + law.internal_state_size])
        forces[index], after = friction(foot, ground, before, s.p["timestep"][0])
        feet.append(foot)
        internal_state += after
    return feet, forces, internal_state


def _integrands(robot: Robot, s: _Symbols, d: _Dynamics) -> list[Scalar]:
    """The rates of INTEGRANDS at the state before the step."""
    torque = sum(ca.fabs(load) for load in d.loads)
    v, w = _triple(s.v[0:3]), _triple(s.v[3:6])
    # The base's twist is in its own frame, so the material acceleration adds omega x v.
    linear = add(d.acceleration.base.linear, cross(w, v))
    angular = d.acceleration.base.angular
    currents = d.electrical.currents
    powers = [
        voltage * current for voltage, current in zip(d.electrical.voltages, currents, strict=True)
    ]
    world = apply(d.attitude, v)
    ahead_x, ahead_y = d.attitude[0][0], d.attitude[1][0]
    forward = (world[0] * ahead_x + world[1] * ahead_y) / ca.sqrt(
        ahead_x * ahead_x + ahead_y * ahead_y
    )
    return [
        torque * torque,
        dot(linear, linear),
        dot(angular, angular),
        sum(powers),
        forward,
        sum(ca.fabs(power) for power in powers),
        sum(ca.fabs(current) for current in currents),
        _heat(robot, currents),
    ]


def _heat(robot: Robot, currents: Sequence[Scalar]) -> Scalar:
    """Sum of R I^2; motors of one resistance share a product."""
    squares: dict[float, Scalar] = {}
    for resistance, current in zip(robot.actuators().resistance.tolist(), currents, strict=True):
        squares[resistance] = squares.get(resistance, 0.0) + current * current
    return sum(resistance * square for resistance, square in squares.items())


def _largest(values: Sequence[Scalar]) -> Scalar:
    return reduce(ca.fmax, values)


def _triple(values: Sequence[Scalar]) -> Vector:
    x, y, z = values
    return x, y, z


def _function(name: str, s: _Symbols, outputs: list[list[Scalar]]) -> Any:
    return ca.Function(name, list(s.inputs), [ca.vertcat(*o) for o in outputs], {"cse": True})
