"""Pages of lists, and entries that are not jobs"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import Final, Generic, TypeVar

from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.job import JobState

T = TypeVar("T")

_LARGEST_PAGE: Final = 10_000


@dataclass(frozen=True, slots=True)
class Page(Generic[T]):
    """A page of a list."""

    items: tuple[T, ...]
    next: str | None  # the `after` of the following page; None on the last


@dataclass(frozen=True, slots=True)
class Queue:
    """Numbers of jobs, and how long they wait."""

    jobs: Mapping[JobState, int]  # by state, for all states
    under_way: Mapping[tuple[JobState, str], int]  # jobs that have not ended, by state and kind
    longest_wait: float  # of a queued job for a runner [s]; 0 if none waits
    errors: tuple[str, ...] = ()  # beginnings of the errors of failed jobs


@dataclass(frozen=True, slots=True)
class RecordingEntry:
    """A recorded walk in a list. What follows `size` is None if the walk is unreadable."""

    id: str
    created_at: datetime
    size: int  # of the stored document, in characters
    scenario: str | None
    controller: str | None
    joints: int | None  # number of joints with currents
    rows: int | None  # number of control ticks
    synthetic: bool  # whether it was computed, not measured


def checked_limit(limit: int) -> int:
    """Return the number of items of a page. Raises InvalidRequest."""
    if limit < 1:
        raise InvalidRequest("a page holds at least one item", field="limit")
    return min(limit, _LARGEST_PAGE)
