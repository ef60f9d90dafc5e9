"""Names that travel in URLs: ids of jobs, and cursors of the job list."""

from __future__ import annotations

import re
import secrets
from datetime import UTC, datetime, timedelta
from typing import Final

from services.optimizer.errors import InvalidRequest

# No vowels, no look-alikes: an id is read aloud, and it spells no word.
_ALPHABET: Final = "23456789bcdfghjkmnpqrstvwxz"
_ID: Final = re.compile(rf"[{_ALPHABET}]{{12}}")
_CURSOR: Final = re.compile(rf"([0-9]{{1,18}})\.([{_ALPHABET}]{{12}})", re.ASCII)
_FITNESS_CURSOR: Final = re.compile(rf"fitness:([0-9.e+-]*):([{_ALPHABET}]{{12}})", re.ASCII)
_NAME_CURSOR: Final = re.compile(rf"name:([{_ALPHABET}]{{12}})", re.ASCII)
_EPOCH: Final = datetime(1970, 1, 1, tzinfo=UTC)


def new_job_id() -> str:
    """Twelve characters, 57 random bits: unique among any number of stores that are merged."""
    return "".join(secrets.choice(_ALPHABET) for _ in range(12))


def is_job_id(text: str) -> bool:
    """Whether it can be the id of a job at all; databases choke on some other strings."""
    return _ID.fullmatch(text) is not None


def to_cursor(created_at: datetime, job_id: str) -> str:
    """Place of a job in the list: microseconds since 1970, then the id among equals."""
    return f"{(created_at - _EPOCH) // timedelta(microseconds=1)}.{job_id}"


def from_cursor(text: str) -> tuple[datetime, str]:
    """Inverse of `to_cursor`; InvalidRequest (field `after`) for anything else."""
    match = _CURSOR.fullmatch(text)
    try:
        if match is not None:
            return _EPOCH + timedelta(microseconds=int(match[1])), match[2]
    except OverflowError:
        pass
    raise no_cursor()


def to_fitness_cursor(fitness: float | None, job_id: str) -> str:
    """Place of a job in the list by fitness; a job without one is among the last."""
    return f"fitness:{'' if fitness is None else repr(fitness)}:{job_id}"


def from_fitness_cursor(text: str) -> tuple[float | None, str]:
    """Inverse of `to_fitness_cursor`; InvalidRequest (field `after`) for anything else."""
    match = _FITNESS_CURSOR.fullmatch(text)
    try:
        if match is not None:
            return float(match[1]) if match[1] else None, match[2]
    except ValueError:
        pass
    raise no_cursor()


def to_name_cursor(job_id: str) -> str:
    """Place of a job in the list by name; a name may be long, and never changes."""
    return f"name:{job_id}"


def from_name_cursor(text: str) -> str:
    """Inverse of `to_name_cursor`; InvalidRequest (field `after`) for anything else."""
    match = _NAME_CURSOR.fullmatch(text)
    if match is None:
        raise no_cursor()
    return match[1]


def no_cursor() -> InvalidRequest:
    """For whoever passes what no page ended with."""
    return InvalidRequest(
        "not a cursor of the job list in this order; pass the `next` of the page before",
        field="after",
    )
