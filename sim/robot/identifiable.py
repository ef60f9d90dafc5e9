"""Parameters of a robot that walks can tell (thesis table 2.7): 3 + 3 L efficiencies + 4 L of feet.

All are inputs of the compiled kernel, so designs that differ in them share one.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache
from typing import Final, TypeVar

from pydantic import BaseModel, ValidationError

from sim.errors import SimulationInputError
from sim.robot.description import Leg, RobotDescription
from sim.robot.robot import Robot
from sim.variables import Variable

_WHOLE: Final = (
    Variable(
        name="battery_voltage",
        low=8.0,
        high=13.0,
        unit="V",
        description="Open-circuit voltage of the battery.",
    ),
    Variable(
        name="battery_resistance",
        low=0.02,
        high=0.6,
        unit="ohm",
        description="Internal resistance of the battery.",
    ),
    Variable(name="body_mass", low=2.0, high=6.0, unit="kg", description="Mass of the body."),
)

_EFFICIENCY: Final = Variable(
    name="efficiency", low=0.25, high=0.98, unit="1", description="Efficiency of the gearhead of"
)  # fmt: skip

_CONTACT: Final = {
    "stiffness": Variable(
        name="stiffness",
        low=1000.0,
        high=20_000.0,
        unit="N/m",
        description="Stiffness of the sole of",
    ),
    "damping": Variable(
        name="damping", low=50.0, high=3000.0, unit="N s/m", description="Damping of the sole of"
    ),
    "sole": Variable(
        name="sole", low=0.004, high=0.016, unit="m", description="Length of the sole's spring of"
    ),
    "friction": Variable(
        name="friction", low=0.05, high=3.0, unit="1", description="Friction of the foot of"
    ),
}


@lru_cache(maxsize=32)
def identifiable_variables(robot: Robot) -> tuple[Variable, ...]:
    """All parameters in the order of table 2.7, bounds around its trial values and intervals.

    Args:
        robot: Whose joints and legs name them: efficiency_<joint> for every joint; stiffness_,
            damping_, sole_ and friction_<leg> for every leg.

    Returns:
        The variables.
    """
    legs = robot.description.legs
    return (
        *_WHOLE,
        *(_named(_EFFICIENCY, joint) for joint in robot.joint_names),
        *(_named(variable, leg.name) for variable in _CONTACT.values() for leg in legs),
    )


def with_parameters(robot: Robot, values: Mapping[str, float]) -> Robot:
    """The same robot with some of `identifiable_variables` at other values.

    Args:
        robot: The robot.
        values: By name.

    Returns:
        The changed robot.

    Raises:
        SimulationInputError: No robot can have a value; names it.
    """
    d = robot.description
    mass = values.get("body_mass", d.body_mass)
    if mass is not None and not mass > 0.0:
        raise SimulationInputError(f"body_mass: {mass:g} kg is not greater than 0")
    battery = {field: f"battery_{field}" for field in ("voltage", "resistance")}
    whole = {"body_mass": mass, "supply": _changed(d.supply, battery, values)}
    return replace(robot, description=_with_legs(d.model_copy(update=whole), values))


def _with_legs(d: RobotDescription, values: Mapping[str, float]) -> RobotDescription:
    """Each joint that is named gets a gearhead of its own, each foot contact of its own."""
    gearheads, actuators, legs = dict(d.gearheads), dict(d.actuators), list[Leg]()
    for leg in d.legs:
        names = list(leg.actuators)
        for index, joint in enumerate(leg.joints):
            variable = f"efficiency_{joint}"
            if variable in values:
                own, actuator = f"of {joint}", actuators[names[index]]
                gearheads[own] = _changed(
                    gearheads[actuator.gearhead], {"efficiency": variable}, values
                )
                actuators[own] = actuator.model_copy(update={"gearhead": own})
                names[index] = own
        by_field = {field: f"{field}_{leg.name}" for field in _CONTACT}
        own_contact = leg.contact
        if not values.keys().isdisjoint(by_field.values()):
            own_contact = _changed(leg.contact or d.contact, by_field, values)
        legs.append(leg.model_copy(update={"actuators": tuple(names), "contact": own_contact}))
    return d.model_copy(
        update={"gearheads": gearheads, "actuators": actuators, "legs": tuple(legs)}
    )


Part = TypeVar("Part", bound=BaseModel)


def _changed(part: Part, variables: Mapping[str, str], values: Mapping[str, float]) -> Part:
    """A part of the robot with fields set from those variables that have a value."""
    update = {field: values[name] for field, name in variables.items() if name in values}
    if not update:
        return part
    try:
        return type(part).model_validate(part.model_dump() | update)
    except ValidationError as error:
        first = error.errors()[0]
        culprit = variables[str(first["loc"][0])]
        raise SimulationInputError(f"{culprit}: {first['msg']}") from error


def _named(variable: Variable, of: str) -> Variable:
    return variable.model_copy(
        update={
            "name": f"{variable.name}_{of}",
            "description": f"{variable.description} {of.replace('_', ' ')}.",
        }
    )
