"""Statements on recorded walks, inside a transaction that someone else began.

A recording's id is its content's hash: it never changes, and storing it again is storing it once.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator, Sequence
from datetime import datetime
from itertools import islice
from typing import Any, Final

from pydantic import ValidationError
from sqlalchemy import (
    ColumnElement,
    Connection,
    Row,
    Text,
    cast,
    func,
    insert,
    select,
    tuple_,
)

from gaitswarm.services.optimizer.errors import InvalidRequest, NotFound
from gaitswarm.services.optimizer.store.port.reading import Page
from gaitswarm.services.optimizer.store.port.recordings import RecordingEntry
from gaitswarm.services.optimizer.store.rows.job_rows import first_problems, kept
from gaitswarm.services.optimizer.store.rows.tables import recordings
from gaitswarm.services.optimizer.store.statements.documents import length_at, text_at
from gaitswarm.services.optimizer.store.statements.job_cursors import time_of, to_cursor
from gaitswarm.sim.identification.recorded_walk import RecordedWalk, Recordings

_SEARCHED_AT_ONCE: Final = 200
"""Walks whose words are read by one statement."""

_MOST_KNOWN: Final = 100_000
"""Walks whose words are remembered; some hundred bytes each."""

_CURSOR: Final = re.compile(r"([0-9]{1,18})\.([0-9a-f]{32})", re.ASCII)


def recording_id(walk: RecordedWalk) -> str:
    """The id of a recorded walk, which depends on its content alone.

    Args:
        walk: The walk.

    Returns:
        32 hexadecimal digits of the SHA-256 of its JSON.
    """
    return hashlib.sha256(walk.model_dump_json().encode()).hexdigest()[:32]


def insert_recording(connection: Connection, walk: RecordedWalk, now: datetime) -> tuple[str, bool]:
    """Store a walk unless it is there.

    Args:
        connection: An open transaction that may write.
        walk: The walk.
        now: The time at which it is stored.

    Returns:
        Its id, and whether it is new.
    """
    name = recording_id(walk)
    known = connection.execute(select(recordings.c.id).where(recordings.c.id == name)).first()
    if known is None:
        document = walk.model_dump(mode="json")
        connection.execute(insert(recordings).values(id=name, document=document, created_at=now))
    return name, known is None


def load_recordings(connection: Connection, ids: Sequence[str]) -> Recordings:
    """Read recorded walks.

    Args:
        connection: An open transaction.
        ids: Of the walks.

    Returns:
        The walks by id.

    Raises:
        NotFound: There is no such recording; names the first.
        Unreadable: One was stored by another version, or damaged.
    """
    if not ids:
        return {}
    query = select(recordings.c.id, recordings.c.document).where(recordings.c.id.in_(ids))
    documents = {row.id: row.document for row in connection.execute(query)}
    for name in ids:
        if name not in documents:
            raise NotFound(f"there is no recording {name!r}")
    return {name: _walk(name, documents[name]) for name in ids}


def recording_page(
    connection: Connection, search: str, after: str | None, limit: int, known: dict[str, str]
) -> Page[RecordingEntry]:
    """Read a page of the list of recorded walks, the newest first.

    Args:
        connection: An open transaction.
        search: Only walks whose id, scenario or controller contain this, whatever its case.
        after: `next` of the page before; None for the first page.
        limit: Most walks on the page.
        known: Words by id of walks that were searched before; gets those that are searched now.

    Returns:
        The page.

    Raises:
        InvalidRequest: `after` is no cursor of this list.
    """
    document = recordings.c.document
    place = (recordings.c.created_at, recordings.c.id)
    newest = select(recordings.c.id).order_by(*(c.desc() for c in place))
    if after is not None:
        newest = newest.where(tuple_(*place) < _from_cursor(after))
    # Which walks the page has is told first: their documents alone are looked into.
    if search:
        every = connection.execute(newest).scalars().all()
        ids = list(islice(_searched(connection, every, search, known), limit + 1))
    else:
        ids = list(connection.execute(newest.limit(limit + 1)).scalars())
    columns = (
        recordings.c.id,
        recordings.c.created_at,
        func.length(cast(document, Text)).label("size"),
        *_names(connection),
        length_at(connection, document, "joints").label("joints"),
        length_at(connection, document, "current").label("rows"),
        text_at(connection, document, "synthetic").label("synthetic"),
    )
    rows = connection.execute(select(*columns).where(recordings.c.id.in_(ids[:limit])))
    by_id = {row.id: _entry(row) for row in rows}
    found = tuple(by_id[name] for name in ids[:limit])
    more = len(ids) > limit
    return Page(found, to_cursor(found[-1].created_at, found[-1].id) if more else None)


def _searched(
    connection: Connection, ids: Sequence[str], search: str, known: dict[str, str]
) -> Iterator[str]:
    """Those ids whose words contain a text, in their order.

    A database reads a document in full to find a name in it; as walks never change, that is done
    once for each, and only as far as the page asks.
    """
    wanted = search.lower()
    for begin in range(0, len(ids), _SEARCHED_AT_ONCE):
        some = ids[begin : begin + _SEARCHED_AT_ONCE]
        # Other threads search meanwhile, and may forget what is known.
        words = {name: text for name in some if (text := known.get(name)) is not None}
        new = _words(connection, [name for name in some if name not in words])
        if new and len(known) + len(new) > _MOST_KNOWN:
            known.clear()
        known.update(new)
        words |= new
        yield from (name for name in some if wanted in words[name])


def _words(connection: Connection, ids: Sequence[str]) -> dict[str, str]:
    """What a search looks into, in small letters."""
    if not ids:
        return {}
    query = select(recordings.c.id, *_names(connection)).where(recordings.c.id.in_(ids))
    return {
        row.id: f"{row.scenario}\n{row.controller}\n{row.id}".lower()
        for row in connection.execute(query)
    }


def _names(connection: Connection) -> tuple[ColumnElement[str], ...]:
    document = recordings.c.document
    return (
        text_at(connection, document, "scenario", "name").label("scenario"),
        text_at(connection, document, "controller").label("controller"),
    )


def _from_cursor(text: str) -> tuple[datetime, str]:
    match = _CURSOR.fullmatch(text)
    created_at = None if match is None else time_of(match[1])
    if match is None or created_at is None:
        raise InvalidRequest(
            "not a cursor of the list of recordings; pass the `next` of the page before",
            field="after",
        )
    return created_at, match[2]


def _entry(row: Row[Any]) -> RecordingEntry:
    return RecordingEntry(
        row.id,
        row.created_at,
        row.size,
        row.scenario or None,
        row.controller or None,
        row.joints,
        row.rows,
        # A truth of JSON as text is spelt by its database.
        row.synthetic in ("true", "1"),
    )


def _walk(name: str, document: Any) -> RecordedWalk:
    try:
        return RecordedWalk.model_validate(document)
    except ValidationError as error:
        raise kept(
            f"recording {name} cannot be read by this gaitswarm ({first_problems(error)})"
        ) from error
