"""Pieces of queries: values inside JSON documents, and cursors of lists"""

from __future__ import annotations

import json
import math
import re
from contextlib import suppress
from datetime import UTC, datetime, timedelta
from typing import Any, Final

from sqlalchemy import Column, ColumnElement, Connection, Text, and_, case, cast, func

from gaitswarm.services.optimizer.errors import InvalidRequest

_EPOCH: Final = datetime(1970, 1, 1, tzinfo=UTC)


def is_readable(connection: Connection, column: Column[Any]) -> ColumnElement[bool]:
    """Match documents into which a path can be followed."""
    document = cast(column, Text)
    if connection.dialect.name == "sqlite":
        # It keeps any text, and fails at a path into one that is not JSON.
        valid: ColumnElement[bool] = func.json_valid(document)
        return valid
    # PostgreSQL fails at any path into a document with a zero byte.
    return func.strpos(document, r"\u0000") == 0


def text_at(connection: Connection, column: Column[Any], *path: str) -> ColumnElement[str]:
    """Select a text; "" if there is none."""
    place = column[path].as_string()
    return func.coalesce(cast(case((is_readable(connection, column), place), else_=""), Text), "")


def length_at(connection: Connection, column: Column[Any], name: str) -> ColumnElement[int | None]:
    """Select the length of a list; NULL if there is none."""
    sqlite = connection.dialect.name == "sqlite"
    arguments = (column, f"$.{name}") if sqlite else (column[name],)
    return case((is_readable(connection, column), func.json_array_length(*arguments)), else_=None)


def number_at(connection: Connection, column: Column[Any], name: str) -> ColumnElement[float]:
    """Select a number; NULL if there is none."""
    if connection.dialect.name == "sqlite":
        types = func.json_type(column, f"$.{name}")
    else:
        types = func.json_typeof(column[name])
    is_number = types.in_(("integer", "real", "number"))
    readable = is_readable(connection, column)
    return case((and_(readable, case((readable, is_number), else_=False)), column[name].as_float()))


def folded(text: str) -> str:
    """Fold case, and replace characters that a database refuses."""
    text = text.casefold().replace("\0", "\N{REPLACEMENT CHARACTER}")
    return text.encode("utf-8", "replace").decode()


def to_cursor(order: str, value: Any, item_id: str) -> str:
    """Return the place of an item in a list sorted by a value and then by id."""
    if isinstance(value, datetime):
        value = (value - _EPOCH) // timedelta(microseconds=1)
    return f"{order}:{json.dumps(value)}:{item_id}"


def from_cursor(order: str, text: str, kind: type) -> tuple[Any, str]:
    """Return value and id of an item, the inverse of `to_cursor`. Raises InvalidRequest.

    kind: of the value: datetime, float or str; it may also be None.
    """
    match = re.fullmatch(rf"{re.escape(order)}:(.*):([0-9a-z]{{12,32}})", text)
    with suppress(ValueError, OverflowError, RecursionError):
        if match is not None:
            value, item_id = json.loads(match[1]), match[2]
            if value is None or (kind is str and isinstance(value, str)):
                return None if value is None else folded(value), item_id
            if kind is datetime and type(value) is int:
                return _EPOCH + timedelta(microseconds=value), item_id
            if kind is float and type(value) in (int, float) and math.isfinite(value):
                return float(value), item_id
    raise InvalidRequest(
        "not a cursor of this list in this order; pass the `next` of the page before",
        field="after",
    )
