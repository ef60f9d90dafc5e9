"""Line numbers for errors about a robot.urdf."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final
from xml.parsers import expat

from gaitswarm.sim.errors import RobotFileError

_PART: Final = re.compile(
    r"""robot\.urdf: (?P<part>(?P<tag>link|joint)\ (?P<name>'(?:[^'\\]|\\.)*'|"(?:[^"\\]|\\.)*"))"""
)
_INNER: Final = re.compile(r"(?P<attribute>\w+)=(?P<value>'[^']*'|\"[^\"]*\") of <(?P<tag>\w+)>")


@contextmanager
def by_line(text: str) -> Iterator[None]:
    """Add line numbers to errors that name a link or a joint of a URDF."""
    try:
        yield
    except RobotFileError as error:
        message = with_line(text, str(error))
        if message == str(error):
            raise
        raise RobotFileError(message) from (error.__cause__ or error)


def with_line(text: str, message: str) -> str:
    """Add the line number to a message that begins with a link or a joint of a URDF."""
    line = _line(text, message)
    if line is None:
        return message
    return message.replace("robot.urdf: ", f"robot.urdf, line {line}: ", 1)


def _line(text: str, message: str) -> int | None:
    """Find the line of the last part with that name, the duplicate of two, or of its attribute."""
    part = _PART.match(message)
    if part is None:
        return None
    inner = _INNER.search(message, part.end())
    depth, inside, line = 0, False, None
    parser = expat.ParserCreate()

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth, inside, line
        depth += 1
        if depth == 2:
            inside = tag == part["tag"] and repr(attributes.get("name", "")) == part["name"]
        found = inside and (
            depth == 2
            or (
                inner is not None
                and tag == inner["tag"]
                and repr(attributes.get(inner["attribute"], "")) == inner["value"]
            )
        )
        if found:
            line = parser.CurrentLineNumber

    def end(_tag: str) -> None:
        nonlocal depth
        depth -= 1

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.Parse(text, True)
    return line
