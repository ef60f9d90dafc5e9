"""Robots and scenarios as the command line names them."""

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
    """A robot's name, a variant as JSON, or a folder. Raises InvalidRequest."""
    from pydantic import TypeAdapter, ValidationError

    from gaitswarm.sim.robot import RobotSource
    from gaitswarm.sim.robot.variant import SHIPPED

    data = robot_data(text)
    if isinstance(data, str) and data not in SHIPPED:
        raise InvalidRequest(
            f"unknown robot {data!r}; known are {', '.join(SHIPPED)}, or name a folder that holds"
            " robot.toml and robot.urdf",
            field="robot",
        )
    try:
        robot: str | RobotVariant | RobotFiles = TypeAdapter(RobotSource).validate_python(data)
    except ValidationError as error:
        raise _refusal(error, "robot") from error
    return robot


def robot_data(text: str | None) -> str | dict[str, Any]:
    """What a spec would hold under `robot`, unchecked. Raises InvalidRequest."""
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
    """What jobs and walks of a robot have unless an option says otherwise. Raises InvalidRequest.

    text: as the option names it.
    """
    from gaitswarm.robots import RobotDefaults
    from gaitswarm.robots import robot_defaults as defaults_of

    if text is None or text.lstrip().startswith("{") or not Path(text).is_dir():
        return RobotDefaults()
    return defaults_of(text)


def scenario_data(text: str, robot: str | None = None) -> list[str | dict[str, Any]]:
    """What a spec would hold under `scenarios`: names and numbers, and the contents of files.

    Where a robot's folder has scenarios of its own, `all` and numbers are of these, and their names
    come before those of presets.

    text: `all`, or entries separated by commas, FILE.json for a scenario of one's own. robot: as
    the option names it. Raises InvalidRequest for a file that is not JSON.
    """
    defaults = robot_defaults(robot)
    if text == "all":
        return defaults.scenarios
    own = defaults.own_scenarios
    numbers = {str(number): entry for number, entry in enumerate(own.values(), start=1)}
    entries = [entry.strip() for entry in text.split(",")]
    return [own.get(e) or numbers.get(e) or _scenario_entry(e) for e in entries]


def chosen_scenarios(text: str, robot: str | None = None) -> tuple[Scenario, ...]:
    """The scenarios of `scenario_data`. Raises SimulationInputError, InvalidRequest."""
    return tuple(map(_found_scenario, scenario_data(text, robot)))


def one_scenario(text: str | None, robot: str | None, *, preset: str) -> Scenario:
    """The walk of a command that is about one.

    text: as the option names it; None for the first of the robot's folder, or else the preset.
    Raises SimulationInputError, InvalidRequest.
    """
    first = "1" if robot_defaults(robot).own_scenarios else preset
    chosen = chosen_scenarios(text or first, robot)
    if len(chosen) != 1:
        raise InvalidRequest("one scenario, not several", field="scenario")
    return chosen[0]


def _found_scenario(entry: str | dict[str, Any]) -> Scenario:
    from gaitswarm.sim.scenario import find_scenario

    return find_scenario(entry) if isinstance(entry, str) else _own_scenario(entry)


def _own_scenario(data: dict[str, Any]) -> Scenario:
    from pydantic import ValidationError

    from gaitswarm.sim.scenario import Scenario

    try:
        return Scenario.model_validate(data)
    except ValidationError as error:
        raise _refusal(error, "scenario") from error


def _refusal(error: ValidationError, option: str) -> InvalidRequest:
    from gaitswarm.views import field_errors

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
