"""Specs, robots and scenarios from objects, names, folders or documents."""

from __future__ import annotations

import csv
import math
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final, Literal, TypeAlias, TypedDict, TypeVar, Unpack, cast, overload

from pydantic import BaseModel, ValidationError

from gaitswarm.services.optimizer.errors import InvalidRequest, simulation_errors
from gaitswarm.services.optimizer.jobs.constraints import Constraint
from gaitswarm.services.optimizer.jobs.documents import SPECS, AnySpec
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.kinds.tuning_worlds import TuningWorlds
from gaitswarm.services.optimizer.jobs.preference import Preference, PreferenceName
from gaitswarm.services.optimizer.jobs.spec import EarlierJobs, Spec, with_settings
from gaitswarm.services.optimizer.search.registry import OptimizerName, OptimizerSettings
from gaitswarm.sim.case_registry import CaseSettings
from gaitswarm.sim.controllers import ControllerName
from gaitswarm.sim.input import numbers_from_booleans, with_known_keys
from gaitswarm.sim.kernel import Precision
from gaitswarm.sim.robot import RobotFiles, RobotVariant
from gaitswarm.sim.robot.variant import SHIPPED
from gaitswarm.sim.scenario import Scenario
from gaitswarm.sim.variables import Variable
from gaitswarm.views.base import field_errors

M = TypeVar("M", bound=BaseModel)

Document: TypeAlias = Mapping[str, Any]
"""A mapping as read from JSON."""

RobotInput: TypeAlias = str | os.PathLike[str] | RobotVariant | RobotFiles | Document
"""A shipped robot by name, a variant of one, or a custom one by folder or text of its files."""

ScenarioInput: TypeAlias = str | Scenario | Document
"""A preset by name or number, or a custom scenario."""

PreferenceInput: TypeAlias = PreferenceName | Preference | Document
"""A, B or C of table 4.5, chapter-3 (eq. 3.1), or a custom preference."""

ConstraintInput: TypeAlias = str | Constraint | Document
"""A limit that designs keep, such as "speed>=0.05", or a document as in docs/constraints.md."""

StartInput: TypeAlias = str | os.PathLike[str] | Sequence[Document] | EarlierJobs | Document
"""Designs by name; a CSV file of them; or earlier jobs, by their ids separated by commas or as the
document of `EarlierJobs`."""

SpecInput: TypeAlias = Spec | Document
"""A job of any kind, as object or as document."""


class _SharedOptions(TypedDict, total=False):
    name: str
    robot: RobotInput
    scenarios: ScenarioInput | Iterable[ScenarioInput]
    preference: PreferenceInput
    constraints: Sequence[ConstraintInput]
    optimizer: OptimizerName | OptimizerSettings | Document
    particles: int
    iterations: int
    scenario_weights: Mapping[str, float]
    scenario_aggregate: Literal["mean", "worst"]


class SpecOptions(_SharedOptions, total=False):
    """Fields of a `JobSpec` as keywords; the defaults are the job of the thesis's chapter 4.

    Besides the values of a document, `robot` takes a folder with robot.toml and robot.urdf, whose
    job.json has further defaults; `scenarios` a single one; `optimizer` settings such as
    `PsoSettings`; and `start` a CSV file, or ids of earlier jobs, separated by commas, for their
    five best designs. `particles` replaces those of `optimizer`.
    """

    controller: ControllerName
    variables: Sequence[str | Variable | Document]
    fixed: Mapping[str, float | str]
    seed: int
    start: StartInput
    precision: Precision
    case: str | CaseSettings | Document | None
    worlds: TuningWorlds | Document | None


class ForkOptions(_SharedOptions, total=False):
    """Fields of a `ForkRequest` as keywords, with the values of `SpecOptions`."""

    bounds: Mapping[str, tuple[float, float]]
    start_count: int
    accept_changes: bool


def laid_options(options: Mapping[str, Any]) -> dict[str, Any]:
    """Convert keyword options to a document that includes a custom robot's files."""
    given: dict[str, Any] = dict(options)
    if "robot" in given:
        given["robot"] = robot_source(given["robot"])
    if "scenarios" in given:
        given["scenarios"] = scenario_entries(given["scenarios"])
    return given


def invalid_request(error: ValidationError, model: Any = None) -> InvalidRequest:
    """Convert pydantic's errors to one InvalidRequest."""
    found = with_known_keys(error.errors(include_url=False), model)
    first, *others = field_errors(found)
    more = "".join(f"; {o.field}: {o.message}" if o.field else f"; {o.message}" for o in others)
    return InvalidRequest(first.message + more, field=first.field)


def checked(kind: type[M], arguments: Mapping[str, Any]) -> M:
    """Validate keyword arguments as a request; None leaves a field at its default."""
    given = {name: value for name, value in arguments.items() if value is not None}
    try:
        return kind.model_validate(laid_options(given))
    except ValidationError as error:
        raise invalid_request(error, kind) from error


@overload
def job_spec(spec: None = None, **options: Unpack[SpecOptions]) -> JobSpec: ...


@overload
def job_spec(spec: SpecInput, **options: Unpack[SpecOptions]) -> AnySpec: ...


def job_spec(spec: SpecInput | None = None, **options: Unpack[SpecOptions]) -> AnySpec:
    """Build the specification of a job and check that it can be simulated; nothing is stored.

    Args:
        spec: Job to start from, as an object or as a document; None for the defaults.
        **options: Fields laid over `spec`, see `SpecOptions`.

    Returns:
        The specification, for `gaitswarm.optimize` and `Jobs.submit`.

    Raises:
        InvalidRequest: A field is invalid or the job cannot be simulated; names the field.
    """
    chosen = chosen_spec(spec, options)
    with simulation_errors("spec"):
        chosen.check_can_be_simulated()
    return chosen


