"""The job list in any order, and its search: keyset pages in SQL."""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime
from typing import Any, Final

from sqlalchemy import (
    ColumnElement,
    Connection,
    Double,
    and_,
    case,
    func,
    literal,
    or_,
    select,
)

from gaitswarm.services.optimizer.jobs.estimate import time_left
from gaitswarm.services.optimizer.jobs.job import JobOrder, JobState
from gaitswarm.services.optimizer.jobs.labels import JobFilter
from gaitswarm.services.optimizer.store.rows.job_views import SHOWN, shown_job
from gaitswarm.services.optimizer.store.rows.tables import EXISTING, jobs
from gaitswarm.services.optimizer.store.statements.documents import number_at
from gaitswarm.services.optimizer.store.statements.job_cursors import (
    from_cursor,
    from_fitness_cursor,
    from_place_cursor,
    no_cursor,
)
from gaitswarm.services.optimizer.store.statements.job_list import Among
from gaitswarm.services.optimizer.store.statements.labels import (
    facet_columns,
    folded,
    spec_field,
    to_facets,
)

_STATES: Final = {str(state): place for place, state in enumerate(JobState)}


def sorted_ids(
    connection: Connection,
    *,
    among: Among,
    kind: str | None,
    search: str,
    where: JobFilter,
    order: JobOrder,
    after: str | None,
    limit: int,
    reverse: bool = False,
) -> list[str]:
    """Return ids of a page of jobs; jobs without a value to sort by are last.

    Raises:
        InvalidRequest: `after` is no cursor of this order; names the field.
    """
    key = _key(connection, order)
    descends = reverse is not (order is JobOrder.CREATED)
    last = None if after is None else _last(connection, key, after, order, reverse=reverse)
    conditions = list(among)
    if kind is not None:
        conditions.append(spec_field(connection, "kind") == kind)
    if search:
        conditions.append(jobs.c.search_text.contains(folded(search), autoescape=True))
    ids: list[str] = []
    for job_id in _matching(connection, key, conditions, where, last, limit, descends=descends):
        ids.append(job_id)
        if len(ids) == limit:
            break
    return ids


def _matching(
    connection: Connection,
    key: ColumnElement[Any],
    conditions: list[ColumnElement[bool]],
    where: JobFilter,
    last: tuple[Any, str] | None,
    limit: int,
    *,
    descends: bool,
) -> Iterator[str]:
    """Yield ids in order: first of jobs with a value, then of those without one."""
    facets = facet_columns(connection) if where.needs_specs else []
    columns = [jobs.c.id, *facets]
    queries = []
    if last is None or last[0] is not None:
        place = [key.desc(), jobs.c.id.desc()] if descends else [key, jobs.c.id]
        valued = select(*columns).where(*conditions, key.is_not(None)).order_by(*place)
        if last is not None:
            value, job_id = last
            beyond = (key < value, jobs.c.id < job_id)
            if not descends:
                beyond = (key > value, jobs.c.id > job_id)
            valued = valued.where(or_(beyond[0], and_(key == value, beyond[1])))
        queries.append(valued)
    unvalued = select(*columns).where(*conditions, key.is_(None)).order_by(jobs.c.id)
    if last is not None and last[0] is None:
        unvalued = unvalued.where(jobs.c.id > last[1])
    queries.append(unvalued)
    for query in queries:
        for row in connection.execute(query if facets else query.limit(limit)):
            if not facets or where.admits(to_facets(row[1:])):
                yield row[0]


def _key(connection: Connection, order: JobOrder) -> ColumnElement[Any]:
    """Return the value to sort by; NULL where it is not known."""
    if order is JobOrder.TIME_LEFT:
        return _time_left(connection)
    if order is JobOrder.GAIN:
        # `Reference.gain`
        reference = number_at(connection, jobs.c.reference, "fitness")
        gain = 1.0 - jobs.c.best_fitness / case((reference > 0.0, reference))
        return -gain
    if order is JobOrder.RATE:
        taken_over = func.coalesce(number_at(connection, jobs.c.lineage, "evaluations"), 0.0)
        own, seconds = jobs.c.evaluations - taken_over, jobs.c.compute_seconds
        return -case((and_(own > 0.0, seconds > 0.0), own / case((seconds > 0.0, seconds))))
    if order is JobOrder.STATE:
        return case(_STATES, value=jobs.c.state)
    keys: dict[JobOrder, ColumnElement[Any]] = {
        JobOrder.CREATED: jobs.c.created_at,
        JobOrder.FITNESS: jobs.c.best_fitness,
        JobOrder.NAME: jobs.c.sort_name,
        JobOrder.EVALUATIONS: -jobs.c.evaluations,
        JobOrder.PRIORITY: -jobs.c.priority,
        JobOrder.ITERATIONS: -jobs.c.iterations,
    }
    return keys[order]


def _time_left(connection: Connection) -> ColumnElement[Any]:
    """Estimated times of the few jobs that run; they depend on the time, so no column has them."""
    running = select(*SHOWN).where(EXISTING, jobs.c.state == JobState.RUNNING)
    now = datetime.now(UTC)
    found = (shown_job(row, connection.dialect) for row in connection.execute(running))
    times = {job.id: time_left(job, now).eta_seconds for job in found}
    known = {job_id: literal(s, Double) for job_id, s in times.items() if s is not None}
    return case(known, value=jobs.c.id) if known else func.nullif(literal(0.0, Double), 0.0)


def _last(
    connection: Connection, key: ColumnElement[Any], cursor: str, order: JobOrder, *, reverse: bool
) -> tuple[Any, str]:
    """Return value and id of the job that the previous page ended with, as they are now."""
    if not reverse and order is JobOrder.CREATED:
        return from_cursor(cursor)
    if not reverse and order is JobOrder.FITNESS:
        return from_fitness_cursor(cursor)
    job_id = from_place_cursor(order, cursor, reverse=reverse)
    row = connection.execute(select(key).where(jobs.c.id == job_id)).first()
    if row is None:
        raise no_cursor()
    return row[0], job_id
