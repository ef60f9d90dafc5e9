"""Single statements on jobs and iterations, inside a transaction that someone else began."""

from __future__ import annotations

import re
import secrets
from collections.abc import Mapping
from datetime import datetime
from typing import Any, Final

from sqlalchemy import Connection, Select, bindparam, insert, select, update
from sqlalchemy import Row as SqlRow

from gaitswarm.services.optimizer.errors import Conflict, NotFound
from gaitswarm.services.optimizer.jobs.estimate import recent_pace
from gaitswarm.services.optimizer.jobs.iteration import Answered, Ask, CompletedIteration
from gaitswarm.services.optimizer.jobs.job import Job, JobState
from gaitswarm.services.optimizer.jobs.provenance import JobProvenance, with_record
from gaitswarm.services.optimizer.store.connections.changes import announce
from gaitswarm.services.optimizer.store.rows.columns import select_columns
from gaitswarm.services.optimizer.store.rows.evaluation_rows import (
    Row,
    ask_columns,
    evaluation_rows,
    fitness_summary,
    reevaluation_row,
    to_ask,
)
from gaitswarm.services.optimizer.store.rows.job_rows import (
    provenance_document,
    provenance_records,
    to_job,
)
from gaitswarm.services.optimizer.store.rows.job_views import SHOWN, shown_job
from gaitswarm.services.optimizer.store.rows.tables import (
    EXISTING,
    evaluations,
    iterations,
    jobs,
    reevaluations,
)
from gaitswarm.services.optimizer.store.statements.chain import chained_columns
from gaitswarm.services.optimizer.store.statements.notifications import note_end

# No vowels, no look-alikes: an id is read aloud, and it spells no word.
ID_ALPHABET: Final = "23456789bcdfghjkmnpqrstvwxz"
_ID: Final = re.compile(rf"[{ID_ALPHABET}]{{12}}")

# Made once: to put a statement together takes longer than to run it.
_OF_JOB: Final = (jobs.c.id == bindparam("job"), EXISTING)
_WHOLE: Final = select(jobs).where(*_OF_JOB)
_LOCKED: Final = _WHOLE.with_for_update()
SHOWN_JOB: Final = select(*SHOWN).where(*_OF_JOB)
_ID_ALONE: Final = select(jobs.c.id).where(*_OF_JOB)


def new_job_id() -> str:
    """Twelve characters, 57 random bits: unique among any number of stores that are merged."""
    return "".join(secrets.choice(ID_ALPHABET) for _ in range(12))


def is_job_id(text: str) -> bool:
    """Whether a text can be the id of a job at all; databases choke on some other strings.

    Args:
        text: Any text.

    Returns:
        True for what `new_job_id` might have made.
    """
    return _ID.fullmatch(text) is not None


def job_row(connection: Connection, job_id: str, *, lock: bool = False) -> Row:
    """Read a job's row.

    Args:
        connection: An open transaction.
        job_id: Of the job.
        lock: Whether to keep it from other writers until the transaction ends. Every transaction
            that changes a job begins so; two commands, or a command and a commit, never act upon
            the same state.

    Returns:
        All columns of `jobs`.

    Raises:
        NotFound: There is no such job.
    """
    row = _row_of(connection, job_id, _LOCKED if lock else _WHOLE)
    return row._mapping  # noqa: SLF001 - as SQLAlchemy documents it


def job_to_show(connection: Connection, job_id: str) -> Job:
    """Read a job to show it.

    Args:
        connection: An open transaction.
        job_id: Of the job.

    Returns:
        The job; one that has not changed need not be read from its row anew.

    Raises:
        NotFound: There is no such job.
    """
    return shown_job(_row_of(connection, job_id, SHOWN_JOB), connection.dialect)


def require_job(connection: Connection, job_id: str) -> None:
    """Check that there is a job.

    Args:
        connection: An open transaction.
        job_id: Of the job.

    Raises:
        NotFound: There is no such job.
    """
    _row_of(connection, job_id, _ID_ALONE)


def _row_of(connection: Connection, job_id: str, query: Select[Any]) -> SqlRow[Any]:
    if is_job_id(job_id):
        row = connection.execute(query, {"job": job_id}).first()
        if row is not None:
            return row
    raise NotFound(f"there is no job {job_id!r}")


def update_job(connection: Connection, row: Row, columns: Mapping[str, Any]) -> Row:
    """Change a job's row; a job that ends leaves a notification, if it has somebody to notify.

    Args:
        connection: The transaction in which the row was locked.
        row: The job as it was read.
        columns: New values by name of their columns.

    Returns:
        The row as it is then.
    """
    connection.execute(update(jobs).where(jobs.c.id == row["id"]).values(**columns))
    announce(connection, row["id"], frozenset(columns))
    after = {**row, **columns}
    if after["notify_url"] is not None and "state" in columns and after["finished_at"] is not None:
        note_end(connection, after)
    return after


def provenance_columns(job: Row, provenance: JobProvenance) -> dict[str, Any]:
    """Columns of a job that goes on with a provenance, from its next iteration on.

    Args:
        job: Its row.
        provenance: What its numbers depend on from now on.

    Returns:
        Values by name of their columns.
    """
    before = provenance_records(job)
    added = with_record(before, job["iterations"], provenance)[len(before) :]
    # Earlier ones stay as they were written, as digests are of that.
    document = [*(job["provenance"] or ()), *provenance_document(added)]
    return {"provenance": document, "accepts_changes": False}


