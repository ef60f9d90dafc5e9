"""Robots and scenarios from options."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.sim.robot import DEFAULT_ROBOT

if TYPE_CHECKING:
    from pydantic import ValidationError

    from gaitswarm.robots import RobotDefaults
    from gaitswarm.sim.robot import RobotFiles, RobotVariant
    from gaitswarm.sim.scenario import Scenario


def chosen_robot(text: str | None) -> str | RobotVariant | RobotFiles:
    """Return the robot of a name, a variant as JSON, or a folder."""
    from pydantic import TypeAdapter, ValidationError

    from gaitswarm.sim.robot import RobotSource
    from gaitswarm.sim.robot.variant import SHIPPED

    data = robot_data(text)
    if isinstance(data, str) and data not in SHIPPED:
        raise InvalidRequest(
            f"unknown robot {data!r}; known are {', '.join(SHIPPED)}, or pass a folder with"
            " robot.toml and robot.urdf",
            field="robot",
        )
    try:
        robot: str | RobotVariant | RobotFiles = TypeAdapter(RobotSource).validate_python(data)
    except ValidationError as error:
        raise _refusal(error, "robot") from error
    return robot


def robot_data(text: str | None) -> str | dict[str, Any]:
    """Return the unchecked field `robot` of a spec."""
    if text is None:
        return DEFAULT_ROBOT
    if text.lstrip().startswith("{"):
        try:
            data: dict[str, Any] = json.loads(text)
        except (ValueError, RecursionError) as error:
            raise InvalidRequest(f"not JSON: {error}", field="robot") from error
        return data
    folder = Path(text)
    if not folder.is_dir():
        return text
    try:
        return {kind: _text(folder / f"robot.{kind}") for kind in ("toml", "urdf")}
    except OSError as error:
        raise InvalidRequest(f"{folder} is not a robot's folder: {error}", field="robot") from error


def _text(path: Path) -> str:
    from gaitswarm.robots import not_utf8

    try:
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise InvalidRequest(not_utf8(path, error), field="robot") from error


def robot_defaults(text: str | None) -> RobotDefaults:
    """Return the defaults of a robot's folder; the general ones for any other robot."""
    from gaitswarm.robots import RobotDefaults
    from gaitswarm.robots import robot_defaults as defaults_of

    if text is None or text.lstrip().startswith("{") or not Path(text).is_dir():
        return RobotDefaults()
    return defaults_of(text)


def scenario_data(text: str, robot: str | None = None) -> list[str | dict[str, Any]]:
    """Return the unchecked field `scenarios` of a spec: names, numbers and contents of files.

    If the robot's folder has scenarios, `all` and numbers refer to these, and their names take
    precedence over presets.

    text: `all`, or names, numbers and FILE.json, separated by commas.
    """
    defaults = robot_defaults(robot)
    if text == "all":
        return defaults.scenarios
    named = defaults.own_scenarios
    numbered = {str(number): entry for number, entry in enumerate(named.values(), start=1)}
    entries = [entry.strip() for entry in text.split(",")]
    return [named.get(e) or numbered.get(e) or _scenario_entry(e) for e in entries]


def chosen_scenarios(text: str, robot: str | None = None) -> tuple[Scenario, ...]:
    """Return the scenarios of `scenario_data`."""
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


def _scenario_entry(entry: str) -> str | dict[str, Any]:
    if not entry.endswith(".json"):
        return entry
    try:
        data: dict[str, Any] = json.loads(Path(entry).read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise InvalidRequest(f"cannot read {entry}: {error}", field="scenario") from error
    return data
