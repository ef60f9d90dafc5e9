"""Job specs, robots, scenarios and designs from options and files."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from gaitswarm.cli.options import Place, full_id, name_and_value
from gaitswarm.services.optimizer.errors import InvalidRequest, NotFound
from gaitswarm.sim.catalogue import GAIT_VARIABLES
from gaitswarm.sim.controllers import CONTROLLERS, Controller, ControllerName
from gaitswarm.sim.input import unique_names
from gaitswarm.sim.near_names import instead_of
from gaitswarm.sim.robot import DEFAULT_ROBOT
from gaitswarm.sim.variables import Variable, VariableCatalogue

if TYPE_CHECKING:
    from pydantic import ValidationError

    from gaitswarm.cli.options import SpecOptions
    from gaitswarm.robots import RobotDefaults
    from gaitswarm.services.optimizer.jobs.documents import AnySpec
    from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
    from gaitswarm.sim.robot import RobotFiles, RobotVariant
    from gaitswarm.sim.scenario import Scenario

LARGEST_FILE: Final = 1 << 20
"""Largest accepted JSON file [B]; a spec takes a few kilobytes."""


def json_object(text: str, option: str) -> dict[str, Any]:
    """Return a JSON object from text, FILE, @FILE, or standard input for `-`."""
    if text.lstrip().startswith(("{", "[")):
        return _parsed(text, "", option)
    return read_json_object(Path(text.removeprefix("@")), option)


def read_json_object(path: Path, option: str) -> dict[str, Any]:
    """Read a JSON object from a file, or from standard input for `-`."""
    return _parsed(read_file(path, option), f"{path} ", option)


def read_file(path: Path, option: str, most: int = LARGEST_FILE) -> bytes:
    """Read a file of at most so many bytes, or standard input for `-`."""
    try:
        with sys.stdin.buffer if str(path) == "-" else path.open("rb") as file:
            content = file.read(most + 1)
    except OSError as error:
        raise InvalidRequest(f"cannot read {path}: {error.strerror}", field=option) from error
    if len(content) > most:
        raise InvalidRequest(f"{path} is larger than {most >> 20} MiB", field=option)
    return content


def _parsed(content: str | bytes, where: str, option: str) -> dict[str, Any]:
    try:
        value = json.loads(content, object_pairs_hook=unique_names)
    except RecursionError as error:
        raise InvalidRequest(f"{where}is nested too deeply", field=option) from error
    except ValueError as error:
        raise InvalidRequest(f"{where}is not valid JSON: {error}", field=option) from error
    if not isinstance(value, dict):
        raise InvalidRequest(f"{where}must be one JSON object, {{...}}", field=option)
    return value


def chosen_robot(text: str | None) -> str | RobotVariant | RobotFiles:
    """Return the robot of a name, a variant as JSON, or a folder."""
    from pydantic import TypeAdapter, ValidationError

    from gaitswarm.sim.robot import RobotSource
    from gaitswarm.specs import robot_source

    try:
        robot: str | RobotVariant | RobotFiles = TypeAdapter(RobotSource).validate_python(
            robot_source(_robot(text))
        )
    except ValidationError as error:
        raise _refusal(error, "robot") from error
    return robot


def build_spec(options: SpecOptions) -> AnySpec:
    """Return the spec of the file, or the default spec, with options applied."""
    from gaitswarm.specs import job_spec

    data = read_json_object(options.spec, "spec") if options.spec is not None else {}
    fields = {name: value for name, value in options.given.items() if name != "spec"}
    if options.scenarios is not None:
        fields["scenarios"] = scenario_data(options.scenarios, options.robot)
    if (terrain := fields.pop("terrain", None)) is not None:
        chosen = fields.get("scenarios") or data.get("scenarios")
        fields["scenarios"] = on_terrain(chosen or scenario_data("all", options.robot), terrain)
    if options.robot is not None:
        fields["robot"] = _robot(options.robot)
    case = options.case
    if case is not None and (case[0:1] in "{@" or case.endswith(".json")):
        fields["case"] = json_object(case, "case")
    constraints = constraint_choice(
        fields.pop("constraint", None), fields.pop("no_worse_than", None)
    )
    if constraints is not None:
        fields["constraints"] = constraints
    _merge_settings(fields, data.get("optimizer", {}))
    _merge_worlds(fields, data.get("worlds"))
    weights = weights_choice(fields.pop("scenario_weight", None))
    if weights is not None:
        fields["scenario_weights"] = weights
    _set_start(fields, data)
    with_gait = fields.pop("with_gait", False)
    spec = job_spec(data, **fields)
    return _with_gait(spec) if with_gait else spec


def _set_start(fields: dict[str, Any], data: Mapping[str, Any]) -> None:
    source, count = fields.pop("start_from", None), fields.pop("start_count", None)
    if source is None and count is None:
        return
    if source is None:
        raise InvalidRequest("requires --start-from", field="start-count")
    if "start" in data:
        raise InvalidRequest("the spec already has a start; choose one", field="start-from")
    from gaitswarm.specs import start_from

    fields["start"] = start_from(source, count)


def _merge_settings(fields: dict[str, Any], optimizer: object) -> None:
    """Merge settings and particles into `optimizer`, by default that of the file."""
    from gaitswarm.services.optimizer.jobs.spec import with_settings

    text, particles = fields.pop("optimizer_settings", None), fields.pop("particles", None)
    settings = {} if text is None else json_object(text, "optimizer-settings")
    if particles is not None:
        settings["particles"] = particles
    if not settings:
        return
    named = with_settings(fields.get("optimizer", optimizer), {})
    if "optimizer" in fields and isinstance(named, Mapping):
        method = named["name"]
        if settings.get("name", method) != method:
            raise InvalidRequest(
                f"are those of {settings['name']}, but the optimizer is {fields['optimizer']};"
                " leave out one of both names",
                field="optimizer-settings",
            )
    fields["optimizer"] = with_settings(named, settings)


def _merge_worlds(fields: dict[str, Any], worlds: object) -> None:
    """Merge options of worlds into those of the file."""
    names = {"worlds": "count", "aggregate": "aggregate", "level": "level", "worlds_seed": "seed"}
    values = {names[option]: fields.pop(option) for option in names if option in fields}
    if not values:
        return
    if "count" not in values and worlds is None:
        option = next(o for o, name in names.items() if name in values).replace("_", "-")
        raise InvalidRequest("requires --worlds", field=option)
    fields["worlds"] = {**(worlds if isinstance(worlds, Mapping) else {}), **values}


def optimizer_choice(name: str | None, settings: str | None) -> Any:
    """Return the unchecked field `optimizer` of a spec; None if both arguments are."""
    if settings is None:
        return name
    fields: dict[str, Any] = {} if name is None else {"optimizer": name}
    fields["optimizer_settings"] = settings
    _merge_settings(fields, {})
    return fields["optimizer"]


def constraint_choice(
    limits: Sequence[str] | None, no_worse_than: str | None, *, none: bool = False
) -> list[Any] | None:
    """Return the unchecked field `constraints` of a spec; None unless any option was passed."""
    if none:
        if limits or no_worse_than is not None:
            raise InvalidRequest("cannot be combined with constraints", field="no-constraints")
        return []
    chosen: list[Any] = list(limits or ())
    if no_worse_than is not None:
        reference = reference_choice(no_worse_than, "no-worse-than")
        chosen.append({"quantity": "*", "relative_to": reference, "max": 1.0})
    return chosen or None


def weights_choice(weights: Sequence[str] | None) -> dict[str, Any] | None:
    """Return the unchecked field `scenario_weights` of a spec; None without the option."""
    form = "NAME=WEIGHT, such as slope-fast=2"
    return dict(name_and_value(text, "scenario-weight", form) for text in weights or ()) or None


def reference_choice(text: str, option: str) -> Any:
    """Return `published:NAME` or a job's id unchanged, and the unchecked design of JSON."""
    if not (text.startswith(("{", "-")) or text.endswith(".json")):
        return text
    content = json_object(text, option)
    return content.get("design", content)


