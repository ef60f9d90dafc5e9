"""Cursors of the job list: where a page ended, so that the next one goes on from there."""

from __future__ import annotations

import re
from datetime import UTC, datetime, timedelta
from typing import Final

from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.job import Job, JobOrder
from gaitswarm.services.optimizer.store.statements.records import ID_ALPHABET

_CURSOR: Final = re.compile(rf"([0-9]{{1,18}})\.([{ID_ALPHABET}]{{12}})", re.ASCII)
_FITNESS_CURSOR: Final = re.compile(rf"fitness:([0-9.e+-]*):([{ID_ALPHABET}]{{12}})", re.ASCII)
_PLACE_CURSOR: Final = re.compile(rf"(-?[a-z_]+):([{ID_ALPHABET}]{{12}})", re.ASCII)
_EPOCH: Final = datetime(1970, 1, 1, tzinfo=UTC)


def to_cursor(created_at: datetime, job_id: str) -> str:
    """Place of a job, or of a recording, in the list by age.

    Args:
        created_at: When the job was submitted.
        job_id: Of the job.

    Returns:
        Microseconds since 1970, then the id among equals.
    """
    return f"{(created_at - _EPOCH) // timedelta(microseconds=1)}.{job_id}"


def from_cursor(text: str) -> tuple[datetime, str]:
    """Inverse of `to_cursor`.

    Args:
        text: What a page ended with.

    Returns:
        When the job was submitted, and its id.

    Raises:
        InvalidRequest: It is no such cursor; names the field `after`.
    """
    match = _CURSOR.fullmatch(text)
    created_at = None if match is None else time_of(match[1])
    if match is None or created_at is None:
        raise no_cursor()
    return created_at, match[2]


def time_of(digits: str) -> datetime | None:
    """Read the time of a cursor.

    Args:
        digits: Microseconds since 1970.

    Returns:
        The time; None beyond the calendar's end.
    """
    try:
        return _EPOCH + timedelta(microseconds=int(digits))
    except OverflowError:
        return None


def to_fitness_cursor(fitness: float | None, job_id: str) -> str:
    """Place of a job in the list by fitness; a job without one is among the last.

    Args:
        fitness: Of the job's best design.
        job_id: Of the job.

    Returns:
        The cursor.
    """
    return f"fitness:{'' if fitness is None else repr(fitness)}:{job_id}"


def from_fitness_cursor(text: str) -> tuple[float | None, str]:
    """Inverse of `to_fitness_cursor`.

    Args:
        text: What a page ended with.

    Returns:
        Fitness of the job's best design then, and the job's id.

    Raises:
        InvalidRequest: It is no such cursor; names the field `after`.
    """
    match = _FITNESS_CURSOR.fullmatch(text)
    try:
        if match is not None:
            return float(match[1]) if match[1] else None, match[2]
    except ValueError:
        pass
    raise no_cursor()


def to_place_cursor(order: JobOrder, job_id: str, *, reverse: bool = False) -> str:
    """Place of a job in a list whose order says nothing that fits into a cursor, as a long name.

    Args:
        order: Of the list.
        reverse: Whether the list is in the reverse order.
        job_id: Of the job; a page goes on from where the job is by then.

    Returns:
        The cursor.
    """
    return f"{'-' if reverse else ''}{order}:{job_id}"


def from_place_cursor(order: JobOrder, text: str, *, reverse: bool = False) -> str:
    """Inverse of `to_place_cursor`.

    Args:
        order: Of the list.
        reverse: Whether the list is in the reverse order.
        text: What a page ended with.

    Returns:
        The job's id.

    Raises:
        InvalidRequest: It is no such cursor; names the field `after`.
    """
    match = _PLACE_CURSOR.fullmatch(text)
    if match is None or match[1] != f"{'-' if reverse else ''}{order}":
        raise no_cursor()
    return match[2]


def no_cursor() -> InvalidRequest:
    """For whoever passes what no page ended with."""
    return InvalidRequest(
        "not a cursor of the job list in this order; pass the `next` of the page before",
        field="after",
    )


def cursor_of(job: Job, order: JobOrder, *, reverse: bool = False) -> str:
    """Place of a job in the list.

    Args:
        job: As it is shown.
        order: By what the list is sorted.
        reverse: Whether the list is in the reverse order.

    Returns:
        What a page that ends with this job ends with.
    """
    if not reverse and order is JobOrder.CREATED:
        return to_cursor(job.created_at, job.id)
    if not reverse and order is JobOrder.FITNESS:
        return to_fitness_cursor(job.progress.best_fitness, job.id)
    return to_place_cursor(order, job.id, reverse=reverse)
