"""Pages and cursors of lists, and entries that are not jobs"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from datetime import UTC, datetime, timedelta
from typing import Any, Final, Generic, NamedTuple, TypeVar

from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.job import JobState

T = TypeVar("T")

_LARGEST_PAGE: Final = 10_000

_EPOCH: Final = datetime(1970, 1, 1, tzinfo=UTC)


class Page(NamedTuple, Generic[T]):
    """A page of a list."""

    items: tuple[T, ...]
    next: str | None  # the `after` of the following page; None on the last

    @classmethod
    def of(cls, items: Sequence[T], limit: int, cursor: Callable[[T], str]) -> Page[T]:
        """Return a page of the first items; more than the limit are known if there are more."""
        more = len(items) > limit
        return cls(tuple(items[:limit]), cursor(items[limit - 1]) if more else None)


def every(page_after: Callable[[str | None], Page[T]]) -> Iterator[T]:
    """Yield the items of all pages of a list."""
    page = page_after(None)
    yield from page.items
    while page.next is not None:
        page = page_after(page.next)
        yield from page.items


class Queue(NamedTuple):
    """Numbers of jobs, and how long they wait."""

    jobs: Mapping[JobState, int]  # by state, for all states
    under_way: Mapping[tuple[JobState, str], int]  # jobs that have not ended, by state and kind
    longest_wait: float  # of a queued job for a runner [s]; 0 if none waits
    errors: tuple[str, ...] = ()  # beginnings of the errors of failed jobs


class RecordingEntry(NamedTuple):
    """A recorded walk in a list."""

    id: str
    created_at: datetime
    size: int  # of the stored document, in characters
    scenario: str
    controller: str
    joints: int  # number of joints with currents
    rows: int  # number of control ticks
    synthetic: bool  # whether it was computed, not measured


def checked_limit(limit: int) -> int:
    """Return the number of items of a page. Raises InvalidRequest."""
    if limit < 1:
        raise InvalidRequest("a page holds at least one item", field="limit")
    return min(limit, _LARGEST_PAGE)


def folded(text: str) -> str:
    """Return a text in a form that is compared in any case."""
    return storable(text.casefold())


def storable(text: str) -> str:
    """Replace characters that a database refuses."""
    text = text.replace("\0", "\N{REPLACEMENT CHARACTER}")
    return text.encode("utf-8", "replace").decode()


def to_cursor(order: str, value: Any, item_id: str) -> str:
    """Return the place of an item in a list sorted by a value and then by id."""
    if isinstance(value, datetime):
        value = (value - _EPOCH) // timedelta(microseconds=1)
    return f"{order}:{json.dumps(value)}:{item_id}"


def from_cursor(order: str, text: str, kind: type) -> tuple[Any, str]:
    """Return value and id of an item, the inverse of `to_cursor`. Raises InvalidRequest."""
    match = re.fullmatch(rf"{re.escape(order)}:(.*):([0-9a-z]{{12,32}})", text)
    with suppress(ValueError, OverflowError, RecursionError):
        if match is not None:
            value, item_id = json.loads(match[1]), match[2]
            if value is None or (kind is str and isinstance(value, str)):
                return None if value is None else folded(value), item_id
            if kind is datetime and type(value) is int:
                return _EPOCH + timedelta(microseconds=value), item_id
            if kind is float and type(value) in (int, float) and math.isfinite(value):
                return float(value), item_id
    raise InvalidRequest(
        "not a cursor of this list in this order; pass the `next` of the page before",
        field="after",
    )
