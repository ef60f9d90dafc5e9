"""New jobs: requests that are repeated, and forks, which begin with iterations of other jobs."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import Connection, Table, bindparam, func, insert, literal, select, update

from gaitswarm.services.optimizer.errors import Conflict, IdempotencyConflict, NotFound
from gaitswarm.services.optimizer.jobs.chain import ask_digest
from gaitswarm.services.optimizer.jobs.fork import Fork, Lineage, TakenHistory
from gaitswarm.services.optimizer.jobs.iteration import best_particle
from gaitswarm.services.optimizer.jobs.job import Job, JobState
from gaitswarm.services.optimizer.jobs.labels import Labels
from gaitswarm.services.optimizer.jobs.provenance import ProvenanceRecords
from gaitswarm.services.optimizer.jobs.quota import Quota
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.services.optimizer.store.rows.evaluation_rows import Row, fitness_summary
from gaitswarm.services.optimizer.store.rows.job_rows import (
    chain_documents,
    lineage_document,
    provenance_document,
    spec_document,
    submitted_spec,
    to_job,
)
from gaitswarm.services.optimizer.store.rows.tables import (
    evaluations,
    iterations,
    jobs,
    reevaluations,
)
from gaitswarm.services.optimizer.store.statements.chain import chain_taken
from gaitswarm.services.optimizer.store.statements.labels import search_columns
from gaitswarm.services.optimizer.store.statements.records import job_row, new_job_id, update_job


@dataclass(frozen=True, slots=True)
class Submission:
    """A job that is to be made.

    Attributes:
        spec: Resolved.
        key: Idempotency key that came with the request, if any.
        digest: Of the request, as `request_digest` has it; None without a key.
        provenance: What its numbers are to depend on; empty where its first claim says that.
        fork: How it is forked from another job; None for a job of its own.
        owner: Name of the token that it comes with, if any.
        notify_url: Where its end is told, if anywhere.
        seconds: Simulated time of all its walks [s]; None where nobody has asked.
        priority: The higher, the sooner it is claimed.
    """

    spec: Spec
    key: str | None = None
    digest: str | None = None
    provenance: ProvenanceRecords = ()
    fork: Fork | None = None
    owner: str | None = None
    notify_url: str | None = None
    seconds: float | None = None
    priority: int = 0

    @property
    def lineage(self) -> Lineage | None:
        """Where the job comes from, if it is forked."""
        return None if self.fork is None else self.fork.lineage


def repeated_job(connection: Connection, asked: Submission) -> Job | None:
    """Find the job that an earlier request made with the same key.

    Args:
        connection: An open transaction.
        asked: The present request.

    Returns:
        That job; None if there is none, or no key.

    Raises:
        IdempotencyConflict: The earlier request asked for another job.
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
    same = submitted_spec(row) == asked.spec and job.lineage == asked.lineage
    if row["request_digest"] != asked.digest and not same:
        what = "the different job" if job.readable else "a job that cannot be read and compared,"
        raise IdempotencyConflict(
            f"idempotency key {asked.key!r} was used before, for {what} {row['id']}; use a new key"
            " for a new job"
        )
    return job


def insert_job(connection: Connection, asked: Submission, now: datetime) -> Job:
    """Store a new queued job.

    Args:
        connection: An open transaction that may write.
        asked: What it is to do.
        now: The time of its submission.

    Returns:
        The job; a fork with the iterations that it takes over.

    Raises:
        Conflict: The job that is forked is gone.
    """
    parent = None if asked.lineage is None else asked.lineage.parent
    if parent is not None and asked.fork is not None and asked.fork.taken is not None:
        _require_parent(connection, parent)
    job_id = new_job_id()
    columns = {
        "id": job_id,
        "state": JobState.QUEUED,
        "spec": spec_document(asked.spec),
        "provenance": provenance_document(asked.provenance),
        "parent_id": parent,
        "lineage": lineage_document(asked.lineage),
        "owner": asked.owner,
        "notify_url": asked.notify_url,
        "simulated_seconds": asked.seconds,
        "priority": asked.priority,
        "idempotency_key": asked.key,
        "request_digest": asked.digest,
        "created_at": now,
        "updated_at": now,
        "lease_token": 0,
        "iterations": 0,
        "evaluations": 0,
        "compute_seconds": 0.0,
        **search_columns(job_id, asked.spec.name, Labels()),
    }
    row = connection.execute(insert(jobs).values(columns).returning(jobs)).mappings().one()
    if asked.fork is None or asked.fork.taken is None:
        return to_job(row)
    progress = _take_history(connection, row, asked.fork.lineage, asked.fork.taken, now)
    return to_job(update_job(connection, row, progress))


def _require_parent(connection: Connection, parent: str) -> None:
    """Keep a parent from being deleted while it is copied. Raises Conflict if it is gone."""
    try:
        job_row(connection, parent, lock=True)
    except NotFound as error:
        raise Conflict(f"job {parent} that was to be forked was deleted") from error


