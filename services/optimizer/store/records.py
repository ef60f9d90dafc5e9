"""Single statements on jobs and iterations, inside a transaction that someone else began."""

from __future__ import annotations

import math
from collections.abc import Mapping
from datetime import datetime
from typing import Any

import numpy as np
from sqlalchemy import Connection, insert, select, update

from services.optimizer.errors import Conflict, NotFound
from services.optimizer.job import Answered, Ask, CompletedIteration, Job, JobState
from services.optimizer.spec import Spec
from services.optimizer.specs import AnySpec
from services.optimizer.store.cursors import is_job_id, new_job_id
from services.optimizer.store.rows import (
    Row,
    ask_columns,
    evaluation_rows,
    iteration_summary,
    spec_document,
    submitted_spec,
    to_ask,
    to_job,
)
from services.optimizer.store.tables import evaluations, iterations, jobs


def job_row(connection: Connection, job_id: str, *, lock: bool = False) -> Row:
    """A job's row. Raises NotFound.

    lock: keep it from other writers until the transaction ends. Every transaction that changes a
        job begins so; two commands, or a command and a commit, never act upon the same state.
    """
    if is_job_id(job_id):
        query = select(jobs).where(jobs.c.id == job_id)
        row = connection.execute(query.with_for_update() if lock else query).mappings().first()
        if row is not None:
            return row
    raise NotFound(f"there is no job {job_id!r}")


def job_of_key(connection: Connection, idempotency_key: str | None) -> tuple[Job, AnySpec] | None:
    """The job that was made with a key, and the spec that it was submitted with.

    None if there is none, or no key.
    """
    if idempotency_key is None:
        return None
    query = select(jobs).where(jobs.c.idempotency_key == idempotency_key)
    row = connection.execute(query).mappings().first()
    return (to_job(row), submitted_spec(row)) if row is not None else None


def insert_job(
    connection: Connection, resolved: Spec, idempotency_key: str | None, now: datetime
) -> Job:
    """A new queued job."""
    columns = {
        "id": new_job_id(),
        "state": JobState.QUEUED,
        "spec": spec_document(resolved),
        "idempotency_key": idempotency_key,
        "created_at": now,
        "updated_at": now,
        "lease_token": 0,
        "iterations": 0,
        "evaluations": 0,
        "compute_seconds": 0.0,
    }
    row = connection.execute(insert(jobs).values(columns).returning(jobs)).mappings().one()
    return to_job(row)


def update_job(connection: Connection, row: Row, columns: Mapping[str, Any]) -> Row:
    """Change a locked job's row; the row as it is then."""
    connection.execute(update(jobs).where(jobs.c.id == row["id"]).values(**columns))
    return {**row, **columns}


def outstanding_ask(connection: Connection, job: Row) -> Ask | None:
    """The iteration that was asked and not yet committed; None for a job that has not begun."""
    query = select(iterations).where(
        iterations.c.job_id == job["id"],
        iterations.c.iteration == job["iterations"],
    )
    row = connection.execute(query).mappings().first()
    return to_ask(row) if row is not None else None


def answered_ask(connection: Connection, job: Row) -> Answered | None:
    """The last committed ask; None for a job that has committed nothing."""
    last = job["iterations"] - 1
    query = select(iterations).where(
        iterations.c.job_id == job["id"], iterations.c.iteration == last
    )
    row = connection.execute(query).mappings().first()
    if row is None:
        return None
    of_swarm = (
        select(evaluations.c.fitness)
        .where(evaluations.c.job_id == job["id"], evaluations.c.iteration == last)
        .order_by(evaluations.c.particle)
    )
    fitness = [math.inf if f is None else f for f in connection.execute(of_swarm).scalars()]
    return Answered(to_ask(row), np.array(fitness, dtype=np.float64))


def insert_ask(connection: Connection, job: Row, ask: Ask, *, expected: int, now: datetime) -> None:
    """Store an ask before it is sent out. Raises Conflict unless it is the iteration expected."""
    if ask.iteration != expected:
        raise Conflict(
            f"job {job['id']} asks for iteration {ask.iteration}, but its next is {expected}"
        )
    columns = {"job_id": job["id"], "asked_at": now, **ask_columns(ask)}
    connection.execute(insert(iterations).values(columns))


def complete_iteration(
    connection: Connection, job: Row, done: CompletedIteration, now: datetime
) -> None:
    """Fill in the asked iteration and add its evaluations. Raises Conflict if it was not asked."""
    filled = connection.execute(
        update(iterations)
        .where(
            iterations.c.job_id == job["id"],
            iterations.c.iteration == done.iteration,
            iterations.c.committed_at.is_(None),
        )
        .values(
            committed_at=now,
            evaluate_seconds=done.evaluate_seconds,
            **iteration_summary(done.fitness, job["best_fitness"]),
        )
    )
    if filled.rowcount != 1:
        raise Conflict(
            f"iteration {done.iteration} of job {job['id']} was not asked; its next is"
            f" {job['iterations']}"
        )
    connection.execute(insert(evaluations), evaluation_rows(job["id"], done))
