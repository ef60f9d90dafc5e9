"""Arguments about jobs, converted to checked values and requests.

Functions raise InvalidRequest that names the argument, before a database or server is used;
a controller that does not exist is NotFound, as its path on a server is.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from enum import StrEnum
from typing import Any, TypeVar, cast, get_args

from pydantic import BaseModel, ValidationError

from gaitswarm.errors import InvalidRequest, NotFound, invalid_request
from gaitswarm.services.optimizer.analysis.certificate import MOST_WORST
from gaitswarm.services.optimizer.analysis.preferences import PreferencesRequest
from gaitswarm.services.optimizer.analysis.targets import LeaveOut
from gaitswarm.services.optimizer.jobs.fork import ForkRequest
from gaitswarm.services.optimizer.jobs.job import Command, JobOrder, JobState
from gaitswarm.services.optimizer.jobs.labels import LabelsChange
from gaitswarm.services.optimizer.jobs.notification import unusable_url
from gaitswarm.services.optimizer.jobs.priority import check_priority
from gaitswarm.sim.controllers import CONTROLLERS, ControllerName
from gaitswarm.sim.kernel.walk import Precision
from gaitswarm.specs import (
    ForkOptions,
    PreferenceInput,
    laid_options,
)
from gaitswarm.tables import TableFormat
from gaitswarm.views import RankingRequest
from gaitswarm.views.verification import VerificationRequest

E = TypeVar("E", bound=StrEnum)
M = TypeVar("M", bound=BaseModel)


def state(text: JobState | str | None) -> JobState | None:
    """A job's state by name."""
    return None if text is None else _one_of(JobState, text, "state")


def order(text: JobOrder | str) -> JobOrder:
    """An order of the job list by name."""
    return _one_of(JobOrder, text, "order")


def command(text: Command | str) -> Command:
    """A command to a job by name."""
    return _one_of(Command, text, "command")


def priority(value: int) -> int:
    """A job's priority."""
    if type(value) is not int:
        raise InvalidRequest(f"must be an integer, it is {value!r}", field="priority")
    check_priority(value)
    return value


def notify_url(url: str) -> str:
    """URL that is notified of the end of a job."""
    reason = unusable_url(url)
    if reason is not None:
        raise InvalidRequest(reason, field="notify_url")
    return url


def controller(name: str) -> ControllerName:
    """A controller by name."""
    if name not in CONTROLLERS:
        raise NotFound(CONTROLLERS.unknown(name))
    return name


def table_format(text: str) -> TableFormat:
    """A file's format by name."""
    if text not in get_args(TableFormat):
        known = ", ".join(get_args(TableFormat))
        raise InvalidRequest(f"{text!r} is none of {known}", field="file_format")
    return cast(TableFormat, text)


def runs(job_ids: Sequence[str]) -> Sequence[str]:
    """Ids of jobs."""
    if isinstance(job_ids, str) or not job_ids:
        raise InvalidRequest("must be a list of at least one id", field="job_ids")
    return job_ids


def leave_out(text: str | None) -> LeaveOut | None:
    """Targets that a calibration leaves out, by name."""
    if text is not None and text not in get_args(LeaveOut):
        known = ", ".join(get_args(LeaveOut))
        raise InvalidRequest(f"{text!r} is none of {known}", field="leave_out")
    return cast(LeaveOut | None, text)


def certificate(worlds: int | None, most: int) -> None:
    """Check arguments of a certificate's summary."""
    if worlds is not None and worlds < 1:
        raise InvalidRequest("must be at least 1", field="worlds")
    if not 0 <= most <= MOST_WORST:
        raise InvalidRequest(f"must be 0 to {MOST_WORST}", field="most")


def ranking(preference: PreferenceInput, top: int) -> RankingRequest:
    """Request to rank the designs of a job."""
    return checked(RankingRequest, {"preference": preference, "top": top})


def labels(
    name: str | None, note: str | None, tags: Iterable[str] | None, archived: bool | None
) -> LabelsChange:
    """Labels of a job."""
    words = None if tags is None else tuple(tags)
    return checked(LabelsChange, {"name": name, "note": note, "tags": words, "archived": archived})


def preferences(
    *,
    drawn: int,
    candidates: int,
    samples: int,
    radius: float,
    seed: int,
    precision: Precision,
) -> PreferencesRequest:
    """Request to rank the designs of a job under many preferences."""
    document = {
        "drawn": drawn,
        "candidates": candidates,
        "samples": samples,
        "radius": radius,
        "seed": seed,
        "precision": precision,
    }
    return checked(PreferencesRequest, document)


def verification(replay: int, seed: int | None, head: str | None) -> VerificationRequest:
    """Request to verify the history of a job."""
    return checked(VerificationRequest, {"replay": replay, "seed": seed, "head": head})


def fork(from_iteration: int, options: ForkOptions) -> ForkRequest:
    """Request to fork a job."""
    return checked(ForkRequest, {"from_iteration": from_iteration, **laid_options(options)})


def _one_of(kind: type[E], text: str, field: str) -> E:
    try:
        return kind(text)
    except ValueError:
        raise InvalidRequest(f"{text!r} is none of {', '.join(kind)}", field=field) from None


def checked(kind: type[M], document: dict[str, Any]) -> M:
    """A request as a model."""
    try:
        return kind.model_validate(document)
    except ValidationError as error:
        raise invalid_request(error, kind) from error
