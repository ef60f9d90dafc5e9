"""The part of the memory's port that keeps recorded walks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Protocol

from gaitswarm.services.optimizer.jobs.audit import LOCAL
from gaitswarm.services.optimizer.store.port.reading import Page
from gaitswarm.sim.identification.recorded_walk import RecordedWalk, Recordings


@dataclass(frozen=True, slots=True)
class RecordingEntry:
    """A recorded walk in a list, without its currents. One that cannot be read has no contents.

    Attributes:
        id: Of the walk.
        created_at: When it was first stored.
        size: Characters of the stored document.
        scenario: Its name; None if it cannot be read.
        controller: That drove it; None if it cannot be read.
        joints: How many joints' currents it has; None if it cannot be read.
        rows: How many control ticks; None if it cannot be read.
        synthetic: Whether it was computed, not measured.
    """

    id: str
    created_at: datetime
    size: int
    scenario: str | None
    controller: str | None
    joints: int | None
    rows: int | None
    synthetic: bool


class KeptRecordings(Protocol):
    """Recorded walks, which never change. Thread-safe, as all of `Store` is."""

    def add_recording(self, walk: RecordedWalk, *, actor: str = LOCAL) -> str:
        """Keep a recorded walk.

        Args:
            walk: As it was recorded.
            actor: Whom the audit log is to name, if the walk is new.

        Returns:
            Its id, which depends on its content alone.
        """

    def recordings(self, ids: Sequence[str]) -> Recordings:
        """Read recorded walks.

        Args:
            ids: Of the walks.

        Returns:
            The walks by id.

        Raises:
            NotFound: There is no such recording; names the first.
            Unreadable: One was stored by another version, or damaged.
        """

    def recording_list(
        self, *, search: str = "", after: str | None = None, limit: int = 50
    ) -> Page[RecordingEntry]:
        """Read a page of the list of recorded walks, the newest first.

        Args:
            search: Only walks whose id, scenario or controller contain this, whatever its case.
            after: `next` of the page before; None for the first page.
            limit: Most walks on the page.

        Returns:
            The page. Walks stored meanwhile do not shift later pages.

        Raises:
            InvalidRequest: `after` is no cursor of this list.
        """
