"""Designs from files, for `simulate` and `plot`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from cli.spec_file import read_json_object
from services.optimizer.errors import InvalidRequest
from sim.controllers import CONTROLLERS, Controller
from sim.scenario import GAIT_VARIABLES
from sim.variables import Variable

_PUBLISHED: Final = "published:"


def read_design(design: str, controller: str, trajectory: Path | None = None) -> dict[str, Any]:
    """Values by name, choices as their indices; numbers are not checked yet.

    design: a file with a flat object {name: value}, or with one under `design`, as `best --json`
        prints; or `published:NAME` for a design of the literature.
    trajectory: a file with gait parameters only, none of which a design file may set as well; a
        published design walks in this gait in place of its own.
    Raises InvalidRequest that names the field.
    """
    values = _read_values(design, controller)
    own = _controller(controller)
    known = (*own.variables, *own.conventions, *GAIT_VARIABLES)
    values = _checked(values, known, "design")
    if trajectory is None:
        return values
    gait = _checked(read_json_object(trajectory, "trajectory"), GAIT_VARIABLES, "trajectory")
    for name in gait:
        if name in values and not design.startswith(_PUBLISHED):
            raise InvalidRequest(
                "set in the design file too; choose one", field=f"trajectory.{name}"
            )
    return {**values, **gait}


def _read_values(design: str, controller: str) -> dict[str, Any]:
    if design.startswith(_PUBLISHED):
        published = _controller(controller).published
        name = design.removeprefix(_PUBLISHED)
        if name not in published:
            known = ", ".join(published)
            raise InvalidRequest(
                f"no published design {name!r} of {controller}; known are {known}", field="design"
            )
        return dict(published[name])
    content = read_json_object(Path(design), "design")
    values = content.get("design", content)
    if not isinstance(values, dict):
        raise InvalidRequest("must be an object of values by name", field="design")
    return values


def _controller(name: str) -> Controller:
    for known, controller in CONTROLLERS.items():
        if known == name:
            return controller
    raise InvalidRequest(
        f"unknown controller {name!r}; known are {', '.join(CONTROLLERS)}", field="controller"
    )


def _checked(values: dict[str, Any], known: Sequence[Variable], field: str) -> dict[str, Any]:
    """Values of known variables, with the index of a choice in place of its name."""
    variables = {variable.name: variable for variable in known}
    checked = dict(values)
    for name, value in values.items():
        if name not in variables:
            raise InvalidRequest(
                f"unknown variable; known are {', '.join(sorted(variables))}",
                field=f"{field}.{name}",
            )
        if variables[name].kind == "categorical" and isinstance(value, str):
            try:
                checked[name] = variables[name].number(value)
            except ValueError as error:
                raise InvalidRequest(
                    str(error).removeprefix(f"{name}: "), field=f"{field}.{name}"
                ) from error
    return checked
