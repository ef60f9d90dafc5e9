"""All that a walk's design may give, and its values by name: numbers, and choices by name."""

from __future__ import annotations

from collections.abc import Mapping

from gaitswarm.sim.controllers import CONTROLLERS
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.gait_variables import GAIT_VARIABLES
from gaitswarm.sim.input.near_names import instead_of
from gaitswarm.sim.variables import VariableCatalogue


def design_catalogue(controller: str) -> VariableCatalogue:
    """Everything that a design of a controller may give.

    Args:
        controller: Name of the controller.

    Returns:
        The controller's variables and conventions and the gait's variables, by name.
    """
    family = CONTROLLERS[controller]
    known = (*family.variables, *family.conventions, *GAIT_VARIABLES)
    return VariableCatalogue(known)


def check_design(controller: str, design: Mapping[str, float | str]) -> None:
    """Check that a design gives all variables of a controller, and beside them only optional ones.

    Args:
        controller: Name of the controller.
        design: Values by name.

    Raises:
        SimulationInputError: A variable is unknown or missing, or its value is none; the message
            begins with `design`, or `design.` and the variable, and a colon.
    """
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
    """A design as the simulator takes it.

    Args:
        controller: Name of the controller.
        design: Values by name; of a categorical variable a choice's name or index. Names that the
            catalogue does not have are left as they are, for whoever checks names.

    Returns:
        Numbers by name.

    Raises:
        SimulationInputError: A value is no number, or none of the choices; names the variable.
    """
    catalogue = design_catalogue(controller)
    numbers = {}
    for name, value in design.items():
        try:
            known = catalogue.get(name)
            numbers[name] = float(value) if known is None else known.number(value)
        except ValueError as error:
            raise SimulationInputError(str(error)) from error
    return numbers


def design_shown(controller: str, design: Mapping[str, float]) -> dict[str, float | str]:
    """A design as people read it; the inverse of `design_numbers`.

    Args:
        controller: Name of the controller.
        design: Numbers by name.

    Returns:
        Values by name; of a categorical variable the choice's name.
    """
    catalogue = design_catalogue(controller)
    return {
        name: catalogue[name].shown(value) if name in catalogue else value
        for name, value in design.items()
    }
