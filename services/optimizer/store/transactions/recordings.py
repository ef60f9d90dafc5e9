"""Recorded walks: each is stored once, and never changes."""

from __future__ import annotations

from collections.abc import Sequence

from sqlalchemy.exc import IntegrityError

from gaitswarm.services.optimizer.jobs.audit import LOCAL, AuditAction
from gaitswarm.services.optimizer.store.connections.engine import Clock, Database
from gaitswarm.services.optimizer.store.port.reading import Page
from gaitswarm.services.optimizer.store.port.recordings import RecordingEntry
from gaitswarm.services.optimizer.store.statements.audit import note_change
from gaitswarm.services.optimizer.store.statements.recordings import (
    insert_recording,
    load_recordings,
    recording_id,
    recording_page,
)
from gaitswarm.services.optimizer.store.transactions.history import checked_limit
from gaitswarm.sim.identification.recorded_walk import RecordedWalk, Recordings


class SqlRecordings:
    """Those methods of `Store` that keep recorded walks.

    Args:
        database: With the newest schema.
        clock: Tells the time of all that is stored.
    """

    def __init__(self, database: Database, clock: Clock) -> None:
        self._database = database
        self._clock = clock
        # Words of walks that were searched: a walk never changes.
        self._known: dict[str, str] = {}

    def add_recording(self, walk: RecordedWalk, *, actor: str = LOCAL) -> str:
        """Keep a recorded walk, once."""
        try:
            with self._database.transaction(write=True) as connection:
                now = self._clock(connection)
                name, new = insert_recording(connection, walk, now)
                if new:
                    action = AuditAction.ADD_RECORDING
                    note_change(connection, now, actor, action, recording=name)
                return name
        except IntegrityError:
            # Another process has stored the same walk between our look and our insertion.
            return recording_id(walk)

    def recordings(self, ids: Sequence[str]) -> Recordings:
        """Read recorded walks."""
        with self._database.transaction(write=False) as connection:
            return load_recordings(connection, ids)

    def recording_list(
        self, *, search: str = "", after: str | None = None, limit: int = 50
    ) -> Page[RecordingEntry]:
        """Read a page of the list of recorded walks."""
        with self._database.transaction(write=False) as connection:
            return recording_page(connection, search, after, checked_limit(limit), self._known)
