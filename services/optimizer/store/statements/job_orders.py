"""The job list in its other orders, and its search.

Names are compared in Python: case folding is then the same on every database, and right for more
than ASCII. Of every job only what is compared is read, some microseconds each.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, Final

from sqlalchemy import Connection, Select, Text, cast, select

from services.optimizer.jobs.job import JobOrder, JobState
from services.optimizer.jobs.labels import JobFilter
from services.optimizer.jobs.time_left import time_left
from services.optimizer.store.rows.job_rows import reference_of
from services.optimizer.store.rows.job_views import SHOWN, shown_job
from services.optimizer.store.rows.tables import EXISTING, jobs
from services.optimizer.store.statements.job_cursors import (
    from_cursor,
    from_fitness_cursor,
    from_place_cursor,
    no_cursor,
)
from services.optimizer.store.statements.job_list import Among
from services.optimizer.store.statements.labels import facet_columns, spec_field, to_facets

_STATES: Final = tuple(JobState)


@dataclass(frozen=True, slots=True)
class _Entry:
    """What a job is found and sorted by; `lineage` as JSON text."""

    id: str
    created_at: datetime
    spec_name: str = ""
    best_fitness: float | None = None
    evaluations: int = 0
    state: str = ""
    labels: Any = None
    iterations: int = 0
    priority: int = 0
    compute_seconds: float = 0.0
    reference: Any = None
    lineage: str | None = None

    @property
    def name(self) -> str:
        """As it is shown: its user's, or else its spec's."""
        return str(self._label("name") or self.spec_name)

    @property
    def words(self) -> str:
        """All that a search looks through, in one case."""
        written = (self.name, self.id, self._label("note") or "", *(self._label("tags") or ()))
        return "\n".join(written).casefold()

    @property
    def gain(self) -> float | None:
        """Over the published design [1]."""
        known = reference_of(self.reference)
        return None if known is None else known.gain(self.best_fitness)

    @property
    def rate(self) -> float | None:
        """Evaluations of its own a second [1/s]."""
        own = self.evaluations - _taken_over(self.lineage)
        return own / self.compute_seconds if own > 0 and self.compute_seconds > 0.0 else None

    def _label(self, name: str) -> Any:
        return self.labels.get(name) if isinstance(self.labels, dict) else None


_N_COLUMNS: Final = 12
"""Of `_Entry`, as `_entries` selects them."""


def sort_jobs(
    connection: Connection,
    *,
    among: Among,
    kind: str | None,
    search: str,
    where: JobFilter,
    order: JobOrder,
    after: str | None,
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
        reverse: Whether the order is reversed; jobs without what they are sorted by stay last.

    Returns:
        Their ids.

    Raises:
        InvalidRequest: The cursor is none of this order; names the field `after`.
    """
    query = _entries(connection).where(*among)
    if kind is not None:
        query = query.where(spec_field(connection, "kind") == kind)
    if where.needs_specs:
        query = query.add_columns(*facet_columns(connection))
    wanted = search.casefold()
    found = []
    for row in connection.execute(query):
        entry = _Entry(*row[:_N_COLUMNS])
        if where.needs_specs and not where.admits(to_facets(row[_N_COLUMNS:])):
            continue
        if not wanted or wanted in entry.words:
            found.append(entry)
    place = _Places(order, reverse, _ends(connection) if order is JobOrder.TIME_LEFT else {})
    if after is None:
        return [entry.id for entry in place.sorted(found)]
    last = _entry_before(connection, after, order, reverse=reverse)
    # The job itself may have another place by now, or fit no longer.
    return [entry.id for entry in place.after(last, [e for e in found if e.id != last.id])]