def preference_choice(text: str) -> Any:
    """Return a preference's name, or an unchecked one of JSON."""
    return json_object(text, "preference") if text.lstrip().startswith("{") else text


def _with_gait(spec: AnySpec) -> AnySpec:
    from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec

    if not isinstance(spec, JobSpec):
        raise InvalidRequest("only jobs that tune a drive have a gait", field="with-gait")
    extended = spec.with_gait_searched()
    extended.check_can_be_simulated()
    return extended


def _robot(text: str | None) -> str | dict[str, Any]:
    """Return a robot's name or folder, or an unchecked variant of JSON."""
    if text is None:
        return DEFAULT_ROBOT
    return json_object(text, "robot") if text.lstrip().startswith("{") else text


def robot_defaults(text: str | None) -> RobotDefaults:
    """Return the defaults of a robot's folder; the general ones for any other robot."""
    from gaitswarm.robots import RobotDefaults
    from gaitswarm.robots import robot_defaults as defaults_of

    if text is None or text.lstrip().startswith("{"):
        return RobotDefaults()
    return defaults_of(text)


def scenario_data(text: str, robot: str | None = None) -> list[str | dict[str, Any]]:
    """Return the unchecked field `scenarios` of a spec: names, numbers and contents of files."""
    defaults = robot_defaults(robot)
    if text == "all":
        return defaults.scenarios
    named = defaults.own_scenarios
    numbered = {str(number): entry for number, entry in enumerate(named.values(), start=1)}
    entries = [entry.strip() for entry in text.split(",")]
    return [
        named.get(entry)
        or numbered.get(entry)
        or (read_json_object(Path(entry), "scenario") if entry.endswith(".json") else entry)
        for entry in entries
    ]


