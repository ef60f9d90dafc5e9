"""Motors, battery and gears, written anew from docs/model.md."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from sim.robot import Robot

Floats = NDArray[np.float64]


class Motors:
    """Quasi-static currents on a battery of finite resistance (thesis 2.2.5)."""

    def __init__(self, robot: Robot) -> None:
        actuators, supply = robot.actuators(), robot.description.supply
        self._k, self._r, self._viscous = actuators.torque, actuators.resistance, actuators.viscous
        self._source, self._internal = supply.voltage, supply.resistance

    def __call__(self, duty: Floats, rates: Floats) -> tuple[Floats, Floats, Floats]:
        """Voltages, currents and torques after friction, by joint.

        The battery gives sum(duty I) at U = source - internal sum(duty I).
        """
        back = self._k * rates
        share = duty / self._r
        supply = (self._source + self._internal * (share @ back)) / (
            1.0 + self._internal * (share @ duty)
        )
        voltage = duty * supply
        current = (voltage - back) / self._r
        return voltage, current, self._k * current - self._viscous * rates


@dataclass(frozen=True, slots=True, eq=False)
class Actuation:
    """Of the actuators in one step: voltage [V], current [A], torque on the links [N m], (J,)."""

    voltage: Floats
    current: Floats
    torque: Floats


class Gears(Protocol):
    """Motors and what joins them to the links.

    armature: rotor inertia that turns with the links (J,) [kg m2].
    """

    armature: Floats

    def encoders(self, angles: Floats) -> Floats:
        """Links' angles (J,) [rad] -> what the encoders see."""

    def actuate(self, duty: Floats, angles: Floats, rates: Floats) -> Actuation:
        """One physics step with the links at these angles [rad] and rates [rad/s]."""


class FirmGears:
    """Rotors that turn with the links."""

    def __init__(self, robot: Robot) -> None:
        self._motors = Motors(robot)
        self.armature = robot.actuators().armature

    def encoders(self, angles: Floats) -> Floats:
        """See `Gears`."""
        return angles

    def actuate(self, duty: Floats, angles: Floats, rates: Floats) -> Actuation:
        """See `Gears`."""
        del angles
        return Actuation(*self._motors(duty, rates))


class LooseGears:
    """Rotors of their own that touch the links at either end of a play, through damped shafts.

    angles [rad] and rates [rad/s]: the rotors', at the gearheads' outputs (J,).
    """

    def __init__(self, robot: Robot, angles: Floats, timestep: float) -> None:
        actuators = robot.actuators()
        self._motors, self._inertia, self._timestep = Motors(robot), actuators.armature, timestep
        self._half = actuators.backlash / 2.0
        self._stiffness, self._damping = actuators.shaft_stiffness, actuators.shaft_damping
        self.armature = np.zeros(robot.n_joints)
        self.angles, self.rates = angles.copy(), np.zeros(robot.n_joints)

    def encoders(self, angles: Floats) -> Floats:
        """See `Gears`."""
        del angles
        return self.angles

    def actuate(self, duty: Floats, angles: Floats, rates: Floats) -> Actuation:
        """See `Gears`; the rotors are stepped."""
        voltage, current, torque = self._motors(duty, self.rates)
        passed = self.shaft_torques(self.angles - angles, self.rates - rates)
        self.rates = self.rates + self._timestep * (torque - passed) / self._inertia
        self.angles = self.angles + self._timestep * self.rates
        return Actuation(voltage, current, passed)

    def shaft_torques(self, ahead: Floats, faster: Floats) -> Floats:
        """Torques on the links [N m] of rotors that are ahead [rad] and faster [rad/s] (J,).

        None inside the play; beyond it a spring and damper that never pulls back.
        """
        beyond = ahead - np.clip(ahead, -self._half, self._half)
        side = np.sign(beyond)
        push = self._stiffness * np.abs(beyond) + self._damping * side * faster
        torque: Floats = side * np.maximum(push, 0.0)
        return torque


def gears_of(robot: Robot, angles: Floats, timestep: float) -> Gears:
    """The robot's, with motors and links at the same angles (J,) [rad], at rest."""
    return LooseGears(robot, angles, timestep) if robot.has_backlash else FirmGears(robot)
