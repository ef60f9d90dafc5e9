"""The job list in its other orders, and its search.

Names are compared in Python: case folding is then the same on every database, and right for more
than ASCII. Of every job only what is compared is read, and remembered.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from datetime import UTC, datetime
from functools import cached_property
from typing import Any, Final

from sqlalchemy import Connection, Dialect, Select, select

from services.optimizer.jobs.job import JobOrder, JobState
from services.optimizer.jobs.labels import JobFilter
from services.optimizer.jobs.time_left import time_left
from services.optimizer.store.rows.job_rows import reference_of
from services.optimizer.store.rows.job_views import (
    LARGEST,
    SHOWN,
    RowMemory,
    as_stored,
    from_stored,
    shown_job,
)
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


@dataclass(frozen=True)
class _Entry:
    """What a job is found and sorted by."""

    id: str
    created_at: datetime
    best_fitness: float | None = None
    evaluations: int = 0
    state: str = ""
    labels: Any = None
    iterations: int = 0
    priority: int = 0
    compute_seconds: float = 0.0
    reference: Any = None
    lineage: Any = None
    spec_name: str = ""

    @cached_property
    def name(self) -> str:
        """As it is shown, its user's or else its spec's, in one case."""
        return self._shown_name.casefold()

    @cached_property
    def words(self) -> str:
        """All that a search looks through, in one case."""
        note, tags = self._label("note") or "", self._label("tags") or ()
        return "\n".join((self._shown_name, self.id, note, *tags)).casefold()

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

    @property
    def _shown_name(self) -> str:
        return str(self._label("name") or self.spec_name)

    def _label(self, name: str) -> Any:
        return self.labels.get(name) if isinstance(self.labels, dict) else None


_COLUMNS: Final = tuple(
    jobs.c[column.name] for column in fields(_Entry) if column.name != "spec_name"
)

_ENTRIES: Final = select(*map(as_stored, _COLUMNS))

_known: Final = RowMemory[_Entry](LARGEST)
"""By their rows, without the names in their specs, which never change."""

_AT_ONCE: Final = 500
"""Jobs whose names are read by one statement."""


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
    query = _ENTRIES.where(*among)
    if kind is not None:
        query = query.where(spec_field(connection, "kind") == kind)
    found = _entries(connection, query)
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


def _entries(connection: Connection, query: Select[Any]) -> list[_Entry]:
    """Entries of jobs that are selected from `_ENTRIES`; those that have not changed are known."""
    rows = [tuple(row) for row in connection.execute(query).all()]
    found = _known.find_all(rows)
    new = [row[0] for row, entry in zip(rows, found, strict=True) if entry is None]
    names = _spec_names(connection, new)
    return [
        _read(row, names.get(row[0], ""), connection.dialect) if entry is None else entry
        for row, entry in zip(rows, found, strict=True)
    ]


def _read(row: tuple[Any, ...], name: str, dialect: Dialect) -> _Entry:
    values = {
        column.name: from_stored(column, value, dialect)
        for column, value in zip(_COLUMNS, row, strict=True)
    }
    return _known.add(row, _Entry(**values, spec_name=name))


def _spec_names(connection: Connection, ids: Sequence[str]) -> dict[str, str]:
    """Names of jobs in their specs, by id."""
    names = select(jobs.c.id, spec_field(connection, "name"))
    found: dict[str, str] = {}
    for begin in range(0, len(ids), _AT_ONCE):
        some = names.where(jobs.c.id.in_(ids[begin : begin + _AT_ONCE]))
        found.update((row[0], row[1]) for row in connection.execute(some))
    return found


def _taken_over(lineage: Any) -> int:
    """Evaluations that a fork has of its parent."""
    try:
        return 0 if lineage is None else int(lineage["evaluations"])
    except (ValueError, TypeError, LookupError):
        return 0


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
    JobOrder.NAME: lambda entry: entry.name or None,
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
    entries = _entries(connection, _ENTRIES.where(jobs.c.id == job_id))
    if not entries:
        raise no_cursor()
    return entries[0]
