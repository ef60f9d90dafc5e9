"""Motors, battery and gears as numbers, written anew from docs/model.md."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.kernel.parameters import STATIC_FRICTION_RATE
from gaitswarm.sim.robot import Robot
from gaitswarm.sim.robot.robot import JointActuators

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Drive:
    """Of the motors at an instant, (J,) each.

    Attributes:
        voltage: [V].
        current: [A].
        torque: at the gearheads' outputs, after friction [N m].
        damping: by which these fall as rates grow, static friction left out [N m s/rad].
    """

    voltage: Floats
    current: Floats
    torque: Floats
    damping: Floats


class Motors(Protocol):
    """Motors of either kind, with the friction behind them."""

    def __call__(self, duty: Floats, rates: Floats) -> Drive:
        """The motors at an instant.

        Args:
            duty: Motor voltage per supply voltage, or torque per torque limit, (J,) [1].
            rates: Of the motors at the joints, (J,) [rad/s].
        """

    def current_after(self, drive: Drive, faster: Floats) -> Floats:
        """Currents under the same command when the rates have grown.

        Args:
            faster: By which the rates have grown, (J,) [rad/s].

        Returns:
            After, (J,) [A].
        """


class _Friction:
    """Of joints and gears. numbers: as for `DcMotors`."""

    def __init__(self, numbers: Mapping[str, Floats]) -> None:
        self.viscous = numbers["viscous"]
        self._static = numbers.get("static_friction", np.empty(0))

    def behind(self, torque: Floats, rates: Floats) -> Floats:
        """What is left of torques [N m] at rates [rad/s] (J,)."""
        torque = torque - self.viscous * rates
        if self._static.size:
            torque -= self._static * np.clip(rates / STATIC_FRICTION_RATE, -1.0, 1.0)
        return torque


class TorqueMotors:
    """Torque-controlled actuators: what is commanded, within what the speed leaves of it."""

    def __init__(self, actuators: JointActuators, numbers: Mapping[str, Floats]) -> None:
        self._a, self._friction = actuators, _Friction(numbers)
        self._source = float(numbers["supply_voltage"][0])
        self._internal = float(numbers["supply_resistance"][0])

    def __call__(self, duty: Floats, rates: Floats) -> Drive:
        """The actuators at an instant."""
        a, wanted = self._a, duty * self._a.torque_limit
        power = float(a.resistance @ (wanted / a.torque) ** 2 + wanted @ rates)
        # U (source - U) / internal = power.
        square = max(0.25 * self._source**2 - self._internal * power, 0.0)
        stall = a.stall_torque + a.stall_torque_per_volt * (0.5 * self._source + math.sqrt(square))
        least, most = (sign * stall - a.torque_drop * rates for sign in (-1.0, 1.0))
        torque = np.clip(wanted, np.minimum(least, 0.0), np.maximum(most, 0.0))
        on_the_line = (torque == most) | (torque == least)
        current = torque / a.torque
        voltage = a.resistance * current + a.torque * rates
        damping = a.torque_drop * on_the_line + self._friction.viscous
        return Drive(voltage, current, self._friction.behind(torque, rates), damping)

    def current_after(self, drive: Drive, faster: Floats) -> Floats:
        """The same where torques are held, less where speed limits them."""
        after: Floats = (
            drive.current - (drive.damping - self._friction.viscous) / (self._a.torque) * faster
        )
        return after


class DcMotors:
    """Quasi-static currents on a battery of finite resistance (thesis 2.2.5).

    Args:
        numbers: `viscous` and, of a robot that has it, `static_friction` (J,), and the battery's
            `supply_voltage` and `supply_resistance` (1,), as `sim.kernel.parameters.Layout` has
            them.
    """

    def __init__(self, actuators: JointActuators, numbers: Mapping[str, Floats]) -> None:
        self._k, self._r = actuators.torque, actuators.resistance
        self._friction = _Friction(numbers)
        self._source = float(numbers["supply_voltage"][0])
        self._internal = float(numbers["supply_resistance"][0])
        self._damping = self._k**2 / self._r + self._friction.viscous

    def __call__(self, duty: Floats, rates: Floats) -> Drive:
        """The motors at an instant.

        The battery gives sum(duty I) at U = source - internal sum(duty I).

        Args:
            duty: Motor voltage per supply voltage, (J,) [1].
            rates: Of the gearheads' outputs, (J,) [rad/s].
        """
        back = self._k * rates
        share = duty / self._r
        supply = (self._source + self._internal * (share @ back)) / (
            1.0 + self._internal * (share @ duty)
        )
        voltage = duty * supply
        current = (voltage - back) / self._r
        torque = self._friction.behind(self._k * current, rates)
        return Drive(voltage, current, torque, self._damping)

    def current_after(self, drive: Drive, faster: Floats) -> Floats:
        """Currents at the same voltages when the rates have grown.

        Args:
            faster: By which the rates have grown, (J,) [rad/s].

        Returns:
            After, (J,) [A].
        """
        after: Floats = drive.current - self._k / self._r * faster
        return after


@dataclass(frozen=True, slots=True, eq=False)
class Actuation:
    """Of motors and gears at an instant.

    Attributes:
        drive: of the motors.
        torque: on the links, (J,) [N m].
    """

    drive: Drive
    torque: Floats


class Gears(Protocol):
    """Motors and what joins them to the links.

    Attributes:
        motors: the motors.
        armature: rotor inertia that turns with the links, (J,) [kg m2].
    """

    motors: Motors
    armature: Floats

    @property
    def memory(self) -> tuple[Floats, ...]:
        """Angles [rad] and rates [rad/s] of rotors of their own, (J,) each; else nothing."""

    def encoders(self, angles: Floats) -> Floats:
        """What the encoders see.

        Args:
            angles: Of the links, (J,) [rad].

        Returns:
            (J,) [rad].
        """

    def actuate(
        self, duty: Floats, angles: Floats, rates: Floats, ahead: Floats | float = 0.0
    ) -> Actuation:
        """What motors and gears do at an instant.

        Args:
            duty: Motor voltage per supply voltage, (J,) [1].
            angles: Of the links, (J,) [rad].
            rates: Of the links, (J,) [rad/s].
            ahead: By which gearheads are turned further, (J,) [rad].
        """

    def kick(self, actuation: Actuation, timestep: float, implicit: float = 0.0) -> Floats | None:
        """Step the rates of rotors of their own.

        Args:
            timestep: [s].

        Returns:
            Accelerations of these rotors, (J,) [rad/s2]; None where they turn with the links.
        """

    def drift(self, time: float) -> None:
        """Turn rotors of their own.

        Args:
            time: For how long [s].
        """


class FirmGears:
    """Rotors that turn with the links."""

    def __init__(self, robot: Robot, motors: Motors) -> None:
        self.motors, self.armature = motors, robot.actuators().armature

    @property
    def memory(self) -> tuple[Floats, ...]:
        """Nothing."""
        return ()

    def encoders(self, angles: Floats) -> Floats:
        """The links' angles."""
        return angles

    def actuate(
        self, duty: Floats, angles: Floats, rates: Floats, ahead: Floats | float = 0.0
    ) -> Actuation:
        """The motors' torques."""
        del angles, ahead
        drive = self.motors(duty, rates)
        return Actuation(drive, drive.torque)

    def kick(self, actuation: Actuation, timestep: float, implicit: float = 0.0) -> Floats | None:
        """Nothing: MuJoCo turns them as the links' armature."""
        del actuation, timestep, implicit
        return None

    def drift(self, time: float) -> None:
        """Nothing."""


