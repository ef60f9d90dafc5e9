"""Forces of motors, gears and ground in numbers, independent of the kernel's (docs/model.md)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.kernel.parameters import CONTACT_LAWS
from gaitswarm.sim.robot.bounds import ContactLaw
from gaitswarm.sim.robot.robot import Robot


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


class Gears:
    """Motors, battery and gears, at rest with motors and links at the same angles (J,) [rad].

    With backlash, rotors turn by themselves and touch the links at either end of a play through
    damped shafts. Else they turn with the links, and their dry friction is MuJoCo's.
    """

    def __init__(self, robot: Robot, numbers: Mapping[str, Floats], angles: Floats) -> None:
        self._a = a = robot.actuators()
        self._viscous = numbers["viscous"]
        self._source = float(numbers["supply_voltage"][0])
        self._internal = float(numbers["supply_resistance"][0])
        self._motors = self._torque_motors if robot.is_torque_controlled else self._dc_motors
        self.dry, self.loose = DryFriction(numbers), robot.has_backlash
        # Inertia of rotors that turn with the links (J,) [kg m2].
        self.armature = np.zeros(robot.n_joints) if self.loose else a.armature
        # Of rotors that turn by themselves: half the play, angles and rates.
        self._half = numbers["backlash"] / 2.0
        self.angles, self.rates = angles.copy(), np.zeros(robot.n_joints)

    @property
    def memory(self) -> tuple[Floats, ...]:
        """Angles and rates of rotors that turn by themselves."""
        return (self.angles, self.rates) if self.loose else ()

    def actuate(
        self, duty: Floats, angles: Floats, rates: Floats, ahead: Floats | float = 0.0
    ) -> tuple[Drive, Floats]:
        """Return the motors' state, and torques on the links (J,) [N m]."""
        if not self.loose:
            drive = self._motors(duty, rates)
            return drive, drive.torque
        torque = self._shaft_torques(self.angles + ahead - angles, self.rates - rates)
        return self._motors(duty, self.rates), torque

    def kick(
        self, drive: Drive, on_links: Floats, timestep: float, implicit: float = 0.0
    ) -> Floats | None:
        """Accelerate rotors that turn by themselves; return their accelerations [rad/s2].

        Motors damp at the given time of the step, shafts at its beginning.
        """
        if not self.loose:
            return None
        dry = self.dry
        inertia = self._a.armature + implicit * timestep * drive.damping
        torque = drive.torque - on_links
        if dry.torques.size:
            limits = dry.limits(drive.current * self._a.torque, self.rates)
            dry.torques = np.clip(-torque - inertia * self.rates / timestep, -limits, limits)
            dry.loads = on_links
            torque = torque + dry.torques
        spin: Floats = torque / inertia
        self.rates = self.rates + timestep * spin
        return spin

    def drift(self, time: float) -> None:
        self.angles = self.angles + time * self.rates

    def _torque_motors(self, duty: Floats, rates: Floats) -> Drive:
        """Torque-controlled actuators: the command, limited by the speed."""
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

    def _dc_motors(self, duty: Floats, rates: Floats) -> Drive:
        """Quasi-static currents on a battery of finite resistance (thesis 2.2.5).

        The battery's voltage is U = source - internal sum(duty I).
        """
        k, r = self._a.torque, self._a.resistance
        back, share = k * rates, duty / r
        supply = (self._source + self._internal * (share @ back)) / (
            1.0 + self._internal * (share @ duty)
        )
        voltage = duty * supply
        current = (voltage - back) / r
        damping = k**2 / r + self._viscous
        return Drive(voltage, current, k * current - self._viscous * rates, damping)

    def _shaft_torques(self, ahead: Floats, faster: Floats) -> Floats:
        """Torques on the links [N m] of rotors that are ahead [rad] and faster [rad/s] (J,)."""
        beyond = ahead - np.clip(ahead, -self._half, self._half)
        side = np.sign(beyond)
        push = self._a.shaft_stiffness * np.abs(beyond) + self._a.shaft_damping * side * faster
        torque: Floats = side * np.maximum(push, 0.0)
        return torque


