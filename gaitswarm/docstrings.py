"""Docstrings by section: they document operations of the API and options of commands."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final


@dataclass(frozen=True)
class Docstring:
    """The parts of a docstring: text, arguments, result, and errors by class name."""

    text: str
    arguments: Mapping[str, str]
    result: str
    errors: Mapping[str, str]


_SECTION: Final = re.compile(r"\n\n?(Args|Returns|Raises):\n")
_ENTRY: Final = re.compile(r"^    \*{0,2}(\w+): (.*(?:\n {5,}.*)*)", re.MULTILINE)


def docstring_of(function: Callable[..., Any]) -> Docstring:
    """Split a docstring into its sections."""
    text, *parts = _SECTION.split(inspect.getdoc(function) or "")
    sections = dict(zip(parts[::2], parts[1::2], strict=True))
    entries = {
        name: {key: " ".join(entry.split()) for key, entry in _ENTRY.findall(section)}
        for name, section in sections.items()
    }
    return Docstring(
        text.strip(),
        entries.get("Args", {}),
        " ".join(sections.get("Returns", "").split()),
        entries.get("Raises", {}),
    )
