"""Texts inside of JSON documents, whatever a database has kept in their place."""

from __future__ import annotations

from typing import Any

from sqlalchemy import Column, ColumnElement, Connection, Text, and_, case, cast, func


def is_readable(connection: Connection, column: Column[Any]) -> ColumnElement[bool]:
    """Tell whether a path leads into a document.

    Args:
        connection: Tells the dialect.
        column: Of documents.

    Returns:
        The condition, to be asked before a path is followed.
    """
    document = cast(column, Text)
    if connection.dialect.name == "sqlite":
        # It keeps any text, and fails at a path into one that is not JSON.
        found: ColumnElement[bool] = func.json_valid(document)
        return found
    # A zero byte, as JSON spells it, makes PostgreSQL fail at any path into the document.
    return func.strpos(document, r"\u0000") == 0


def text_at(connection: Connection, column: Column[Any], *path: str) -> ColumnElement[str]:
    """Select a text of a document.

    Args:
        connection: Tells the dialect.
        column: Of documents.
        *path: Names of fields that lead to it.

    Returns:
        The text; "" where the document has none there, or is no JSON.
    """
    place = column[path].as_string()
    return func.coalesce(cast(case((is_readable(connection, column), place), else_=""), Text), "")


def length_at(connection: Connection, column: Column[Any], name: str) -> ColumnElement[int | None]:
    """Select the length of a list in a document.

    Args:
        connection: Tells the dialect.
        column: Of documents.
        name: Of the list.

    Returns:
        The number of its items; NULL where the document has no such list, or is no JSON.
    """
    if connection.dialect.name == "sqlite":
        length = func.json_array_length(column, f"$.{name}")
    else:
        length = func.json_array_length(column[name])
    return case((is_readable(connection, column), length), else_=None)


def number_at(connection: Connection, column: Column[Any], name: str) -> ColumnElement[float]:
    """Select a number of a document; NULL where the document has none there, or is no JSON."""
    if connection.dialect.name == "sqlite":
        types = func.json_type(column, f"$.{name}")
    else:
        types = func.json_typeof(column[name])
    is_number = types.in_(("integer", "real", "number"))
    readable = is_readable(connection, column)
    return case((and_(readable, case((readable, is_number), else_=False)), column[name].as_float()))
