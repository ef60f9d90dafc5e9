"""Errors of the service.

GaitswarmError
├── InvalidRequest          what was asked makes no sense; names the field (HTTP 422)
├── NotFound                no job or iteration of that id (HTTP 404)
├── Conflict                not possible in the job's present state (HTTP 409)
│   ├── BudgetChanged       the job was extended since it was claimed
│   ├── ProvenanceChanged   its numbers would depend on something else than those it has
│   ├── IdempotencyConflict the key was used before with another body
│   ├── QuotaExceeded       its owner has as many jobs as they may have; names the field
│   └── Unreadable          this version cannot read what is stored; it stays as it is
├── Forbidden               not for whoever asks (HTTP 403)
│   └── Unauthorized        the server knows nobody of that token, or asks for one (HTTP 401)
├── LeaseLost               another runner, or a cancellation, has taken the job
├── KilledWorker            a task ends the workers that run it
└── Unavailable             not possible now, whatever was asked; try again later (HTTP 503)
    ├── TooManyRequests     whoever asks does so too often; says when to try again (HTTP 429)
    ├── EvaluatorUnavailable    the workers cannot be reached
    └── StoreUnavailable        the database or server cannot be reached, or has another schema
        └── StoreReplaced       the database's file was removed or replaced while it was open
"""

from __future__ import annotations

from typing import ClassVar


class GaitswarmError(Exception):
    """Base of every error that gaitswarm raises on purpose."""


class InvalidRequest(GaitswarmError, ValueError):
    """What was asked makes no sense.

    field: dotted path of the offending field, "" when it is the request as a whole.
    """

    def __init__(self, message: str, *, field: str = "") -> None:
        self.field = field
        super().__init__(f"{field}: {message}" if field else message)


class NotFound(GaitswarmError):
    """No such job, or no such iteration of it."""


class Conflict(GaitswarmError):
    """The job's present state does not allow it."""


class BudgetChanged(Conflict):
    """The job was extended since it was claimed: what follows is to be asked anew."""


class ProvenanceChanged(Conflict):
    """The job's next numbers would depend on something else than those that it has."""


class IdempotencyConflict(Conflict):
    """The idempotency key was used before for another request."""


class QuotaExceeded(Conflict):
    """The unfinished jobs of an owner would be more than they may be.

    field: field of the request that makes it too much, "" when it is the request as a whole.
    """

    def __init__(self, message: str, *, field: str = "") -> None:
        self.field = field
        super().__init__(f"{field}: {message}" if field else message)


class Unreadable(Conflict):
    """This version cannot read what is stored: it was written by another one, or damaged."""


class Forbidden(GaitswarmError):
    """Whoever asks may not do that."""


class Unauthorized(Forbidden):
    """The token is unknown or was revoked, or there is none where one is needed."""


class LeaseLost(GaitswarmError):
    """The job belongs to another runner now, or was cancelled.

    taken_over: another runner has claimed the job since.
    """

    def __init__(self, message: str, *, taken_over: bool = False) -> None:
        self.taken_over = taken_over
        super().__init__(message)


class KilledWorker(GaitswarmError):
    """A task was tried on several workers, and each of them died of it."""


class Unavailable(GaitswarmError):
    """Not possible now, whatever was asked."""


class TooManyRequests(Unavailable):
    """Whoever asks does so too often, or has too much open.

    retry_after: time after which it is worth trying again [s].
    """

    def __init__(self, message: str, *, retry_after: float = 1.0) -> None:
        self.retry_after = retry_after
        super().__init__(message)


class EvaluatorUnavailable(Unavailable):
    """The workers cannot be reached now."""


class StoreUnavailable(Unavailable):
    """The database or server cannot be reached, or holds another schema.

    for_clients: text for clients of a server; an error's own may quote the database's driver.
    """

    for_clients: ClassVar[str] = "the database is unavailable; the server's log says why"


class StoreReplaced(StoreUnavailable):
    """The database's file was removed or replaced while it was open; only a restart helps."""

    for_clients: ClassVar[str] = (
        "the database file was removed or replaced while it was open; restart the server"
    )
