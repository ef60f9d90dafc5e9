"""Designs from arguments: JSON, files, published names, ids of jobs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from gaitswarm.cli.inputs.options import Place, full_id
from gaitswarm.cli.inputs.robots import chosen_robot, robot_defaults
from gaitswarm.cli.inputs.spec_file import json_object, read_json_object
from gaitswarm.services.optimizer.errors import InvalidRequest, NotFound
from gaitswarm.sim.controllers import CONTROLLERS, Controller, ControllerName
from gaitswarm.sim.gait_variables import GAIT_VARIABLES
from gaitswarm.sim.near_names import instead_of
from gaitswarm.sim.variables import Variable, VariableCatalogue

if TYPE_CHECKING:
    from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
    from gaitswarm.sim.robot import RobotFiles, RobotVariant

_PUBLISHED: Final = "published:"
_JOB: Final = "job:"


@dataclass(frozen=True, slots=True)
class GivenDesign:
    """A design from a file, from the literature, or a job's best.

    Attributes:
        values: in the variables' units, by name; indices of choices for categorical variables.
        spec: of the job whose best design it is; None for other designs.
    """

    label: str
    controller: ControllerName
    values: dict[str, float]
    spec: JobSpec | None = None

    def robot(self, option: str | None) -> str | RobotVariant | RobotFiles:
        """Return the robot of the option, else the job's, else the default."""
        if option is None and self.spec is not None:
            return self.spec.robot
        return chosen_robot(option)


def given_design(
    given: str,
    controller: str | None,
    trajectory: Path | None = None,
    *,
    robot: str | None = None,
    place: Place,
) -> GivenDesign:
    """Return the design of an argument DESIGN|ID."""
    if not may_be_file(given):
        best = _best_of_job(given.removeprefix(_JOB), controller, place)
        return replace(best, values=_in_gait(best.values, trajectory))
    if given.startswith(_PUBLISHED):
        label = f"published {given.removeprefix(_PUBLISHED)}"
    else:
        label = "design" if _is_json(given) else Path(given).stem
    name = _controller_name(controller or robot_defaults(robot).controller)
    return GivenDesign(label, name, read_design(given, name, trajectory))


def may_be_file(given: str) -> bool:
    """Return whether an argument DESIGN|ID names anything but a job."""
    if given.startswith(_JOB):
        return False
    named = given == "-" or given.startswith(_PUBLISHED) or given.endswith(".json")
    return named or _is_json(given) or Path(given).exists()


def _is_json(given: str) -> bool:
    return given.lstrip().startswith("{")


def _best_of_job(job_id: str, controller: str | None, place: Place) -> GivenDesign:
    from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
    from gaitswarm.sim.catalogue import design_numbers

    with place.open() as jobs:
        job_id = full_id(jobs, job_id)
        try:
            spec = jobs.job(job_id).spec
        except NotFound as error:
            hint = "pass the id of a job, a file, or published:NAME"
            raise NotFound(f"{error}; {hint}") from error
        if not isinstance(spec, JobSpec):
            raise InvalidRequest(
                f"job {job_id} is of kind {spec.kind}, which tunes no drive", field="design"
            )
        best = jobs.best(job_id)
    if controller not in (None, spec.controller):
        raise InvalidRequest(
            f"job {job_id} tunes {spec.controller}, not {controller}", field="controller"
        )
    values = design_numbers(spec.controller, best.design)
    return GivenDesign(spec.name or f"job {job_id}", spec.controller, values, spec)


def read_design(design: str, controller: str, trajectory: Path | None = None) -> dict[str, Any]:
    """Read values by name, with indices of choices; numbers are not checked yet.

    design: a JSON object {name: value}, or one with it under `design`, as printed by
        `best --json`; a file of it; `published:NAME`; or `job:ID` for the best of a job in the
        environment's database.
    trajectory: a file of gait parameters; they replace those of a published design, but must not
        repeat those of a design file.
    """
    values = _read_values(design, controller)
    law = _controller(controller)
    values = _checked(values, (*law.variables, *law.conventions, *GAIT_VARIABLES), "design")
    return _in_gait(values, trajectory, replacing=design.startswith(_PUBLISHED))


def _in_gait(
    values: dict[str, Any], trajectory: Path | None, *, replacing: bool = False
) -> dict[str, Any]:
    """Add the gait parameters of a file to a design; replacing: also replace its own."""
    if trajectory is None:
        return values
    gait = _checked(read_json_object(trajectory, "trajectory"), GAIT_VARIABLES, "trajectory")
    for name in gait:
        if name in values and not replacing:
            raise InvalidRequest("also set in the design; choose one", field=f"trajectory.{name}")
    return {**values, **gait}


def _read_values(design: str, controller: str) -> dict[str, Any]:
    if design.startswith(_PUBLISHED):
        published = _controller(controller).published
        name = design.removeprefix(_PUBLISHED)
        if not published:
            names = ", ".join(variable.name for variable in _controller(controller).variables)
            raise InvalidRequest(
                f"no design of {controller} was published; pass a JSON object or a file with"
                f" values of {names}, or job:ID for the best of a job",
                field="design",
            )
        if name not in published:
            raise InvalidRequest(
                f"no published design {name!r} of {controller}; {instead_of(name, published)}",
                field="design",
            )
        return dict(published[name])
    if design.startswith(_JOB):
        return _best_of_job(design.removeprefix(_JOB), controller, Place()).values
    if _is_json(design):
        content = json_object(design, "design")
    else:
        content = read_json_object(Path(design), "design")
    values = content.get("design", content)
    if not isinstance(values, dict):
        raise InvalidRequest("must be an object of values by name", field="design")
    return values


def _controller(name: str) -> Controller:
    return CONTROLLERS[_controller_name(name)]


def _controller_name(name: str) -> ControllerName:
    if name not in CONTROLLERS:
        raise InvalidRequest(CONTROLLERS.unknown(name), field="controller")
    return name


def _checked(values: dict[str, Any], allowed: Sequence[Variable], field: str) -> dict[str, Any]:
    """Check names, and replace names of choices by their indices."""
    variables = VariableCatalogue(allowed)
    checked = dict(values)
    for name, value in values.items():
        if name not in variables:
            raise InvalidRequest(
                f"unknown variable; {instead_of(name, sorted(variables))}",
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
