"""The memory in SQL: SQLite for one machine, PostgreSQL for many."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any, Final

from sqlalchemy import update
from sqlalchemy.exc import IntegrityError

from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.audit import LOCAL, AuditAction, AuditEntry
from gaitswarm.services.optimizer.jobs.documents import check_budget
from gaitswarm.services.optimizer.jobs.fork import Fork
from gaitswarm.services.optimizer.jobs.job import (
    Claim,
    Command,
    Job,
    JobOrder,
    JobState,
    commanded,
    extended,
)
from gaitswarm.services.optimizer.jobs.labels import ANY_JOB, FacetCounts, JobFilter, LabelsChange
from gaitswarm.services.optimizer.jobs.priority import check_can_be_prioritized
from gaitswarm.services.optimizer.jobs.provenance import JobProvenance, first_record
from gaitswarm.services.optimizer.jobs.quota import Quota
from gaitswarm.services.optimizer.jobs.reference import Reference
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.services.optimizer.store.connections.changes import SqlChanges
from gaitswarm.services.optimizer.store.connections.engine import (
    Clock,
    Database,
    check_file,
    connect,
    database_time,
    parse_url,
)
from gaitswarm.services.optimizer.store.connections.file_system import check_file_system
from gaitswarm.services.optimizer.store.port.reading import Page, Queue
from gaitswarm.services.optimizer.store.rows.job_rows import request_digest, to_job
from gaitswarm.services.optimizer.store.rows.tables import jobs
from gaitswarm.services.optimizer.store.schema.in_use import admit
from gaitswarm.services.optimizer.store.schema.migrate import create
from gaitswarm.services.optimizer.store.schema.revisions import check_revision
from gaitswarm.services.optimizer.store.statements.audit import (
    audit_page,
    note_change,
    note_submission,
)
from gaitswarm.services.optimizer.store.statements.claims import (
    has_live_lease,
    take_job,
)
from gaitswarm.services.optimizer.store.statements.job_cursors import cursor_of
from gaitswarm.services.optimizer.store.statements.job_list import (
    among_jobs,
    fittest_jobs,
    jobs_of,
    newest_jobs,
)
from gaitswarm.services.optimizer.store.statements.job_orders import sorted_ids
from gaitswarm.services.optimizer.store.statements.labels import count_facets, label_job
from gaitswarm.services.optimizer.store.statements.queue import count_jobs
from gaitswarm.services.optimizer.store.statements.records import (
    entering,
    job_row,
    job_to_show,
    require_readable,
    update_job,
)
from gaitswarm.services.optimizer.store.statements.submissions import (
    Submission,
    check_quota,
    insert_job,
    repeated_job,
)
from gaitswarm.services.optimizer.store.transactions.deletion import SqlDeletion
from gaitswarm.services.optimizer.store.transactions.history import SqlHistory, checked_limit
from gaitswarm.services.optimizer.store.transactions.outbox import SqlOutbox
from gaitswarm.services.optimizer.store.transactions.recordings import SqlRecordings
from gaitswarm.services.optimizer.store.transactions.runs import SqlRuns
from gaitswarm.services.optimizer.store.transactions.tokens import SqlTokens

_LONGEST_KEY: Final = 200

_LISTED: Final = {JobOrder.CREATED: newest_jobs, JobOrder.FITNESS: fittest_jobs}
"""What reads a page of the job list by itself, where nothing is searched for."""


def open_store(url: str, *, clock: Clock = database_time) -> SqlStore:
    """Open a database of the newest schema; an SQLite file, and the tables of an empty database,
    are made.

    Args:
        url: `sqlite:///path`, a bare path, or `postgresql://user:password@host/database`.
        clock: Tells the time of all that is stored, leases included. Only tests need another than
            the database's own, which all processes share.

    Returns:
        The store; whoever opened it closes it.

    Raises:
        StoreUnavailable: The database cannot be used; names it and says what to do.
    """
    parsed = parse_url(url)
    check_file_system(parsed)
    create(parsed)
    database = connect(parsed)
    admit(database)
    return SqlStore(database, clock=clock)


class SqlStore(SqlDeletion, SqlHistory, SqlRecordings, SqlRuns):
    """`Store` on a database that has the newest schema, such as `open_store` gives.

    Args:
        database: Closed with this.
        clock: Tells the time of all that is stored.
    """

    def __init__(self, database: Database, *, clock: Clock = database_time) -> None:
        SqlHistory.__init__(self, database)
        SqlDeletion.__init__(self, database, clock)
        SqlRecordings.__init__(self, database, clock)
        SqlRuns.__init__(self, database, clock)
        self.tokens = SqlTokens(database, clock)
        self.outbox = SqlOutbox(database, clock)
        self.changes = SqlChanges(database)

    # jobs, as their users see them

    def create_job(
        self,
        spec: Spec,
        *,
        provenance: JobProvenance | None = None,
        idempotency_key: str | None = None,
        request: Any = None,
        fork: Fork | None = None,
        owner: str | None = None,
        notify_url: str | None = None,
        seconds: float | None = None,
        quota: Quota | None = None,
        priority: int = 0,
    ) -> tuple[Job, bool]:
        """Insert a queued job, or find the one that the same key made before."""
        _check_key(idempotency_key)
        digest: str | None = None
        if idempotency_key is not None:
            sent = spec.model_dump(mode="json", exclude_unset=True) if request is None else request
            digest = request_digest(sent)
        records = first_record(provenance)
        asked = Submission(
            spec.resolved(),
            idempotency_key,
            digest,
            records,
            fork,
            owner,
            notify_url,
            seconds,
            priority,
        )
        try:
            with self._database.transaction(write=True) as connection:
                earlier = repeated_job(connection, asked)
                if earlier is None:
                    check_quota(connection, owner, quota, new_jobs=1, new_seconds=seconds or 0.0)
                    now = self._clock(connection)
                    job = insert_job(connection, asked, now)
                    note_submission(connection, now, job)
                    return job, True
        except IntegrityError:
            # Another process has inserted the same key between our look and our insertion.
            with self._database.transaction(write=False) as connection:
                earlier = repeated_job(connection, asked)
            if earlier is None:
                raise
        return earlier, False

    def create_claimed_job(
        self,
        spec: Spec,
        runner: str,
        *,
        lease_seconds: float,
        provenance: JobProvenance | None = None,
    ) -> Claim:
        """Insert a job that is running from the start, held by `runner`."""
        with self._database.transaction(write=True) as connection:
            now = self._clock(connection)
            asked = Submission(spec.resolved(), provenance=first_record(provenance))
            job = insert_job(connection, asked, now)
            note_submission(connection, now, job)
            return take_job(connection, job_row(connection, job.id), runner, lease_seconds, now)

    def job(self, job_id: str) -> Job:
        """Read a job with its progress."""
        with self._database.transaction(write=False) as connection:
            return job_to_show(connection, job_id)

    def jobs(
        self,
        *,
        state: JobState | None = None,
        kind: str | None = None,
        parent: str | None = None,
        search: str = "",
        where: JobFilter = ANY_JOB,
        order: JobOrder = JobOrder.CREATED,
        after: str | None = None,
        limit: int = 50,
        reverse: bool = False,
    ) -> Page[Job]:
        """Read a page of jobs."""
        limit = checked_limit(limit)
        among = among_jobs(state, parent, where.archived)
        listed = _LISTED.get(order)
        plain = not search and kind is None and not where.needs_specs and not reverse
        if plain and listed is not None:
            with self._database.transaction(write=False) as connection:
                return listed(connection, among, after, limit)
        while True:
            with self._database.transaction(write=False) as connection:
                found = sorted_ids(
                    connection,
                    among=among,
                    kind=kind,
                    search=search,
                    where=where,
                    order=order,
                    after=after,
                    limit=limit + 1,
                    reverse=reverse,
                )
                ids, more = found[:limit], len(found) > limit
                items = jobs_of(connection, ids)
            # Else a job was removed in between.
            if len(items) == len(ids):
                end = cursor_of(items[-1], order, reverse=reverse) if more else None
                return Page(items, end)

    def facets(self, *, archived: bool | None = None) -> FacetCounts:
        """Count jobs by what they are found by."""
        with self._database.transaction(write=False) as connection:
            return count_facets(connection, among_jobs(None, None, archived))

    def label(self, job_id: str, change: LabelsChange, *, actor: str = LOCAL) -> Job:
        """Change what is written on a job."""
        with self._database.transaction(write=True) as connection:
            now = self._clock(connection)
            return to_job(label_job(connection, job_id, change, now=now, actor=actor))

    def note_reference(self, job_id: str, reference: Reference) -> None:
        """Note what a job's best is measured against."""
        with self._database.transaction(write=True) as connection:
            unknown = jobs.c.reference.is_(None)
            noted = update(jobs).where(jobs.c.id == job_id, unknown)
            connection.execute(noted.values(reference=asdict(reference)))

    def queue(self) -> Queue:
        """Count the jobs."""
        with self._database.transaction(write=False) as connection:
            return count_jobs(connection, self._clock(connection))

    def command(
        self,
        job_id: str,
        command: Command,
        *,
        accept_changes: bool = False,
        actor: str = LOCAL,
        quota: Quota | None = None,
    ) -> Job:
        """Apply a command of a user, or refuse it."""
        with self._database.transaction(write=True) as connection:
            row = job_row(connection, job_id, lock=True)
            now = self._clock(connection)
            before = JobState(row["state"])
            under_way = before in (JobState.RUNNING, JobState.PAUSING)
            abandoned = under_way and not has_live_lease(connection, job_id, now)
            if abandoned and command is Command.RESUME:
                state = JobState.QUEUED
            else:
                state = commanded(before, command)
            if abandoned and state is JobState.PAUSING:
                # No runner would complete the pause.
                state = JobState.PAUSED
            if state is JobState.QUEUED:
                require_readable(row)
            if before.terminal and not state.terminal:
                seconds = row["simulated_seconds"] or 0.0
                check_quota(connection, row["owner"], quota, new_jobs=1, new_seconds=seconds)
            changes = entering(state, now)
            details = {}
            if command is Command.RESUME:
                queued = state is JobState.QUEUED
                changes |= {"error": None, "accepts_changes": queued and accept_changes}
                changes |= {"crashes": None}
                details = {"accept_changes": True} if accept_changes else {}
            note_change(connection, now, actor, AuditAction(command), job_id, **details)
            return to_job(update_job(connection, row, changes))

    def extend(
        self,
        job_id: str,
        iterations: int,
        *,
        actor: str = LOCAL,
        seconds: float | None = None,
        quota: Quota | None = None,
    ) -> Job:
        """Change the budget of a job, and queue it again if it had ended."""
        with self._database.transaction(write=True) as connection:
            row = job_row(connection, job_id, lock=True)
            require_readable(row)
            state = JobState(row["state"])
            job = to_job(row)
            after = extended(state, job.spent, iterations)
            check_budget(job.spec, iterations)
            # One that has ended is not among the unfinished ones: all of it is added.
            ended = state.terminal
            planned = row["simulated_seconds"] if seconds is None else seconds
            known = 0.0 if ended else row["simulated_seconds"] or 0.0
            added = (planned or 0.0) - known
            again = int(ended and not after.terminal)
            check_quota(connection, row["owner"], quota, new_jobs=again, new_seconds=added)
            # Whoever runs the job notices when it commits; until then nothing changes for it.
            now = self._clock(connection)
            changes = entering(after, now) if after is not state else {}
            changes |= {"budget": iterations, "simulated_seconds": planned}
            note_change(connection, now, actor, AuditAction.EXTEND, job_id, iterations=iterations)
            return to_job(update_job(connection, row, changes))

    def prioritize(self, job_id: str, priority: int, *, actor: str = LOCAL) -> Job:
        """Change a job's priority."""
        with self._database.transaction(write=True) as connection:
            row = job_row(connection, job_id, lock=True)
            check_can_be_prioritized(JobState(row["state"]))
            now, action = self._clock(connection), AuditAction.PRIORITIZE
            note_change(connection, now, actor, action, job_id, priority=priority)
            return to_job(update_job(connection, row, {"priority": priority}))

    def audit(
        self, *, job_id: str | None = None, after: str | None = None, limit: int = 50
    ) -> Page[AuditEntry]:
        """Read a page of the audit log."""
        limit = checked_limit(limit)
        with self._database.transaction(write=False) as connection:
            return audit_page(connection, job_id, after, limit)

    def ping(self) -> None:
        """Ask the database for its schema revision."""
        check_revision(self._database)
        self._database.check_in_place()

    def verify(self) -> None:
        """Read an SQLite file anew; a PostgreSQL server watches over its own."""
        check_file(self._database)

    def close(self) -> None:
        """Close the pooled connections."""
        self.changes.close()
        self._database.close()


def _check_key(key: str | None) -> None:
    if key is not None and not (0 < len(key) <= _LONGEST_KEY and key.isprintable()):
        raise InvalidRequest(
            f"an idempotency key has 1 to {_LONGEST_KEY} printable characters",
            field="idempotency_key",
        )
