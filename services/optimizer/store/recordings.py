"""Recorded walks: stored once, never changed"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from datetime import datetime

from pydantic import ValidationError
from sqlalchemy import Connection, Text, cast, func, insert, select, tuple_
from sqlalchemy.exc import IntegrityError

from gaitswarm.services.optimizer.errors import NotFound
from gaitswarm.services.optimizer.jobs.audit import LOCAL, AuditAction
from gaitswarm.services.optimizer.jobs.listing import Page, RecordingEntry, checked_limit
from gaitswarm.services.optimizer.store.engine import Aggregate
from gaitswarm.services.optimizer.store.job_rows import first_problems, unreadable
from gaitswarm.services.optimizer.store.queries import (
    folded,
    from_cursor,
    length_at,
    text_at,
    to_cursor,
)
from gaitswarm.services.optimizer.store.tables import recordings
from gaitswarm.services.optimizer.store.tokens import note_change
from gaitswarm.sim.identification.recorded_walk import RecordedWalk
from gaitswarm.sim.identification.recorded_walk import Recordings as Walks


class Recordings(Aggregate):
    """Recorded walks."""

    def add_recording(self, walk: RecordedWalk, *, actor: str = LOCAL) -> str:
        """Store a recorded walk, once.

        Args:
            walk: to store.
            actor: for the audit log, if the walk is new.

        Returns:
            Its id, a digest of its content.
        """
        recording = hashlib.sha256(walk.model_dump_json().encode()).hexdigest()[:32]
        stored = select(recordings.c.id).where(recordings.c.id == recording)
        try:
            with self._database.write("add_recording") as connection:
                if connection.execute(stored).first() is None:
                    now, document = self._clock(connection), walk.model_dump(mode="json")
                    values = {"id": recording, "document": document, "created_at": now}
                    connection.execute(insert(recordings).values(values))
                    action = AuditAction.ADD_RECORDING
                    note_change(connection, now, actor, action, recording=recording)
        except IntegrityError:
            # Another process has stored the same walk meanwhile.
            pass
        return recording

    def recordings(self, ids: Sequence[str]) -> Walks:
        """Return recorded walks by id.

        Args:
            ids: of the walks.

        Raises:
            NotFound: no such recording; names the first.
            Unreadable: one was stored by another version, or is damaged.
        """
        with self._database.read("recordings") as connection:
            return load_recordings(connection, ids)

    def recording_list(
        self, *, search: str = "", after: str | None = None, limit: int = 50
    ) -> Page[RecordingEntry]:
        """Return a page of recorded walks, newest first. New walks do not shift later pages.

        Args:
            search: part of an id, scenario or controller, in any case.
        """
        limit = checked_limit(limit)
        document, place = recordings.c.document, (recordings.c.created_at, recordings.c.id)
        newest = [column.desc() for column in place]
        page = select(recordings.c.id).order_by(*newest).limit(limit + 1)
        if after is not None:
            page = page.where(tuple_(*place) < from_cursor("recording", after, datetime))
        with self._database.read("recording_list") as connection:
            scenario = text_at(connection, document, "scenario", "name")
            controller = text_at(connection, document, "controller")
            if search:
                words = scenario + "\n" + controller + "\n" + recordings.c.id
                page = page.where(func.lower(words).contains(folded(search), autoescape=True))
            # Documents outside the page are not parsed.
            columns = (
                func.length(cast(document, Text)).label("size"),
                func.nullif(scenario, "").label("scenario"),
                func.nullif(controller, "").label("controller"),
                length_at(connection, document, "joints").label("joints"),
                length_at(connection, document, "current").label("rows"),
                # How each database spells a truth as text.
                text_at(connection, document, "synthetic").in_(("true", "1")).label("synthetic"),
            )
            # Documents outside the page are not parsed.
            query = select(*place, *columns).where(recordings.c.id.in_(page)).order_by(*newest)
            rows = connection.execute(query).mappings().all()
        items = tuple(RecordingEntry(**row) for row in rows[:limit])
        if len(rows) <= limit:
            return Page(items, None)
        return Page(items, to_cursor("recording", items[-1].created_at, items[-1].id))


def load_recordings(connection: Connection, ids: Sequence[str]) -> Walks:
    """Return recorded walks by id. Raises NotFound and Unreadable."""
    if not ids:
        return {}
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
