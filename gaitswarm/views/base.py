"""Links and problems."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any, Final

from pydantic import Field

from gaitswarm.services.optimizer.jobs.job import DELETABLE, TRANSITIONS, Job, JobState
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.views import View
from gaitswarm.sim.input import message_of, without_tags

PREFIX: Final = "/v1"
"""Version of the HTTP API, in every path."""

_RESOURCES: Final = ("iterations", "events")
_OF_A_BEST: Final = ("scenarios", "preferences", "firmware")

_RESOURCES_BY_SPEC: Final = ("best", "distribution", "particles", "export")
"""Links of jobs whose spec can be read."""

_COMMANDS: Final = {
    state: [(c.value, after) for (before, c), after in TRANSITIONS.items() if before is state]
    for state in JobState
}
"""Commands by state, each with the state after it."""


def job_links(job: Job) -> dict[str, str]:
    """Return the links of a job."""
    here = f"{PREFIX}/jobs/{job.id}"
    names = [*_RESOURCES, *(_RESOURCES_BY_SPEC if job.readable else ())]
    if isinstance(job.stored_spec, JobSpec):
        names += ["ranking", *(_OF_A_BEST if job.progress.best_fitness is not None else ())]
    resources = {name: f"{here}/{name}" for name in names}
    commands = {
        command: f"{here}/{command}"
        for command, after in _COMMANDS[job.state]
        if job.readable or after is not JobState.QUEUED
    }
    if job.readable and job.state is not JobState.CANCELLED:
        commands["extend"] = f"{here}/extend"
    if job.readable and job.progress.iterations:
        resources["evidence"] = f"{here}/evidence"
        resources["verify"] = f"{here}/verify"
        commands["fork"] = f"{here}/fork"
    commands["keep"] = f"{here}/keep"
    if not job.state.terminal:
        commands["priority"] = f"{here}/priority"
    if job.state in DELETABLE and not job.kept:
        commands["delete"] = here
    if job.lineage is not None:
        resources["parent"] = f"{PREFIX}/jobs/{job.lineage.parent}"
    return {"self": here, **resources, **commands}


_LEADING_FIELD: Final = re.compile(r"^([a-z_]+(?:\.\w+)*): (.*)$", re.DOTALL)


class FieldErrorView(View):
    """What is wrong with one field of a request."""

    field: str = Field(
        description="Path of the field, parts joined by dots; empty for the request as a whole.",
        examples=["variables.0.low"],
    )
    message: str = Field(
        description="What is wrong with it and what it must be.",
        examples=["must be a finite number"],
    )

    @classmethod
    def from_message(cls, field: str, message: str) -> FieldErrorView:
        """An error whose message may name its field."""
        match = _LEADING_FIELD.match(message)
        if not field and match:
            field, message = match.groups()
        return cls(field=field, message=message)


class ProblemView(View):
    """A problem (RFC 9457, application/problem+json)."""

    type: str = Field(
        description="Kind of problem, the same for every occurrence of it.",
        examples=["urn:gaitswarm:problem:invalid-request"],
    )
    title: str = Field(description="The kind in words.", examples=["Invalid request"])
    status: int = Field(description="HTTP status code.", examples=[422])
    detail: str = Field(
        description="What went wrong this time and what to do about it.",
        examples=["iterations: must be at least 1"],
    )
    instance: str = Field(description="Path of the request.", examples=["/v1/jobs"])
    errors: list[FieldErrorView] = Field(
        default=[], description="Every offending field; empty if no field is to blame."
    )


def field_errors(errors: Iterable[Mapping[str, Any]], *, prefix: str = "") -> list[FieldErrorView]:
    """Return pydantic's errors by field, without repeats."""
    found = []
    for error in errors:
        if _follows_from_others(error):
            continue
        location = without_tags(error["loc"])
        path = ".".join(str(part) for part in (*([prefix] if prefix else []), *location))
        found.append(FieldErrorView.from_message(path, message_of(error)))
    return list(dict.fromkeys(found))


def _follows_from_others(error: Mapping[str, Any]) -> bool:
    """A list whose items are wrong is then too short as well, though it was not in the input."""
    return bool(error["type"] == "too_short" and len(error["input"]) >= error["ctx"]["min_length"])
