"""One limb in a physics step, as symbols.

A step is the kick of a leapfrog: it changes velocities at fixed positions. Forces that depend on
velocity are taken at the step's middle by one linearly implicit equation, whose matrix is the
articulated inertia with half a step's damping added (implicit midpoint rule; Hairer and Wanner,
Solving Ordinary Differential Equations II, 1996, IV.7).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from typing import Final

import casadi as ca

from gaitswarm.sim.controllers.fixed_point import CONTROL_PERIOD
from gaitswarm.sim.kernel.dynamics.articulated_body import Link, LinkState, Passed, inward, outward
from gaitswarm.sim.kernel.dynamics.contact import FRICTION, foot_on_ground
from gaitswarm.sim.kernel.dynamics.drives import (
    Drive,
    at_middle,
    drive_of,
    friction_of,
    shaft_torque,
)
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
    apply,
    cross,
    dot,
    rotation_of,
    scale,
    subtract,
)
from gaitswarm.sim.kernel.parameters import CONTACT_LAWS
from gaitswarm.sim.robot.bounds import ContactLaw
from gaitswarm.sim.robot.limbs import Limb

Scalars = tuple[Scalar, ...]

LANDING_HORIZON: Final = 1.25 * CONTROL_PERIOD
"""Look-ahead for touchdowns [s]: from a control tick's last step to the end of the next one."""


@dataclass(frozen=True, slots=True)
class Environment:
    """State common to all limbs in a step."""

    timestep: Scalar  # [s]
    supply: Scalar  # voltage of the battery under load [V]
    displaced: Scalar = 0.0  # 1 if disturbances are angles, else 0; with backlash only


@dataclass(frozen=True, slots=True)
class LimbState:
    """Joints and motors of a limb before a step, by joint."""

    angles: Scalars  # of the links [rad]
    rates: Scalars  # of the links [rad/s]
    duty: Scalars  # motor voltage per supply voltage, or commanded torque per torque limit [1]
    disturbance: Scalars  # torque on the link [N m], or angle [rad]
    motor_angles: Scalars = ()  # with backlash [rad]
    motor_rates: Scalars = ()  # with backlash [rad/s]
    springs: Scalars = ()  # torques of dry friction's springs [N m]
    loads: Scalars = ()  # torques passed to the links in the step before, with dry friction [N m]
    carried: Scalars = ()  # internal state of the foot's contact law
    patch: Scalars = ()  # uneven ground under the foot, see `foot_on_ground`


@dataclass(frozen=True, slots=True)
class Held:
    """Values of a limb that are kept between `before` and `after`."""

    sines: Scalars  # of the rotations about the joints' axes
    cosines: Scalars  # of the same
    passed: tuple[Passed, ...]
    drives: tuple[Drive, ...]
    armature: Scalars  # of the rotors, with half a step's damping [kg m2]
    landing: Scalar  # 1 if the foot may touch down within `LANDING_HORIZON`, else 0
    # squared speed of the foot along the ground that it touches, 0 in the air [m2/s2]
    squared_slip: Scalar
    height: Scalar  # of the sole above the ground [m]
    # passed by the gearheads to the links, before the step; without backlash including the torque
    # that accelerates the rotors [N m]
    torques: Scalars
    spins: Scalars = ()  # accelerations of rotors behind backlash [rad/s2]


@dataclass(frozen=True, slots=True)
class Before:
    """Results for a limb before the body's acceleration is known."""

    inertia: Inertia  # articulated, in the body's frame
    force: Force  # of the bias, in the body's frame
    held: Held
    motor_rates: Scalars  # after the step, with backlash
    springs: Scalars  # after the step, with dry friction
    carried: Scalars  # after the step
    foot_force: Vector  # before the step, along the world's x, y, z [N]


@dataclass(frozen=True, slots=True)
class After:
    """Results for a limb after the body's acceleration is known."""

    accelerations: Scalars  # of the joints [rad/s2]
    rates: Scalars  # of the joints after the step [rad/s]
    currents: Scalars  # of the motors, at the step's middle [A]
    loads: Scalars  # torques passed by the gearheads to the links, at the step's middle [N m]
    # sums over the limb's motors at the step's middle: |load| [N m], electrical power [W], its
    # absolute value [W], |current| [A], heat [W]; slip of the foot [m/s]; then the largest
    # |current| [A] and |load| [N m], 1 if the foot may touch down within `LANDING_HORIZON`, else 0,
    # and the height of the sole [m]
    tallies: Scalars


