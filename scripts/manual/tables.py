"""Tables of Markdown, and what their cells say of JSON schemas."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from typing import Any

Json = dict[str, Any]

SCHEMA = "#/components/schemas/"
"""What the OpenAPI document names a schema by."""

_BOUNDS = {
    "minimum": "from",
    "exclusiveMinimum": "above",
    "maximum": "to",
    "exclusiveMaximum": "below",
    "minItems": "at least",
    "maxItems": "at most",
    "maxLength": "of length to",
}


def head(*names: str) -> Iterator[str]:
    """The first two lines of a table.

    Args:
        *names: Of its columns.
    """
    yield row(names)
    yield row(["---"] * len(names))


def row(cells: Sequence[str]) -> str:
    """One line of a table.

    Args:
        cells: Markdown, of which line breaks and bars are made harmless.
    """
    return "| " + " | ".join(" ".join(cell.split()).replace("|", "\\|") for cell in cells) + " |"


def code(text: object) -> str:
    """A text as code; nothing for an empty one.

    Args:
        text: Anything that can be printed.
    """
    return f"`{text}`" if str(text) else ""


def kind_of(schema: Json) -> str:
    """What values may be, with links to other schemas.

    Args:
        schema: A JSON schema.
    """
    if "$ref" in schema:
        name = schema["$ref"].removeprefix(SCHEMA)
        return f"[{name}](#schema-{name.lower()})"
    for several in ("anyOf", "oneOf", "allOf"):
        if several in schema:
            return " or ".join(dict.fromkeys(kind_of(inner) for inner in schema[several]))
    if "enum" in schema:
        return ", ".join(code(value) for value in schema["enum"])
    if "const" in schema:
        return code(schema["const"])
    bounds = [f"{word} {_number(schema[key])}" for key, word in _BOUNDS.items() if key in schema]
    kind = schema.get("type", "any")
    if kind == "array":
        inner = schema.get("items") or next(iter(schema.get("prefixItems", [])), {})
        return f"list of {kind_of(inner)}" + "".join(f", {bound}" for bound in bounds)
    return " ".join([kind, *bounds])


def default_of(schema: Json) -> str:
    """A schema's default as code; nothing where there is none.

    Args:
        schema: A JSON schema.
    """
    value = schema.get("default")
    return "" if value is None else code(json.dumps(value, ensure_ascii=False))


def _number(value: float) -> str:
    return str(int(value)) if abs(value) < 1e15 and value == int(value) else str(value)
