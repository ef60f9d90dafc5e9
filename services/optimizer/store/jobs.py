"""Submission, commands, labels and deletion of jobs"""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Collection
from dataclasses import asdict
from datetime import datetime, timedelta
from typing import Any, Final

from sqlalchemy import Connection, Table, delete, exists, func, insert, select, update
from sqlalchemy.exc import IntegrityError

from gaitswarm.services.optimizer.errors import (
    Conflict,
    IdempotencyConflict,
    InvalidRequest,
    NotFound,
)
from gaitswarm.services.optimizer.jobs.audit import LOCAL, RETENTION, AuditAction
from gaitswarm.services.optimizer.jobs.documents import check_budget
from gaitswarm.services.optimizer.jobs.fork import Fork, Lineage
from gaitswarm.services.optimizer.jobs.job import (
    DELETABLE,
    ENDED,
    Claim,
    Command,
    Job,
    JobState,
    Quota,
    commanded,
    extended,
)
from gaitswarm.services.optimizer.jobs.labels import (
    Labels,
    LabelsChange,
    preference_name,
    robot_name,
)
from gaitswarm.services.optimizer.jobs.listing import folded, storable
from gaitswarm.services.optimizer.jobs.provenance import JobProvenance, first_record
from gaitswarm.services.optimizer.jobs.reference import Reference
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.services.optimizer.store.engine import Aggregate
from gaitswarm.services.optimizer.store.history import take_history
from gaitswarm.services.optimizer.store.job_rows import (
    COLUMNS,
    entering,
    job_row,
    new_job_id,
    provenance_document,
    to_job,
    update_job,
)
from gaitswarm.services.optimizer.store.leases import has_live_lease, take_job
from gaitswarm.services.optimizer.store.tables import (
    EXISTING,
    Row,
    evaluations,
    jobs,
    metadata,
    notifications,
)
from gaitswarm.services.optimizer.store.tokens import check_quota, note_change

_LONGEST_KEY: Final = 200

_EVALUATIONS_AT_ONCE: Final = 5000
"""Removed in one transaction."""

_JOBS_AT_ONCE: Final = 500
_STEADY: Final = timedelta(days=1)
"""Marked as deleted in one transaction."""

_DELETED: Final = select(jobs.c.id).where(jobs.c.deleted_at.is_not(None)).limit(1)

_OF_JOBS: Final[tuple[Table, ...]] = tuple(
    table
    for table in reversed(metadata.sorted_tables)
    if "job_id" in table.c and (table.foreign_keys or table is notifications)
)
"""Tables whose rows are removed with their job, referring tables first; not the audit log."""


