"""The job list in its other orders, and its search.

Names are compared in Python: case folding is then the same on every database, and right for more
than ASCII. Of every job only what is compared is read, and remembered.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, Final

from sqlalchemy import Connection, select

from services.optimizer.jobs.job import JobOrder, JobState
from services.optimizer.jobs.labels import JobFilter
from services.optimizer.jobs.time_left import time_left
from services.optimizer.store.rows.job_views import (
    SHOWN,
    shown_job,
)
from services.optimizer.store.rows.tables import EXISTING, jobs
from services.optimizer.store.statements.job_cursors import (
    from_cursor,
    from_fitness_cursor,
    from_place_cursor,
    no_cursor,
)
from services.optimizer.store.statements.job_entries import JobEntry, job_entries, job_entry
from services.optimizer.store.statements.job_list import Among
from services.optimizer.store.statements.labels import facet_columns, to_facets

_STATES: Final = tuple(JobState)


def sort_jobs(
    connection: Connection,
    *,
    among: Among,
    kind: str | None,
    search: str,
    where: JobFilter,
    order: JobOrder,
    after: str | None,
    version: Hashable | None,
    reverse: bool = False,
) -> list[str]:
    """Find all jobs that are asked for, in order.

    Args:
        connection: An open transaction.
        among: Only jobs for which these hold.
        kind: Only jobs whose specs say that they are of this kind.
        search: Only jobs whose name, id, note or tags contain this, whatever its case.
        where: Only jobs that this admits.
        order: By what they are sorted.
        after: Only jobs after this cursor.
        version: As for `job_entries`.
        reverse: Whether the order is reversed; jobs without what they are sorted by stay last.

    Returns:
        Their ids.

    Raises:
        InvalidRequest: The cursor is none of this order; names the field `after`.
    """
    found = job_entries(connection, among, kind, version)
    if where.needs_specs:
        columns = connection.execute(select(jobs.c.id, *facet_columns(connection)).where(*among))
        admitted = {row[0] for row in columns if where.admits(to_facets(row[1:]))}
        found = [entry for entry in found if entry.id in admitted]
    wanted = search.casefold()
    if wanted:
        found = [entry for entry in found if wanted in entry.words]
    place = _Places(order, reverse, _ends(connection) if order is JobOrder.TIME_LEFT else {})
    if after is None:
        return [entry.id for entry in place.sorted(found)]
    last = _entry_before(connection, after, order, reverse=reverse)
    # The job itself may have another place by now, or fit no longer.
    return [entry.id for entry in place.after(last, [e for e in found if e.id != last.id])]


def _ends(connection: Connection) -> Mapping[str, float | None]:
    """Time to the end of each job that runs [s]."""
    running = select(*SHOWN).where(EXISTING, jobs.c.state == JobState.RUNNING)
    now = datetime.now(UTC)
    found = (shown_job(row, connection.dialect) for row in connection.execute(running))
    return {job.id: time_left(job, now).eta_seconds for job in found}


@dataclass(frozen=True, slots=True)
class _Places:
    """order, reverse: of the list; ends: time to the end by id of the jobs that run [s]."""

    order: JobOrder
    reverse: bool
    ends: Mapping[str, float | None]

    def sorted(self, entries: Sequence[JobEntry]) -> list[JobEntry]:
        """Those without what they are sorted by last; equals are told apart by their ids."""
        known: list[tuple[Any, str, JobEntry]] = []
        unknown: list[tuple[Any, str, JobEntry]] = []
        for entry in entries:
            key = self._key(entry)
            (unknown if key is None else known).append((key, entry.id, entry))
        known.sort(key=lambda place: place[:2], reverse=self._descends)
        unknown.sort(key=lambda place: place[1])
        return [entry for _, _, entry in (*known, *unknown)]

    def after(self, last: JobEntry, entries: list[JobEntry]) -> list[JobEntry]:
        """Those that come after one that is not among them, in order."""
        in_order = self.sorted([*entries, last])
        return in_order[in_order.index(last) + 1 :]

    @property
    def _descends(self) -> bool:
        return self.reverse is not (self.order is JobOrder.CREATED)

    def _key(self, entry: JobEntry) -> Any:
        """Less comes first, but for the newest; None if it is not known."""
        if self.order is JobOrder.TIME_LEFT:
            return self.ends.get(entry.id)
        return _KEYS[self.order](entry)


def _negative(value: float | None) -> float | None:
    return None if value is None else -value


_KEYS: Final[Mapping[JobOrder, Callable[[JobEntry], Any]]] = {
    JobOrder.CREATED: lambda entry: entry.created_at,
    JobOrder.FITNESS: lambda entry: entry.best_fitness,
    JobOrder.NAME: lambda entry: entry.name or None,
    JobOrder.STATE: lambda entry: _STATES.index(JobState(entry.state)),
    JobOrder.EVALUATIONS: lambda entry: -entry.evaluations,
    JobOrder.GAIN: lambda entry: _negative(entry.gain),
    JobOrder.PRIORITY: lambda entry: -entry.priority,
    JobOrder.ITERATIONS: lambda entry: -entry.iterations,
    JobOrder.RATE: lambda entry: _negative(entry.rate),
}


def _entry_before(
    connection: Connection, cursor: str, order: JobOrder, *, reverse: bool
) -> JobEntry:
    """The job that a page ended with, as it was then or as it is; only its place counts."""
    if not reverse and order is JobOrder.CREATED:
        created_at, job_id = from_cursor(cursor)
        return JobEntry(job_id, created_at)
    if not reverse and order is JobOrder.FITNESS:
        fitness, job_id = from_fitness_cursor(cursor)
        return JobEntry(job_id, datetime.max.replace(tzinfo=UTC), best_fitness=fitness)
    job_id = from_place_cursor(order, cursor, reverse=reverse)
    found = job_entry(connection, job_id)
    if found is None:
        raise no_cursor()
    return found
