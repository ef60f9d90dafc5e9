"""Submission, commands, labels, lists and deletion of jobs"""

from __future__ import annotations

import hashlib
import json
import time
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Sequence
from datetime import UTC, datetime, timedelta
from typing import Any, Final

import sqlalchemy as sa
from sqlalchemy.exc import IntegrityError

from gaitswarm.services.optimizer import errors
from gaitswarm.services.optimizer.jobs.audit import LOCAL, RETENTION, AuditAction
from gaitswarm.services.optimizer.jobs.documents import check_budget
from gaitswarm.services.optimizer.jobs.fork import Fork
from gaitswarm.services.optimizer.jobs.job import (
    DELETABLE,
    ENDED,
    Claim,
    Command,
    Job,
    JobOrder,
    JobState,
    Quota,
    Reference,
    commanded,
    extended,
)
from gaitswarm.services.optimizer.jobs.labels import (
    ANY_JOB,
    OWN,
    JobFacetsView,
    JobFilter,
    Labels,
    LabelsChange,
    preference_name,
    robot_name,
)
from gaitswarm.services.optimizer.jobs.listing import (
    Page,
    Queue,
    checked_limit,
    folded,
    from_cursor,
    storable,
    to_cursor,
)
from gaitswarm.services.optimizer.jobs.provenance import JobProvenance, first_record
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.services.optimizer.jobs.time_left import time_left
from gaitswarm.services.optimizer.store.engine import Aggregate
from gaitswarm.services.optimizer.store.history import take_history
from gaitswarm.services.optimizer.store.job_rows import (
    COLUMNS,
    INSERT,
    entering,
    is_job_id,
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
from gaitswarm.sim.robot.variant import SHIPPED

_ERROR_LENGTH: Final = 300

_LONGEST_KEY: Final = 200

_EVALUATIONS_AT_ONCE: Final = 5000
"""Removed in one transaction."""

_STEADY: Final = timedelta(days=1)

NO_TIME: Final = timedelta()

TRASH: Final = timedelta(hours=24)
"""Time for which a deleted job can be restored."""

_NEVER_RESTORED: Final = datetime(1970, 1, 1, tzinfo=UTC)
"""Deletion of a job of which rows are removed."""

_OF_JOBS: Final[tuple[sa.Table, ...]] = tuple(
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
        """Insert a queued job, or return the one that the same key created before; and whether new.

        A repeated request with a key creates no second job, even if presets or defaults have
        changed in between. Raises Conflict if the parent of a fork is gone, InvalidRequest for an
        invalid key, and IdempotencyConflict for one that was used for another request.

        Args:
            request: JSON document of the request as sent; None for the fields set in the spec.
            fork: origin of a forked job, whose history is copied.
            owner: name of the token of the request.
            notify_url: checked URL that is notified of the job's end.
        """
        key, digest = idempotency_key, None
        if key is not None:
            if not (0 < len(key) <= _LONGEST_KEY and key.isprintable()):
                raise errors.InvalidRequest(
                    f"an idempotency key has 1 to {_LONGEST_KEY} printable characters",
                    field="idempotency_key",
                )
            sent = spec.model_dump(mode="json", exclude_unset=True) if request is None else request
            canonical = json.dumps(sent, sort_keys=True, separators=(",", ":"))
            digest = hashlib.sha256(canonical.encode()).hexdigest()
        spec = spec.resolved()
        try:
            with self._database.write("create_job") as connection:
                earlier = _repeated_job(connection, key, digest, spec, fork)
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
                earlier = _repeated_job(connection, key, digest, spec, fork)
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
        self, connection: sa.Connection, spec: Spec, columns: Row, fork: Fork | None = None
    ) -> Row:
        now, job_id, document = self._clock(connection), new_job_id(), spec.model_dump(mode="json")
        action, details = AuditAction.SUBMIT, dict[str, Any]()
        if fork is not None:
            lineage, parent = fork.lineage, fork.lineage.parent
            if fork.taken is not None:
                try:
                    # It must not be deleted while it is copied.
                    job_row(connection, parent, lock=True)
                except errors.NotFound as error:
                    raise errors.Conflict(
                        f"job {parent} that was to be forked was deleted"
                    ) from error
            columns = {
                **columns,
                "parent_id": parent,
                "lineage": lineage.model_dump(mode="json"),
                "evaluations_taken": lineage.evaluations,
            }
            action = AuditAction.FORK
            details = {"parent": parent, "from_iteration": lineage.from_iteration}
        values = {
            "id": job_id,
            "state": JobState.QUEUED,
            "spec": document,
            "created_at": now,
            "updated_at": now,
            "kind": document["kind"],
            "robot": robot_name(spec.robot),
            "controller": getattr(spec, "controller", None),
            "preference": preference_name(getattr(spec, "preference", None)),
            **_search_columns(job_id, spec.name, Labels()),
            **columns,
        }
        row: Row = connection.execute(INSERT, values).mappings().one()
        note_change(connection, now, row["owner"] or LOCAL, action, job_id, **details)
        if fork is not None and fork.taken is not None:
            history = take_history(connection, row, fork.lineage, fork.taken, now)
            row = update_job(connection, row, history)
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
        the lease, so the runner's next write is refused. Raises Conflict if the state does not
        allow the command, and Unreadable if an unreadable job would be queued. The quota is checked
        if an ended job is queued again.
        """
        with self._database.write("command") as connection:
            row, now = job_row(connection, job_id, lock=True), self._clock(connection)
            before = JobState(row["state"])
            leased = sa.select(jobs.c.id).where(jobs.c.id == job_id, has_live_lease(now))
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
        """Change a job's budget and return it, queued if it had succeeded; see `extended`.

        Later asks are made under the new budget, as the runner detects it at its next commit.
        Raises Conflict, InvalidRequest for a budget that is spent or impossible, and Unreadable.
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
        """Change a job's priority, which its runner reads at the next renewal. Raises Conflict."""
        with self._database.write("prioritize") as connection:
            row = job_row(connection, job_id, lock=True)
            state = JobState(row["state"])
            if state.terminal:
                raise errors.Conflict(f"cannot prioritize a job that is {state}; it has ended")
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
        unset = sa.update(jobs).where(jobs.c.id == job_id, jobs.c.reference_kind.is_(None))
        columns = {f"reference_{name}": value for name, value in reference._asdict().items()}
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
        """Delete a job with its history, whose rows `purge_deleted` removes; forks have copies.

        `restore_job` brings it back within `TRASH`. Raises Conflict if it is queued, running,
        pausing or kept.
        """
        with self._database.write("delete_job") as connection:
            row = job_row(connection, job_id, lock=True)
            state = JobState(row["state"])
            if state not in DELETABLE:
                raise errors.Conflict(
                    f"cannot delete a job that is {state}; cancel it first: `gaitswarm cancel"
                    f" {job_id}`, or POST /v1/jobs/{job_id}/cancel"
                )
            if row["kept"]:
                raise errors.Conflict(
                    "cannot delete a job that is kept; release it first: `gaitswarm keep --release"
                    f" {job_id}`, or DELETE /v1/jobs/{job_id}/keep"
                )
            _mark_deleted(connection, [jobs.c.id == job_id], self._clock(connection), actor)

    def deleted_job(self, job_id: str) -> Job:
        """Return a job that can be restored. Raises NotFound."""
        with self._database.read("deleted_job") as connection:
            return to_job(self._deleted_row(connection, job_id))

    def restore_job(self, job_id: str, *, actor: str = LOCAL) -> Job:
        """Bring back a deleted job, without its idempotency key. Raises NotFound after `TRASH`."""
        with self._database.write("restore_job") as connection:
            row = self._deleted_row(connection, job_id, lock=True)
            note_change(connection, self._clock(connection), actor, AuditAction.RESTORE, job_id)
            return to_job(update_job(connection, row, {"deleted_at": None}))

    def _deleted_row(self, connection: sa.Connection, job_id: str, *, lock: bool = False) -> Row:
        since = self._clock(connection) - TRASH
        query = sa.select(*COLUMNS).where(jobs.c.id == job_id, jobs.c.deleted_at > since)
        query = query.with_for_update() if lock else query
        row = connection.execute(query).mappings().first() if is_job_id(job_id) else None
        if row is None:
            raise errors.NotFound(f"no job {job_id!r} was deleted in the last 24 hours")
        return row

    def clock_jump(self) -> timedelta | None:
        """Return the clock's jump ahead in the last day, which a day without changes counts as."""
        changed = jobs.c.updated_at
        with self._database.read("clock_jump") as connection:
            now = self._clock(connection)
            before = connection.scalar(
                sa.select(sa.func.max(changed)).where(changed <= now - _STEADY)
            )
            if before is None:
                return None
            after = connection.scalar(sa.select(sa.func.min(changed)).where(changed > before))
        jump: timedelta = (after or now) - before
        return jump if jump > _STEADY else None

    def delete_ended_before(
        self, moment: datetime, states: Collection[JobState] = ENDED
    ) -> tuple[str, ...]:
        """Delete jobs that ended before an aware time, but kept ones and parents; return ids."""
        fork = jobs.alias("fork")
        unfinished_fork = sa.exists().where(
            fork.c.parent_id == jobs.c.id, fork.c.state.not_in(ENDED), fork.c.deleted_at.is_(None)
        )
        expired = (
            jobs.c.state.in_(ENDED.intersection(states)),
            jobs.c.finished_at < moment,
            jobs.c.kept.is_(False),
            EXISTING,
            ~unfinished_fork,
        )
        with self._database.write("delete_ended_before") as connection:
            return _mark_deleted(connection, expired, self._clock(connection), RETENTION)

    def purge_deleted(
        self, should_stop: Callable[[], bool] = lambda: False, *, older_than: timedelta = NO_TIME
    ) -> None:
        """Remove rows of jobs deleted before some time, in short transactions, half of the time."""
        with self._database.read("purge_deleted") as connection:
            before = jobs.c.deleted_at <= self._clock(connection) - older_than
            deleted = sa.select(jobs.c.id).where(before).limit(1)
            more = connection.scalar(deleted) is not None
        while more and not should_stop():
            begun = time.monotonic()
            with self._database.write("purge_deleted") as connection:
                more = _remove_rows(connection, deleted)
            if more:
                time.sleep(time.monotonic() - begun)

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
        """Return a page of jobs. Jobs submitted meanwhile do not shift later pages.

        Args:
            state, kind, where: only jobs in a state, of a kind, and that meet further criteria.
            parent: only forks of the job of this id.
            order: sort order; jobs without a value are last, also in the reverse order.
        """
        limit = checked_limit(limit)
        cursor = f"-{order}" if reverse else str(order)
        kinds: dict[JobOrder, type] = {JobOrder.CREATED: datetime, JobOrder.NAME: str}
        last = None if after is None else from_cursor(cursor, after, kinds.get(order, float))
        conditions = _conditions(where)
        if state is not None:
            conditions.append(jobs.c.state == state)
        if parent is not None:
            conditions.append(jobs.c.parent_id == parent if is_job_id(parent) else sa.false())
        if search:
            conditions.append(jobs.c.search_text.contains(folded(search), autoescape=True))
        if kind is not None:
            conditions.append(jobs.c.kind == kind)
        with self._database.read("jobs") as connection:
            key = _key(connection, order)
            rows = list[Any]()
            descending = reverse is not (order is JobOrder.CREATED)
            for ids, place in _pages(conditions, key, last, descending):
                # Only ids are sorted and filtered: specs may be large.
                some = jobs.c.id.in_(ids.limit(limit + 1 - len(rows)))
                shown = sa.select(*COLUMNS, key.label("sort_key")).where(some)
                rows += connection.execute(shown.order_by(*place)).mappings()
                if len(rows) > limit:
                    break
        page = Page.of(rows, limit, lambda row: to_cursor(cursor, row["sort_key"], row["id"]))
        return Page(tuple(map(to_job, page.items)), page.next)

    def facets(self, *, archived: bool | None = None) -> JobFacetsView:
        """Count jobs by facet."""
        names = ("state", "robot", "controller", "preference")
        query = sa.select(*(jobs.c[name] for name in names), jobs.c.tags)
        with self._database.read("facets") as connection:
            rows = connection.execute(query.where(*_conditions(JobFilter(archived=archived)))).all()
        counts = {
            f"{name}s": Counter(v for row in rows if (v := row[k]) is not None)
            for k, name in enumerate(names)
        }
        tags = Counter(tag for row in rows for tag in (row.tags or "").split("\n")[1:-1])
        return JobFacetsView(total=len(rows), tags=tags, **counts)

    def queue(self) -> Queue:
        """Count jobs by state and kind. Ended jobs are not read, as there may be very many."""
        with self._database.read("queue") as connection:
            now = self._clock(connection)
            numbers = (
                sa.select(jobs.c.state, sa.func.count()).where(EXISTING).group_by(jobs.c.state)
            )
            by_state = dict.fromkeys(JobState, 0)
            by_state |= {JobState(state): count for state, count in connection.execute(numbers)}
            state_and_kind = (jobs.c.state, jobs.c.kind)
            unfinished = sa.select(*state_and_kind, sa.func.count()).group_by(*state_and_kind)
            query = unfinished.where(jobs.c.state.not_in(ENDED), EXISTING)
            under_way = {
                (JobState(state), kind): count for state, kind, count in connection.execute(query)
            }
            queued = (jobs.c.state == JobState.QUEUED, EXISTING)
            since = connection.scalar(sa.select(sa.func.min(jobs.c.updated_at)).where(*queued))
            beginning = sa.func.substr(sa.func.coalesce(jobs.c.error, ""), 1, _ERROR_LENGTH)
            failed = sa.select(beginning).where(jobs.c.state == JobState.FAILED, EXISTING)
            failures = tuple(connection.execute(failed).scalars())
        wait = 0.0 if since is None else max(0.0, (now - since).total_seconds())
        return Queue(by_state, under_way, wait, failures)


def _repeated_job(
    connection: sa.Connection, key: str | None, digest: str | None, spec: Spec, fork: Fork | None
) -> Job | None:
    """Return the job that the same key created. Raises IdempotencyConflict for another request."""
    query = sa.select(*COLUMNS).where(jobs.c.idempotency_key == key)
    row = None if key is None else connection.execute(query).mappings().first()
    if row is None:
        return None
    job, submitted = to_job(row), to_job({**row, "budget": None}).stored_spec
    # Equal requests resolve to unequal specs if presets have changed since; a request in other
    # words is the same if its spec is.
    lineage = None if fork is None else fork.lineage
    if row["request_digest"] == digest or (submitted == spec and job.lineage == lineage):
        return job
    what = "the different job" if job.readable else "a job that cannot be read and compared,"
    raise errors.IdempotencyConflict(
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


def _mark_deleted(
    connection: sa.Connection, which: Sequence[sa.ColumnElement[bool]], now: datetime, actor: str
) -> tuple[str, ...]:
    gone = {"deleted_at": now, "idempotency_key": None, "request_digest": None}
    marked = sa.update(jobs).where(*which).values(**gone).returning(jobs.c.id)
    ids = tuple(connection.execute(marked).scalars())
    for job_id in ids:
        note_change(connection, now, actor, AuditAction.DELETE, job_id)
    return ids


def _remove_rows(connection: sa.Connection, deleted: sa.Select[Any]) -> bool:
    """Remove some iterations of a deleted job, or its last rows. Returns whether there was one."""
    job_id = connection.scalar(deleted.with_for_update(skip_locked=True))
    if job_id is None:
        return False
    connection.execute(
        sa.update(jobs).where(jobs.c.id == job_id).values(deleted_at=_NEVER_RESTORED)
    )
    place, of_job = evaluations.c.iteration, evaluations.c.job_id == job_id
    first = connection.scalar(sa.select(sa.func.min(place)).where(of_job))
    end: int | None = None
    if first is not None:
        count = sa.select(sa.func.count()).where(of_job, place == first)
        end = first + max(1, _EVALUATIONS_AT_ONCE // connection.execute(count).scalar_one())
    for table in _OF_JOBS:
        rows = sa.delete(table).where(table.c.job_id == job_id)
        if end is None:
            connection.execute(rows)
        elif "iteration" in table.c:
            connection.execute(rows.where(table.c.iteration < end))
    if end is None:
        connection.execute(sa.delete(jobs).where(jobs.c.id == job_id))
    return True


def _conditions(where: JobFilter) -> list[sa.ColumnElement[bool]]:
    conditions: list[sa.ColumnElement[bool]] = [EXISTING]
    if where.archived is not None:
        conditions.append(jobs.c.archived.is_(where.archived))
    if where.robot == OWN:
        conditions.append(jobs.c.robot.not_in(SHIPPED))
    elif where.robot is not None:
        conditions.append(jobs.c.robot == storable(where.robot))
    if where.controller is not None:
        conditions.append(jobs.c.controller == storable(where.controller))
    if where.preference is not None:
        conditions.append(jobs.c.preference == storable(where.preference))
    if where.tag is not None:
        # Unlike LIKE, this tells capital letters apart in both databases.
        without = sa.func.replace(jobs.c.tags, f"\n{storable(where.tag)}\n", "")
        conditions.append(without != jobs.c.tags)
    return conditions


def _pages(
    conditions: list[sa.ColumnElement[bool]],
    key: sa.ColumnElement[Any],
    last: tuple[Any, str] | None,
    descending: bool,
) -> Iterator[tuple[sa.Select[Any], list[sa.ColumnElement[Any]]]]:
    """Yield ids after the last job and their order: jobs with a sort value, then the others."""
    ids = sa.select(jobs.c.id).where(*conditions)
    if last is None or last[0] is not None:
        place = [key, jobs.c.id]
        valued = ids.where(key.is_not(None))
        if last is not None:
            value = sa.literal(last[0], sa.Double if isinstance(last[0], float) else None)
            end, here = sa.tuple_(value, sa.literal(last[1])), sa.tuple_(*place)
            valued = valued.where(here < end if descending else here > end)
        order = [column.desc() if descending else column for column in place]
        yield valued.order_by(*order), order
    if key is not jobs.c.created_at:
        unvalued = ids.where(key.is_(None)).order_by(jobs.c.id)
        if last is not None and last[0] is None:
            unvalued = unvalued.where(jobs.c.id > last[1])
        yield unvalued, [jobs.c.id]


def _key(connection: sa.Connection, order: JobOrder) -> sa.ColumnElement[Any]:
    """Return the value to sort by; NULL if a job has none."""
    if order is JobOrder.TIME_LEFT:
        return _time_left(connection)
    if order is JobOrder.GAIN:
        # The negative of `Job.gain`.
        reference = jobs.c.reference_fitness
        return jobs.c.best_fitness / sa.case((reference > 0.0, reference)) - 1.0
    if order is JobOrder.RATE:
        own, seconds = jobs.c.evaluations - jobs.c.evaluations_taken, jobs.c.compute_seconds
        return -sa.case((sa.and_(own > 0, seconds > 0.0), own / sa.case((seconds > 0.0, seconds))))
    if order is JobOrder.STATE:
        return sa.case({str(state): k for k, state in enumerate(JobState)}, value=jobs.c.state)
    keys: dict[JobOrder, sa.ColumnElement[Any]] = {
        JobOrder.CREATED: jobs.c.created_at,
        JobOrder.FITNESS: jobs.c.best_fitness,
        JobOrder.NAME: jobs.c.sort_name,
        JobOrder.EVALUATIONS: -jobs.c.evaluations,
        JobOrder.PRIORITY: -jobs.c.priority,
        JobOrder.ITERATIONS: -jobs.c.iterations,
    }
    return keys[order]


def _time_left(connection: sa.Connection) -> sa.ColumnElement[Any]:
    """Return the estimates of the few running jobs; they depend on the time."""
    running = sa.select(*COLUMNS).where(EXISTING, jobs.c.state == JobState.RUNNING)
    now = datetime.now(UTC)
    shown = map(to_job, connection.execute(running).mappings())
    times = {job.id: time_left(job, now).eta_seconds for job in shown}
    known = {job_id: sa.literal(s, sa.Double) for job_id, s in times.items() if s is not None}
    return (
        sa.case(known, value=jobs.c.id)
        if known
        else sa.func.nullif(sa.literal(0.0, sa.Double), 0.0)
    )
