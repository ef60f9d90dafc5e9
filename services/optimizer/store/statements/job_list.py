"""The job list as most ask for it: by its indexes, no more of it than a page."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any, Final

from sqlalchemy import (
    ColumnElement,
    Connection,
    Integer,
    Select,
    bindparam,
    false,
    func,
    select,
    tuple_,
)

from gaitswarm.services.optimizer.jobs.job import Job, JobOrder, JobState
from gaitswarm.services.optimizer.store.port.reading import Page
from gaitswarm.services.optimizer.store.rows.job_views import (
    SHOWN,
    Values,
    shown_job,
)
from gaitswarm.services.optimizer.store.rows.tables import EXISTING, jobs
from gaitswarm.services.optimizer.store.statements.job_cursors import (
    cursor_of,
    from_cursor,
    from_fitness_cursor,
)
from gaitswarm.services.optimizer.store.statements.records import is_job_id

_KEPT: Final = 64
"""Statements of a kind: to put one together takes longer than to run it."""

_MOST: Final = bindparam("most", type_=Integer)

_IDS: Final = jobs.c.id.in_(bindparam("ids", expanding=True))

Among = tuple[ColumnElement[bool], ...]
"""Conditions on jobs, all of which hold for those that are wanted."""


@lru_cache(maxsize=_KEPT)
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
    values: dict[str, Any] = {"most": limit + 1}
    if after is not None:
        values["created_at"], values["job"] = from_cursor(after)
    rows = connection.execute(_newest(among, after is not None), values)
    return _page(connection, list(map(tuple, rows)), limit, JobOrder.CREATED)


@lru_cache(maxsize=_KEPT)
def _newest(among: Among, paged: bool) -> Select[Any]:
    newest = select(*SHOWN).order_by(jobs.c.created_at.desc(), jobs.c.id.desc())
    query = newest.where(*among).limit(_MOST)
    if not paged:
        return query
    place = tuple_(bindparam("created_at", type_=jobs.c.created_at.type), bindparam("job"))
    return query.where(tuple_(jobs.c.created_at, jobs.c.id) < place)


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
    values = {"fitness": fitness, "job": job_id, "most": limit + 1}
    rows = list[Values]()
    # Apart, for an index has those without a fitness at its other end.
    if after is None or fitness is not None:
        rows += map(tuple, connection.execute(_fittest(among, after is not None), values))
    if len(rows) <= limit:
        last = {"job": job_id if fitness is None else "", "most": limit + 1 - len(rows)}
        rows += map(tuple, connection.execute(_without_fitness(among), last))
    return _page(connection, rows, limit, JobOrder.FITNESS)


@lru_cache(maxsize=_KEPT)
def _fittest(among: Among, paged: bool) -> Select[Any]:
    order = (jobs.c.best_fitness, jobs.c.id)
    query = select(*SHOWN).where(*among, order[0].is_not(None)).order_by(*order).limit(_MOST)
    if not paged:
        return query
    place = tuple_(bindparam("fitness", type_=order[0].type), bindparam("job"))
    return query.where(tuple_(*order) > place)


@lru_cache(maxsize=_KEPT)
def _without_fitness(among: Among) -> Select[Any]:
    order = (jobs.c.best_fitness, jobs.c.id)
    query = select(*SHOWN).where(*among, order[0].is_(None), order[1] > bindparam("job"))
    return query.order_by(*order).limit(_MOST)


def _page(connection: Connection, rows: Sequence[Values], limit: int, order: JobOrder) -> Page[Job]:
    """A page of rows, of which one more than the page tells that others follow."""
    found = _shown(connection, rows[:limit])
    return Page(found, cursor_of(found[-1], order) if len(rows) > limit else None)


def jobs_of(connection: Connection, ids: Sequence[str]) -> tuple[Job, ...]:
    """Read jobs to show them.

    Args:
        connection: An open transaction.
        ids: Of the jobs.

    Returns:
        The jobs, in the order of the ids, without those that are removed.
    """
    rows = connection.execute(select(*SHOWN).where(_IDS), {"ids": list(ids)})
    found = {job.id: job for job in _shown(connection, list(map(tuple, rows)))}
    return tuple(found[job_id] for job_id in ids if job_id in found)


def _shown(connection: Connection, rows: Sequence[Values]) -> tuple[Job, ...]:
    return tuple(shown_job(row, connection.dialect) for row in rows)
