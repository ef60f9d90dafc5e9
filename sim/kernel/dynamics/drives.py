"""Drives of the joints in a physics step, as symbols: DC motors or torque-controlled actuators.

With backlash (thesis: gearlash) the motor side (rotor, gearhead, encoder) is a second inertia that
touches the link at either end of the play through a stiff, damped shaft.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import casadi as ca

from gaitswarm.sim.kernel.dynamics.electrical import supply_voltage
from gaitswarm.sim.kernel.dynamics.spatial import Scalar
from gaitswarm.sim.kernel.parameters import DRY_FRICTION, HOLDING_FREQUENCY
from gaitswarm.sim.robot.limbs import LimbJoint, is_torque_controlled


def shaft_torque(
    ahead: Scalar, rate: Scalar, play: Scalar, stiffness: float, damping: float
) -> Scalar:
    """Torque of a stiff, damped shaft on the link [N m], which never pulls into the play [rad]."""
    half = 0.5 * play
    drag = damping * rate
    forward = ca.fmax(stiffness * (ahead - half) + drag, 0.0) * (half < ahead)
    backward = ca.fmin(stiffness * (ahead + half) + drag, 0.0) * (ahead < -half)
    return forward + backward


@dataclass(frozen=True, slots=True)
class Drive:
    """A motor with its gearhead in a step."""

    voltage: Scalar  # [V]
    current: Scalar  # before the step [A]
    torque: Scalar  # behind the gearhead's friction, before the step [N m]
    damping: Scalar  # -d torque / d rate [N m s/rad]
    spring: Scalar  # torque of dry friction's spring after the step [N m]


@dataclass(frozen=True, slots=True)
class TorqueDrive(Drive):
    """The drive of a torque-controlled actuator."""

    # by which its torque falls as its rate grows, where the speed limits it; else 0 [N m s/rad]
    drop: Scalar


@dataclass(frozen=True, slots=True)
class DryFriction:
    """Dry friction of a gear that holds its load at rest.

    Below its limit it is a spring with a damper, so that a loaded joint comes to rest; at the limit
    it slips. Spring and damper are in proportion to the rotor's inertia, so that a step resolves
    them whatever the gear carries. The limit is that of Duclusaud et al., Extended Friction Models
    for the Physics Simulation of Servo Actuators (2025), M6, also with Hess and Soom's curve of
    Stribeck (1990).
    """

    p: Mapping[str, Scalar]  # of `DRY_FRICTION`; the directional fields only if there are any
    spring: Scalar  # torque of the spring before the step [N m]
    load: Scalar  # torque passed to the link in the step before [N m]

    def limit(self, torque: Scalar, rate: Scalar) -> Scalar:
        """Largest friction [N m] of a motor with a torque [N m] at the joint's rate [rad/s]."""
        p, load = self.p, self.load
        square, knee = rate * rate, p["stribeck_speed"] * p["stribeck_speed"]
        slow, share = knee / (knee + square), p["load_friction"]
        if "stribeck_exponent" not in p:
            return (
                p["coulomb_friction"]
                + p["stribeck_friction"] * slow
                + share * ca.fabs(torque + load)
            )
        exponent = p["stribeck_exponent"]
        exponential = ca.exp(-((ca.fabs(rate) / p["stribeck_speed"]) ** exponent))
        slow = slow + (exponent > 0.0) * (exponential - slow)
        from_motor = (share + p["motor_load_friction"]) * torque
        at_rest = p["stribeck_motor_load"] * torque + p["stribeck_link_load"] * load
        motor, link = torque * torque, load * load
        driving = link < motor
        squares = p["motor_load_square"] * motor
        squares = squares + driving * (p["link_load_square"] * link - squares)
        return (
            p["coulomb_friction"]
            + ca.fabs(from_motor + (share + p["link_load_friction"]) * load)
            + slow * (p["stribeck_friction"] + ca.fabs(at_rest) + (torque * load > 0.0) * squares)
        )


