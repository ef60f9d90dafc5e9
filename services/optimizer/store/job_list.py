"""The job list: its orders, its search, and the cursors of its pages.

Names are compared in Python: case folding is then the same on every database, and right for more
than ASCII. Of every job only what is compared is read, some microseconds each.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from typing import Any, Final, NamedTuple

from sqlalchemy import (
    ColumnElement,
    Connection,
    Select,
    false,
    func,
    select,
    tuple_,
)

from services.optimizer.errors import InvalidRequest
from services.optimizer.jobs.job import Job, JobOrder, JobState
from services.optimizer.jobs.labels import JobFilter
from services.optimizer.store.job_views import SHOWN, shown_job
from services.optimizer.store.labels import facet_columns, spec_field, to_facets
from services.optimizer.store.reading import Page
from services.optimizer.store.records import ID_ALPHABET, is_job_id
from services.optimizer.store.rows import Row
from services.optimizer.store.tables import EXISTING, jobs

_CURSOR: Final = re.compile(rf"([0-9]{{1,18}})\.([{ID_ALPHABET}]{{12}})", re.ASCII)
_FITNESS_CURSOR: Final = re.compile(rf"fitness:([0-9.e+-]*):([{ID_ALPHABET}]{{12}})", re.ASCII)
_PLACE_CURSOR: Final = re.compile(rf"([a-z]+):([{ID_ALPHABET}]{{12}})", re.ASCII)
_STATES: Final = tuple(JobState)
_EPOCH: Final = datetime(1970, 1, 1, tzinfo=UTC)


def to_cursor(created_at: datetime, job_id: str) -> str:
    """Place of a job in the list by age.

    Args:
        created_at: When the job was submitted.
        job_id: Of the job.

    Returns:
        Microseconds since 1970, then the id among equals.
    """
    return f"{(created_at - _EPOCH) // timedelta(microseconds=1)}.{job_id}"


def from_cursor(text: str) -> tuple[datetime, str]:
    """Inverse of `to_cursor`.

    Args:
        text: What a page ended with.

    Returns:
        When the job was submitted, and its id.

    Raises:
        InvalidRequest: It is no such cursor; names the field `after`.
    """
    match = _CURSOR.fullmatch(text)
    try:
        if match is not None:
            return _EPOCH + timedelta(microseconds=int(match[1])), match[2]
    except OverflowError:
        pass
    raise no_cursor()


def to_fitness_cursor(fitness: float | None, job_id: str) -> str:
    """Place of a job in the list by fitness; a job without one is among the last.

    Args:
        fitness: Of the job's best design.
        job_id: Of the job.

    Returns:
        The cursor.
    """
    return f"fitness:{'' if fitness is None else repr(fitness)}:{job_id}"


def from_fitness_cursor(text: str) -> tuple[float | None, str]:
    """Inverse of `to_fitness_cursor`.

    Args:
        text: What a page ended with.

    Returns:
        Fitness of the job's best design then, and the job's id.

    Raises:
        InvalidRequest: It is no such cursor; names the field `after`.
    """
    match = _FITNESS_CURSOR.fullmatch(text)
    try:
        if match is not None:
            return float(match[1]) if match[1] else None, match[2]
    except ValueError:
        pass
    raise no_cursor()


def to_place_cursor(order: JobOrder, job_id: str) -> str:
    """Place of a job in a list whose order says nothing that fits into a cursor, as a long name.

    Args:
        order: Of the list.
        job_id: Of the job; a page goes on from where the job is by then.

    Returns:
        The cursor.
    """
    return f"{order}:{job_id}"


def from_place_cursor(order: JobOrder, text: str) -> str:
    """Inverse of `to_place_cursor`.

    Args:
        order: Of the list.
        text: What a page ended with.

    Returns:
        The job's id.

    Raises:
        InvalidRequest: It is no such cursor; names the field `after`.
    """
    match = _PLACE_CURSOR.fullmatch(text)
    if match is None or match[1] != order:
        raise no_cursor()
    return match[2]


def no_cursor() -> InvalidRequest:
    """For whoever passes what no page ended with."""
    return InvalidRequest(
        "not a cursor of the job list in this order; pass the `next` of the page before",
        field="after",
    )


Among = tuple[ColumnElement[bool], ...]
"""Conditions on jobs, all of which hold for those that are wanted."""


def among_jobs(state: JobState | None, parent: str | None, archived: bool | None = None) -> Among:
    """Conditions on jobs that the database itself can tell.

    Args:
        state: Only jobs in this state; None for any.
        parent: Only jobs that were forked from the job of this id; None for any.
        archived: Only jobs that are archived, or that are not; None for both.

    Returns:
        The conditions.
    """
    found: list[ColumnElement[bool]] = [EXISTING]
    if archived is not None:
        found.append(func.coalesce(jobs.c.archived, False).is_(archived))
    if state is not None:
        found.append(jobs.c.state == state)
    # An id that is none might have characters that a database refuses.
    if parent is not None:
        found.append(jobs.c.parent_id == parent if is_job_id(parent) else false())
    return tuple(found)


def newest_jobs(connection: Connection, among: Among, after: str | None, limit: int) -> Page[Job]:
    """Read the list as most ask for it: by one query, which reads no more than the page.

    Args:
        connection: An open transaction.
        among: Only jobs for which these hold.
        after: `next` of the page before.
        limit: Most jobs on the page.

    Returns:
        The page, newest first.

    Raises:
        InvalidRequest: `after` is no cursor of this order.
    """
    newest = select(*SHOWN).order_by(jobs.c.created_at.desc(), jobs.c.id.desc())
    query = newest.where(*among).limit(limit + 1)
    if after is not None:
        created_at, job_id = from_cursor(after)
        types = (jobs.c.created_at.type, jobs.c.id.type)
        place = tuple_(created_at, job_id, types=types)
        query = query.where(tuple_(jobs.c.created_at, jobs.c.id) < place)
    rows = connection.execute(query).mappings().all()
    found = tuple(shown_job(row) for row in rows[:limit])
    more = len(rows) > limit
    return Page(found, to_cursor(found[-1].created_at, found[-1].id) if more else None)


def fittest_jobs(connection: Connection, among: Among, after: str | None, limit: int) -> Page[Job]:
    """Read the list by fitness, no more of it than the page.

    Args:
        connection: An open transaction.
        among: Only jobs for which these hold.
        after: `next` of the page before.
        limit: Most jobs on the page.

    Returns:
        The page, the best fitness first, jobs without one last.

    Raises:
        InvalidRequest: `after` is no cursor of this order.
    """
    fitness, job_id = (None, "") if after is None else from_fitness_cursor(after)
    columns = (jobs.c.best_fitness, jobs.c.id)
    rows: list[Row] = []
    # Apart, for an index has those without a fitness at its other end.
    if after is None or fitness is not None:
        query = select(*SHOWN).where(*among, columns[0].is_not(None))
        if after is not None:
            place = tuple_(fitness, job_id, types=tuple(column.type for column in columns))
            query = query.where(tuple_(*columns) > place)
        rows += connection.execute(query.order_by(*columns).limit(limit + 1)).mappings()
    if len(rows) <= limit:
        last = job_id if fitness is None else ""
        query = select(*SHOWN).where(*among, columns[0].is_(None), columns[1] > last)
        query = query.order_by(*columns).limit(limit + 1 - len(rows))
        rows += connection.execute(query).mappings()
    following = cursor_of(rows[limit - 1], JobOrder.FITNESS) if len(rows) > limit else None
    return Page(tuple(shown_job(row) for row in rows[:limit]), following)


class _Entry(NamedTuple):
    """What a job is found and sorted by."""

    id: str
    created_at: datetime
    spec_name: str = ""
    best_fitness: float | None = None
    evaluations: int = 0
    state: str = ""
    labels: Any = None

    @property
    def name(self) -> str:
        """As it is shown: its user's, or else its spec's."""
        return str(self._label("name") or self.spec_name)

    @property
    def words(self) -> str:
        """All that a search looks through, in one case."""
        written = (self.name, self.id, self._label("note") or "", *(self._label("tags") or ()))
        return "\n".join(written).casefold()

    def _label(self, name: str) -> Any:
        return self.labels.get(name) if isinstance(self.labels, dict) else None


def sort_jobs(
    connection: Connection,
    *,
    among: Among,
    kind: str | None,
    search: str,
    where: JobFilter,
    order: JobOrder,
    after: str | None,
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
    width, wanted = len(_Entry._fields), search.casefold()
    found = []
    for row in connection.execute(query):
        entry = _Entry._make(row[:width])
        if where.needs_specs and not where.admits(to_facets(row[width:])):
            continue
        if wanted in entry.words:
            found.append(entry)
    newest_first = order is JobOrder.CREATED
    places = sorted(((_place(entry, order), entry.id) for entry in found), reverse=newest_first)
    if after is not None:
        last = _place(_entry_before(connection, after, order), order)
        places = [p for p in places if (p[0] < last if newest_first else p[0] > last)]
    return [job_id for _, job_id in places]


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
    )


def job_rows(connection: Connection, ids: Sequence[str]) -> list[Row]:
    """Read the rows of jobs.

    Args:
        connection: An open transaction.
        ids: Of the jobs.

    Returns:
        The columns `SHOWN`, in the order of the ids.
    """
    query = select(*SHOWN).where(jobs.c.id.in_(ids))
    rows = {row["id"]: row for row in connection.execute(query).mappings()}
    return [rows[job_id] for job_id in ids]


def cursor_of(row: Row, order: JobOrder) -> str:
    """Place of a job in the list.

    Args:
        row: The job's row.
        order: By what the list is sorted.

    Returns:
        What a page that ends with this job ends with.
    """
    match order:
        case JobOrder.CREATED:
            return to_cursor(row["created_at"], row["id"])
        case JobOrder.FITNESS:
            return to_fitness_cursor(row["best_fitness"], row["id"])
        case _:
            return to_place_cursor(order, row["id"])


def _place(entry: _Entry, order: JobOrder) -> tuple[Any, ...]:
    """What the list is sorted by; equals are told apart by their ids."""
    match order:
        case JobOrder.CREATED:
            return (entry.created_at, entry.id)
        case JobOrder.FITNESS:
            fitness = math.inf if entry.best_fitness is None else entry.best_fitness
            return (fitness, entry.id)
        case JobOrder.NAME:
            return (not entry.name, entry.name.casefold(), entry.id)
        case JobOrder.STATE:
            return (_STATES.index(entry.state), entry.id)
        case JobOrder.EVALUATIONS:
            return (-entry.evaluations, entry.id)


def _entry_before(connection: Connection, cursor: str, order: JobOrder) -> _Entry:
    """The job that a page ended with, as it was then or as it is; only its place counts."""
    nowhen = datetime.max.replace(tzinfo=UTC)
    match order:
        case JobOrder.CREATED:
            created_at, job_id = from_cursor(cursor)
            return _Entry(job_id, created_at)
        case JobOrder.FITNESS:
            fitness, job_id = from_fitness_cursor(cursor)
            return _Entry(job_id, nowhen, best_fitness=fitness)
        case _:
            job_id = from_place_cursor(order, cursor)
            row = connection.execute(_entries(connection).where(jobs.c.id == job_id)).first()
            if row is None:
                raise no_cursor()
            return _Entry._make(row)