def check_quota(
    connection: Connection,
    owner: str | None,
    quota: Quota | None,
    *,
    new_jobs: int,
    new_seconds: float,
) -> None:
    """Refuse what would be more than an owner may have unfinished.

    Two that ask at once take turns, so that they cannot both have the last place.

    Args:
        connection: An open transaction that may write.
        owner: Of the jobs; None for all that have no owner.
        quota: What there may be; None for no limit.
        new_jobs: That are to be added.
        new_seconds: Simulated time that is to be added [s].

    Raises:
        QuotaExceeded: It would be too much.
    """
    if quota is None:
        return
    if connection.dialect.name == "postgresql":
        turn = func.hashtext(f"quota of {owner}")
        connection.execute(select(func.pg_advisory_xact_lock(turn)))
    query = select(func.count(), func.coalesce(func.sum(jobs.c.simulated_seconds), 0.0)).where(
        jobs.c.state.in_([state for state in JobState if not state.terminal]),
        jobs.c.owner.is_(None) if owner is None else jobs.c.owner == owner,
    )
    count, seconds = connection.execute(query).one()
    quota.check(count, seconds, new_jobs=new_jobs, new_seconds=new_seconds)


def _take_history(
    connection: Connection, job: Row, lineage: Lineage, taken: TakenHistory, now: datetime
) -> dict[str, Any]:
    """Copy the rows of the parent's iterations, so that the fork depends on it no longer.

    Returns columns of the fork's own row by name. Raises Conflict if the parent is gone.
    """
    job_id = job["id"]
    committed = {"optimizer_state": {}, "asked_at": now, "committed_at": now}
    copied = _copy(connection, iterations, job_id, lineage, committed | {"evaluate_seconds": 0.0})
    if copied != lineage.from_iteration:
        raise Conflict(
            f"job {lineage.parent} has not the {lineage.from_iteration} iterations any more that"
            " were to be forked"
        )
    count = _copy(connection, evaluations, job_id, lineage, {"walk_key": None})
    _copy(connection, reevaluations, job_id, lineage, {})
    own = (iterations.c.job_id == job_id, iterations.c.iteration == lineage.from_iteration - 1)
    last = connection.execute(select(iterations.c.positions).where(*own)).scalar_one()
    digest = ask_digest(np.array(last, dtype=np.float64), taken.state)
    state = {"optimizer_state": taken.state, "ask_digest": digest}
    connection.execute(update(iterations).where(*own).values(**state))
    if taken.fitness is not None:
        _judge_anew(connection, job_id, taken.fitness)
    provenance = provenance_document(taken.provenance)
    documents = chain_documents({**job, "provenance": provenance})
    return {
        "iterations": lineage.from_iteration,
        "evaluations": count,
        "evaluations_saved": count,
        "provenance": provenance,
        "head": chain_taken(connection, job_id, documents, lineage.from_iteration),
        "accepts_changes": taken.accepts_changes,
        **_best(connection, job_id, job["spec"]["precision"]),
    }


def _copy(
    connection: Connection,
    table: Table,
    job_id: str,
    lineage: Lineage,
    values: Mapping[str, Any],
) -> int:
    """Copy rows of the parent's iterations, some columns with other values; how many."""
    given = {"job_id": job_id, **values}
    columns = [
        literal(given[column.name], column.type) if column.name in given else column
        for column in table.c
    ]
    rows = select(*columns).where(
        table.c.job_id == lineage.parent, table.c.iteration < lineage.from_iteration
    )
    if table is iterations:
        rows = rows.where(table.c.committed_at.is_not(None))
    names = [column.name for column in table.c]
    # Drivers tell it for an insertion only as long as its cursor is open.
    copied = insert(table).from_select(names, rows).execution_options(preserve_rowcount=True)
    return connection.execute(copied).rowcount


def _judge_anew(
    connection: Connection, job_id: str, fitness: Sequence[NDArray[np.float64]]
) -> None:
    """Give copied evaluations, and what is said of their iterations, another fitness."""
    table = evaluations.c
    judged = update(evaluations).where(
        table.job_id == job_id,
        table.iteration == bindparam("at"),
        table.particle == bindparam("of"),
    )
    so_far: float | None = None
    for index, values in enumerate(fitness):
        rows = [
            {"at": index, "of": particle, "worth": value if math.isfinite(value) else None}
            for particle, value in enumerate(values.tolist())
        ]
        connection.execute(judged.values(fitness=bindparam("worth")), rows)
        best = best_particle(values)
        summary = fitness_summary(values, None if best is None else float(values[best]), so_far)
        so_far = summary["best_so_far"]
        connection.execute(
            update(iterations)
            .where(iterations.c.job_id == job_id, iterations.c.iteration == index)
            .values(**summary)
        )


def _best(connection: Connection, job_id: str, precision: str) -> dict[str, Any]:
    """Where the best of copied evaluations is, in double precision, the earliest of equals."""
    table = evaluations.c if precision == "double" else reevaluations.c
    query = (
        select(table.fitness, table.iteration, table.particle)
        .where(table.job_id == job_id, table.fitness.is_not(None))
        .order_by(table.fitness, table.iteration, table.particle)
        .limit(1)
    )
    found = connection.execute(query).first()
    if found is None:
        return {}
    names = ("best_fitness", "best_iteration", "best_particle")
    return dict(zip(names, found, strict=True))
