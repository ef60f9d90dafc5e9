"""Errors of the service; `gaitswarm.api.problems` answers requests with them"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import ClassVar

from gaitswarm.sim.errors import SimulationError, SimulationInputError


class GaitswarmError(Exception):
    """Base of all errors that gaitswarm raises."""


class InvalidRequest(GaitswarmError, ValueError):
    """Invalid request; `field` is the dotted path of the offending one, "" for the whole."""

    def __init__(self, message: str, *, field: str = "") -> None:
        self.field = field
        super().__init__(f"{field}: {message}" if field else message)


@contextmanager
def within(field: str) -> Iterator[None]:
    """Name the field in whose document another one is invalid."""
    try:
        yield
    except InvalidRequest as error:
        message = str(error).removeprefix(f"{error.field}: ")
        inner = f".{error.field}" if error.field else ""
        raise InvalidRequest(message, field=f"{field}{inner}") from error


class NotFound(GaitswarmError):
    """No such job or iteration."""


class Conflict(GaitswarmError):
    """Not possible in the job's current state."""


class BudgetChanged(Conflict):
    """The job was extended after it was claimed: the next iteration must be asked for again."""


class ProvenanceChanged(Conflict):
    """Code or libraries differ from those of the job's earlier results."""


class IdempotencyConflict(Conflict):
    """The idempotency key was used before for another request."""


class QuotaExceeded(Conflict):
    """The owner's unfinished jobs would exceed the quota; `field` as of InvalidRequest."""

    def __init__(self, message: str, *, field: str = "") -> None:
        self.field = field
        super().__init__(f"{field}: {message}" if field else message)


class Unreadable(Conflict):
    """This version cannot read the stored document: another version wrote it, or it is damaged."""


class Forbidden(GaitswarmError):
    """Permission denied."""


class Unauthorized(Forbidden):
    """The token is unknown, revoked or missing."""


class LeaseLost(GaitswarmError):
    """The job belongs to another runner (`taken_over`), or was cancelled."""

    def __init__(self, message: str, *, taken_over: bool = False) -> None:
        self.taken_over = taken_over
        super().__init__(message)


class KilledWorker(GaitswarmError):
    """A task crashed each of several workers that ran it."""


class Unavailable(GaitswarmError):
    """Temporarily not possible, for any request."""


class TooManyRequests(Unavailable):
    """Too many requests or open connections; to be repeated after `retry_after` [s]."""

    def __init__(self, message: str, *, retry_after: float = 1.0) -> None:
        self.retry_after = retry_after
        super().__init__(message)


class EvaluatorUnavailable(Unavailable):
    """The workers cannot be reached."""


class StoreUnavailable(Unavailable):
    """The database or server cannot be reached, or has another schema."""

    for_clients: ClassVar[str] = "the database is unavailable; see the server's log"


class StoreReplaced(StoreUnavailable):
    """The database file was removed or replaced while it was open; restart the process."""

    for_clients: ClassVar[str] = (
        "the database file was removed or replaced while it was open; restart the server"
    )


@contextmanager
def simulation_errors(field: str) -> Iterator[None]:
    """Convert errors of the simulator; `field` is that of the request which an input comes from."""
    try:
        yield
    except SimulationInputError as error:
        raise InvalidRequest(str(error).removeprefix(f"{field}: "), field=field) from error
    except SimulationError as error:
        raise EvaluatorUnavailable(str(error)) from error
