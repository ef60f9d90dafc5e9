"""What jobs have committed, which never changes: the reading half of the store."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import Integer, Select, Table, bindparam, select

from gaitswarm.services.optimizer.errors import InvalidRequest, NotFound
from gaitswarm.services.optimizer.jobs.chain import ChainDocuments
from gaitswarm.services.optimizer.jobs.columns import EvaluationColumns
from gaitswarm.services.optimizer.jobs.iteration import (
    CachedOutcome,
    Evaluation,
    Iteration,
    Reevaluation,
)
from gaitswarm.services.optimizer.store.connections.engine import Database
from gaitswarm.services.optimizer.store.port.reading import Page, StoredLink
from gaitswarm.services.optimizer.store.rows.columns import select_columns, select_known
from gaitswarm.services.optimizer.store.rows.evaluation_rows import (
    LISTED,
    to_evaluation,
    to_iteration,
    to_reevaluation,
)
from gaitswarm.services.optimizer.store.rows.job_rows import chain_documents
from gaitswarm.services.optimizer.store.rows.tables import evaluations, iterations, reevaluations
from gaitswarm.services.optimizer.store.statements.chain import select_links, select_reevaluations
from gaitswarm.services.optimizer.store.statements.records import job_row, job_to_show, require_job

_LARGEST_INDEX: Final = 2**31 - 1
_LARGEST_PAGE: Final = 10_000


def _particle(table: Table) -> Select[Any]:
    """One design in a table of them."""
    return select(table).where(
        table.c.job_id == bindparam("job"),
        table.c.iteration == bindparam("iteration"),
        table.c.particle == bindparam("particle"),
    )


# Made once: to put a statement together takes longer than to run it.
_BEST: Final = _particle(evaluations)
_BEST_ANEW: Final = _particle(reevaluations)
_ITERATIONS: Final = (
    select(*LISTED)
    .where(
        iterations.c.job_id == bindparam("job"),
        iterations.c.iteration > bindparam("after"),
        iterations.c.committed_at.is_not(None),
    )
    .order_by(iterations.c.iteration)
    .limit(bindparam("limit", type_=Integer))
)
_EVALUATIONS: Final = (
    select(evaluations)
    .where(
        evaluations.c.job_id == bindparam("job"),
        evaluations.c.iteration >= bindparam("first"),
        evaluations.c.iteration < bindparam("last"),
    )
    .order_by(evaluations.c.iteration, evaluations.c.particle)
)


class SqlHistory:
    """Those methods of `Store` that read committed iterations.

    Args:
        database: With the newest schema.
    """

    def __init__(self, database: Database) -> None:
        self._database = database

    def iterations(
        self, job_id: str, *, after: int | None = None, limit: int = 100
    ) -> Page[Iteration]:
        """Read a page of committed iterations."""
        limit = checked_limit(limit)
        place = {"job": job_id, "after": -1 if after is None else _bounded(after)}
        with self._database.transaction(write=False) as connection:
            require_job(connection, job_id)
            rows = connection.execute(_ITERATIONS, place | {"limit": limit + 1}).mappings().all()
        found = tuple(to_iteration(row) for row in rows[:limit])
        return Page(found, str(found[-1].index) if len(rows) > limit else None)

    def evaluations(self, job_id: str, iteration: int) -> tuple[Evaluation, ...]:
        """Read the designs of a committed iteration."""
        found = self.evaluations_between(job_id, iteration, iteration + 1)
        if not found:
            raise NotFound(f"job {job_id} has no committed iteration {iteration}")
        return found

    def evaluations_between(self, job_id: str, first: int, last: int) -> tuple[Evaluation, ...]:
        """Read the designs of a range of committed iterations."""
        between = {"job": job_id, "first": _bounded(first), "last": _bounded(last)}
        with self._database.transaction(write=False) as connection:
            require_job(connection, job_id)
            rows = connection.execute(_EVALUATIONS, between).mappings().all()
        return tuple(to_evaluation(row) for row in rows)

    def evaluation_columns(self, job_id: str, first: int, last: int) -> EvaluationColumns | None:
        """Read the designs of a range of committed iterations as columns."""
        with self._database.transaction(write=False) as connection:
            require_job(connection, job_id)
            return select_columns(connection, job_id, _bounded(first), _bounded(last))

    def asked(self, job_id: str, first: int, last: int) -> tuple[NDArray[np.float64], ...]:
        """Read the asks of a range of committed iterations."""
        query = (
            select(iterations.c.positions)
            .where(
                iterations.c.job_id == job_id,
                iterations.c.iteration >= _bounded(first),
                iterations.c.iteration < _bounded(last),
                iterations.c.committed_at.is_not(None),
            )
            .order_by(iterations.c.iteration)
        )
        with self._database.transaction(write=False) as connection:
            require_job(connection, job_id)
            rows = connection.execute(query).scalars().all()
        return tuple(np.array(positions, dtype=np.float64) for positions in rows)

    def chain_documents(self, job_id: str) -> ChainDocuments:
        """Read what a job's chain depends on."""
        with self._database.transaction(write=False) as connection:
            return chain_documents(job_row(connection, job_id))

    def links(self, job_id: str, first: int, last: int) -> tuple[StoredLink, ...]:
        """Read a range of iterations beside their evaluations."""
        with self._database.transaction(write=False) as connection:
            return select_links(connection, job_id, _bounded(first), _bounded(last))

    def reevaluations(self, job_id: str) -> tuple[tuple[int, Reevaluation], ...]:
        """Read the designs that were evaluated anew."""
        return self.reevaluations_between(job_id, 0, _LARGEST_INDEX)

    def reevaluations_between(
        self, job_id: str, first: int, last: int
    ) -> tuple[tuple[int, Reevaluation], ...]:
        """Read the designs of a range of iterations that were evaluated anew."""
        with self._database.transaction(write=False) as connection:
            require_job(connection, job_id)
            return select_reevaluations(connection, job_id, _bounded(first), _bounded(last))

    def known(self, keys: Sequence[bytes]) -> dict[bytes, CachedOutcome]:
        """Find what designs came to in any job."""
        with self._database.transaction(write=False) as connection:
            return select_known(connection, keys)

    def best(self, job_id: str) -> Evaluation | None:
        """Read the design of least fitness."""
        with self._database.transaction(write=False) as connection:
            job = job_to_show(connection, job_id)
            if job.progress.best_iteration is None:
                return None
            place = {
                "job": job.id,
                "iteration": job.progress.best_iteration,
                "particle": job.progress.best_particle,
            }
            row = connection.execute(_BEST, place).mappings().one()
            anew = connection.execute(_BEST_ANEW, place).mappings().first()
            return to_evaluation(row, None if anew is None else to_reevaluation(anew))


def checked_limit(limit: int) -> int:
    """Items of a page: as many as are asked for, within reason.

    Args:
        limit: As asked for.

    Returns:
        The same, or the largest that there is.

    Raises:
        InvalidRequest: It is less than one; names the field `limit`.
    """
    if limit < 1:
        raise InvalidRequest("a page holds at least one item", field="limit")
    return min(limit, _LARGEST_PAGE)


def _bounded(index: int) -> int:
    """An index that both databases can compare; no iteration lies beyond."""
    return max(-1, min(index, _LARGEST_INDEX))
