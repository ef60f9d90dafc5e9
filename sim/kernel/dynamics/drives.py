"""What drives a joint in a physics step, as symbols: a DC motor, or an actuator of given torque."""

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
    """Torque of a stiff, damped shaft on the link; it pushes, but never pulls into the play.

    Args:
        ahead: Motor side's angle less the link's [rad].
        rate: Derivative of `ahead` [rad/s].
        play: End to end [rad].
        stiffness: Of the closed play [N m/rad].
        damping: Of the closed play [N m s/rad].

    Returns:
        Torque on the link [N m].
    """
    half = 0.5 * play
    drag = damping * rate
    forward = ca.fmax(stiffness * (ahead - half) + drag, 0.0) * (half < ahead)
    backward = ca.fmin(stiffness * (ahead + half) + drag, 0.0) * (ahead < -half)
    return forward + backward


def static_friction(rate: Scalar, friction: Scalar) -> Scalar:
    """Torque against the motion, whatever its speed; linear in a narrow zone, so it never drives.

    Args:
        rate: Of the gearhead's output, at the joint [rad/s].
        friction: From `STATIC_FRICTION_RATE` on [N m].

    Returns:
        Torque [N m].
    """
    return -friction * ca.fmin(ca.fmax(rate * (1.0 / STATIC_FRICTION_RATE), -1.0), 1.0)


def static_friction_slope(rate: Scalar, friction: Scalar) -> Scalar:
    """How `static_friction` grows with the rate, where it does.

    Args:
        rate: Of the gearhead's output, at the joint [rad/s].
        friction: From `STATIC_FRICTION_RATE` on [N m].

    Returns:
        -d torque / d rate [N m s/rad].
    """
    return friction * (ca.fabs(rate) < STATIC_FRICTION_RATE) * (1.0 / STATIC_FRICTION_RATE)


@dataclass(frozen=True, slots=True)
class Drive:
    """A motor with its gearhead in a step.

    Attributes:
        voltage: [V].
        current: before the step [A].
        torque: behind the gearhead's friction, before the step [N m].
        damping: -d torque / d rate [N m s/rad].
    """

    voltage: Scalar
    current: Scalar
    torque: Scalar
    damping: Scalar


@dataclass(frozen=True, slots=True)
class TorqueDrive(Drive):
    """The drive of a torque-controlled actuator.

    Attributes:
        drop: by which its torque falls as its rate grows, where speed limits it; else 0
            [N m s/rad].
    """

    drop: Scalar


@dataclass(frozen=True, slots=True)
class Friction:
    """Of a joint and its gears.

    Attributes:
        viscous: [N m s/rad].
        static: against the motion, whatever its speed; None for none [N m].
    """

    viscous: Scalar
    static: Scalar | None


def friction_of(joint: int, p: Mapping[str, Sequence[Scalar]]) -> Friction:
    """Friction among the run-time parameters."""
    static = p["static_friction"]
    return Friction(p["viscous"][joint], static[joint] if static else None)


def drive_of(
    joint: LimbJoint, duty: Scalar, rate: Scalar, supply: Scalar, friction: Friction
) -> Drive:
    """The drive of a joint at the beginning of a step.

    Args:
        duty: Motor voltage per supply voltage, or commanded torque per torque limit [1].
        rate: Of the motor at the joint [rad/s].
        supply: Voltage of the battery under load [V].
    """
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
    """The torque that is commanded, within what the speed leaves of it along the motion."""
    stall = joint.stall_torque + joint.stall_torque_per_volt * supply
    most = stall - joint.torque_drop * rate
    least = -stall - joint.torque_drop * rate
    wanted = duty * joint.torque_limit
    torque = ca.fmin(ca.fmax(wanted, ca.fmin(least, 0.0)), ca.fmax(most, 0.0))
    limited = (most < wanted) * (most > 0.0) + (wanted < least) * (least < 0.0)
    drop = joint.torque_drop * limited
    current = joint.inverse_torque * torque
    voltage = joint.resistance * current + joint.torque * rate
    return TorqueDrive(voltage, current, *_with_friction(torque, drop, rate, friction), drop)


def _with_friction(
    torque: Scalar, damping: Scalar, rate: Scalar, friction: Friction
) -> tuple[Scalar, Scalar]:
    """Torque behind a joint's friction, and its damping with the friction's."""
    torque = torque - friction.viscous * rate
    damping = damping + friction.viscous
    if friction.static is not None:
        torque = torque + static_friction(rate, friction.static)
        damping = damping + static_friction_slope(rate, friction.static)
    return torque, damping


def at_middle(joint: LimbJoint, drive: Drive, faster: Scalar) -> tuple[Scalar, Scalar]:
    """Voltage and current of a motor later in a step.

    Args:
        faster: By which the motor's rate at the joint has grown since [rad/s].

    Returns:
        Voltage [V] and current [A].
    """
    if isinstance(drive, TorqueDrive):
        # Of I = tau / k and U = R I + k omega.
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
    """Voltage of the battery under the load of all motors.

    The power of torque-controlled actuators, P = sum(R / k^2 tau^2 + tau omega) of the torques that
    are commanded, does not depend on the voltage: U (V - U) / R_i = P, of whose solutions the
    higher one is taken. A battery that cannot give P gives all it can, at half its own voltage.

    Args:
        constants: As `gaitswarm.sim.robot.limbs.electrical_constants` has them, (2 J,).
        duty: Motor voltage per supply voltage, or commanded torque per torque limit, (J,) [1].
        rates: Of the motors at the joints, (J,) [rad/s].
        source: Open-circuit voltage of the battery [V].
        internal: Resistance of the battery [ohm].

    Returns:
        Under load [V].
    """
    n = len(duty)
    if not torque:
        return supply_voltage(duty, rates, constants[n:], constants[:n], source, internal)
    power = 0.0
    for share, rate, loss, limit in zip(duty, rates, constants[:n], constants[n:], strict=True):
        wanted = share * limit
        power = power + wanted * (loss * wanted + rate)
    half = 0.5 * source
    return half + ca.sqrt(ca.fmax(half * half - internal * power, 0.0))
