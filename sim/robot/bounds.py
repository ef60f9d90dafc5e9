"""Size limits for the untrusted text of a robot's files, checked in linear time before parsing"""

from __future__ import annotations

import re
from typing import Annotated, Final, Literal
from xml.parsers import expat

from pydantic import AfterValidator, Field

from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.input import Line

LONGEST_TOML: Final = 200_000
"""Characters of a robot.toml."""

LONGEST_URDF: Final = 800_000
"""Characters of a robot.urdf."""

MOST_LEGS: Final = 32

MOST_LINKS: Final = 256
"""Links of a URDF, and also its joints."""

LONGEST_NAME: Final = 100
"""Characters of a part's name."""

LONGEST_LEG_NAME: Final = 60
"""Characters of a leg's name, as in scenarios."""

DEEPEST: Final = 16
"""Nested arrays, tables or elements, and parts of a dotted key."""

MOST_VALUES: Final = 5000
"""Values of a robot.toml."""

MOST_ELEMENTS: Final = 10_000
"""Elements of a robot.urdf."""

MOST_ATTRIBUTES: Final = 64
"""Attributes of an element of a URDF; Pinocchio's reader compares every pair of them."""

LONGEST_ATTRIBUTE: Final = 1000
"""Characters of an attribute of a URDF."""

SMALLEST, LARGEST = 1e-15, 1e9
"""Magnitude of a nonzero number, in the units of its field."""

_TOML: Final = re.compile(
    r"""
      \#[^\n]*+
    | "{3}(?:[^"\\]|\\.|"(?!""))*+(?:"{3,5}|\\?\Z)
    | '{3}(?:[^']|'(?!''))*+(?:'{3,5}|\Z)
    | "(?:[^"\\\n]|\\.)*+"?
    | '[^'\n]*+'?
    | (?P<open>[\[{])
    | (?P<close>[\]}])
    | (?P<value>[=,])
    | (?P<dot>\.)
    | (?P<line>\n\s*+)
    """,
    re.DOTALL | re.VERBOSE,
)
"""Tokens of TOML that nest or repeat. Comments and strings are skipped; alternatives do not
backtrack, so that no character is read twice."""


def _in_size(value: float) -> float:
    if value != 0.0 and not SMALLEST <= abs(value) <= LARGEST:
        raise ValueError(f"must be 0, or from {SMALLEST:g} to {LARGEST:g} in magnitude")
    return value


Number = Annotated[float, AfterValidator(_in_size)]
"""A number of a robot.toml, within the allowed magnitudes."""

PartName = Annotated[Line, Field(min_length=1, max_length=LONGEST_NAME)]
"""Name of a part of a robot."""

Sentence = Annotated[Line, Field(min_length=1, max_length=LONGEST_ATTRIBUTE)]
"""A sentence about a robot for users."""

ContactLaw = Literal["linear_zone", "karnopp", "stick", "dead_zone"]
"""Friction law of soles; see `gaitswarm.sim.kernel.dynamics.contact`."""

PlannedSoles = Literal["nominal", "own"]
"""Sole lengths that a gait assumes: the robot's common one, or each leg's."""


def check_toml(text: str) -> None:
    _check_text("robot.toml", text, LONGEST_TOML)
    depth, parts, values = 0, 1, 0
    for token in _TOML.finditer(text):
        kind = token.lastgroup
        if kind == "dot":
            parts += 1
        elif kind is not None:
            parts = 1
            depth = max(0, depth + (kind == "open") - (kind == "close"))
            values += kind == "value"
        if depth > DEEPEST or parts > DEEPEST:
            problem = f"nested too deep: at most {DEEPEST} tables, arrays or parts of a key"
        elif values > MOST_VALUES:
            problem = f"has more than {MOST_VALUES} values"
        else:
            continue
        line = 1 + text.count("\n", 0, token.start())
        raise RobotFileError(f"robot.toml, line {line}: {problem}")


def check_urdf(text: str) -> None:
    """Check the size of a robot.urdf, and that it declares no document type, hence no entities."""
    _check_text("robot.urdf", text, LONGEST_URDF)
    if not text.strip():
        raise RobotFileError("robot.urdf: is empty; it must contain the URDF of a robot")
    parser = expat.ParserCreate()
    scan = _UrdfScan(parser)
    parser.StartElementHandler = scan.start
    parser.EndElementHandler = scan.end
    parser.StartDoctypeDeclHandler = scan.doctype
    try:
        parser.Parse(text, True)
    except expat.ExpatError as error:
        raise RobotFileError(
            f"robot.urdf, line {error.lineno}: not well-formed XML:"
            f" {expat.ErrorString(error.code)} (column {error.offset})"
        ) from error


class _UrdfScan:
    """Counts parts of a URDF and raises RobotFileError when a limit is exceeded."""

    def __init__(self, parser: expat.XMLParserType) -> None:
        self._parser = parser
        self._depth = 0
        self._elements = 0
        self._parts = {"link": 0, "joint": 0}

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        self._depth += 1
        self._elements += 1
        if self._depth > DEEPEST:
            raise self._error(f"nested too deep: at most {DEEPEST} elements within each other")
        if self._elements > MOST_ELEMENTS:
            raise self._error(f"has more than {MOST_ELEMENTS} elements")
        if len(attributes) > MOST_ATTRIBUTES:
            raise self._error(f"<{shortened(tag)}> has more than {MOST_ATTRIBUTES} attributes")
        for name, value in attributes.items():
            longest = LONGEST_NAME if name == "name" else LONGEST_ATTRIBUTE
            if len(value) > longest:
                raise self._error(
                    f"{shortened(name)} of <{shortened(tag)}> is longer than {longest} characters"
                )
        if not attributes.get("name", "").isprintable():
            raise self._error(f"name of <{shortened(tag)}> must contain only printable characters")
        if self._depth == 2 and tag in self._parts:
            self._parts[tag] += 1
            if self._parts[tag] > MOST_LINKS:
                raise self._error(f"has more than {MOST_LINKS} {tag}s")

    def end(self, _tag: str) -> None:
        self._depth -= 1

    def doctype(self, *_: object) -> None:
        raise self._error("declares a document type, which a URDF must not; remove <!DOCTYPE>")

    def _error(self, problem: str) -> RobotFileError:
        return RobotFileError(f"robot.urdf, line {self._parser.CurrentLineNumber}: {problem}")


def shortened(text: str, longest: int = LONGEST_NAME) -> str:
    return text if len(text) <= longest else f"{text[:longest]}..."


def _check_text(file: str, text: str, longest: int) -> None:
    if len(text) > longest:
        raise RobotFileError(f"{file}: is longer than {longest} characters")
    try:
        text.encode()
    except UnicodeEncodeError as error:
        raise RobotFileError(
            f"{file}: character {error.start} is not a valid Unicode character"
        ) from error
