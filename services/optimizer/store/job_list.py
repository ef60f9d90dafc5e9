"""Lists of jobs: filters, search, sort orders and counts"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from datetime import UTC, datetime
from typing import Any, Final

from sqlalchemy import (
    ColumnElement,
    Connection,
    Double,
    Select,
    and_,
    case,
    false,
    func,
    literal,
    select,
    tuple_,
)

from gaitswarm.services.optimizer.jobs.estimate import time_left
from gaitswarm.services.optimizer.jobs.job import ENDED, Job, JobOrder, JobState
from gaitswarm.services.optimizer.jobs.labels import (
    ANY_JOB,
    OWN,
    FacetCounts,
    JobFilter,
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
from gaitswarm.services.optimizer.store.engine import Aggregate
from gaitswarm.services.optimizer.store.job_rows import COLUMNS, is_job_id, to_job
from gaitswarm.services.optimizer.store.tables import EXISTING, jobs
from gaitswarm.sim.robot.variant import SHIPPED

_ERROR_LENGTH: Final = 300


class JobList(Aggregate):
    """Lists and numbers of jobs."""

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
            state: only jobs in this state.
            kind: only jobs of this kind.
            parent: only forks of the job of this id.
            where: further criteria.
            order: sort order; jobs without a value are last, also in the reverse order.
            reverse: whether to reverse the order.

        Raises:
            InvalidRequest: the cursor is invalid or of another order, or the limit less than 1.
        """
        limit = checked_limit(limit)
        cursor = f"-{order}" if reverse else str(order)
        kinds: dict[JobOrder, type] = {JobOrder.CREATED: datetime, JobOrder.NAME: str}
        last = None if after is None else from_cursor(cursor, after, kinds.get(order, float))
        conditions = _conditions(where)
        if state is not None:
            conditions.append(jobs.c.state == state)
        if parent is not None:
            conditions.append(jobs.c.parent_id == parent if is_job_id(parent) else false())
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
                page = ids.limit(limit + 1 - len(rows))
                shown = select(*COLUMNS, key.label("sort_key")).where(jobs.c.id.in_(page))
                rows += connection.execute(shown.order_by(*place)).mappings()
                if len(rows) > limit:
                    break
        items = tuple(map(to_job, rows[:limit]))
        if len(rows) <= limit:
            return Page(items, None)
        return Page(items, to_cursor(cursor, rows[limit - 1]["sort_key"], items[-1].id))

    def facets(self, *, archived: bool | None = None) -> FacetCounts:
        """Count jobs by facet."""
        names = ("state", "robot", "controller", "preference")
        query = select(*(jobs.c[name] for name in names), jobs.c.tags)
        with self._database.read("facets") as connection:
            rows = connection.execute(query.where(*_conditions(JobFilter(archived=archived)))).all()
        states, robots, controllers, preferences = (
            Counter(v for row in rows if (v := row[k]) is not None) for k in range(4)
        )
        tags = Counter(tag for row in rows for tag in (row.tags or "").split("\n")[1:-1])
        return FacetCounts(len(rows), states, robots, controllers, preferences, tags)

    def queue(self) -> Queue:
        """Count jobs by state and kind. Ended jobs are not read, as there may be very many."""
        with self._database.read("queue") as connection:
            now = self._clock(connection)
            numbers = select(jobs.c.state, func.count()).where(EXISTING).group_by(jobs.c.state)
            by_state = dict.fromkeys(JobState, 0)
            by_state |= {JobState(state): count for state, count in connection.execute(numbers)}
            state_and_kind = (jobs.c.state, jobs.c.kind)
            unfinished = select(*state_and_kind, func.count()).group_by(*state_and_kind)
            query = unfinished.where(jobs.c.state.not_in(ENDED), EXISTING)
            under_way = {
                (JobState(state), kind): count for state, kind, count in connection.execute(query)
            }
            queued = (jobs.c.state == JobState.QUEUED, EXISTING)
            since = connection.execute(select(func.min(jobs.c.updated_at)).where(*queued)).scalar()
            beginning = func.substr(func.coalesce(jobs.c.error, ""), 1, _ERROR_LENGTH)
            failed = select(beginning).where(jobs.c.state == JobState.FAILED, EXISTING)
            errors = tuple(connection.execute(failed).scalars())
        wait = 0.0 if since is None else max(0.0, (now - since).total_seconds())
        return Queue(by_state, under_way, wait, errors)


def _conditions(where: JobFilter) -> list[ColumnElement[bool]]:
    conditions: list[ColumnElement[bool]] = [EXISTING]
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
        without = func.replace(jobs.c.tags, f"\n{storable(where.tag)}\n", "")
        conditions.append(without != jobs.c.tags)
    return conditions


def _pages(
    conditions: list[ColumnElement[bool]],
    key: ColumnElement[Any],
    last: tuple[Any, str] | None,
    descending: bool,
) -> Iterator[tuple[Select[Any], list[ColumnElement[Any]]]]:
    """Yield ids after the last job and their order: jobs with a sort value, then the others."""
    ids = select(jobs.c.id).where(*conditions)
    if last is None or last[0] is not None:
        place = [key, jobs.c.id]
        valued = ids.where(key.is_not(None))
        if last is not None:
            value = literal(last[0], Double if isinstance(last[0], float) else None)
            end, here = tuple_(value, literal(last[1])), tuple_(*place)
            valued = valued.where(here < end if descending else here > end)
        order = [column.desc() if descending else column for column in place]
        yield valued.order_by(*order), order
    if key is not jobs.c.created_at:
        unvalued = ids.where(key.is_(None)).order_by(jobs.c.id)
        if last is not None and last[0] is None:
            unvalued = unvalued.where(jobs.c.id > last[1])
        yield unvalued, [jobs.c.id]


def _key(connection: Connection, order: JobOrder) -> ColumnElement[Any]:
    """Return the value to sort by; NULL if a job has none."""
    if order is JobOrder.TIME_LEFT:
        return _time_left(connection)
    if order is JobOrder.GAIN:
        # The negative of `Job.gain`.
        reference = jobs.c.reference_fitness
        return jobs.c.best_fitness / case((reference > 0.0, reference)) - 1.0
    if order is JobOrder.RATE:
        own, seconds = jobs.c.evaluations - jobs.c.evaluations_taken, jobs.c.compute_seconds
        return -case((and_(own > 0, seconds > 0.0), own / case((seconds > 0.0, seconds))))
    if order is JobOrder.STATE:
        return case({str(state): k for k, state in enumerate(JobState)}, value=jobs.c.state)
    keys: dict[JobOrder, ColumnElement[Any]] = {
        JobOrder.CREATED: jobs.c.created_at,
        JobOrder.FITNESS: jobs.c.best_fitness,
        JobOrder.NAME: jobs.c.sort_name,
        JobOrder.EVALUATIONS: -jobs.c.evaluations,
        JobOrder.PRIORITY: -jobs.c.priority,
        JobOrder.ITERATIONS: -jobs.c.iterations,
    }
    return keys[order]


def _time_left(connection: Connection) -> ColumnElement[Any]:
    """Return the estimates of the few running jobs; they depend on the time."""
    running = select(*COLUMNS).where(EXISTING, jobs.c.state == JobState.RUNNING)
    now = datetime.now(UTC)
    shown = map(to_job, connection.execute(running).mappings())
    times = {job.id: time_left(job, now).eta_seconds for job in shown}
    known = {job_id: literal(s, Double) for job_id, s in times.items() if s is not None}
    return case(known, value=jobs.c.id) if known else func.nullif(literal(0.0, Double), 0.0)
