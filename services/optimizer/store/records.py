"""Single statements on jobs and iterations, inside a transaction that someone else began."""

from __future__ import annotations

import math
import re
import secrets
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Final

import numpy as np
from sqlalchemy import Connection, insert, select, update

from services.optimizer.errors import (
    Conflict,
    IdempotencyConflict,
    NotFound,
)
from services.optimizer.jobs.job import (
    Answered,
    Ask,
    CompletedIteration,
    Job,
    JobState,
)
from services.optimizer.jobs.provenance import JobProvenance, ProvenanceRecords, with_record
from services.optimizer.jobs.spec import Spec
from services.optimizer.store.rows import (
    Row,
    ask_columns,
    best_particle,
    evaluation_rows,
    iteration_summary,
    provenance_document,
    provenance_records,
    spec_document,
    submitted_spec,
    to_ask,
    to_job,
)
from services.optimizer.store.tables import evaluations, iterations, jobs

# No vowels, no look-alikes: an id is read aloud, and it spells no word.
ID_ALPHABET: Final = "23456789bcdfghjkmnpqrstvwxz"
_ID: Final = re.compile(rf"[{ID_ALPHABET}]{{12}}")


def new_job_id() -> str:
    """Twelve characters, 57 random bits: unique among any number of stores that are merged."""
    return "".join(secrets.choice(ID_ALPHABET) for _ in range(12))


def is_job_id(text: str) -> bool:
    """Whether it can be the id of a job at all; databases choke on some other strings."""
    return _ID.fullmatch(text) is not None


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


@dataclass(frozen=True, slots=True)
class Submission:
    """A job that is to be made.

    Attributes:
        spec: Resolved.
        key: Idempotency key that came with the request, if any.
        digest: Of the request, as `request_digest` has it; None without a key.
        provenance: What its numbers are to depend on; empty where its first claim says that.
    """

    spec: Spec
    key: str | None = None
    digest: str | None = None
    provenance: ProvenanceRecords = ()


def repeated_job(connection: Connection, asked: Submission) -> Job | None:
    """The job that an earlier request made with the same key; None if there is none, or no key.

    Raises:
        IdempotencyConflict: That request asked for another job.
    """
    if asked.key is None:
        return None
    query = select(jobs).where(jobs.c.idempotency_key == asked.key)
    row = connection.execute(query).mappings().first()
    if row is None:
        return None
    job = to_job(row)
    # Presets and defaults may have changed since: then equal requests ask for unequal specs. And a
    # request that was worded in another way, or not kept, is the same if its spec is.
    if row["request_digest"] != asked.digest and submitted_spec(row) != asked.spec:
        what = "the different job" if job.readable else "a job that cannot be read and compared,"
        raise IdempotencyConflict(
            f"idempotency key {asked.key!r} was used before, for {what} {row['id']}; use a new key"
            " for a new job"
        )
    return job


def insert_job(connection: Connection, asked: Submission, now: datetime) -> Job:
    """A new queued job."""
    columns = {
        "id": new_job_id(),
        "state": JobState.QUEUED,
        "spec": spec_document(asked.spec),
        "provenance": provenance_document(asked.provenance),
        "idempotency_key": asked.key,
        "request_digest": asked.digest,
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


def provenance_columns(job: Row, provenance: JobProvenance) -> dict[str, Any]:
    """Columns of a job that goes on with a provenance, from its next iteration on."""
    records = with_record(provenance_records(job), job["iterations"], provenance)
    return {"provenance": provenance_document(records), "accepts_changes": False}


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


def entering(state: JobState, now: datetime) -> dict[str, Any]:
    """Columns that follow from a state; only a job under way keeps its lease.

    The token stays in any case, so that the next one is higher.
    """
    columns: dict[str, Any] = {
        "state": state,
        "updated_at": now,
        "finished_at": now if state.terminal else None,
    }
    if state not in (JobState.RUNNING, JobState.PAUSING):
        columns |= {"lease_owner": None, "lease_expires_at": None}
    return columns


def state_after_commit(state: JobState, following: Ask | None) -> JobState:
    """The end of the budget wins over a pause that was asked for in the last iteration."""
    if following is None:
        return JobState.SUCCEEDED
    return JobState.PAUSED if state is JobState.PAUSING else state


def state_after_release(state: JobState, wanted: JobState) -> JobState:
    """A job that was to pause is not queued again by a runner that shuts down."""
    if wanted is JobState.QUEUED and state is JobState.PAUSING:
        return JobState.PAUSED
    return wanted


def progress_after(job: Row, done: CompletedIteration) -> dict[str, Any]:
    """Progress with one more iteration; only a strictly lower fitness is a new best."""
    columns: dict[str, Any] = {
        "iterations": done.iteration + 1,
        "evaluations": job["evaluations"] + len(done.fitness),
        "compute_seconds": job["compute_seconds"] + done.evaluate_seconds,
    }
    particle = best_particle(done.fitness)
    if particle is not None:
        fitness = float(done.fitness[particle])
        if job["best_fitness"] is None or fitness < job["best_fitness"]:
            columns |= {
                "best_fitness": fitness,
                "best_iteration": done.iteration,
                "best_particle": particle,
            }
    return columns


def require_readable(row: Row) -> None:
    """Raise Unreadable, with the reason, if the job's spec cannot be read."""
    _ = to_job(row).spec
