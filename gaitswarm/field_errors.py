"""What pydantic finds wrong, in the words of the input: paths as in the document, no repeats.

Pydantic reports every alternative of a union, under labels that no document has. Here only the
alternative that the input comes nearest to speaks.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from gaitswarm.views import FieldErrorView
from sim.former_names import as_written

_OTHER_SHAPE: Final = frozenset(
    {"string_type", "literal_error", "model_type", "model_attributes_type", "dict_type"}
)
"""Errors that say: the input is not of this alternative at all."""

_LEADING_FIELD: Final = re.compile(r"^([a-z_]+(?:\.\w+)*): (.*)$", re.DOTALL)

Path = tuple[str | int, ...]


@dataclass(frozen=True, slots=True)
class _Entry:
    """One error. labels: unions that it is inside of, as (path of the union, alternative)."""

    path: Path
    labels: tuple[tuple[Path, str], ...]
    kind: str
    message: str


def field_errors(errors: Sequence[Mapping[str, Any]], document: Any) -> list[FieldErrorView]:
    """errors: as `ValidationError.errors()`, locations from the document's root."""
    entries = [
        _entry(error, document) for error in errors if not _follows_from_others(error, document)
    ]
    misfits = _misfits(entries)
    least: defaultdict[Path, int] = defaultdict(lambda: 2)
    for (union, _), misfit in misfits.items():
        least[union] = min(least[union], misfit)
    near = [e for e in entries if all(misfits[label] == least[label[0]] for label in e.labels)]
    found = [field_error(".".join(map(str, e.path)), e.message) for e in near]
    return list({(error.field, error.message): error for error in found}.values())


def field_error(field: str, message: str) -> FieldErrorView:
    """Checks of a whole object begin their message with the field that they blame."""
    match = _LEADING_FIELD.match(message)
    if not field and match:
        field, message = match.groups()
    return FieldErrorView(field=field, message=message)


def _entry(error: Mapping[str, Any], document: Any) -> _Entry:
    path: Path = ()
    labels: list[tuple[Path, str]] = []
    location = as_written(document, error["loc"])
    for position, part in enumerate(location):
        last = position == len(location) - 1
        if _has(document, part):
            document = document[part]
        elif not (last and error["type"] == "missing"):
            labels.append((path, str(part)))
            continue
        path += (part,)
    message = str(error["msg"]).removeprefix("Value error, ")
    return _Entry(path, tuple(labels), error["type"], message)


def _misfits(entries: Sequence[_Entry]) -> dict[tuple[Path, str], int]:
    """How far the input is from each alternative: 2 another shape, 1 a foreign field, 0 near."""
    misfits: dict[tuple[Path, str], int] = defaultdict(int)
    for entry in entries:
        for union, alternative in entry.labels:
            misfit = 0
            if entry.path == union and entry.kind in _OTHER_SHAPE:
                misfit = 2
            elif entry.path[:-1] == union and entry.kind == "extra_forbidden":
                misfit = 1
            misfits[union, alternative] = max(misfits[union, alternative], misfit)
    return misfits


def _follows_from_others(error: Mapping[str, Any], document: Any) -> bool:
    """A list whose items are wrong is then too short as well, though it was not in the input."""
    if error["type"] != "too_short":
        return False
    for part in as_written(document, error["loc"]):
        if _has(document, part):
            document = document[part]
    return isinstance(document, list | tuple) and len(document) >= error["ctx"]["min_length"]


def _has(document: Any, part: str | int) -> bool:
    if isinstance(document, Mapping):
        return part in document
    return isinstance(document, list | tuple) and isinstance(part, int) and part < len(document)
