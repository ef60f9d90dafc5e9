"""Former names of fields, so that documents that were written with them can still be read.

Job specs, recorded walks and robot files outlive a name in them. The models of these documents
call `current_names` before they validate, so nothing else knows a former name, and what is written
has the current ones only.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any, Final

SCENARIO: Final[Mapping[str, str]] = MappingProxyType({"withers": "hip_height"})
"""Of a scenario: former name -> current name."""

ROBOT_VARIANT: Final[Mapping[str, str]] = MappingProxyType({"gearlash": "backlash"})
"""Of a variant of a shipped robot."""

ROBOT_FILE: Final[Mapping[str, str]] = MappingProxyType({"drives": "actuators"})
"""Of a robot.toml, and of a leg in it."""

ACTUATOR: Final[Mapping[str, str]] = MappingProxyType({"gearlash": "backlash"})
"""Of an actuator in a robot.toml."""

_FORMER: Final[Mapping[str, str]] = MappingProxyType(
    {
        current: former
        for names in (SCENARIO, ROBOT_VARIANT, ROBOT_FILE, ACTUATOR)
        for former, current in names.items()
    }
)


def current_names(document: Any, former_names: Mapping[str, str]) -> Any:
    """A document with current names in place of former ones."""
    if not isinstance(document, Mapping) or former_names.keys().isdisjoint(document):
        return document
    for former, current in former_names.items():
        if former in document and current in document:
            raise ValueError(
                f"{current}: given twice, for {former!r} is its former name; keep {current!r} alone"
            )
    return {former_names.get(name, name): value for name, value in document.items()}


def as_written(document: Any, location: Sequence[str | int]) -> tuple[str | int, ...]:
    """A location by the names that the document itself uses, so that an error can quote it."""
    written: list[str | int] = []
    for part in location:
        name = part
        if isinstance(document, Mapping):
            former = _FORMER.get(str(part))
            if former is not None and former in document and part not in document:
                name = former
            document = document.get(name, document)
        elif isinstance(document, list | tuple) and isinstance(part, int) and part < len(document):
            document = document[part]
        written.append(name)
    return tuple(written)
