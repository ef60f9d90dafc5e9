"""Values of designs by name: variables of controllers and gaits."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Final

from pydantic import ValidationError

from gaitswarm.sim.controllers import CONTROLLERS
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.input import message_of
from gaitswarm.sim.near_names import instead_of
from gaitswarm.sim.scenario import Scenario
from gaitswarm.sim.variables import (
    Variable,
    VariableCatalogue,
    listed_variables,
    split_name,
)

GAIT_VARIABLES: Final = listed_variables("gait")
"""Gait parameters that a design may set besides the controller's, the first as in thesis table 3.2.

A value set by a design replaces the scenario's own in every scenario. Bounds suit Szabad(ka)-II.
"""

GAIT_CATALOGUE: Final = VariableCatalogue(GAIT_VARIABLES)
"""The same by name, including those of groups, such as `stride[front]`."""


def orders_searched(searched: Iterable[Variable]) -> list[dict[str, float]]:
    """Return every order of footfalls that a search may choose."""
    known = GAIT_CATALOGUE["gait"]
    choices = [choice for v in searched if v.name == known.name for choice in v.choices]
    return [{known.name: known.number(choice)} for choice in choices] or [{}]


def with_gait(scenario: Scenario, gait: Mapping[str, float]) -> Scenario:
    if not gait:
        return scenario
    values: dict[str, Any] = {name: v for name, v in gait.items() if split_name(name)[1] is None}
    of_groups = {name: value for name, value in gait.items() if name not in values}
    if of_groups:
        values["by_group"] = {**(scenario.by_group or {}), **of_groups}
    for variable in GAIT_VARIABLES:
        if variable.kind == "categorical" and variable.name in values:
            try:
                values[variable.name] = variable.shown(variable.number(values[variable.name]))
            except ValueError as error:
                raise SimulationInputError(str(error)) from error
    if "fir_ms" in values:
        if not float(values["fir_ms"]).is_integer():
            raise SimulationInputError(f"fir_ms: {values['fir_ms']:g} is not a whole number of ms")
        values["fir_ms"] = int(values["fir_ms"])
    if "gait" in values:
        values["phases"] = None
    try:
        return Scenario.model_validate(scenario.model_dump() | values)
    except ValidationError as error:
        first = error.errors()[0]
        message = message_of(first).removeprefix("by_group.")
        where = ".".join(str(part) for part in first["loc"])
        raise SimulationInputError(f"{where}: {message}" if where else message) from error


def design_catalogue(controller: str) -> VariableCatalogue:
    family = CONTROLLERS[controller]
    known = (*family.variables, *family.conventions, *GAIT_VARIABLES)
    return VariableCatalogue(known)


def check_design(controller: str, design: Mapping[str, float | str]) -> None:
    """Check that a design sets all variables of a controller, and otherwise only optional ones."""
    known = design_catalogue(controller)
    for name in design:
        if name not in known:
            raise SimulationInputError(
                f"design: unknown variable {name!r}; {instead_of(name, known)}"
            )
    needed = [variable.name for variable in CONTROLLERS[controller].variables]
    missing = [name for name in needed if name not in design]
    if missing:
        raise SimulationInputError(f"design: {', '.join(missing)} missing; {controller} needs it")
    try:
        design_numbers(controller, design)
    except SimulationInputError as error:
        raise SimulationInputError(f"design.{error}") from error


def design_numbers(controller: str, design: Mapping[str, float | str]) -> dict[str, float]:
    catalogue = design_catalogue(controller)
    numbers = {}
    for name, value in design.items():
        try:
            variable = catalogue.get(name)
            numbers[name] = float(value) if variable is None else variable.number(value)
        except ValueError as error:
            raise SimulationInputError(str(error)) from error
    return numbers


def design_shown(controller: str, design: Mapping[str, float]) -> dict[str, float | str]:
    catalogue = design_catalogue(controller)
    return {
        name: catalogue[name].shown(value) if name in catalogue else value
        for name, value in design.items()
    }
