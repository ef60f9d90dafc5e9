"""Motors, battery and gears in numbers, independent of the kernel's formulas (docs/model.md)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.robot.robot import JointActuators, Robot


@dataclass(frozen=True, slots=True, eq=False)
class Drive:
    """State of the motors at an instant, (J,) each."""

    voltage: Floats  # [V]
    current: Floats  # [A]
    torque: Floats  # at the gearheads' outputs, after viscous friction [N m]
    damping: Floats  # decrease of the torque per rate [N m s/rad]


class DryFriction:
    """Dry friction in numbers: the torque that would stop a joint, within its limit."""

    def __init__(self, numbers: Mapping[str, Floats]) -> None:
        self._numbers = numbers
        self.torques, self.loads = np.zeros((2, numbers["coulomb_friction"].size))

    def limits(self, torque: Floats, rates: Floats) -> Floats:
        """Largest friction (J,) [N m] at torques of the motors [N m] and rates [rad/s] (J,)."""
        p, load = self._numbers, self.loads
        slow, share = 1.0 / (1.0 + (rates / p["stribeck_speed"]) ** 2), p["load_friction"]
        limits: Floats = p["coulomb_friction"] + p["stribeck_friction"] * slow
        if not p["stribeck_exponent"].size:
            return limits + share * np.abs(torque + load)
        exponent = p["stribeck_exponent"]
        exponential = np.exp(-(np.abs(rates / p["stribeck_speed"]) ** exponent))
        slow = np.where(exponent > 0.0, exponential, slow)
        from_motor = (share + p["motor_load_friction"]) * torque
        at_rest = np.abs(p["stribeck_motor_load"] * torque + p["stribeck_link_load"] * load)
        driving = np.abs(load) < np.abs(torque)
        squares = np.where(
            driving, p["link_load_square"] * load**2, p["motor_load_square"] * torque**2
        )
        at_rest += np.where(torque * load > 0.0, squares, 0.0) + p["stribeck_friction"]
        sides = np.abs(from_motor + (share + p["link_load_friction"]) * load)
        return p["coulomb_friction"] + sides + slow * at_rest

    @property
    def memory(self) -> tuple[Floats, ...]:
        """As the kernel's internal state: what its springs bear, and the loads."""
        return (-self.torques, self.loads) if self.torques.size else ()


class TorqueMotors:
    """Torque-controlled actuators: the command, limited by the speed."""

    def __init__(self, actuators: JointActuators, numbers: Mapping[str, Floats]) -> None:
        self._a, self._viscous = actuators, numbers["viscous"]
        self._source = float(numbers["supply_voltage"][0])
        self._internal = float(numbers["supply_resistance"][0])

    def __call__(self, duty: Floats, rates: Floats) -> Drive:
        a, commanded = self._a, duty * self._a.torque_limit
        power = float(a.resistance @ (commanded / a.torque) ** 2 + commanded @ rates)
        # U (source - U) / internal = power.
        square = max(0.25 * self._source**2 - self._internal * power, 0.0)
        stall = a.stall_torque + a.stall_torque_per_volt * (0.5 * self._source + math.sqrt(square))
        least, most = (sign * stall - a.torque_drop * rates for sign in (-1.0, 1.0))
        torque = np.clip(commanded, np.minimum(least, 0.0), np.maximum(most, 0.0))
        on_the_line = (torque == most) | (torque == least)
        current = torque / a.torque
        voltage = a.resistance * current + a.torque * rates
        damping = a.torque_drop * on_the_line + self._viscous
        return Drive(voltage, current, torque - self._viscous * rates, damping)

    def current_after(self, drive: Drive, faster: Floats) -> Floats:
        after: Floats = drive.current - (drive.damping - self._viscous) / (self._a.torque) * faster
        return after


class DcMotors:
    """Quasi-static currents on a battery of finite resistance (thesis 2.2.5)."""

    def __init__(self, actuators: JointActuators, numbers: Mapping[str, Floats]) -> None:
        self._k, self._r = actuators.torque, actuators.resistance
        self._viscous = numbers["viscous"]
        self._source = float(numbers["supply_voltage"][0])
        self._internal = float(numbers["supply_resistance"][0])
        self._damping = self._k**2 / self._r + self._viscous

    def __call__(self, duty: Floats, rates: Floats) -> Drive:
        """The battery's voltage is U = source - internal sum(duty I)."""
        back = self._k * rates
        share = duty / self._r
        supply = (self._source + self._internal * (share @ back)) / (
            1.0 + self._internal * (share @ duty)
        )
        voltage = duty * supply
        current = (voltage - back) / self._r
        torque = self._k * current - self._viscous * rates
        return Drive(voltage, current, torque, self._damping)

    def current_after(self, drive: Drive, faster: Floats) -> Floats:
        after: Floats = drive.current - self._k / self._r * faster
        return after


