"""Errors of the library; those of a database and of a server are the same.

GaitswarmError              everything that gaitswarm raises on purpose
├── InvalidRequest          what was asked makes no sense; `field` names the argument or field
├── NotFound                no job, iteration, recording or result of that id
├── Conflict                not possible in the job's present state
│   ├── ProvenanceChanged   its numbers would depend on something else than those it has
│   ├── QuotaExceeded       the server lets whoever asks have no more unfinished jobs
│   ├── Unreadable          this version cannot read what is stored of the job; it stays as it is
│   └── IdempotencyConflict the key was used before for another job
├── Forbidden               the server does not let whoever asks do that
│   └── Unauthorized        it asks for a token, or the one that was sent is not valid
├── JobEnded                the job that was waited for did not succeed; `job` says why
├── LeaseLost               another process, or a cancellation, has taken the job
└── Unavailable             not possible now, whatever was asked; try again later
    ├── TooManyRequests     the server is asked too often by whoever asks
    ├── EvaluatorUnavailable    the workers or the compiler cannot be used
    └── StoreUnavailable        the database or the server cannot be reached

KeyboardInterrupt
└── Interrupted             Ctrl-C while a job was run: it was given back, and can be gone on with
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from gaitswarm.services.optimizer.errors import (
    Conflict,
    EvaluatorUnavailable,
    Forbidden,
    GaitswarmError,
    IdempotencyConflict,
    InvalidRequest,
    LeaseLost,
    NotFound,
    ProvenanceChanged,
    QuotaExceeded,
    StoreUnavailable,
    TooManyRequests,
    Unauthorized,
    Unavailable,
    Unreadable,
)
from gaitswarm.services.optimizer.masking import masked_url
from gaitswarm.sim.errors import SimulationError, SimulationInputError

if TYPE_CHECKING:
    from pydantic import ValidationError

    from gaitswarm.views import JobView


class JobEnded(GaitswarmError):
    """The job that was waited for did not succeed.

    Attributes:
        job: The job as it is: paused, cancelled or failed.
    """

    def __init__(self, job: JobView) -> None:
        self.job = job
        super().__init__(f"job {job.id} is {job.state}" + (f": {job.error}" if job.error else ""))


class Interrupted(KeyboardInterrupt):
    """Ctrl-C while a job was run. What it had committed is stored, and it is queued again.

    One that was only followed goes on in the process that runs it.

    Attributes:
        job: The job as it was then.
    """

    def __init__(self, job: JobView, db: str) -> None:
        self.job = job
        left = "goes on elsewhere" if job.state == "running" else "was given back"
        super().__init__(
            f"job {job.id} {left} after {job.spent};"
            f" go on with gaitswarm.optimize(resume={job.id!r}, db={masked_url(db)!r})"
        )


def invalid_request(error: ValidationError, model: Any = None) -> InvalidRequest:
    """What pydantic found wrong, in the words of the input."""
    from gaitswarm.sim.input import with_known_keys
    from gaitswarm.views import field_errors

    found = with_known_keys(error.errors(include_url=False), model)
    first, *others = field_errors(found)
    more = "".join(f"; {o.field}: {o.message}" if o.field else f"; {o.message}" for o in others)
    return InvalidRequest(first.message + more, field=first.field)


@contextmanager
def simulation_errors(field: str) -> Iterator[None]:
    """Errors of the simulator as errors of the library."""
    try:
        yield
    except SimulationInputError as error:
        raise InvalidRequest(str(error), field=field) from error
    except SimulationError as error:
        raise EvaluatorUnavailable(str(error)) from error


__all__ = [
    "Conflict",
    "EvaluatorUnavailable",
    "Forbidden",
    "GaitswarmError",
    "IdempotencyConflict",
    "Interrupted",
    "InvalidRequest",
    "JobEnded",
    "LeaseLost",
    "NotFound",
    "ProvenanceChanged",
    "QuotaExceeded",
    "StoreUnavailable",
    "TooManyRequests",
    "Unauthorized",
    "Unavailable",
    "Unreadable",
    "invalid_request",
    "simulation_errors",
]
