"""Values of designs by name: variables of controllers and gaits."""

from __future__ import annotations

from collections.abc import Mapping

from gaitswarm.sim.controllers import CONTROLLERS
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.gait_variables import GAIT_VARIABLES
from gaitswarm.sim.near_names import instead_of
from gaitswarm.sim.variables import VariableCatalogue


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
