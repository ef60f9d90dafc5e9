"""Requests that make jobs, change them or end them, as values."""

from __future__ import annotations

import json

from gaitswarm.jobs.server.call import (
    IDEMPOTENCY_KEY,
    JOB_PRIORITY,
    NOTIFY_URL,
    Call,
    job_path,
    posted,
)
from gaitswarm.requests import arguments
from gaitswarm.services.optimizer.jobs.fork import ForkRequest
from gaitswarm.services.optimizer.jobs.job import Command
from gaitswarm.services.optimizer.jobs.labels import LabelsChange
from gaitswarm.services.optimizer.jobs.priority import DEFAULT
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.views import JobView


def submit(
    spec: Spec, key: str, *, priority: int = DEFAULT, notify_url: str | None = None
) -> Call[JobView]:
    """Queue a job.

    Args:
        spec: What it is to do.
        key: Idempotency key: the same key and spec again make no second job.
        priority: The higher, the sooner.
        notify_url: Where its end is told, if anywhere.
    """
    return posted("/jobs", JobView, spec, _submission(key, priority, notify_url))


def fork(
    job_id: str,
    request: ForkRequest,
    key: str,
    *,
    priority: int = DEFAULT,
    notify_url: str | None = None,
) -> Call[JobView]:
    """Queue a job that begins with iterations of another one.

    Args:
        job_id: Identifier of that one.
        request: From where, and what is to be different.
        key: Idempotency key: the same key and fork again make no second job.
        priority: The higher, the sooner.
        notify_url: Where its end is told, if anywhere.
    """
    headers = _submission(key, priority, notify_url)
    return posted(f"{job_path(job_id)}/fork", JobView, request, headers)


def _submission(key: str, priority: int, notify_url: str | None) -> dict[str, str]:
    headers = {IDEMPOTENCY_KEY: key}
    if priority != DEFAULT:
        headers[JOB_PRIORITY] = str(arguments.priority(priority))
    if notify_url is not None:
        headers[NOTIFY_URL] = arguments.notify_url(notify_url)
    return headers


def command(job_id: str, asked: Command, accept_changes: bool) -> Call[JobView]:
    """Pause, resume or cancel.

    Args:
        job_id: Identifier of the job.
        asked: Which of these.
        accept_changes: Whether a job that is resumed goes on although what its numbers depend on
            has changed.
    """
    body = json.dumps({"accept_changes": True}) if accept_changes else None
    return Call("POST", f"{job_path(job_id)}/{asked.value}", JobView.model_validate_json, body=body)


def extend(job_id: str, iterations: int) -> Call[JobView]:
    """Give a job another budget.

    Args:
        job_id: Identifier of the job.
        iterations: The budget, in all.
    """
    body = json.dumps({"iterations": iterations})
    return Call("POST", f"{job_path(job_id)}/extend", JobView.model_validate_json, body=body)


def prioritize(job_id: str, priority: int) -> Call[JobView]:
    """Give a job another priority.

    Args:
        job_id: Identifier of the job.
        priority: The higher, the sooner.
    """
    body = json.dumps({"priority": arguments.priority(priority)})
    return Call("PUT", f"{job_path(job_id)}/priority", JobView.model_validate_json, body=body)


def label(job_id: str, change: LabelsChange) -> Call[JobView]:
    """Write on a job.

    Args:
        job_id: Identifier of the job.
        change: What is to be different.
    """
    body = change.model_dump_json(exclude_none=True)
    return Call("PATCH", job_path(job_id), JobView.model_validate_json, body=body)


def keep(job_id: str, kept: bool) -> Call[JobView]:
    """Protect a job from deletion, or release it.

    Args:
        job_id: Identifier of the job.
        kept: Whether it is protected.
    """
    path = f"{job_path(job_id)}/keep"
    return Call("PUT" if kept else "DELETE", path, JobView.model_validate_json)


def delete(job_id: str) -> Call[bytes]:
    """Delete a job.

    Args:
        job_id: Identifier of the job.
    """
    return Call("DELETE", job_path(job_id), bytes)