@dataclass(frozen=True, slots=True)
class Friction:
    """Friction of a joint and its gears."""

    viscous: Scalar  # [N m s/rad]
    dry: DryFriction | None
    timestep: Scalar  # [s]

    def behind(
        self, joint: LimbJoint, torque: Scalar, damping: Scalar, rate: Scalar
    ) -> tuple[Scalar, Scalar, Scalar]:
        """Torque behind the friction, its damping, and the torque of the spring after the step."""
        dry, inertia = self.dry, joint.armature
        behind, damped = torque - self.viscous * rate, damping + self.viscous
        if dry is None:
            return behind, damped, 0.0
        limit = dry.limit(torque, rate)
        stretched = dry.spring + (HOLDING_FREQUENCY**2 * inertia) * (self.timestep * rate)
        spring = ca.fmin(ca.fmax(stretched, -limit), limit)
        # Not linearly implicit, so that friction stays within its limit over the whole step.
        pull = spring + (2.0 * HOLDING_FREQUENCY * inertia) * rate
        return behind - ca.fmin(ca.fmax(pull, -limit), limit), damped, spring


def friction_of(
    joint: int,
    p: Mapping[str, Sequence[Scalar]],
    springs: Sequence[Scalar],
    loads: Sequence[Scalar],
    timestep: Scalar,
) -> Friction:
    dry = None
    if springs:
        numbers = {name: p[name][joint] for name in DRY_FRICTION if p[name]}
        dry = DryFriction(numbers, springs[joint], loads[joint])
    return Friction(p["viscous"][joint], dry, timestep)


def drive_of(
    joint: LimbJoint, duty: Scalar, rate: Scalar, supply: Scalar, friction: Friction
) -> Drive:
    """The drive of a joint at the beginning of a step, with the motor's rate at the joint."""
    if is_torque_controlled(joint):
        return _torque_drive(joint, duty, rate, supply, friction)
    voltage = duty * supply
    current = (voltage - joint.torque * rate) * joint.conductance
    damping = joint.torque * joint.torque * joint.conductance
    behind = friction.behind(joint, joint.torque * current, damping, rate)
    return Drive(voltage, current, *behind)


def _torque_drive(
    joint: LimbJoint, duty: Scalar, rate: Scalar, supply: Scalar, friction: Friction
) -> TorqueDrive:
    """The commanded torque within the limits that the speed sets along the motion."""
    stall = joint.stall_torque + joint.stall_torque_per_volt * supply
    most = stall - joint.torque_drop * rate
    least = -stall - joint.torque_drop * rate
    commanded = duty * joint.torque_limit
    torque = ca.fmin(ca.fmax(commanded, ca.fmin(least, 0.0)), ca.fmax(most, 0.0))
    limited = (most < commanded) * (most > 0.0) + (commanded < least) * (least < 0.0)
    drop = joint.torque_drop * limited
    current = joint.inverse_torque * torque
    voltage = joint.resistance * current + joint.torque * rate
    return TorqueDrive(voltage, current, *friction.behind(joint, torque, drop, rate), drop)


def at_middle(joint: LimbJoint, drive: Drive, faster: Scalar) -> tuple[Scalar, Scalar]:
    """Voltage [V] and current [A] after an increase of the motor's rate at the joint [rad/s]."""
    if isinstance(drive, TorqueDrive):
        # From I = tau / k and U = R I + k omega.
        less = (joint.inverse_torque * drive.drop) * faster
        voltage = drive.voltage + joint.torque * faster - joint.resistance * less
        return voltage, drive.current - less
    return drive.voltage, drive.current - (joint.torque * joint.conductance) * faster


def battery_voltage(
    constants: Sequence[Scalar],
    duty: Sequence[Scalar],
    rates: Sequence[Scalar],
    source: Scalar,
    internal: Scalar,
    *,
    torque: bool,
) -> Scalar:
    """Voltage of the battery under the load of all motors [V].

    The power of torque-controlled actuators, P = sum(R / k^2 tau^2 + tau omega) of the commanded
    torques, does not depend on the voltage; of the solutions of U (V - U) / R_i = P the higher one
    is taken. A battery that cannot deliver P delivers its maximum, at half its own voltage. For the
    constants see `gaitswarm.sim.robot.limbs.electrical_constants`.
    """
    n = len(duty)
    if not torque:
        return supply_voltage(duty, rates, constants[n:], constants[:n], source, internal)
    power = 0.0
    for share, rate, loss, limit in zip(duty, rates, constants[:n], constants[n:], strict=True):
        commanded = share * limit
        power = power + commanded * (loss * commanded + rate)
    half = 0.5 * source
    return half + ca.sqrt(ca.fmax(half * half - internal * power, 0.0))
