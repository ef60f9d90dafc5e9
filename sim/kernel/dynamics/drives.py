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
from gaitswarm.sim.kernel.parameters import STATIC_FRICTION_RATE
from gaitswarm.sim.robot.limbs import LimbJoint, is_torque_controlled


def shaft_torque(
    ahead: Scalar, rate: Scalar, play: Scalar, stiffness: float, damping: float
) -> Scalar:
    """Torque of a stiff, damped shaft on the link [N m]; it pushes, but never pulls into the play.

    `ahead` is the motor side's angle minus the link's [rad], `play` is from end to end [rad].
    """
    half = 0.5 * play
    drag = damping * rate
    forward = ca.fmax(stiffness * (ahead - half) + drag, 0.0) * (half < ahead)
    backward = ca.fmin(stiffness * (ahead + half) + drag, 0.0) * (ahead < -half)
    return forward + backward


def static_friction(rate: Scalar, friction: Scalar) -> Scalar:
    """Torque against the motion [N m]; linear in a narrow zone, so it never drives."""
    return -friction * ca.fmin(ca.fmax(rate * (1.0 / STATIC_FRICTION_RATE), -1.0), 1.0)


def static_friction_slope(rate: Scalar, friction: Scalar) -> Scalar:
    """-d torque / d rate of `static_friction` [N m s/rad]."""
    return friction * (ca.fabs(rate) < STATIC_FRICTION_RATE) * (1.0 / STATIC_FRICTION_RATE)


@dataclass(frozen=True, slots=True)
class Drive:
    """A motor with its gearhead in a step."""

    voltage: Scalar  # [V]
    current: Scalar  # before the step [A]
    torque: Scalar  # behind the gearhead's friction, before the step [N m]
    damping: Scalar  # -d torque / d rate [N m s/rad]


@dataclass(frozen=True, slots=True)
class TorqueDrive(Drive):
    """The drive of a torque-controlled actuator."""

    # by which its torque falls as its rate grows, where the speed limits it; else 0 [N m s/rad]
    drop: Scalar


@dataclass(frozen=True, slots=True)
class Friction:
    """Friction of a joint and its gears."""

    viscous: Scalar  # [N m s/rad]
    static: Scalar | None  # [N m]; None for none


def friction_of(joint: int, p: Mapping[str, Sequence[Scalar]]) -> Friction:
    static = p["static_friction"]
    return Friction(p["viscous"][joint], static[joint] if static else None)


def drive_of(
    joint: LimbJoint, duty: Scalar, rate: Scalar, supply: Scalar, friction: Friction
) -> Drive:
    """The drive of a joint at the beginning of a step, with the motor's rate at the joint."""
    if is_torque_controlled(joint):
        return _torque_drive(joint, duty, rate, supply, friction)
    voltage = duty * supply
    current = (voltage - joint.torque * rate) * joint.conductance
    damping = joint.torque * joint.torque * joint.conductance
    behind = _with_friction(joint.torque * current, damping, rate, friction)
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
    return TorqueDrive(voltage, current, *_with_friction(torque, drop, rate, friction), drop)


def _with_friction(
    torque: Scalar, damping: Scalar, rate: Scalar, friction: Friction
) -> tuple[Scalar, Scalar]:
    """Torque behind a joint's friction, and its damping including that of the friction."""
    torque = torque - friction.viscous * rate
    damping = damping + friction.viscous
    if friction.static is not None:
        torque = torque + static_friction(rate, friction.static)
        damping = damping + static_friction_slope(rate, friction.static)
    return torque, damping


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