class Jobs(Aggregate):
    """Jobs as users see them. Methods with an id raise NotFound for an unknown one."""

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
        """Insert a queued job, or return the one that the same key created before.

        Args:
            idempotency_key: a repeated request with it creates no second job, even if presets or
                defaults have changed in between.
            request: JSON document of the request as sent; None for the fields set in the spec.
            fork: origin of a forked job, whose history is copied.
            owner: name of the token of the request.
            notify_url: checked URL that is notified of the job's end.

        Returns:
            The job, and whether it is new.

        Raises:
            Conflict: the parent of a fork is gone.
            InvalidRequest: the key is empty, too long or not printable.
            IdempotencyConflict: the key was used for another request.
        """
        key, digest = idempotency_key, None
        if key is not None:
            if not (0 < len(key) <= _LONGEST_KEY and key.isprintable()):
                raise InvalidRequest(
                    f"an idempotency key has 1 to {_LONGEST_KEY} printable characters",
                    field="idempotency_key",
                )
            sent = spec.model_dump(mode="json", exclude_unset=True) if request is None else request
            canonical = json.dumps(sent, sort_keys=True, separators=(",", ":"))
            digest = hashlib.sha256(canonical.encode()).hexdigest()
        spec = spec.resolved()
        lineage = None if fork is None else fork.lineage
        try:
            with self._database.write("create_job") as connection:
                earlier = _repeated_job(connection, key, digest, spec, lineage)
                if earlier is not None:
                    return earlier, False
                check_quota(connection, owner, quota, new_jobs=1, new_seconds=seconds or 0.0)
                columns = {
                    "provenance": provenance_document(first_record(provenance)),
                    "owner": owner,
                    "notify_url": notify_url,
                    "simulated_seconds": seconds,
                    "priority": priority,
                    "idempotency_key": key,
                    "request_digest": digest,
                }
                return to_job(self._insert(connection, spec, columns, fork)), True
        except IntegrityError:
            # Another process has inserted the same key meanwhile.
            with self._database.read("create_job") as connection:
                earlier = _repeated_job(connection, key, digest, spec, lineage)
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
        """Insert a running job leased by a runner, which no other can claim in between."""
        with self._database.write("create_claimed_job") as connection:
            columns = {"provenance": provenance_document(first_record(provenance))}
            row = self._insert(connection, spec.resolved(), columns)
            return take_job(connection, row, runner, lease_seconds, row["created_at"])

    def _insert(
        self, connection: Connection, spec: Spec, columns: Row, fork: Fork | None = None
    ) -> Row:
        now, job_id = self._clock(connection), new_job_id()
        lineage = None if fork is None else fork.lineage
        taken = None if fork is None else fork.taken
        if lineage is not None and taken is not None:
            try:
                # It must not be deleted while it is copied.
                job_row(connection, lineage.parent, lock=True)
            except NotFound as error:
                raise Conflict(f"job {lineage.parent} that was to be forked was deleted") from error
        document = spec.model_dump(mode="json")
        values = {
            "id": job_id,
            "state": JobState.QUEUED,
            "spec": document,
            "parent_id": None if lineage is None else lineage.parent,
            "lineage": None if lineage is None else lineage.model_dump(mode="json"),
            "created_at": now,
            "updated_at": now,
            "lease_token": 0,
            "iterations": 0,
            "evaluations": 0,
            "compute_seconds": 0.0,
            "evaluations_taken": 0 if lineage is None else lineage.evaluations,
            "kind": document["kind"],
            "robot": robot_name(spec.robot),
            "controller": getattr(spec, "controller", None),
            "preference": preference_name(getattr(spec, "preference", None)),
            **_search_columns(job_id, spec.name, Labels()),
            **columns,
        }
        statement = insert(jobs).values(values).returning(*COLUMNS)
        row: Row = connection.execute(statement).mappings().one()
        action, details = AuditAction.SUBMIT, {}
        if lineage is not None:
            action = AuditAction.FORK
            details = {"parent": lineage.parent, "from_iteration": lineage.from_iteration}
        note_change(connection, now, row["owner"] or LOCAL, action, job_id, **details)
        if lineage is not None and taken is not None:
            row = update_job(connection, row, take_history(connection, row, lineage, taken, now))
        return row

    def job(self, job_id: str) -> Job:
        """Return a job, whether its spec is readable or not."""
        with self._database.read("job") as connection:
            return to_job(job_row(connection, job_id))

    def command(
        self,
        job_id: str,
        command: Command,
        *,
        accept_changes: bool = False,
        actor: str = LOCAL,
        quota: Quota | None = None,
    ) -> Job:
        """Apply a user's command and return the changed job; see `commanded`.

        A job whose lease has expired is paused at once, and queued if resumed. Cancelling clears
        the lease, so the runner's next write is refused.

        Args:
            command: to apply.
            accept_changes: whether a resumed job may continue under a changed provenance.
            quota: of the owner's unfinished jobs, if an ended job is queued again.

        Raises:
            Conflict: its state does not allow the command.
            Unreadable: it would be queued, but is unreadable.
        """
        with self._database.write("command") as connection:
            row, now = job_row(connection, job_id, lock=True), self._clock(connection)
            before = JobState(row["state"])
            leased = select(jobs.c.id).where(jobs.c.id == job_id, has_live_lease(now))
            under_way = before in (JobState.RUNNING, JobState.PAUSING)
            abandoned = under_way and connection.execute(leased).first() is None
            if abandoned and command is Command.RESUME:
                state = JobState.QUEUED
            else:
                state = commanded(before, command)
            if abandoned and state is JobState.PAUSING:
                # No runner would complete the pause.
                state = JobState.PAUSED
            if state is JobState.QUEUED:
                _ = to_job(row).spec  # Raises Unreadable.
            if before.terminal and not state.terminal:
                seconds = row["simulated_seconds"] or 0.0
                check_quota(connection, row["owner"], quota, new_jobs=1, new_seconds=seconds)
            changes, details = entering(state, now), {}
            if command is Command.RESUME:
                accepts = state is JobState.QUEUED and accept_changes
                changes |= {"error": None, "accepts_changes": accepts, "crashes": 0}
                details = {"accept_changes": True} if accept_changes else {}
            note_change(connection, now, actor, AuditAction(command), job_id, **details)
            job = to_job(update_job(connection, row, changes))
        if job.state is JobState.CANCELLED:
            for observer in self._database.observers:
                observer.cancelled(job)
        return job

    def extend(
        self,
        job_id: str,
        iterations: int,
        *,
        actor: str = LOCAL,
        seconds: float | None = None,
        quota: Quota | None = None,
    ) -> Job:
        """Change a job's budget; see `extended`.

        Committed iterations and the open ask stay; later asks are made under the new budget, as
        the runner detects it at its next commit.

        Returns:
            The changed job, queued if it had succeeded.

        Raises:
            Conflict: the job was cancelled.
            InvalidRequest: the budget is spent already, or the job cannot have it.
            Unreadable: the job's spec is unreadable.
        """
        with self._database.write("extend") as connection:
            row = job_row(connection, job_id, lock=True)
            state, job = JobState(row["state"]), to_job(row)
            after = extended(state, job.spent, iterations)
            check_budget(job.spec, iterations)
            planned = row["simulated_seconds"] if seconds is None else seconds
            # An ended job does not count yet.
            counted = 0.0 if state.terminal else row["simulated_seconds"] or 0.0
            added, again = (planned or 0.0) - counted, state.terminal and not after.terminal
            check_quota(connection, row["owner"], quota, new_jobs=int(again), new_seconds=added)
            now = self._clock(connection)
            changes = entering(after, now) if after is not state else {}
            changes |= {"budget": iterations, "simulated_seconds": planned}
            note_change(connection, now, actor, AuditAction.EXTEND, job_id, iterations=iterations)
            return to_job(update_job(connection, row, changes))

    def prioritize(self, job_id: str, priority: int, *, actor: str = LOCAL) -> Job:
        """Change an unfinished job's priority, which its runner reads at the next renewal.

        Raises:
            Conflict: the job has ended.
        """
        with self._database.write("prioritize") as connection:
            row = job_row(connection, job_id, lock=True)
            state = JobState(row["state"])
            if state.terminal:
                raise Conflict(f"cannot prioritize a job that is {state}; it has ended")
            now, action = self._clock(connection), AuditAction.PRIORITIZE
            note_change(connection, now, actor, action, job_id, priority=priority)
            return to_job(update_job(connection, row, {"priority": priority}))

    def label(self, job_id: str, change: LabelsChange, *, actor: str = LOCAL) -> Job:
        """Change a job's labels; results do not depend on them."""
        with self._database.write("label") as connection:
            row = job_row(connection, job_id, lock=True)
            job = to_job(row)
            labels = change.applied(job.labels)
            columns: dict[str, Any] = {"labels": labels.model_dump(mode="json")}
            columns |= _search_columns(job_id, job.stored_spec.name, labels)
            if change.archived is not None:
                columns["archived"] = change.archived
            note_change(connection, self._clock(connection), actor, AuditAction.LABEL, job_id)
            return to_job(update_job(connection, row, columns))

    def note_reference(self, job_id: str, reference: Reference) -> None:
        """Store the reference of a job's best design, unless one is stored or the job is gone."""
        unset = update(jobs).where(jobs.c.id == job_id, jobs.c.reference_kind.is_(None))
        columns = {f"reference_{name}": value for name, value in asdict(reference).items()}
        with self._database.write("note_reference") as connection:
            connection.execute(unset.values(columns))

    def keep(self, job_id: str, kept: bool, *, actor: str = LOCAL) -> Job:
        """Protect a job from deletion, or release it."""
        with self._database.write("keep") as connection:
            row = job_row(connection, job_id, lock=True)
            action = AuditAction.KEEP if kept else AuditAction.RELEASE
            note_change(connection, self._clock(connection), actor, action, job_id)
            return to_job(update_job(connection, row, {"kept": kept}))

    def delete_job(self, job_id: str, *, actor: str = LOCAL) -> None:
        """Delete a job with its history; forks have copies of theirs.

        The job is invisible, and its idempotency key free, once this returns. `purge_deleted`
        removes the rows of a long job, as SQLite has one writer at a time.

        Raises:
            Conflict: it is queued, running, pausing or kept.
        """
        with self._database.write("delete_job") as connection:
            row = job_row(connection, job_id, lock=True)
            state = JobState(row["state"])
            if state not in DELETABLE:
                raise Conflict(
                    f"cannot delete a job that is {state}; cancel it first: `gaitswarm cancel"
                    f" {job_id}`, or POST /v1/jobs/{job_id}/cancel"
                )
            if row["kept"]:
                raise Conflict(
                    "cannot delete a job that is kept; release it first: `gaitswarm keep --release"
                    f" {job_id}`, or DELETE /v1/jobs/{job_id}/keep"
                )
            _mark_deleted(connection, [job_id], self._clock(connection), actor)
            if row["evaluations"] <= _EVALUATIONS_AT_ONCE:
                _remove_rows(connection, job_id)

    def clock_jump(self) -> timedelta | None:
        """Return by how much the clock has jumped ahead in the last day; None if it has not.

        A day without any change, and less than a day with changes since, counts as a jump: what
        ended before it may seem older than it is.
        """
        changed = jobs.c.updated_at
        with self._database.read("clock_jump") as connection:
            now = self._clock(connection)
            before = connection.execute(
                select(func.max(changed)).where(changed <= now - _STEADY)
            ).scalar()
            if before is None:
                return None
            after = connection.execute(select(func.min(changed)).where(changed > before)).scalar()
        jump: timedelta = (after or now) - before
        return jump if jump > _STEADY else None

    def delete_ended_before(
        self, moment: datetime, states: Collection[JobState] = ENDED
    ) -> tuple[str, ...]:
        """Delete jobs as `delete_job` does, except kept ones and parents of unfinished forks.

        Args:
            moment: aware time before which they ended.
            states: in which they ended.

        Returns:
            Their ids.
        """
        fork = jobs.alias("fork")
        unfinished_fork = exists().where(
            fork.c.parent_id == jobs.c.id, fork.c.state.not_in(ENDED), fork.c.deleted_at.is_(None)
        )
        expired = select(jobs.c.id).where(
            jobs.c.state.in_(ENDED.intersection(states)),
            jobs.c.finished_at < moment,
            jobs.c.kept.is_(False),
            EXISTING,
            ~unfinished_fork,
        )
        deleted: list[str] = []
        while True:
            with self._database.write("delete_ended_before") as connection:
                query = expired.limit(_JOBS_AT_ONCE).with_for_update()
                ids = list(connection.execute(query).scalars())
                _mark_deleted(connection, ids, self._clock(connection), RETENTION)
            deleted += ids
            if len(ids) < _JOBS_AT_ONCE:
                return tuple(deleted)

    def purge_deleted(self, should_stop: Callable[[], bool] = lambda: False) -> None:
        """Remove rows of deleted jobs in short transactions, using half of the time.

        Several processes may do so at once.

        Args:
            should_stop: called between transactions; if true, the rest is left to a later call.
        """
        with self._database.read("purge_deleted") as connection:
            more = connection.execute(_DELETED).first() is not None
        while more and not should_stop():
            begun = time.monotonic()
            with self._database.write("purge_deleted") as connection:
                more = _remove_rows(connection)
            if more:
                time.sleep(time.monotonic() - begun)


