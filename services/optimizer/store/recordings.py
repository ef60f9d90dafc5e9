"""Recorded walks: stored once, never changed"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from contextlib import suppress
from datetime import datetime
from typing import TYPE_CHECKING

from pydantic import ValidationError
from sqlalchemy import Connection, func, insert, select, tuple_
from sqlalchemy.exc import IntegrityError

from gaitswarm.services.optimizer.errors import NotFound
from gaitswarm.services.optimizer.jobs import listing
from gaitswarm.services.optimizer.jobs.audit import LOCAL, AuditAction
from gaitswarm.services.optimizer.store.engine import Aggregate
from gaitswarm.services.optimizer.store.job_rows import first_problems, unreadable
from gaitswarm.services.optimizer.store.tables import recordings
from gaitswarm.services.optimizer.store.tokens import note_change

if TYPE_CHECKING:
    from gaitswarm.sim.identification import RecordedWalk
    from gaitswarm.sim.identification import Recordings as Walks


class Recordings(Aggregate):
    """Recorded walks."""

    def add_recording(self, walk: RecordedWalk, *, actor: str = LOCAL) -> str:
        """Store a recorded walk, once, and return its id, a digest of its content."""
        text = walk.model_dump_json()
        recording = hashlib.sha256(text.encode()).hexdigest()[:32]
        stored = select(recordings.c.id).where(recordings.c.id == recording)
        # Another process may store the same walk meanwhile.
        with suppress(IntegrityError), self._database.write("add_recording") as connection:
            if connection.execute(stored).first() is None:
                now, document = self._clock(connection), walk.model_dump(mode="json")
                connection.execute(
                    insert(recordings).values(
                        id=recording,
                        document=document,
                        created_at=now,
                        size=len(text),
                        scenario=walk.scenario.name,
                        controller=walk.controller,
                        joints=len(walk.joints),
                        rows=len(walk.current),
                        synthetic=walk.synthetic,
                    )
                )
                action = AuditAction.ADD_RECORDING
                note_change(connection, now, actor, action, recording=recording)
        return recording

    def recordings(self, ids: Sequence[str]) -> Walks:
        """Return recorded walks by id. Raises NotFound, and Unreadable for a damaged one."""
        with self._database.read("recordings") as connection:
            return load_recordings(connection, ids)

    def recording_list(
        self, *, search: str = "", after: str | None = None, limit: int = 50
    ) -> listing.Page[listing.RecordingEntry]:
        """Return a page of recorded walks, newest first. New walks do not shift later pages."""
        limit = listing.checked_limit(limit)
        table = recordings.c
        columns = (table[name] for name in listing.RecordingEntry._fields)
        query = select(*columns).order_by(table.created_at.desc(), table.id.desc())
        if after is not None:
            place = listing.from_cursor("recording", after, datetime)
            query = query.where(tuple_(table.created_at, table.id) < place)
        if search:
            words = table.scenario + "\n" + table.controller + "\n" + table.id
            query = query.where(func.lower(words).contains(listing.folded(search), autoescape=True))
        with self._database.read("recording_list") as connection:
            rows = connection.execute(query.limit(limit + 1)).mappings().all()
        entries = [listing.RecordingEntry(**row) for row in rows]
        return listing.Page.of(
            entries, limit, lambda e: listing.to_cursor("recording", e.created_at, e.id)
        )


def load_recordings(connection: Connection, ids: Sequence[str]) -> Walks:
    """Return recorded walks by id. Raises NotFound and Unreadable."""
    if not ids:
        return {}
    from gaitswarm.sim.identification import RecordedWalk

    query = select(recordings.c.id, recordings.c.document).where(recordings.c.id.in_(ids))
    documents = {row.id: row.document for row in connection.execute(query)}
    walks = {}
    for recording in ids:
        if recording not in documents:
            raise NotFound(f"there is no recording {recording!r}")
        try:
            walks[recording] = RecordedWalk.model_validate(documents[recording])
        except ValidationError as error:
            raise unreadable(
                f"recording {recording} cannot be read by this gaitswarm ({first_problems(error)})"
            ) from error
    return walks