def on_terrain(
    entries: Sequence[str | Mapping[str, Any] | Scenario], text: str
) -> list[dict[str, Any]]:
    """Return scenarios on another terrain, in the text of --terrain."""
    from gaitswarm.sim.scenario import Scenario, find_scenario

    terrain = _terrain(text)
    scenarios = []
    for entry in entries:
        full = entry if isinstance(entry, Mapping | Scenario) else find_scenario(entry)
        document = full.model_dump(mode="json") if isinstance(full, Scenario) else dict(full)
        scenarios.append(document | {"terrain": terrain})
    return scenarios


_NUMBERS: Final = {
    "plane": (),
    "rough": ("amplitude", "correlation_length", "seed"),
    "steps": ("height", "depth", "start"),
    "stairs": ("height", "depth", "start"),
}
"""Fields of a kind of terrain that follow it in --terrain."""


def _terrain(text: str) -> dict[str, Any]:
    if text.lstrip().startswith("{") or text.endswith(".json"):
        return json_object(text, "terrain")
    kind, *parts = text.split(":")
    if kind == "grid" and len(parts) == 2:
        from gaitswarm.robots import read_text

        lines = read_text(Path(parts[0]), field="terrain", most=LARGEST_FILE).split()
        return {"kind": kind, "cell": parts[1], "heights": [line.split(",") for line in lines]}
    if len(parts) > len(_NUMBERS.get(kind, ())):
        raise InvalidRequest(
            f"{text!r} is not rough:AMPLITUDE[:CORRELATION_LENGTH[:SEED]], steps or"
            " stairs:HEIGHT[:DEPTH[:START]], grid:FILE.csv:CELL, plane or FILE.json",
            field="terrain",
        )
    return {"kind": kind} | dict(zip(_NUMBERS.get(kind, ()), parts, strict=False))


def chosen_scenarios(text: str, robot: str | None = None) -> tuple[Scenario, ...]:
    return tuple(map(_scenario, scenario_data(text, robot)))


def one_scenario(text: str | None, robot: str | None, *, preset: str) -> Scenario:
    """Return one scenario; by default the first of the robot's folder, else the preset."""
    first = "1" if robot_defaults(robot).own_scenarios else preset
    scenarios = chosen_scenarios(text or first, robot)
    if len(scenarios) != 1:
        raise InvalidRequest("must name one scenario", field="scenario")
    return scenarios[0]


def _scenario(entry: str | dict[str, Any]) -> Scenario:
    from pydantic import ValidationError

    from gaitswarm.sim.scenario import Scenario, find_scenario

    if isinstance(entry, str):
        return find_scenario(entry)
    try:
        return Scenario.model_validate(entry)
    except ValidationError as error:
        raise _refusal(error, "scenario") from error


def _refusal(error: ValidationError, option: str) -> InvalidRequest:
    from gaitswarm.views.base import field_errors

    first = field_errors(error.errors(include_url=False), prefix=option)[0]
    return InvalidRequest(first.message, field=first.field)


_PUBLISHED: Final = "published:"
_JOB: Final = "job:"


@dataclass(frozen=True, slots=True)
class GivenDesign:
    """A design from a file, from the literature, or a job's best, with numbers for choices."""

    label: str
    controller: ControllerName
    values: dict[str, float]
    spec: JobSpec | None = None

    def robot(self, option: str | None) -> str | RobotVariant | RobotFiles:
        """Return the robot of the option, else the job's, else the default."""
        if option is None and self.spec is not None:
            return self.spec.robot
        return chosen_robot(option)

    def scenarios(self, option: str | None, robot: str | None) -> Sequence[Any]:
        """Return the unchecked scenarios of the option, else the job's, else all of the robot."""
        if option is None and self.spec is not None:
            return self.spec.resolved_scenarios()
        return scenario_data(option or "all", robot)


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

    design: a JSON object {name: value}, or one with it under `design`; a file of it; or
    `published:NAME`. trajectory: a file of gait parameters, which replace those of a published
    design only.
    """
    law, is_published = CONTROLLERS[_controller_name(controller)], design.startswith(_PUBLISHED)
    if is_published:
        values = _published(law, controller, design.removeprefix(_PUBLISHED))
    else:
        content = json_object(design, "design")
        values = content.get("design", content)
        if not isinstance(values, dict):
            raise InvalidRequest("must be an object of values by name", field="design")
    values = _checked(values, (*law.variables, *law.conventions, *GAIT_VARIABLES), "design")
    return _in_gait(values, trajectory, replacing=is_published)


def _published(law: Controller, controller: str, name: str) -> dict[str, Any]:
    if not law.published:
        names = ", ".join(variable.name for variable in law.variables)
        raise InvalidRequest(
            f"no design of {controller} was published; pass a JSON object or a file with values of"
            f" {names}, or job:ID for the best of a job",
            field="design",
        )
    if name not in law.published:
        raise InvalidRequest(
            f"no published design {name!r} of {controller}; {instead_of(name, law.published)}",
            field="design",
        )
    return dict(law.published[name])


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
