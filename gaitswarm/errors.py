"""Errors of the library in addition to those of the service, and conversions to them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from gaitswarm.services.optimizer.errors import GaitswarmError, InvalidRequest
from gaitswarm.services.optimizer.masking import masked_url

if TYPE_CHECKING:
    from pydantic import ValidationError

    from gaitswarm.views.job import JobView


class JobEnded(GaitswarmError):
    """The awaited job did not succeed.

    Attributes:
        job: The job: paused, cancelled or failed.
    """

    def __init__(self, job: JobView) -> None:
        self.job = job
        super().__init__(f"job {job.id} is {job.state}" + (f": {job.error}" if job.error else ""))


class Interrupted(KeyboardInterrupt):
    """Ctrl-C while running a job. Committed iterations are stored, and the job is queued again.

    A job that was only followed continues in the process that runs it.

    Attributes:
        job: The job as it was then.
    """

    def __init__(self, job: JobView, db: str) -> None:
        self.job = job
        left = "continues in another process" if job.state == "running" else "was queued again"
        super().__init__(
            f"job {job.id} {left} after {job.spent};"
            f" resume it with gaitswarm.optimize(resume={job.id!r}, db={masked_url(db)!r})"
        )


def invalid_request(error: ValidationError, model: Any = None) -> InvalidRequest:
    """Convert pydantic's errors to one InvalidRequest."""
    from gaitswarm.sim.input import with_known_keys
    from gaitswarm.views.base import field_errors

    found = with_known_keys(error.errors(include_url=False), model)
    first, *others = field_errors(found)
    more = "".join(f"; {o.field}: {o.message}" if o.field else f"; {o.message}" for o in others)
    return InvalidRequest(first.message + more, field=first.field)
