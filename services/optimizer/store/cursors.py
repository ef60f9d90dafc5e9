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
    raise InvalidRequest(
        "not a cursor of the job list; pass the `next` of the page before", field="after"
    )
