"""Jobs as they are shown: what has not changed since it was last read is not read anew."""

from __future__ import annotations

import json
import threading
from collections import OrderedDict
from collections.abc import Callable, Sequence
from typing import Any, Final, Generic, TypeVar

from sqlalchemy import Column, Dialect, Row, Text, cast, type_coerce
from sqlalchemy.sql.elements import Label
from sqlalchemy.types import NullType

from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.store.rows.job_rows import JobDocuments, read_documents, to_job
from gaitswarm.services.optimizer.store.rows.tables import Document, UnparsedText, UtcDateTime, jobs

V = TypeVar("V")

_DOCUMENTS: Final = ("spec", "provenance", "lineage")

_UNSHOWN: Final = frozenset(
    {
        "idempotency_key",
        "request_digest",
        "lease_owner",
        "lease_token",
        "lease_expires_at",
        "parent_id",
        "crashes",
        "notify_url",
        "deleted_at",
        "simulated_seconds",
        "sort_name",
        "search_text",
    }
)
"""Columns of which a job that is shown has nothing."""


def as_stored(column: Column[Any]) -> Label[Any]:
    """Select a column as the driver gives it; JSON as text, which databases keep as written.

    Most rows are known, and need not be read from what they are stored as.

    Args:
        column: Of `jobs`.

    Returns:
        What to select, by the column's name.
    """
    found = cast(column, Text) if isinstance(column.type, Document) else column
    return type_coerce(found, NullType()).label(column.name)


_COLUMNS: Final = tuple(
    sorted(
        (column for column in jobs.c if column.name not in _UNSHOWN),
        key=lambda column: column.name in _DOCUMENTS,
    )
)
"""The documents last."""

_NAMES: Final = tuple(column.name for column in _COLUMNS)

SHOWN: Final = tuple(map(as_stored, _COLUMNS))
"""Columns of a job that is shown and not changed, as they are stored."""

BRIEF: Final = SHOWN[: -len(_DOCUMENTS)]
"""Those of them that are no long documents."""

LONG: Final = SHOWN[-len(_DOCUMENTS) :]
"""Those that are; after `BRIEF` they are all of `SHOWN`."""

LARGEST: Final = 8 << 20
"""Characters of all texts that a memory has; what they are read to takes some times that."""

_ENTRY: Final = 100
"""Characters that what is not text counts for, in every row."""

Values = tuple[Any, ...]
"""Of some columns of a row, as they are stored."""


class RowMemory(Generic[V]):
    """What rows were read to; of too many, those asked for longest ago go. Thread-safe.

    The row itself is the key: what any program puts in its place is another key, and nobody has to
    be told.

    Args:
        largest: Characters of all rows together; each counts for at least a hundred.
        length: Characters of what a row was read to, where it has some that the row has not.
    """

    def __init__(self, largest: int, length: Callable[[V], int] = lambda _: 0) -> None:
        self._largest = largest
        self._length = length
        self._size = 0
        self._known: OrderedDict[Values, V] = OrderedDict()
        self._lock = threading.Lock()

    def find(self, values: Values) -> V | None:
        """Look for what a row was read to.

        Args:
            values: Of the row.

        Returns:
            The same object as before; None if it is not remembered.
        """
        with self._lock:
            found = self._known.get(values)
            if found is not None:
                self._known.move_to_end(values)
            return found

    def find_all(self, rows: Sequence[Values]) -> list[V | None]:
        """Look for what all rows of a table were read to; none counts as asked for by that.

        Args:
            rows: Values of each.

        Returns:
            As `find`, for each.
        """
        with self._lock:
            return list(map(self._known.get, rows))

    def add(self, values: Values, read: V) -> V:
        """Remember what a row was read to.

        Args:
            values: Of the row.
            read: What it was read to.

        Returns:
            The same; what another thread has added meanwhile, if one has.
        """
        with self._lock:
            first = self._known.setdefault(values, read)
            if first is read:
                self._size += self._of_entry(values, read)
            while self._size > self._largest:
                self._size -= self._of_entry(*self._known.popitem(last=False))
            return first

    def _of_entry(self, values: Values, read: V) -> int:
        return _ENTRY + length_of(values) + self._length(read)


def length_of(values: Values) -> int:
    """Characters of all texts among the values of a row.

    Args:
        values: Of some columns.

    Returns:
        Their sum.
    """
    return sum(len(value) for value in values if isinstance(value, str))


_documents: Final = RowMemory[JobDocuments](LARGEST)
_jobs: Final = RowMemory[Job](LARGEST)


def shown_job(row: Row[Any] | Values, dialect: Dialect) -> Job:
    """A job from its row, as `to_job` has it.

    Args:
        row: The columns `SHOWN`.
        dialect: Of the database.

    Returns:
        The job; the same object for a row that has not changed, as far as it is remembered. Jobs of
        the same documents may share their spec.
    """
    values = tuple(row)
    found = _jobs.find(values)
    if found is not None:
        return found
    columns = dict(zip(_NAMES, values, strict=True))
    documents = _read_documents(tuple(columns[name] for name in _DOCUMENTS))
    for column in _COLUMNS:
        if column.name not in _DOCUMENTS:
            columns[column.name] = from_stored(column, columns[column.name], dialect)
    job = to_job(columns, documents)
    return _jobs.add(values, job) if documents.readable else job


def from_stored(column: Column[Any], value: Any, dialect: Dialect) -> Any:
    """Read what `as_stored` selects.

    Args:
        column: Of `jobs`.
        value: As the driver gave it.
        dialect: Of the database.

    Returns:
        The value, as the column itself gives it.
    """
    if isinstance(column.type, Document):
        return _parsed(value)
    if isinstance(column.type, UtcDateTime):
        read = column.type.dialect_impl(dialect).result_processor(dialect, None)
        return value if read is None else read(value)
    return value


def _read_documents(texts: tuple[str | None, ...]) -> JobDocuments:
    found = _documents.find(texts)
    if found is None:
        found = read_documents(dict(zip(_DOCUMENTS, map(_parsed, texts), strict=True)))
        # What cannot be read may be so for a reason that passes.
        if found.readable:
            found = _documents.add(texts, found)
    return found


def _parsed(text: str | None) -> Any:
    """As the column's type `Document` does it."""
    try:
        return None if text is None else json.loads(text)
    except (ValueError, RecursionError):
        return UnparsedText(text)