def chosen_spec(spec: SpecInput | None, options: SpecOptions) -> AnySpec:
    """Combine a spec with keyword options."""
    if isinstance(spec, Spec) and not options:
        return cast(AnySpec, spec)
    document = dict(spec.model_dump() if isinstance(spec, Spec) else spec or {})
    given = laid_options(options)
    if "particles" in given:
        settings = given.get("optimizer", document.get("optimizer", {}))
        given["optimizer"] = with_settings(settings, {"particles": given.pop("particles")})
    document = _folder_defaults(options.get("robot"), document | given) | document
    if isinstance(given.get("start"), str | os.PathLike):
        given["start"] = start_from(given["start"])
    document |= given
    try:
        combined = SPECS.validate_python(document)
        for where in numbers_from_booleans(document, combined.model_dump()):
            raise InvalidRequest("must be a number", field=".".join(map(str, where)))
        return combined
    except ValidationError as error:
        raise invalid_request(error, AnySpec) from error


def _folder_defaults(robot: RobotInput | None, document: Mapping[str, Any]) -> dict[str, Any]:
    """Defaults from the folder of a robot; none for other robots."""
    if not isinstance(robot, str | os.PathLike) or robot in SHIPPED:
        return {}
    if document.get("kind", "tuning") != "tuning":
        return {}
    from gaitswarm.robots import robot_defaults

    return robot_defaults(robot).of_controller(document.get("controller"))


def scenario_entries(
    scenarios: ScenarioInput | Iterable[ScenarioInput],
) -> tuple[ScenarioInput, ...]:
    """Convert one scenario or several to a tuple."""
    if isinstance(scenarios, str | Scenario | Mapping):
        return (scenarios,)
    return tuple(scenarios)


def robot_source(robot: RobotInput) -> str | RobotVariant | RobotFiles | dict[str, Any]:
    """Convert a robot to the `robot` field of a spec."""
    if isinstance(robot, str | os.PathLike):
        if robot in SHIPPED:
            return str(robot)
        return _read_folder(Path(robot))
    return dict(robot) if isinstance(robot, Mapping) else robot


def _read_folder(folder: Path) -> dict[str, Any]:
    if not folder.is_dir():
        raise InvalidRequest(
            f"unknown robot {str(folder)!r}; known are {', '.join(SHIPPED)}, or name a folder that"
            " holds robot.toml and robot.urdf",
            field="robot",
        )
    files = {kind: folder / f"robot.{kind}" for kind in ("toml", "urdf")}
    missing = ", ".join(path.name for path in files.values() if not path.is_file())
    if missing:
        raise InvalidRequest(
            f"{folder} is not a robot's folder: No such file: {missing}", field="robot"
        )
    from gaitswarm.robots import read_text

    return {kind: read_text(path, field="robot") for kind, path in files.items()}


_DESIGN: Final = "design."
"""Prefix of variables in a table of evaluations."""

_FITNESS: Final = "fitness"

Design = dict[str, float | str]


def start_from(
    source: str | os.PathLike[str], count: int | None = None
) -> tuple[Design, ...] | dict[str, Any]:
    """Start designs from a file or from identifiers of jobs."""
    if count is not None and count < 1:
        raise InvalidRequest("must be at least 1", field="start_count")
    if Path(source).suffix.lower() == ".csv":
        return read_designs(Path(source), count)
    if Path(source).is_file():
        raise InvalidRequest(
            f"{os.fspath(source)} is a file, of which only CSV is read: its name must end in .csv",
            field="start",
        )
    ids = [entry.strip() for entry in str(source).split(",") if entry.strip()]
    return {"jobs": ids} if count is None else {"jobs": ids, "count": count}


def read_designs(path: Path, count: int | None = None) -> tuple[Design, ...]:
    """Read designs from a CSV file: one row a design, one column a variable."""
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            rows = list(_rows(csv.DictReader(file, strict=True)))
    except OSError as error:
        raise InvalidRequest(f"cannot read {path}: {error.strerror}", field="start") from error
    except (csv.Error, UnicodeDecodeError) as error:
        raise InvalidRequest(f"{path} is not a CSV file: {error}", field="start") from error
    rows.sort(key=lambda row: row[0])
    different = dict.fromkeys(tuple(design.items()) for _, design in rows)
    if not different:
        raise InvalidRequest(
            f"{path} has no designs; its first line names variables, and every other line is a"
            " design",
            field="start",
        )
    return tuple(dict(design) for design in different)[:count]


def _rows(reader: csv.DictReader[str]) -> Iterator[tuple[float, Design]]:
    """Yield fitness and design; a file without fitness is in order."""
    names = list(reader.fieldnames or ())
    exported = any(name.startswith(_DESIGN) for name in names)
    for cells in reader:
        if None in cells:
            raise csv.Error(f"line {reader.line_num} has more cells than the first line has names")
        design: Design = {}
        for name in names:
            text = (cells[name] or "").strip()
            if text and name != _FITNESS and name.startswith(_DESIGN if exported else ""):
                design[name.removeprefix(_DESIGN)] = _value(text)
        fitness = _value((cells[_FITNESS] or "nan").strip()) if _FITNESS in names else 0.0
        if isinstance(fitness, float) and math.isfinite(fitness):
            yield fitness, design


def _value(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text