class Ground:
    """A clamped spring and damper along the ground's normal, and a friction law.

    Positions and velocities of feet are (L, 3), in [m] and [m/s]; `numbers` (L,) each, by the names
    of `gaitswarm.sim.robot.description.Contact`; `memory` (L, m) is the law's internal state: of
    `stick` the springs' elongation along the world's axes [m], 0 after lift-off.
    """

    def __init__(self, law: ContactLaw, numbers: Mapping[str, Floats]) -> None:
        self.law, self.numbers = law, numbers
        self.memory: Floats = np.zeros(
            (len(numbers["friction"]), CONTACT_LAWS[law].internal_state_size)
        )

    def press(self, position: Floats, velocity: Floats) -> tuple[NDArray[np.bool_], Floats]:
        """Which feet touch (L,), and F_z = k p - c dz/dt (L,) [N] on these, never pulling."""
        depth = self.numbers["sole"] - position[:, 2]
        touching = depth > 0.0
        elastic = self.numbers["stiffness"] * depth - self.numbers["damping"] * velocity[:, 2]
        return touching, np.where(touching, np.maximum(elastic, 0.0), 0.0)

    def landing(self, position: Floats, velocity: Floats, time: float) -> bool:
        """Whether a foot in the air, at this speed, is on the ground after a time [s]."""
        depth = self.numbers["sole"] - position[:, 2]
        return bool(((depth <= 0.0) & (depth > velocity[:, 2] * time)).any())

    def forces(self, position: Floats, velocity: Floats, timestep: float) -> tuple[Floats, Floats]:
        """Return forces on the feet (L, 3) [N], and the memory after the step."""
        touching, normal = self.press(position, velocity)
        limit, slip, memory = self.numbers["friction"] * normal, velocity[:, :2], self.memory
        if self.law == "stick":
            rub, memory = self._stick(touching, limit, slip, timestep)
        else:
            rub = self._slide(limit, slip)
        return np.concatenate([rub, normal[:, None]], axis=1), memory

    def _slide(self, limit: Floats, slip: Floats) -> Floats:
        """Friction (L, 2) [N] against the slip, up to a limit (L,) [N]."""
        if self.law == "karnopp":
            # Full along each axis of the world along which the foot moves fast enough.
            slides = np.abs(slip) > self.numbers["stick_velocity"][:, None]
            return np.where(slides, -np.sign(slip) * limit[:, None], 0.0)
        speed, full = np.hypot(slip[:, 0], slip[:, 1]), self.numbers["slip_velocity"]
        if self.law == "linear_zone":
            return -(limit / np.maximum(speed, full))[:, None] * slip
        # None below one velocity, full above another, linear between the two. Identified speeds may
        # cross: the friction then jumps at the first.
        none = self.numbers["stick_velocity"]
        speed = np.maximum(speed, none)
        share = np.clip((speed - none) / np.maximum(full - none, 1e-9), 0.0, 1.0)
        return -(limit * share / speed)[:, None] * slip

    def _stick(
        self, touching: NDArray[np.bool_], limit: Floats, slip: Floats, timestep: float
    ) -> tuple[Floats, Floats]:
        """A spring and damper along the ground that slips where it would pull more than a limit."""
        spring, damper = self.numbers["stick_stiffness"], self.numbers["stick_damping"]
        longer = np.where(touching[:, None], self.memory + timestep * slip, 0.0)
        pull = -(spring[:, None] * longer + damper[:, None] * slip)
        size = np.hypot(pull[:, 0], pull[:, 1])
        share = np.divide(limit, size, out=np.ones_like(size), where=size > limit)[:, None]
        return np.where(touching[:, None], share * pull, 0.0), share * longer