def before(
    limb: Limb,
    law: ContactLaw,
    base: LinkState,
    state: LimbState,
    environment: Environment,
    p: Mapping[str, Scalars],
) -> Before:
    """Compute the inertia and force that the limb passes to the body, from the body's state."""
    half = 0.5 * environment.timestep
    sines, cosines = turns(limb, state.angles)
    links = links_of(limb, sines, cosines, state.rates)
    states = []
    for link in links:
        base = base.carries(link)
        states.append(base)
    drives = _drives(limb, state, environment, p)
    if state.motor_angles:
        shafts, spins = _behind_backlash(limb, state, drives, environment, p)
        share = 1.0 - environment.displaced
        torques = [a + share * b for a, b in zip(shafts, state.disturbance, strict=True)]
        armature: list[Scalar] = [0.0] * len(links)
    else:
        spins = ()
        torques = [d.torque + more for d, more in zip(drives, state.disturbance, strict=True)]
        armature = [j.armature + half * d.damping for j, d in zip(limb.joints, drives, strict=True)]
    gear_torques, rotors = tuple(torques), tuple(armature)
    for k, (angle, rate) in enumerate(zip(state.angles, state.rates, strict=True)):
        obstacle = p["jam_stiffness"][k] * (angle - p["jam_angle"][k]) + p["jam_damping"][k] * rate
        torques[k] = torques[k] - obstacle
        armature[k] = armature[k] + half * p["jam_damping"][k]
    ground = {name: p[name][0] for name in CONTACT_LAWS[law].parameters}
    foot = foot_on_ground(states[-1], limb.foot, ground, limb.mobility, state.patch)
    reaction = FRICTION[law](foot, ground, state.carried, environment.timestep)
    resistance = _scaled(half, reaction.resistance)
    # Accelerations are relative to free fall until the end; the foot's resistance is not. A damper
    # keeps its direction in the axes of the tibia.
    gain = add(states[-1].gain_at(limb.foot), states[-1].gravity)
    push = subtract(reaction.force, apply(resistance, gain))
    inertia, force, passed = inward(
        links,
        states,
        [joint.sign * torque for joint, torque in zip(limb.joints, torques, strict=True)],
        armature,
        Inertia.at_point(limb.foot, resistance),
        Force(push, cross(limb.foot, push)),
    )
    dt, tibia = environment.timestep, states[-1]
    return Before(
        inertia,
        force,
        Held(
            sines,
            cosines,
            passed,
            drives,
            rotors,
            foot.lands_within(LANDING_HORIZON),
            foot.touching * ca.fmax(foot.squared_slip, 0.0),
            -foot.penetration,
            gear_torques,
            spins,
        ),
        tuple(rate + dt * spin for rate, spin in zip(state.motor_rates, spins, strict=True)),
        tuple(drive.spring for drive in drives if state.springs),
        reaction.internal_state,
        (
            dot(tibia.ahead, reaction.force),
            dot(cross(tibia.up, tibia.ahead), reaction.force),
            dot(tibia.up, reaction.force),
        ),
    )


