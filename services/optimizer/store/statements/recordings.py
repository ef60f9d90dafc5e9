"""Statements on recorded walks, inside a transaction that someone else began.

A recording's id is its content's hash: it never changes, and storing it again is storing it once.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from datetime import datetime
from typing import Any

from pydantic import ValidationError
from sqlalchemy import Connection, insert, select

from services.optimizer.errors import NotFound
from services.optimizer.store.rows.job_rows import first_problems, kept
from services.optimizer.store.rows.tables import recordings
from sim.identification.recorded_walk import RecordedWalk, Recordings


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


def _walk(name: str, document: Any) -> RecordedWalk:
    try:
        return RecordedWalk.model_validate(document)
    except ValidationError as error:
        raise kept(
            f"recording {name} cannot be read by this gaitswarm ({first_problems(error)})"
        ) from error
