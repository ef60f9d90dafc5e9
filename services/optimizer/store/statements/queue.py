"""Jobs counted by state and kind, without reading those that have ended."""

from __future__ import annotations

from datetime import datetime
from typing import Final

from sqlalchemy import Connection, func, select

from gaitswarm.services.optimizer.jobs.job import JobState
from gaitswarm.services.optimizer.store.port.reading import Queue
from gaitswarm.services.optimizer.store.rows.tables import EXISTING, jobs
from gaitswarm.services.optimizer.store.statements.labels import spec_field

_KINDS: Final = ("tuning", "certificate", "identification", "calibration")

_BEGINNING: Final = 300
"""Characters of an error, which may quote much."""

_UNDER_WAY: Final = tuple(state for state in JobState if not state.terminal)


def count_jobs(connection: Connection, now: datetime) -> Queue:
    """Count the jobs.

    Args:
        connection: An open transaction.
        now: The time until which jobs have waited.

    Returns:
        The counts. A job whose kind cannot be read counts as `unknown`.
    """
    by_state = dict.fromkeys(JobState, 0)
    # Without their specs: there may be very many jobs that have ended.
    for state, count in connection.execute(
        select(jobs.c.state, func.count()).where(EXISTING).group_by(jobs.c.state)
    ):
        by_state[JobState(state)] = count
    kind = spec_field(connection, "kind").label("kind")
    query = (
        select(jobs.c.state, kind, func.count())
        .where(jobs.c.state.in_(_UNDER_WAY), EXISTING)
        .group_by(jobs.c.state, kind)
    )
    under_way: dict[tuple[JobState, str], int] = {}
    for state, found, count in connection.execute(query):
        key = (JobState(state), found if found in _KINDS else "unknown")
        under_way[key] = under_way.get(key, 0) + count
    since = connection.execute(
        select(func.min(jobs.c.updated_at)).where(jobs.c.state == JobState.QUEUED, EXISTING)
    ).scalar_one()
    wait = 0.0 if since is None else max(0.0, (now - since).total_seconds())
    beginning = func.substr(func.coalesce(jobs.c.error, ""), 1, _BEGINNING)
    errors = connection.execute(select(beginning).where(jobs.c.state == JobState.FAILED, EXISTING))
    return Queue(by_state, under_way, wait, tuple(errors.scalars()))