def after(limb: Limb, held: Held, carrier: Motion, rates: Scalars, timestep: Scalar) -> After:
    """Compute the limb's accelerations from the body's; rates are those before the step."""
    half = 0.5 * timestep
    links = links_of(limb, held.sines, held.cosines, rates)
    turned = outward(links, held.passed, carrier)
    accelerations = tuple(j.sign * a for j, a in zip(limb.joints, turned, strict=True))
    voltages, currents, loads = [], [], []
    for k, (joint, drive) in enumerate(zip(limb.joints, held.drives, strict=True)):
        spin = held.spins[k] if held.spins else accelerations[k]
        voltage, current = at_middle(joint, drive, half * spin)
        voltages.append(voltage)
        currents.append(current)
        if held.spins:
            loads.append(held.torques[k])
        else:
            # M_L = r K_M I - B omega - J r^2 domega.
            loads.append(held.torques[k] - held.armature[k] * spin)
    powers = [voltage * current for voltage, current in zip(voltages, currents, strict=True)]
    sizes = [ca.fabs(current) for current in currents]
    strains = [ca.fabs(load) for load in loads]
    heat = sum(j.resistance * (c * c) for j, c in zip(limb.joints, currents, strict=True))
    return After(
        accelerations,
        tuple(rate + timestep * a for rate, a in zip(rates, accelerations, strict=True)),
        tuple(currents),
        tuple(loads),
        (
            sum(strains),
            sum(powers),
            sum(ca.fabs(power) for power in powers),
            sum(sizes),
            heat,
            ca.sqrt(held.squared_slip),
            reduce(ca.fmax, sizes),
            reduce(ca.fmax, strains),
            held.landing,
            held.height,
        ),
    )


def place(limb: Limb, q: Sequence[Scalar], angles: Sequence[Scalar]) -> Scalars:
    """Foot, then knee (the tibia's joint) in the world, x, y, z each [m], for a body at q (7)."""
    foot, knee = limb.foot, (0.0, 0.0, 0.0)
    links = links_of(limb, *turns(limb, angles), [0.0] * len(limb.joints))
    for link in reversed(links):
        foot = add(link.offset, link.rotation.inwards(foot))
        knee = link.offset if link is links[-1] else add(link.offset, link.rotation.inwards(knee))
    attitude, at = rotation_of(q[3:7]), (q[0], q[1], q[2])
    return (*add(at, apply(attitude, foot)), *add(at, apply(attitude, knee)))


def turns(limb: Limb, angles: Sequence[Scalar]) -> tuple[Scalars, Scalars]:
    """Sines and cosines of the rotations about the joints' axes."""
    sines = tuple(j.sign * ca.sin(angle) for j, angle in zip(limb.joints, angles, strict=True))
    return sines, tuple(ca.cos(angle) for angle in angles)


def links_of(limb: Limb, sines: Scalars, cosines: Scalars, rates: Sequence[Scalar]) -> list[Link]:
    links = []
    for j, sine, cosine, rate in zip(limb.joints, sines, cosines, rates, strict=True):
        xx, yy, zz, xy, xz, yz = j.angular
        body = RigidBody(j.mass, j.moment, ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz)))
        rotation = Rotation(j.rotation, j.axis, sine, cosine)
        links.append(Link(j.axis, rotation, j.offset, body, j.sign * rate))
    return links


def _drives(
    limb: Limb, state: LimbState, environment: Environment, p: Mapping[str, Scalars]
) -> tuple[Drive, ...]:
    rates = state.motor_rates or state.rates
    return tuple(
        drive_of(
            joint,
            duty,
            rate,
            environment.supply,
            friction_of(k, p, state.springs, state.loads, environment.timestep),
        )
        for k, (joint, duty, rate) in enumerate(zip(limb.joints, state.duty, rates, strict=True))
    )


def _behind_backlash(
    limb: Limb,
    state: LimbState,
    drives: tuple[Drive, ...],
    environment: Environment,
    p: Mapping[str, Scalars],
) -> tuple[Scalars, Scalars]:
    """Torques of the shafts, and accelerations of the rotors."""
    half = 0.5 * environment.timestep
    shafts, spins = [], []
    for k, (joint, drive) in enumerate(zip(limb.joints, drives, strict=True)):
        ahead = state.motor_angles[k] - state.angles[k]
        ahead = ahead + environment.displaced * state.disturbance[k]
        shaft = shaft_torque(
            ahead,
            state.motor_rates[k] - state.rates[k],
            p["backlash"][k],
            joint.shaft_stiffness,
            joint.shaft_damping,
        )
        shafts.append(shaft)
        spins.append((drive.torque - shaft) / (joint.armature + half * drive.damping))
    return tuple(shafts), tuple(spins)


def _scaled(factor: Scalar, m: Matrix) -> Matrix:
    return scale(factor, m[0]), scale(factor, m[1]), scale(factor, m[2])
