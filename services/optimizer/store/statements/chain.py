"""The chain of a job's history in the database: written with each iteration, and read back."""

from __future__ import annotations

from itertools import pairwise
from typing import Any, Final

import numpy as np
from sqlalchemy import Connection, bindparam, select, update

from gaitswarm.services.optimizer.jobs.chain import (
    ChainDocuments,
    Link,
    Outcomes,
    iteration_digest,
)
from gaitswarm.services.optimizer.jobs.iteration import CompletedIteration, Reevaluation
from gaitswarm.services.optimizer.store.port.reading import SUMMARY, StoredLink
from gaitswarm.services.optimizer.store.rows.columns import select_columns
from gaitswarm.services.optimizer.store.rows.evaluation_rows import Row, to_reevaluation
from gaitswarm.services.optimizer.store.rows.job_rows import chain_documents
from gaitswarm.services.optimizer.store.rows.tables import iterations, reevaluations

_PIECE: Final = 64
"""Iterations of a fork that are read at once."""

_OF_IT: Final = (
    iterations.c.job_id == bindparam("job"),
    iterations.c.iteration == bindparam("at"),
)
_ASKED: Final = select(iterations.c.positions, iterations.c.ask_digest).where(*_OF_IT)


def chained_columns(connection: Connection, job: Row, done: CompletedIteration) -> dict[str, Any]:
    """Chain an iteration to the one before.

    Args:
        connection: The transaction in which the job was locked.
        job: The job's row.
        done: What the iteration came to.

    Returns:
        Value of its column `digest`; none where it was not asked.
    """
    of_it = {"job": job["id"], "at": done.iteration}
    row = connection.execute(_ASKED, of_it).first()
    if row is None:
        return {}
    documents = chain_documents(job)
    link = Link(done.iteration, np.array(row.positions, dtype=np.float64), row.ask_digest)
    before = job["head"] or documents.digest
    chained = iteration_digest(before, documents, link, Outcomes.of(done))
    return {"digest": chained}


def chain_taken(connection: Connection, job_id: str, documents: ChainDocuments, count: int) -> str:
    """Chain the iterations that a fork takes over, under its own spec and lineage.

    Args:
        connection: The transaction in which they were copied.
        job_id: Of the fork.
        documents: Of the fork.
        count: Iterations.

    Returns:
        Digest of the last one.
    """
    table = iterations.c
    chained = (
        update(iterations)
        .where(table.job_id == job_id, table.iteration == bindparam("at"))
        .values(digest=bindparam("chained"))
    )
    before = documents.digest
    for first, last in pairwise([*range(0, count, _PIECE), count]):
        rows = []
        columns = select_columns(connection, job_id, first, last)
        anew = dict(select_reevaluations(connection, job_id, first, last))
        for stored in select_links(connection, job_id, first, last):
            index = stored.link.iteration
            assert columns is not None  # noqa: S101 - every iteration has designs
            own = Outcomes.read(columns.of_iteration(index), anew.get(index))
            before = iteration_digest(before, documents, stored.link, own)
            rows.append({"at": index, "chained": before})
        connection.execute(chained, rows)
    return before


def select_links(
    connection: Connection, job_id: str, first: int, last: int
) -> tuple[StoredLink, ...]:
    """Read a range of iterations, the one under way with them.

    Args:
        connection: An open transaction.
        job_id: Of the job.
        first: Least index of an iteration.
        last: Index after the greatest.

    Returns:
        Those that there are, in order.

    Raises:
        ValueError: One is damaged.
    """
    table = iterations.c
    query = (
        select(iterations)
        .where(table.job_id == job_id, table.iteration >= first, table.iteration < last)
        .order_by(table.iteration)
    )
    return tuple(_stored_link(row) for row in connection.execute(query).mappings())


def _stored_link(row: Row) -> StoredLink:
    positions = np.array(row["positions"], dtype=np.float64)
    return StoredLink(
        Link(row["iteration"], positions, row["ask_digest"], row["digest"]),
        row["committed_at"] is not None,
        row["optimizer_state"],
        {name: row[name] for name in SUMMARY},
    )


def select_reevaluations(
    connection: Connection, job_id: str, first: int, last: int
) -> tuple[tuple[int, Reevaluation], ...]:
    """Read what best designs came to in double precision.

    Args:
        connection: An open transaction.
        job_id: Of the job.
        first: Least index of an iteration.
        last: Index after the greatest.

    Returns:
        Index of the iteration, and the reevaluation, in order.
    """
    table = reevaluations.c
    query = (
        select(reevaluations)
        .where(table.job_id == job_id, table.iteration >= first, table.iteration < last)
        .order_by(table.iteration, table.particle)
    )
    rows = connection.execute(query).mappings()
    return tuple((row["iteration"], to_reevaluation(row)) for row in rows)
