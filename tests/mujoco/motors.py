"""Motors, battery and gears, written anew from docs/model.md."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from sim.robot import Robot

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Drive:
    """Of the motors at an instant: voltage [V], current [A], torque after friction [N m], (J,)."""

    voltage: Floats
    current: Floats
    torque: Floats


class Motors:
    """Quasi-static currents on a battery of finite resistance (thesis 2.2.5).

    damping: by which torques after friction fall with the rates (J,) [N m s/rad].
    """

    def __init__(self, robot: Robot) -> None:
        actuators, supply = robot.actuators(), robot.description.supply
        self._k, self._r, self._viscous = actuators.torque, actuators.resistance, actuators.viscous
        self._source, self._internal = supply.voltage, supply.resistance
        self.damping = self._k**2 / self._r + self._viscous

    def __call__(self, duty: Floats, rates: Floats) -> Drive:
        """By joint. The battery gives sum(duty I) at U = source - internal sum(duty I)."""
        back = self._k * rates
        share = duty / self._r
        supply = (self._source + self._internal * (share @ back)) / (
            1.0 + self._internal * (share @ duty)
        )
        voltage = duty * supply
        current = (voltage - back) / self._r
        return Drive(voltage, current, self._k * current - self._viscous * rates)

    def current_after(self, current: Floats, faster: Floats) -> Floats:
        """Currents [A] at the same voltages when the rates have grown [rad/s]."""
        after: Floats = current - self._k / self._r * faster
        return after


@dataclass(frozen=True, slots=True, eq=False)
class Actuation:
    """Of motors and gears at an instant: the drive, and the torque on the links [N m], (J,)."""

    drive: Drive
    torque: Floats


class Gears(Protocol):
    """Motors and what joins them to the links.

    motors: the motors.
    armature: rotor inertia that turns with the links (J,) [kg m2].
    damping: by which torques on the links fall with the links' rates, and which a step takes
        implicitly (J,) [N m s/rad].
    memory: angles and rates of rotors of their own.
    """

    motors: Motors
    armature: Floats
    damping: Floats

    @property
    def memory(self) -> list[Floats]:
        """See `Gears`."""

    def encoders(self, angles: Floats) -> Floats:
        """Links' angles (J,) [rad] -> what the encoders see."""

    def actuate(self, duty: Floats, angles: Floats, rates: Floats) -> Actuation:
        """With the links at these angles [rad] and rates [rad/s]."""

    def kick(self, actuation: Actuation, spins: Floats, timestep: float) -> Floats:
        """Step the rotors' rates; their accelerations, where the links have these [rad/s2]."""

    def drift(self, time: float) -> None:
        """Turn the rotors for a time [s]."""


class FirmGears:
    """Rotors that turn with the links."""

    memory: list[Floats] = []  # noqa: RUF012

    def __init__(self, robot: Robot) -> None:
        self.motors = Motors(robot)
        self.armature, self.damping = robot.actuators().armature, self.motors.damping

    def encoders(self, angles: Floats) -> Floats:
        """See `Gears`."""
        return angles

    def actuate(self, duty: Floats, angles: Floats, rates: Floats) -> Actuation:
        """See `Gears`."""
        del angles
        drive = self.motors(duty, rates)
        return Actuation(drive, drive.torque)

    def kick(self, actuation: Actuation, spins: Floats, timestep: float) -> Floats:
        """See `Gears`."""
        del actuation, timestep
        return spins

    def drift(self, time: float) -> None:
        """See `Gears`."""


class LooseGears:
    """Rotors of their own that touch the links at either end of a play, through damped shafts.

    angles [rad] and rates [rad/s]: the rotors', at the gearheads' outputs (J,).
    """

    def __init__(self, robot: Robot, angles: Floats) -> None:
        actuators = robot.actuators()
        self.motors, self._inertia = Motors(robot), actuators.armature
        self._half = actuators.backlash / 2.0
        self._stiffness, self._damping = actuators.shaft_stiffness, actuators.shaft_damping
        self.armature = self.damping = np.zeros(robot.n_joints)
        self.angles, self.rates = angles.copy(), np.zeros(robot.n_joints)

    @property
    def memory(self) -> list[Floats]:
        """See `Gears`."""
        return [self.angles, self.rates]

    def encoders(self, angles: Floats) -> Floats:
        """See `Gears`."""
        del angles
        return self.angles

    def actuate(self, duty: Floats, angles: Floats, rates: Floats) -> Actuation:
        """See `Gears`."""
        passed = self.shaft_torques(self.angles - angles, self.rates - rates)
        return Actuation(self.motors(duty, self.rates), passed)

    def kick(self, actuation: Actuation, spins: Floats, timestep: float) -> Floats:
        """See `Gears`. Motors damp at the step's middle, shafts before the step."""
        del spins
        inertia = self._inertia + 0.5 * timestep * self.motors.damping
        own: Floats = (actuation.drive.torque - actuation.torque) / inertia
        self.rates = self.rates + timestep * own
        return own

    def drift(self, time: float) -> None:
        """See `Gears`."""
        self.angles = self.angles + time * self.rates

    def shaft_torques(self, ahead: Floats, faster: Floats) -> Floats:
        """Torques on the links [N m] of rotors that are ahead [rad] and faster [rad/s] (J,).

        None inside the play; beyond it a spring and damper that never pulls back.
        """
        beyond = ahead - np.clip(ahead, -self._half, self._half)
        side = np.sign(beyond)
        push = self._stiffness * np.abs(beyond) + self._damping * side * faster
        torque: Floats = side * np.maximum(push, 0.0)
        return torque


def gears_of(robot: Robot, angles: Floats) -> Gears:
    """The robot's, with motors and links at the same angles (J,) [rad], at rest."""
    return LooseGears(robot, angles) if robot.has_backlash else FirmGears(robot)
