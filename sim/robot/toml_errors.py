"""What is wrong with a robot.toml, told by field, line, and what the field means in which unit."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Final

from pydantic import BaseModel, ValidationError

from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.input.wording import message_of, with_known_keys
from gaitswarm.sim.robot.actuators import Actuator, Gearhead, Motor, TorqueActuator, TorqueCommand
from gaitswarm.sim.robot.bounds import shortened
from gaitswarm.sim.robot.description import (
    Contact,
    Leg,
    Pwm,
    RobotDescription,
    Sensors,
    Supply,
)

_TABLE: Final = re.compile(r"(\[\[?)([^\[\]]++)\]\]?(?:\s*+#.*)?")
_KEY: Final = re.compile(r"([^=#\[\]\s][^=]*+)=")
"""Of a line without blanks around it. Possessive: no line takes longer than its length asks for."""

_FIELD: Final = re.compile(r"`(\w+)`")
"""Of a leg, as messages name it."""

_PARTS: Final[tuple[type[BaseModel], ...]] = (
    RobotDescription,
    Motor,
    Gearhead,
    Actuator,
    TorqueActuator,
    TorqueCommand,
    Supply,
    Pwm,
    Sensors,
    Contact,
    Leg,
)


def first_problem(error: ValidationError, text: str) -> str:
    """The first thing that is wrong."""
    first = with_known_keys(error.errors(), RobotDescription)[0]
    location = _without_kind(first["loc"])
    where = shortened(".".join(str(part) for part in location))
    line = line_of(text, [part for part in location if not _is_class(part)])
    message = message_of(first)
    meaning = _meaning(first["loc"])
    return (
        "robot.toml"
        + (f", line {line}" if line else "")
        + (f": {where}" if where else "")
        + f": {message}"
        + (f" ({meaning})" if meaning else "")
    )


@contextmanager
def by_leg(text: str, legs: Sequence[str]) -> Iterator[None]:
    """Add the line to errors that name a leg or the held joints of a robot.toml."""
    try:
        yield
    except RobotFileError as error:
        said = str(error)
        named = [k for k, leg in enumerate(legs) if said.startswith(f"robot.toml: leg {leg!r}: ")]
        line = None
        if named:
            line = line_of(text, ["legs", named[0], *_FIELD.findall(said)[-1:]])
        elif said.startswith("robot.toml: held_joints"):
            line = line_of(text, ["held_joints"])
        if line is None:
            raise
        raise RobotFileError(said.replace("robot.toml: ", f"robot.toml, line {line}: ", 1)) from (
            error.__cause__ or error
        )


def line_of(text: str, path: Sequence[str | int]) -> int | None:
    """Line of a field in a TOML file.

    Follows tables, arrays of tables and dotted keys as robot files use them; inline tables count
    as one line.
    """
    found, depth = None, 0
    table: list[str | int] = []
    counts: dict[str, int] = {}
    for number, line in enumerate(map(str.strip, text.splitlines()), start=1):
        if match := _TABLE.fullmatch(line):
            name = match[2].strip()
            table = list(_split(name))
            if match[1] == "[[":
                index = counts.get(name, -1) + 1
                counts[name] = index
                table.append(index)
            here = table
        elif match := _KEY.match(line):
            here = [*table, *_split(match[1])]
        else:
            continue
        if len(here) > depth and list(path[: len(here)]) == here:
            found, depth = number, len(here)
    return found


def _split(key: str) -> list[str]:
    return [part.strip().strip("\"'") for part in re.findall(r'"[^"]*"|\'[^\']*\'|[^.]+', key)]


def _without_kind(location: tuple[str | int, ...]) -> tuple[str | int, ...]:
    """Pydantic names the kind of an actuator behind its name."""
    if len(location) > 2 and location[0] == "actuators":
        return (*location[:2], *location[3:])
    return location


def _is_class(part: str | int) -> bool:
    """Pydantic names the members of unions among the keys."""
    return isinstance(part, str) and part[:1].isupper() and part.isidentifier()


def _meaning(location: tuple[str | int, ...]) -> str | None:
    """Description, with unit, of a field of any part of a robot description."""
    own = (TorqueActuator,) if "torque" in location[2:3] else ()
    field = str(location[-1]) if location else ""
    parts: tuple[type[BaseModel], ...] = (*own, *_PARTS)
    for part in parts:
        if field in part.model_fields:
            return part.model_fields[field].description
    return None