class LooseGears:
    """Rotors of their own that touch the links at either end of a play, through damped shafts.

    Args:
        play: Of all joints, end to end, (J,) [rad].
        angles: At which rotors and links begin, at rest, (J,) [rad].

    Attributes:
        angles: of the rotors at the gearheads' outputs, (J,) [rad].
        rates: likewise, (J,) [rad/s].
    """

    def __init__(self, robot: Robot, motors: Motors, play: Floats, angles: Floats) -> None:
        actuators = robot.actuators()
        self.motors, self._inertia = motors, actuators.armature
        self._half = play / 2.0
        self._stiffness, self._damping = actuators.shaft_stiffness, actuators.shaft_damping
        self.armature = np.zeros(robot.n_joints)
        self.angles, self.rates = angles.copy(), np.zeros(robot.n_joints)

    @property
    def memory(self) -> tuple[Floats, ...]:
        """The rotors' angles and rates."""
        return self.angles, self.rates

    def encoders(self, angles: Floats) -> Floats:
        """The rotors' angles."""
        del angles
        return self.angles

    def actuate(
        self, duty: Floats, angles: Floats, rates: Floats, ahead: Floats | float = 0.0
    ) -> Actuation:
        """The shafts' torques."""
        passed = self._shaft_torques(self.angles + ahead - angles, self.rates - rates)
        return Actuation(self.motors(duty, self.rates), passed)

    def kick(self, actuation: Actuation, timestep: float, implicit: float = 0.0) -> Floats | None:
        """Motors damp at the given time of the step, shafts at its beginning."""
        inertia = self._inertia + implicit * timestep * actuation.drive.damping
        own: Floats = (actuation.drive.torque - actuation.torque) / inertia
        self.rates = self.rates + timestep * own
        return own

    def drift(self, time: float) -> None:
        """Angles at constant rates."""
        self.angles = self.angles + time * self.rates

    def _shaft_torques(self, ahead: Floats, faster: Floats) -> Floats:
        """Torques on the links [N m] of rotors that are ahead [rad] and faster [rad/s] (J,).

        None inside the play; beyond it a spring and damper that never pulls back.
        """
        beyond = ahead - np.clip(ahead, -self._half, self._half)
        side = np.sign(beyond)
        push = self._stiffness * np.abs(beyond) + self._damping * side * faster
        torque: Floats = side * np.maximum(push, 0.0)
        return torque


def gears_of(robot: Robot, numbers: Mapping[str, Floats], angles: Floats) -> Gears:
    """The gears of a robot, motors and links at the same angles and at rest.

    Args:
        numbers: As for `DcMotors`; of a robot with backlash `backlash` (J,), too.
        angles: (J,) [rad].
    """
    kind = TorqueMotors if robot.is_torque_controlled else DcMotors
    motors = kind(robot.actuators(), numbers)
    if robot.has_backlash:
        return LooseGears(robot, motors, numbers["backlash"], angles)
    return FirmGears(robot, motors)
