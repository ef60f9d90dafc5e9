"""Robots and scenarios as the command line names them."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from services.optimizer.errors import InvalidRequest

if TYPE_CHECKING:
    from sim.robot import RobotVariant
    from sim.scenario import Scenario


def chosen_robot(text: str | None) -> str | RobotVariant:
    """A robot's name, or a variant as JSON. Raises InvalidRequest that names the field."""
    from pydantic import ValidationError

    from sim.robot import RobotVariant

    if text is None or not text.lstrip().startswith("{"):
        return text or "szabadka2"
    try:
        return RobotVariant.model_validate(json.loads(text))
    except json.JSONDecodeError as error:
        raise InvalidRequest(f"not JSON: {error}", field="robot") from error
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(str(part) for part in ("robot", *first["loc"]))
        raise InvalidRequest(first["msg"], field=where) from error


def chosen_scenarios(text: str) -> tuple[Scenario, ...]:
    """`all`, or names and numbers separated by commas. Raises SimulationInputError."""
    from sim.scenario import SCENARIOS, find_scenario

    if text == "all":
        return SCENARIOS
    return tuple(find_scenario(name.strip()) for name in text.split(","))
