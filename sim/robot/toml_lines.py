"""Where in a TOML file a field stands, so that an error can name the line."""

from __future__ import annotations

import re
from collections.abc import Sequence

_TABLE = re.compile(r"^\s*(\[\[?)\s*([^\[\]]+?)\s*\]\]?\s*(?:#.*)?$")
_KEY = re.compile(r"^\s*([^=#\[\]\s][^=]*?)\s*=")


def line_of(text: str, path: Sequence[str | int]) -> int | None:
    """1-based line of a field, or of the innermost table on its way; None if there is neither.

    path: keys and indices from the root, as pydantic gives them. Follows tables, arrays of tables
    and dotted keys as robot files use them; inline tables count as one line.
    """
    found, depth = None, 0
    table: list[str | int] = []
    counts: dict[str, int] = {}
    for number, line in enumerate(text.splitlines(), start=1):
        if match := _TABLE.match(line):
            names = _split(match[2])
            table = list(names)
            if match[1] == "[[":
                index = counts.get(match[2], -1) + 1
                counts[match[2]] = index
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