def _repeated_job(
    connection: Connection, key: str | None, digest: str | None, spec: Spec, lineage: Lineage | None
) -> Job | None:
    """Return the job that the same key created. Raises IdempotencyConflict for another request."""
    query = select(*COLUMNS).where(jobs.c.idempotency_key == key)
    row = None if key is None else connection.execute(query).mappings().first()
    if row is None:
        return None
    job, submitted = to_job(row), to_job({**row, "budget": None}).stored_spec
    # Equal requests resolve to unequal specs if presets have changed since; a request in other
    # words is the same if its spec is.
    if row["request_digest"] == digest or (submitted == spec and job.lineage == lineage):
        return job
    what = "the different job" if job.readable else "a job that cannot be read and compared,"
    raise IdempotencyConflict(
        f"idempotency key {key!r} was used before, for {what} {row['id']}; use a new key for a new"
        " job"
    )


def _search_columns(job_id: str, spec_name: str, labels: Labels) -> dict[str, Any]:
    """Return the columns by which a job is found and sorted by name."""
    name = labels.name or spec_name
    words = "\n".join((name, job_id, labels.note, *labels.tags))
    tags = "\n".join(("", *labels.tags, ""))
    columns = {"sort_name": folded(name) or None, "search_text": folded(words)}
    return columns | {"tags": storable(tags) if labels.tags else None}