def outstanding_ask(connection: Connection, job: Row) -> Ask | None:
    """Read the iteration that was asked and is not yet committed.

    Args:
        connection: An open transaction.
        job: The job's row.

    Returns:
        The ask; None for a job that has not begun, or has spent its budget.
    """
    query = select(iterations).where(
        iterations.c.job_id == job["id"],
        iterations.c.iteration == job["iterations"],
    )
    row = connection.execute(query).mappings().first()
    return to_ask(row) if row is not None else None


def answered_ask(connection: Connection, job: Row) -> Answered | None:
    """Read the last committed ask with its evaluations, from which the next one follows.

    Args:
        connection: An open transaction.
        job: The job's row.

    Returns:
        The ask and its answer; None for a job that has committed nothing.
    """
    last = job["iterations"] - 1
    query = select(iterations).where(
        iterations.c.job_id == job["id"], iterations.c.iteration == last
    )
    row = connection.execute(query).mappings().first()
    if row is None:
        return None
    columns = select_columns(connection, job["id"], last, last + 1)
    return None if columns is None else Answered(to_ask(row), columns)


def insert_ask(connection: Connection, job: Row, ask: Ask, *, expected: int, now: datetime) -> None:
    """Store an ask before it is sent out.

    Args:
        connection: The transaction in which the job was locked.
        job: The job's row.
        ask: What is to be evaluated.
        expected: The iteration that is the job's next.
        now: The time at which it is asked.

    Raises:
        Conflict: The ask is of another iteration.
    """
    if ask.iteration != expected:
        raise Conflict(
            f"job {job['id']} asks for iteration {ask.iteration}, but its next is {expected}"
        )
    columns = {"job_id": job["id"], "asked_at": now, **ask_columns(ask)}
    connection.execute(insert(iterations).values(columns))


def complete_iteration(
    connection: Connection, job: Row, done: CompletedIteration, now: datetime
) -> str:
    """Fill in the iteration that was asked, and add its evaluations and reevaluation.

    The optimizer's state of the iteration before is cleared: a job goes on from the outstanding ask
    or, where it is extended, from the last committed one, and states may grow with every iteration.

    Args:
        connection: The transaction in which the job was locked.
        job: The job's row.
        done: What the iteration came to.
        now: The time of the commit.

    Returns:
        Digest of the iteration, chained to the one before.

    Raises:
        Conflict: The iteration was not asked, or is committed already.
    """
    chained = chained_columns(connection, job, done)
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
            **chained,
            **fitness_summary(
                done.fitness, None if done.best is None else done.best[1], job["best_fitness"]
            ),
        )
    )
    if filled.rowcount != 1:
        raise Conflict(
            f"iteration {done.iteration} of job {job['id']} was not asked; its next is"
            f" {job['iterations']}"
        )
    connection.execute(
        update(iterations)
        .where(iterations.c.job_id == job["id"], iterations.c.iteration == done.iteration - 1)
        .values(optimizer_state={})
    )
    connection.execute(insert(evaluations), evaluation_rows(job["id"], done))
    if done.reevaluation is not None:
        row = reevaluation_row(job["id"], done.iteration, done.reevaluation)
        connection.execute(insert(reevaluations).values(row))
    digest: str = chained["digest"]
    return digest


def entering(state: JobState, now: datetime) -> dict[str, Any]:
    """Columns that follow from a state; only a job under way keeps its lease, none waits yet.

    The token stays in any case, so that the next one is higher.

    Args:
        state: The state that a job enters.
        now: The time at which it does.

    Returns:
        Values by name of their columns.
    """
    columns: dict[str, Any] = {
        "state": state,
        "updated_at": now,
        "finished_at": now if state.terminal else None,
        "waiting": None,
    }
    if state not in (JobState.RUNNING, JobState.PAUSING):
        columns |= {"lease_owner": None, "lease_expires_at": None}
    return columns


def state_after_commit(state: JobState, following: Ask | None) -> JobState:
    """The state of a job that has committed an iteration.

    Args:
        state: Its state before.
        following: What was asked next. None at the end of the budget, which wins over a pause that
            was asked for in the last iteration.

    Returns:
        Its state after.
    """
    if following is None:
        return JobState.SUCCEEDED
    return JobState.PAUSED if state is JobState.PAUSING else state


def state_after_release(state: JobState, wanted: JobState) -> JobState:
    """The state of a job that its runner gives up.

    Args:
        state: Its state before.
        wanted: What the runner releases it as.

    Returns:
        As wanted; but a job that was to pause is not queued again by a runner that shuts down.
    """
    if wanted is JobState.QUEUED and state is JobState.PAUSING:
        return JobState.PAUSED
    return wanted


def progress_after(job: Row, done: CompletedIteration) -> dict[str, Any]:
    """Progress with one more iteration; only a strictly lower fitness is a new best.

    Args:
        job: The job's row before.
        done: What the iteration came to.

    Returns:
        Values by name of their columns.
    """
    columns: dict[str, Any] = {
        "crashes": None,
        "iterations": done.iteration + 1,
        "evaluations": job["evaluations"] + len(done.fitness),
        "evaluations_saved": (job["evaluations_saved"] or 0) + done.saved,
        "compute_seconds": job["compute_seconds"] + done.evaluate_seconds,
        "recent_seconds": recent_pace(
            job["recent_seconds"], done.evaluate_seconds / max(1, len(done.fitness))
        ),
    }
    if done.best is not None:
        particle, fitness = done.best
        if job["best_fitness"] is None or fitness < job["best_fitness"]:
            columns |= {
                "best_fitness": fitness,
                "best_iteration": done.iteration,
                "best_particle": particle,
            }
    return columns


def require_readable(row: Row) -> None:
    """Refuse what needs the spec of a job that cannot be read.

    Args:
        row: The job's row.

    Raises:
        Unreadable: Its spec cannot be read; says why.
    """
    _ = to_job(row).spec
