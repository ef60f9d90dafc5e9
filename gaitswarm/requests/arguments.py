"""Arguments as a program gives them, made into checked values and requests.

They raise InvalidRequest that names the argument, before anything is asked of a database or server;
a controller that does not exist is NotFound, as its path on a server is.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from enum import StrEnum
from typing import Any, TypeVar, cast, get_args

from pydantic import BaseModel, ValidationError

from gaitswarm.errors import InvalidRequest, NotFound, invalid_request
from gaitswarm.requests.replay import ReplayRequest
from gaitswarm.requests.robustness import RobustnessOptions, RobustnessRequest
from gaitswarm.requests.surface import SurfaceRequest
from gaitswarm.requests.walk import SimulationRequest
from gaitswarm.specs import (
    ForkOptions,
    PreferenceInput,
    RobotInput,
    ScenarioInput,
    laid_options,
    robot_source,
    scenario_entries,
)
from gaitswarm.tables import TableFormat
from gaitswarm.views import RankingRequest
from services.optimizer.analysis.fits.targets import LeaveOut
from services.optimizer.analysis.robustness.certificate import MOST_WORST
from services.optimizer.jobs.fork import ForkRequest
from services.optimizer.jobs.job import Command, JobOrder, JobState
from sim.controllers import CONTROLLERS, ControllerName
from sim.kernel.walk import Precision

E = TypeVar("E", bound=StrEnum)
M = TypeVar("M", bound=BaseModel)


def state(text: JobState | str | None) -> JobState | None:
    """A job's state by name.

    Args:
        text: The name; None for any state.

    Returns:
        The state, None for any.

    Raises:
        InvalidRequest: There is none of this name.
    """
    return None if text is None else _one_of(JobState, text, "state")


def order(text: JobOrder | str) -> JobOrder:
    """An order of the job list by name.

    Args:
        text: The name.

    Returns:
        The order.

    Raises:
        InvalidRequest: There is none of this name.
    """
    return _one_of(JobOrder, text, "order")


def command(text: Command | str) -> Command:
    """A command to a job by name.

    Args:
        text: The name.

    Returns:
        The command.

    Raises:
        InvalidRequest: There is none of this name.
    """
    return _one_of(Command, text, "command")


def controller(name: str) -> ControllerName:
    """A controller by name.

    Args:
        name: The name.

    Returns:
        The same.

    Raises:
        NotFound: There is none of this name.
    """
    if name not in CONTROLLERS:
        raise NotFound(f"no controller {name!r}; known are {', '.join(CONTROLLERS)}")
    return name


def table_format(text: str) -> TableFormat:
    """A file's format by name.

    Args:
        text: The name.

    Returns:
        The format.

    Raises:
        InvalidRequest: There is none of this name; its field is `file_format`.
    """
    if text not in get_args(TableFormat):
        known = ", ".join(get_args(TableFormat))
        raise InvalidRequest(f"{text!r} is none of {known}", field="file_format")
    return cast(TableFormat, text)


def runs(job_ids: Sequence[str]) -> Sequence[str]:
    """Ids of jobs.

    Args:
        job_ids: At least one.

    Returns:
        The same.

    Raises:
        InvalidRequest: There is none, or it is a single text.
    """
    if isinstance(job_ids, str) or not job_ids:
        raise InvalidRequest("must be a list of at least one id", field="job_ids")
    return job_ids


def leave_out(text: str | None) -> LeaveOut | None:
    """What a calibration leaves out, by name.

    Args:
        text: "target" or "walk"; None for nothing.

    Returns:
        The same.

    Raises:
        InvalidRequest: It is something else.
    """
    if text is not None and text not in get_args(LeaveOut):
        known = ", ".join(get_args(LeaveOut))
        raise InvalidRequest(f"{text!r} is none of {known}", field="leave_out")
    return cast(LeaveOut | None, text)


def certificate(worlds: int | None, most: int) -> None:
    """Check what is asked of a certificate.

    Args:
        worlds: Worlds to take; None for all.
        most: Worst worlds to name.

    Raises:
        InvalidRequest: A number is out of range; names it.
    """
    if worlds is not None and worlds < 1:
        raise InvalidRequest("must be at least 1", field="worlds")
    if not 0 <= most <= MOST_WORST:
        raise InvalidRequest(f"must be 0 to {MOST_WORST}", field="most")


def ranking(preference: PreferenceInput, top: int) -> RankingRequest:
    """By what to judge the designs of a job anew.

    Args:
        preference: How objectives are weighed: A, B, C of table 4.5, `chapter-3` (eq. 3.1), or
            `Preference`.
        top: How many of the best designs to list.

    Returns:
        The request, checked.

    Raises:
        InvalidRequest: An argument makes no sense; names it.
    """
    return _valid(RankingRequest, {"preference": preference, "top": top})


def fork(from_iteration: int, options: ForkOptions) -> ForkRequest:
    """From where to fork a job, and what is to be different.

    Args:
        from_iteration: First iteration that is the fork's own, counted from 0.
        options: Keywords that the caller gave.

    Returns:
        The request, checked.

    Raises:
        InvalidRequest: An argument makes no sense; names it.
    """
    return _valid(ForkRequest, {"from_iteration": from_iteration, **laid_options(options)})


def simulation(
    design: Mapping[str, float | str],
    *,
    scenarios: ScenarioInput | Iterable[ScenarioInput] | None,
    controller: ControllerName,
    robot: RobotInput,
    preference: PreferenceInput,
    precision: Precision,
    log: bool,
) -> SimulationRequest:
    """One design and the walks in which to try it.

    Args:
        design: Value by variable, in the variables' units.
        scenarios: Names or numbers of presets, or `Scenario`; None for the six of table 4.2.
        controller: Motor controller that drives the robot.
        robot: A shipped robot by name, a `RobotVariant`, or the folder of another.
        preference: How objectives are weighed: A, B, C of table 4.5, `chapter-3` (eq. 3.1), or
            `Preference`.
        precision: Of the physics' numbers.
        log: Whether to record every walk at 500 Hz.

    Returns:
        The request, checked.

    Raises:
        InvalidRequest: An argument makes no sense; names it.
    """
    document: dict[str, Any] = {
        "robot": robot_source(robot),
        "controller": controller,
        "design": _design(design),
        "preference": preference,
        "precision": precision,
        "log": log,
    }
    if scenarios is not None:
        document["scenarios"] = scenario_entries(scenarios)
    return _valid(SimulationRequest, document)


def robustness(design: Mapping[str, float | str], options: RobustnessOptions) -> RobustnessRequest:
    """One design, its walks, and the sample around it.

    Args:
        design: Value by variable, in the variables' units.
        options: What is not to have its default.

    Returns:
        The request, checked.

    Raises:
        InvalidRequest: An argument makes no sense; names it.
    """
    document: dict[str, Any] = {**options, "design": _design(design)}
    if "robot" in options:
        document["robot"] = robot_source(options["robot"])
    if "scenarios" in options:
        document["scenarios"] = scenario_entries(options["scenarios"])
    return _valid(RobustnessRequest, document)


def replay(
    design: Mapping[str, float | str],
    *,
    scenario: ScenarioInput,
    controller: ControllerName,
    robot: RobotInput,
    rate: float,
) -> ReplayRequest:
    """One design and the walk in which to look at it.

    Args:
        design: Value by variable, in the variables' units.
        scenario: Name or number of a preset, or `Scenario`.
        controller: Motor controller that drives the robot.
        robot: A shipped robot by name, a `RobotVariant`, or the folder of another.
        rate: Frames a second [Hz].

    Returns:
        The request, checked.

    Raises:
        InvalidRequest: An argument makes no sense; names it.
    """
    document: dict[str, Any] = {
        "robot": robot_source(robot),
        "controller": controller,
        "design": _design(design),
        "scenario": scenario,
        "rate": rate,
    }
    return _valid(ReplayRequest, document)


def surface(
    design: Mapping[str, float | str],
    *,
    error_points: int,
    current_points: int,
    velocity_error: float,
) -> SurfaceRequest:
    """One design of a fuzzy controller, and how finely to look at it.

    Args:
        design: Value by variable, in the variables' units.
        error_points: Points of the grid over the error's range.
        current_points: Points of the grid over the current's range.
        velocity_error: At which the surfaces of fuzzy-pi-3 are taken [counts/s].

    Returns:
        The request, checked.

    Raises:
        InvalidRequest: An argument makes no sense; names it.
    """
    document: dict[str, Any] = {
        "design": _design(design),
        "error_points": error_points,
        "current_points": current_points,
        "velocity_error": velocity_error,
    }
    return _valid(SurfaceRequest, document)


def _design(design: Mapping[str, float | str]) -> dict[str, float | str]:
    if not isinstance(design, Mapping):
        raise InvalidRequest("must be a mapping of values by name", field="design")
    return dict(design)


def _one_of(kind: type[E], text: str, field: str) -> E:
    try:
        return kind(text)
    except ValueError:
        raise InvalidRequest(f"{text!r} is none of {', '.join(kind)}", field=field) from None


def _valid(kind: type[M], document: dict[str, Any]) -> M:
    try:
        return kind.model_validate(document)
    except ValidationError as error:
        raise invalid_request(error, document) from error