def _mark_deleted(connection: Connection, ids: Collection[str], now: datetime, actor: str) -> None:
    gone = {"deleted_at": now, "idempotency_key": None, "request_digest": None}
    connection.execute(update(jobs).where(jobs.c.id.in_(ids)).values(**gone))
    for job_id in ids:
        note_change(connection, now, actor, AuditAction.DELETE, job_id)


def _remove_rows(connection: Connection, job_id: str | None = None) -> bool:
    """Remove some rows of a deleted job, of any if None, and with the last its own.

    Returns whether there may be more.
    """
    query = _DELETED if job_id is None else _DELETED.where(jobs.c.id == job_id)
    job_id = connection.execute(query.with_for_update(skip_locked=True)).scalar()
    if job_id is None:
        return False
    table = evaluations.c
    places = select(table.iteration).where(table.job_id == job_id)
    places = places.order_by(table.iteration, table.particle)
    end = connection.execute(places.offset(_EVALUATIONS_AT_ONCE).limit(1)).scalar()
    if end is not None:
        # At least one iteration.
        end = max(end, connection.execute(places.limit(1)).scalar_one() + 1)
    for of_job in _OF_JOBS:
        rows = delete(of_job).where(of_job.c.job_id == job_id)
        if end is None:
            connection.execute(rows)
        elif "iteration" in of_job.c:
            connection.execute(rows.where(of_job.c.iteration < end))
    if end is None:
        connection.execute(delete(jobs).where(jobs.c.id == job_id))
    return True
