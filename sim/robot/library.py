"""Actuators by name, with the source of their numbers: actuators.toml."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from functools import lru_cache
from importlib import resources
from types import MappingProxyType

from pydantic import Field

from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.near_names import instead_of
from gaitswarm.sim.robot.bounds import Number
from gaitswarm.sim.robot.description import ActuatorKind, DryFriction, PositionLoop


class ListedActuator(DryFriction):
    """A motor with its gear, by its numbers at the output unless there is a gear ratio."""

    title: str
    source: str
    guessed: tuple[str, ...] = Field(default=())  # numbers that the source does not have
    kind: ActuatorKind = "dc"
    voltage: Number  # recommended [V]
    gear_ratio: Number = 1.0
    torque_constant: Number
    resistance: Number
    rotor_inertia: Number
    viscous_friction: Number
    torque_limit: Number | None = None
    speed_limit: Number | None = None
    knee_speed: Number | None = None
    encoder_counts: int = 65536  # per turn
    bounds_p: tuple[Number, Number] | None = None  # for tuning
    servo: PositionLoop | None = None

    @property
    def stall_torque(self) -> float:
        """Largest torque of the motor at rest and the recommended voltage [N m]."""
        constant = self.gear_ratio * self.torque_constant
        return self.torque_limit or constant * self.voltage / self.resistance

    @property
    def no_load_speed(self) -> float:
        """Speed at which the motor's torque reaches zero at the recommended voltage [rad/s]."""
        return self.speed_limit or self.voltage / (self.gear_ratio * self.torque_constant)

    @property
    def armature(self) -> float:
        """Rotor inertia at the output [kg m2]."""
        return self.rotor_inertia * self.gear_ratio**2

    @property
    def note(self) -> str:
        guessed = f"; guessed: {', '.join(self.guessed)}" if self.guessed else ""
        return f"{self.title} at {self.voltage:g} V, {self.source}{guessed}"


@lru_cache(maxsize=1)
def listed_actuators() -> Mapping[str, ListedActuator]:
    """All actuators by name."""
    file = resources.files("gaitswarm.sim.robot") / "actuators.toml"
    document = tomllib.loads(file.read_text(encoding="utf-8"))
    return MappingProxyType(
        {name: ListedActuator.model_validate(entry) for name, entry in document.items()}
    )


def listed_actuator(name: str) -> ListedActuator:
    """Return an actuator of the library.

    Raises:
        RobotFileError: No actuator has this name.
    """
    listed = listed_actuators()
    if name not in listed:
        raise RobotFileError(f"actuator {name!r} is not listed; {instead_of(name, listed)}")
    return listed[name]