def _entries(connection: Connection) -> Select[Any]:
    """A row of what `_Entry` holds for every job."""
    return select(
        jobs.c.id,
        jobs.c.created_at,
        spec_field(connection, "name"),
        jobs.c.best_fitness,
        jobs.c.evaluations,
        jobs.c.state,
        jobs.c.labels,
        jobs.c.iterations,
        jobs.c.priority,
        jobs.c.compute_seconds,
        jobs.c.reference,
        cast(jobs.c.lineage, Text),
    )


def _taken_over(lineage: str | None) -> int:
    """Evaluations that a fork has of its parent."""
    if lineage is None:
        return 0
    try:
        return int(json.loads(lineage)["evaluations"])
    except (ValueError, TypeError, LookupError, RecursionError):
        return 0


def _ends(connection: Connection) -> Mapping[str, float | None]:
    """Time to the end of each job that runs [s]."""
    running = select(*SHOWN).where(EXISTING, jobs.c.state == JobState.RUNNING)
    now = datetime.now(UTC)
    found = map(shown_job, connection.execute(running).mappings())
    return {job.id: time_left(job, now).eta_seconds for job in found}


@dataclass(frozen=True, slots=True)
class _Places:
    """order, reverse: of the list; ends: time to the end by id of the jobs that run [s]."""

    order: JobOrder
    reverse: bool
    ends: Mapping[str, float | None]

    def sorted(self, entries: list[_Entry]) -> list[_Entry]:
        """Those without what they are sorted by last; equals are told apart by their ids."""
        known: list[tuple[Any, str, _Entry]] = []
        unknown: list[tuple[Any, str, _Entry]] = []
        for entry in entries:
            key = self._key(entry)
            (unknown if key is None else known).append((key, entry.id, entry))
        known.sort(key=lambda place: place[:2], reverse=self._descends)
        unknown.sort(key=lambda place: place[1])
        return [entry for _, _, entry in (*known, *unknown)]

    def after(self, last: _Entry, entries: list[_Entry]) -> list[_Entry]:
        """Those that come after one that is not among them, in order."""
        in_order = self.sorted([*entries, last])
        return in_order[in_order.index(last) + 1 :]

    @property
    def _descends(self) -> bool:
        return self.reverse is not (self.order is JobOrder.CREATED)

    def _key(self, entry: _Entry) -> Any:
        """Less comes first, but for the newest; None if it is not known."""
        if self.order is JobOrder.TIME_LEFT:
            return self.ends.get(entry.id)
        return _KEYS[self.order](entry)


def _negative(value: float | None) -> float | None:
    return None if value is None else -value


_KEYS: Final[Mapping[JobOrder, Callable[[_Entry], Any]]] = {
    JobOrder.CREATED: lambda entry: entry.created_at,
    JobOrder.FITNESS: lambda entry: entry.best_fitness,
    JobOrder.NAME: lambda entry: entry.name.casefold() or None,
    JobOrder.STATE: lambda entry: _STATES.index(JobState(entry.state)),
    JobOrder.EVALUATIONS: lambda entry: -entry.evaluations,
    JobOrder.GAIN: lambda entry: _negative(entry.gain),
    JobOrder.PRIORITY: lambda entry: -entry.priority,
    JobOrder.ITERATIONS: lambda entry: -entry.iterations,
    JobOrder.RATE: lambda entry: _negative(entry.rate),
}


def _entry_before(connection: Connection, cursor: str, order: JobOrder, *, reverse: bool) -> _Entry:
    """The job that a page ended with, as it was then or as it is; only its place counts."""
    if not reverse and order is JobOrder.CREATED:
        created_at, job_id = from_cursor(cursor)
        return _Entry(job_id, created_at)
    if not reverse and order is JobOrder.FITNESS:
        fitness, job_id = from_fitness_cursor(cursor)
        return _Entry(job_id, datetime.max.replace(tzinfo=UTC), best_fitness=fitness)
    job_id = from_place_cursor(order, cursor, reverse=reverse)
    row = connection.execute(_entries(connection).where(jobs.c.id == job_id)).first()
    if row is None:
        raise no_cursor()
    return _Entry(*row)
