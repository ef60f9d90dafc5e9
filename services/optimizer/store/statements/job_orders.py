"""The job list in its other orders, and its search.

Names are compared in Python: case folding is then the same on every database, and right for more
than ASCII. Of every job only what is compared is read, and remembered.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cached_property
from typing import Any, Final

from sqlalchemy import Connection, select

from gaitswarm.services.optimizer.jobs.estimate import time_left
from gaitswarm.services.optimizer.jobs.job import JobOrder, JobState
from gaitswarm.services.optimizer.jobs.labels import JobFilter
from gaitswarm.services.optimizer.store.rows.job_views import (
    SHOWN,
    shown_job,
)
from gaitswarm.services.optimizer.store.rows.tables import EXISTING, jobs
from gaitswarm.services.optimizer.store.statements.job_cursors import (
    from_cursor,
    from_fitness_cursor,
    from_place_cursor,
    no_cursor,
)
from gaitswarm.services.optimizer.store.statements.job_entries import (
    JobEntries,
    JobEntry,
    job_entries,
    job_entry,
)
from gaitswarm.services.optimizer.store.statements.job_list import Among
from gaitswarm.services.optimizer.store.statements.labels import facet_columns, to_facets

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
    entries = job_entries(connection, among, kind, version)
    listed = _in_order(connection, entries, order, reverse=reverse)
    found: Sequence[JobEntry] = listed.entries
    if after is not None:
        found = listed.after(_entry_before(connection, entries, after, order, reverse=reverse))
    if where.needs_specs:
        columns = connection.execute(select(jobs.c.id, *facet_columns(connection)).where(*among))
        admitted = {row[0] for row in columns if where.admits(to_facets(row[1:]))}
        found = [entry for entry in found if entry.id in admitted]
    wanted = search.casefold()
    if wanted:
        found = [entry for entry in found if wanted in entry.words]
    return [entry.id for entry in found]


def _ends(connection: Connection) -> Mapping[str, float | None]:
    """Time to the end of each job that runs [s]."""
    running = select(*SHOWN).where(EXISTING, jobs.c.state == JobState.RUNNING)
    now = datetime.now(UTC)
    found = (shown_job(row, connection.dialect) for row in connection.execute(running))
    return {job.id: time_left(job, now).eta_seconds for job in found}


@dataclass(frozen=True)
class _InOrder:
    """Entries in an order, of which whoever asks has a part.

    Attributes:
        entries: Those without what they are sorted by last; equals are told apart by their ids.
    """

    entries: Sequence[JobEntry]
    _key: Callable[[JobEntry], Any]
    _descends: bool

    @classmethod
    def sort(
        cls, entries: Iterable[JobEntry], key: Callable[[JobEntry], Any], *, descends: bool
    ) -> _InOrder:
        """Sort entries.

        Args:
            entries: In any order.
            key: Less comes first, unless the order descends; None if it is not known.
            descends: Whether the greatest comes first.
        """
        known: list[tuple[Any, str, JobEntry]] = []
        unknown: list[tuple[Any, str, JobEntry]] = []
        for entry in entries:
            value = key(entry)
            (unknown if value is None else known).append((value, entry.id, entry))
        known.sort(key=lambda place: place[:2], reverse=descends)
        unknown.sort(key=lambda place: place[1])
        return cls([entry for _, _, entry in (*known, *unknown)], key, descends)

    def after(self, last: JobEntry) -> Sequence[JobEntry]:
        """Those that come after one.

        Args:
            last: One of them; or what it was, or one that is none of them.
        """
        place = self._places.get(last.id)
        if place is not None and self._key(self.entries[place]) == self._key(last):
            return self.entries[place + 1 :]
        # The job may have another place by now: what it was is put among the others.
        others = [entry for entry in self.entries if entry.id != last.id]
        found = _InOrder.sort([*others, last], self._key, descends=self._descends).entries
        return found[found.index(last) + 1 :]

    @cached_property
    def _places(self) -> Mapping[str, int]:
        return {entry.id: place for place, entry in enumerate(self.entries)}


def _in_order(
    connection: Connection, entries: JobEntries, order: JobOrder, *, reverse: bool
) -> _InOrder:
    descends = reverse is not (order is JobOrder.CREATED)
    if order is JobOrder.TIME_LEFT:
        ends = _ends(connection)
        return _InOrder.sort(
            entries.by_id.values(), lambda entry: ends.get(entry.id), descends=descends
        )

    def make() -> _InOrder:
        return _InOrder.sort(entries.by_id.values(), _KEYS[order], descends=descends)

    return entries.once((order, reverse), make)


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
    connection: Connection, entries: JobEntries, cursor: str, order: JobOrder, *, reverse: bool
) -> JobEntry:
    """The job that a page ended with, as it was then or as it is; only its place counts."""
    if not reverse and order is JobOrder.CREATED:
        created_at, job_id = from_cursor(cursor)
        return JobEntry(job_id, created_at)
    if not reverse and order is JobOrder.FITNESS:
        fitness, job_id = from_fitness_cursor(cursor)
        return JobEntry(job_id, datetime.max.replace(tzinfo=UTC), best_fitness=fitness)
    job_id = from_place_cursor(order, cursor, reverse=reverse)
    found = entries.by_id.get(job_id) or job_entry(connection, job_id)
    if found is None:
        raise no_cursor()
    return found
