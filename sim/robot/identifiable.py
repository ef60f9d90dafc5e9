"""Robot parameters that simulations can identify, and modelling conventions.

Those of thesis table 2.7 (3 + 3 L efficiencies + 4 L of feet) are inputs of the compiled kernel, so
that designs which differ only in them share one.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from typing import Final, TypeVar

from pydantic import BaseModel, ValidationError

from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.input import message_of
from gaitswarm.sim.robot.description import Actuator, Leg, RobotDescription, TorqueActuator
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.variables import Variable, listed_variables

_OF_LEGS: Final = listed_variables("robot_leg", "robot")
"""Contact parameters; their descriptions end with the name of the leg."""

_DRY_FRICTION: Final = ("coulomb_friction", "stribeck_friction", "load_friction")

CONVENTIONAL_VARIABLES: Final = listed_variables("robot_convention", "robot")
"""Values for the whole robot that the thesis omits, or gives more than once."""


@lru_cache(maxsize=32)
def identifiable_variables(robot: Robot) -> tuple[Variable, ...]:
    """Return all parameters in the order of table 2.7, with bounds around its values."""
    legs = robot.description.legs
    efficiency, friction = listed_variables("robot_joint", "robot")
    losses = friction if robot.is_torque_controlled else efficiency
    return (
        *listed_variables("robot", "robot"),
        *(_named(losses, joint) for joint in robot.joint_names),
        *(_named(variable, leg.name) for variable in _OF_LEGS for leg in legs),
    )


def with_parameters(robot: Robot, values: Mapping[str, float | str]) -> Robot:
    """Return the robot with some parameters and conventions at other values.

    Args:
        robot: Robot to start from.
        values: Values by name; of a convention a choice or its index.
    """
    conventions = _conventions(values)
    _check_gearheads(robot, values)
    numbers = _numbers({name: v for name, v in values.items() if name not in conventions})
    d = _with_conventions(robot.description, conventions)
    mass = numbers.get("body_mass", d.body_mass)
    if mass is not None and not mass > 0.0:
        raise SimulationInputError(f"body_mass: {mass:g} kg is not greater than 0")
    battery = {field: f"battery_{field}" for field in ("voltage", "resistance")}
    whole = {"body_mass": mass, "supply": _changed(d.supply, battery, numbers)}
    return replace(robot, description=_with_legs(d.model_copy(update=whole), numbers))


def _check_gearheads(robot: Robot, values: Mapping[str, float | str]) -> None:
    if not robot.is_torque_controlled:
        return
    for name in ("efficiency", *(f"efficiency_{joint}" for joint in robot.joint_names)):
        if name in values:
            raise SimulationInputError(
                f"{name}: torque-controlled actuators have no gearhead efficiency; set their"
                " friction instead"
            )


def _conventions(values: Mapping[str, float | str]) -> dict[str, float | str]:
    given = [variable for variable in CONVENTIONAL_VARIABLES if variable.name in values]
    try:
        return {v.name: v.shown(v.number(values[v.name])) for v in given}
    except ValueError as error:
        raise SimulationInputError(str(error)) from error


def _numbers(values: Mapping[str, float | str]) -> dict[str, float]:
    for name, value in values.items():
        if isinstance(value, str):
            raise SimulationInputError(f"{name}: {value!r} is not a number")
    return {name: float(value) for name, value in values.items()}


def _with_conventions(d: RobotDescription, values: Mapping[str, float | str]) -> RobotDescription:
    """Apply `CONVENTIONAL_VARIABLES` to all gearheads, all feet and the robot."""
    if not values:
        return d

    def changed(part: Part, *fields: str) -> Part:
        return _changed(part, {field: field for field in fields}, values)

    legs = tuple(
        leg.model_copy(update={"contact": leg.contact and changed(leg.contact, "slip_velocity")})
        for leg in d.legs
    )
    parts = {
        "gearheads": {
            name: changed(gear, "efficiency", *_DRY_FRICTION) for name, gear in d.gearheads.items()
        },
        "actuators": {
            name: changed(actuator, *_DRY_FRICTION)
            if isinstance(actuator, TorqueActuator)
            else actuator
            for name, actuator in d.actuators.items()
        },
        "supply": changed(d.supply, "energy"),
        "sensors": changed(d.sensors, "current_filter"),
        "contact": changed(d.contact, "slip_velocity"),
        "legs": legs,
    }
    whole = {field: values[field] for field in ("contact_law", "planned_soles") if field in values}
    described = d.model_copy(update=parts | whole)
    try:
        RobotDescription.model_validate(described.model_dump())
    except ValidationError as error:
        message = message_of(error.errors()[0])
        raise SimulationInputError(f"{', '.join(values)}: {message}") from error
    return described


def _with_legs(d: RobotDescription, values: Mapping[str, float]) -> RobotDescription:
    gearheads, actuators, legs = dict(d.gearheads), dict(d.actuators), list[Leg]()
    for leg in d.legs:
        names = list(leg.actuators)
        for index, joint in enumerate(leg.joints):
            actuator, own = actuators[names[index]], f"of {joint}"
            field = "efficiency" if isinstance(actuator, Actuator) else "viscous_friction"
            variables = {field: f"{field}_{joint}"}
            if variables[field] not in values:
                continue
            if isinstance(actuator, Actuator):
                gearheads[own] = _changed(gearheads[actuator.gearhead], variables, values)
                actuators[own] = actuator.model_copy(update={"gearhead": own})
            else:
                actuators[own] = _changed(actuator, variables, values)
            names[index] = own
        by_field = {variable.name: f"{variable.name}_{leg.name}" for variable in _OF_LEGS}
        own_contact = leg.contact
        if not values.keys().isdisjoint(by_field.values()):
            own_contact = _changed(leg.contact or d.contact, by_field, values)
        legs.append(leg.model_copy(update={"actuators": tuple(names), "contact": own_contact}))
    return d.model_copy(
        update={"gearheads": gearheads, "actuators": actuators, "legs": tuple(legs)}
    )


Part = TypeVar("Part", bound=BaseModel)


def _changed(part: Part, variables: Mapping[str, str], values: Mapping[str, float | str]) -> Part:
    update = {field: values[name] for field, name in variables.items() if name in values}
    if not update:
        return part
    try:
        return type(part).model_validate(part.model_dump() | update)
    except ValidationError as error:
        first = error.errors()[0]
        culprit = variables[str(first["loc"][0])]
        raise SimulationInputError(f"{culprit}: {message_of(first)}") from error


def _named(variable: Variable, of: str) -> Variable:
    return variable.model_copy(
        update={
            "name": f"{variable.name}_{of}",
            "description": f"{variable.description} {of.replace('_', ' ')}.",
        }
    )