@dataclass(frozen=True, slots=True, eq=False)
class Actuation:
    """State of motors and gears at an instant."""

    drive: Drive
    torque: Floats  # on the links, (J,) [N m]


Motors = TorqueMotors | DcMotors
"""Called with the duty, (J,) [1], and the rates at the joints, (J,) [rad/s]; `current_after` are
the currents (J,) [A] for the same command and rates higher by `faster` (J,) [rad/s]."""


class FirmGears:
    """Rotors that turn with the links; their dry friction is MuJoCo's."""

    def __init__(self, robot: Robot, motors: Motors, dry: DryFriction) -> None:
        self.motors, self.dry, self.armature = motors, dry, robot.actuators().armature

    @property
    def memory(self) -> tuple[Floats, ...]:
        return ()

    def encoders(self, angles: Floats) -> Floats:
        return angles

    def actuate(
        self, duty: Floats, angles: Floats, rates: Floats, ahead: Floats | float = 0.0
    ) -> Actuation:
        del angles, ahead
        drive = self.motors(duty, rates)
        return Actuation(drive, drive.torque)

    def kick(self, actuation: Actuation, timestep: float, implicit: float = 0.0) -> Floats | None:
        """None: MuJoCo turns the rotors as the links' armature."""
        del actuation, timestep, implicit
        return None

    def drift(self, time: float) -> None: ...


class LooseGears:
    """Separate rotors that touch the links at either end of a play through damped shafts."""

    def __init__(
        self, robot: Robot, motors: Motors, dry: DryFriction, play: Floats, angles: Floats
    ) -> None:
        actuators = robot.actuators()
        self.motors, self.dry, self._inertia = motors, dry, actuators.armature
        self._half = play / 2.0
        self._stiffness, self._damping = actuators.shaft_stiffness, actuators.shaft_damping
        self._torque_constants, self.armature = actuators.torque, np.zeros(robot.n_joints)
        self.angles, self.rates = angles.copy(), np.zeros(robot.n_joints)

    @property
    def memory(self) -> tuple[Floats, ...]:
        return self.angles, self.rates

    def encoders(self, angles: Floats) -> Floats:
        del angles
        return self.angles

    def actuate(
        self, duty: Floats, angles: Floats, rates: Floats, ahead: Floats | float = 0.0
    ) -> Actuation:
        torque = self._shaft_torques(self.angles + ahead - angles, self.rates - rates)
        return Actuation(self.motors(duty, self.rates), torque)

    def kick(self, actuation: Actuation, timestep: float, implicit: float = 0.0) -> Floats | None:
        """Motors damp at the given time of the step, shafts at its beginning."""
        drive, dry = actuation.drive, self.dry
        inertia = self._inertia + implicit * timestep * drive.damping
        torque = drive.torque - actuation.torque
        if dry.torques.size:
            limits = dry.limits(drive.current * self._torque_constants, self.rates)
            dry.torques = np.clip(-torque - inertia * self.rates / timestep, -limits, limits)
            dry.loads = actuation.torque
            torque = torque + dry.torques
        spin: Floats = torque / inertia
        self.rates = self.rates + timestep * spin
        return spin

    def drift(self, time: float) -> None:
        self.angles = self.angles + time * self.rates

    def _shaft_torques(self, ahead: Floats, faster: Floats) -> Floats:
        """Torques on the links [N m] of rotors that are ahead [rad] and faster [rad/s] (J,)."""
        beyond = ahead - np.clip(ahead, -self._half, self._half)
        side = np.sign(beyond)
        push = self._stiffness * np.abs(beyond) + self._damping * side * faster
        torque: Floats = side * np.maximum(push, 0.0)
        return torque


Gears = FirmGears | LooseGears
"""Motors and their coupling to the links: `armature` is the rotor inertia that turns with the links
(J,) [kg m2], `memory` angles [rad] and rates [rad/s] of separate rotors, which `kick` accelerates,
returning their accelerations [rad/s2], and `drift` turns for a time [s]."""


def gears_of(robot: Robot, numbers: Mapping[str, Floats], angles: Floats) -> Gears:
    """Gears at rest, motors and links at the same angles. For numbers see `DcMotors`."""
    kind = TorqueMotors if robot.is_torque_controlled else DcMotors
    motors, dry = kind(robot.actuators(), numbers), DryFriction(numbers)
    if robot.has_backlash:
        return LooseGears(robot, motors, dry, numbers["backlash"], angles)
    return FirmGears(robot, motors, dry)
