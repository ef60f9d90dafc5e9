"""Checks of what a database holds, and the removal of what nothing refers to any more."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator
from contextlib import closing
from dataclasses import dataclass
from datetime import timedelta
from typing import Any, Final

from sqlalchemy import Connection, Select, Text, cast, delete, exists, func, or_, select

from gaitswarm.services.optimizer.jobs.job import ENDED, JobState
from gaitswarm.services.optimizer.store.connections.engine import (
    Database,
    connect,
    database_time,
    parse_url,
)
from gaitswarm.services.optimizer.store.rows.tables import (
    EXISTING,
    evaluations,
    iterations,
    jobs,
    metadata,
    recordings,
)
from gaitswarm.services.optimizer.store.schema.revisions import check_revision
from gaitswarm.services.optimizer.store.transactions.deletion import SqlDeletion

_MOST: Final = 20
"""Findings of one kind."""

_GRACE: Final = timedelta(days=1)
"""For so long a recorded walk waits for the job that is to refer to it."""

_RECORDING: Final = re.compile(r"\b[0-9a-f]{32}\b")

_OF_EXISTING: Final = iterations.c.job_id.in_(select(jobs.c.id).where(EXISTING))
"""Rows of deleted jobs go piece by piece: nothing is wrong with those that are left."""

Rows = Select[*tuple[Any, ...]]


def check(url: str) -> list[str]:
    """Read all that a database holds, and look for what contradicts itself.

    Each question sees the database at a moment of its own on PostgreSQL; none of them depends on
    another, and jobs may run meanwhile.

    Args:
        url: Of the database, as for `open_store`.

    Returns:
        What is wrong, for people, at most 20 findings of one kind; nothing if all is well.

    Raises:
        StoreUnavailable: The database cannot be read, or has another schema than the newest.
    """
    with closing(connect(parse_url(url), for_migration=True)) as database:
        check_revision(database)
        with database.transaction(write=False) as connection:
            return [finding for look in _LOOKS for finding in look(connection)]


@dataclass(frozen=True, slots=True)
class Pruned:
    """What was removed.

    Attributes:
        jobs: Ids of jobs that ended long ago.
        recordings: How many recorded walks no job refers to any more.
        audit: How many entries of the audit log were too old.
    """

    jobs: tuple[str, ...]
    recordings: int
    audit: int = 0


def prune(
    url: str,
    *,
    older_than: timedelta | None = None,
    states: Collection[JobState] = ENDED,
    audit_older_than: timedelta | None = None,
) -> Pruned:
    """Remove what is old, and recorded walks that no job refers to; give free space back.

    Args:
        url: Of the database, as for `open_store`.
        older_than: Only jobs that ended so long ago; None removes no job. Those that are kept, and
            parents of forks that have not ended, stay in any case.
        states: Only jobs that ended in one of these.
        audit_older_than: Only entries of the audit log that are so old; None removes none.

    Returns:
        What was removed.

    Raises:
        StoreUnavailable: The database cannot be written, or has another schema than the newest.
    """
    with closing(connect(parse_url(url), for_migration=True)) as database:
        check_revision(database)
        deletion = SqlDeletion(database, database_time)
        with database.transaction(write=False) as connection:
            now = database_time(connection)
        removed: tuple[str, ...] = ()
        if older_than is not None:
            removed = deletion.delete_ended_before(now - older_than, states)
        forgotten = 0
        if audit_older_than is not None:
            forgotten = deletion.forget_audit_before(now - audit_older_than)
        deletion.purge_deleted()
        with database.transaction(write=True) as connection:
            recorded = _remove_unreferenced(connection)
        _vacuum(database)
    return Pruned(removed, recorded, forgotten)


def _remove_unreferenced(connection: Connection) -> int:
    before = database_time(connection) - _GRACE
    query = select(recordings.c.id).where(recordings.c.created_at < before)
    candidates = set(connection.execute(query).scalars())
    # As text: a spec that this version cannot read keeps its recordings, too.
    specs = connection.execute(
        select(cast(jobs.c.spec, Text)), execution_options={"yield_per": 500}
    )
    for spec in specs.scalars():
        candidates -= set(_RECORDING.findall(spec))
    for name in candidates:
        connection.execute(delete(recordings).where(recordings.c.id == name))
    return len(candidates)


def _vacuum(database: Database) -> None:
    with database.outside_transactions() as connection:
        if connection.dialect.name == "sqlite":
            for statement in ("VACUUM", "PRAGMA wal_checkpoint(TRUNCATE)", "PRAGMA optimize"):
                connection.exec_driver_sql(statement)
            return
        for table in metadata.sorted_tables:
            connection.exec_driver_sql(f"VACUUM (ANALYZE) {table.name}")


def _pages(connection: Connection) -> Iterator[str]:
    """Of the file; a server has tools of its own."""
    if connection.dialect.name == "sqlite":
        for (found,) in connection.exec_driver_sql(f"PRAGMA integrity_check({_MOST})"):
            if found != "ok":
                yield f"the file is damaged: {found}"


def _references(connection: Connection) -> Iterator[str]:
    if connection.dialect.name == "sqlite":
        found = connection.exec_driver_sql("PRAGMA foreign_key_check").fetchmany(_MOST)
        for table, row, parent, _ in found:
            yield f"row {row} of {table} refers to a row of {parent} that is not there"


def _counted_iterations(connection: Connection) -> Iterator[str]:
    """A job has committed all iterations from 0 to the one that it counts, and no other."""
    count, last = func.count(iterations.c.iteration), func.max(iterations.c.iteration)
    committed = (iterations.c.job_id == jobs.c.id) & iterations.c.committed_at.is_not(None)
    query: Rows = (
        select(jobs.c.id, jobs.c.iterations, count)
        .select_from(jobs.outerjoin(iterations, committed))
        .where(EXISTING)
        .group_by(jobs.c.id, jobs.c.iterations)
        .having(or_(count != jobs.c.iterations, func.coalesce(last, -1) != jobs.c.iterations - 1))
    )
    for job, counted, found in _first(connection, query):
        yield f"job {job} counts {counted} iterations, but has {found} that are committed"


def _counted_evaluations(connection: Connection) -> Iterator[str]:
    count = func.count(evaluations.c.particle)
    query: Rows = (
        select(jobs.c.id, jobs.c.evaluations, count)
        .select_from(jobs.outerjoin(evaluations, evaluations.c.job_id == jobs.c.id))
        .where(EXISTING)
        .group_by(jobs.c.id, jobs.c.evaluations)
        .having(count != jobs.c.evaluations)
    )
    for job, counted, found in _first(connection, query):
        yield f"job {job} counts {counted} evaluations, but has {found}"


def _iterations_without_evaluations(connection: Connection) -> Iterator[str]:
    query = select(iterations.c.job_id, iterations.c.iteration).where(
        iterations.c.committed_at.is_not(None), ~_evaluated(), _OF_EXISTING
    )
    for job, iteration in _first(connection, query):
        yield f"iteration {iteration} of job {job} is committed without evaluations"


def _evaluations_without_commit(connection: Connection) -> Iterator[str]:
    query = select(iterations.c.job_id, iterations.c.iteration).where(
        iterations.c.committed_at.is_(None), _evaluated(), _OF_EXISTING
    )
    for job, iteration in _first(connection, query):
        yield f"iteration {iteration} of job {job} has evaluations, but is not committed"


def _best_designs(connection: Connection) -> Iterator[str]:
    best = exists().where(
        evaluations.c.job_id == jobs.c.id,
        evaluations.c.iteration == jobs.c.best_iteration,
        evaluations.c.particle == jobs.c.best_particle,
    )
    query = select(jobs.c.id).where(jobs.c.best_iteration.is_not(None), ~best, EXISTING)
    for (job,) in _first(connection, query):
        yield f"the best design of job {job} is not among its evaluations"


def _evaluated() -> Any:
    return exists().where(
        evaluations.c.job_id == iterations.c.job_id,
        evaluations.c.iteration == iterations.c.iteration,
    )


def _first(connection: Connection, query: Rows) -> list[Any]:
    return list(connection.execute(query.limit(_MOST)))


_LOOKS: Final[tuple[Callable[[Connection], Iterator[str]], ...]] = (
    _pages,
    _references,
    _counted_iterations,
    _counted_evaluations,
    _iterations_without_evaluations,
    _evaluations_without_commit,
    _best_designs,
)
