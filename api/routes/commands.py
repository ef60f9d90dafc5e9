"""Commands to existing jobs: pause, resume, extend, cancel, prioritize, keep, delete."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Body, Depends, status

from gaitswarm.api.access import (
    Actor,
    OwnersQuota,
    RequestToken,
    check_may_prioritize,
    may_command,
)
from gaitswarm.api.dependencies import JobId, Service
from gaitswarm.api.documentation import problems
from gaitswarm.api.routes.jobs import full_view
from gaitswarm.services.optimizer.jobs.job import Command
from gaitswarm.views import PREFIX, ExtensionRequest, JobView, PriorityRequest, ResumeRequest

router = APIRouter(prefix=PREFIX, tags=["jobs"])


@router.post(
    "/jobs/{job_id}/pause",
    operation_id="pause_job",
    dependencies=[Depends(may_command)],
    summary="Pause a job",
    status_code=status.HTTP_202_ACCEPTED,
    responses=problems(403, 404, 409, 422),
)
def pause_job(job_id: JobId, service: Service, actor: Actor) -> JobView:
    """Pause a job. A running job first commits its current iteration (`pausing`).

    409 if it is already paused or has ended.
    """
    return full_view(service, service.command(job_id, Command.PAUSE, actor=actor))


@router.post(
    "/jobs/{job_id}/resume",
    operation_id="resume_job",
    dependencies=[Depends(may_command)],
    summary="Resume a job",
    status_code=status.HTTP_202_ACCEPTED,
    responses=problems(400, 403, 404, 409, 413, 422),
)
def resume_job(
    job_id: JobId,
    service: Service,
    actor: Actor,
    quota: OwnersQuota,
    resumption: Annotated[ResumeRequest | None, Body()] = None,
) -> JobView:
    """Resume a paused or failed job; it continues bit for bit as if it had never stopped.

    If code, robot files or backend differ from the recorded provenance, the job fails and says
    what has changed; the body `{"accept_changes": true}` continues nevertheless. 409 if the job is
    queued, running or has ended.
    """
    accept = resumption is not None and resumption.accept_changes
    job = service.command(job_id, Command.RESUME, accept_changes=accept, actor=actor, quota=quota)
    return full_view(service, job)


@router.post(
    "/jobs/{job_id}/extend",
    operation_id="extend_job",
    dependencies=[Depends(may_command)],
    summary="Change the budget of a job",
    status_code=status.HTTP_202_ACCEPTED,
    responses=problems(400, 403, 404, 409, 413, 422),
)
def extend_job(
    extension: ExtensionRequest,
    job_id: JobId,
    service: Service,
    actor: Actor,
    quota: OwnersQuota,
) -> JobView:
    """Change the budget. A job that has succeeded is queued and continues from its last iteration.

    Committed iterations stay, and the current iteration is committed unchanged. Later ones follow
    the schedule of the new budget, over which a falling inertia falls: a job of 25 iterations
    extended to 50 is reproducible, but differs from a job of 50. 409 if the job was cancelled.
    """
    job = service.extend(job_id, extension.iterations, actor=actor, quota=quota)
    return full_view(service, job)


@router.post(
    "/jobs/{job_id}/cancel",
    operation_id="cancel_job",
    dependencies=[Depends(may_command)],
    summary="Cancel a job",
    responses=problems(403, 404, 409, 422),
)
def cancel_job(job_id: JobId, service: Service, actor: Actor) -> JobView:
    """End a job for good. Committed iterations stay; the current one is dropped.

    409 if it has ended.
    """
    return full_view(service, service.command(job_id, Command.CANCEL, actor=actor))


@router.put(
    "/jobs/{job_id}/priority",
    operation_id="prioritize_job",
    dependencies=[Depends(may_command)],
    summary="Change the priority of a job",
    responses=problems(400, 403, 404, 409, 413, 422),
)
def prioritize_job(
    request: PriorityRequest, job_id: JobId, service: Service, actor: Actor, token: RequestToken
) -> JobView:
    """Queued jobs start in order of priority, the oldest first among equals. Each step doubles a
    running job's share of the workers, from its next iteration on; no job is interrupted.

    Results do not depend on it. Values above 0 require a token of scope `admin`, where tokens are
    required. 409 if the job has ended.
    """
    check_may_prioritize(token, request.priority)
    return full_view(service, service.prioritize(job_id, request.priority, actor=actor))


@router.put(
    "/jobs/{job_id}/keep",
    operation_id="keep_job",
    dependencies=[Depends(may_command)],
    summary="Protect a job from deletion",
    responses=problems(403, 404, 422),
)
def keep_job(job_id: JobId, service: Service, actor: Actor) -> JobView:
    """Protect a job from deletion by users and by retention."""
    return full_view(service, service.keep(job_id, kept=True, actor=actor))


@router.delete(
    "/jobs/{job_id}/keep",
    operation_id="release_job",
    dependencies=[Depends(may_command)],
    summary="End the protection of a job",
    responses=problems(403, 404, 422),
)
def release_job(job_id: JobId, service: Service, actor: Actor) -> JobView:
    """Allow deletion again; a server with a retention time deletes the job when that has passed."""
    return full_view(service, service.keep(job_id, kept=False, actor=actor))


@router.delete(
    "/jobs/{job_id}",
    operation_id="delete_job",
    dependencies=[Depends(may_command)],
    summary="Delete a job",
    status_code=status.HTTP_204_NO_CONTENT,
    response_description="The job was deleted.",
    responses=problems(403, 404, 409, 422),
)
def delete_job(job_id: JobId, service: Service, actor: Actor) -> None:
    """Delete a job with its iterations and evaluations, irrevocably.

    Forks and certificates of its designs stay. Its idempotency key can be used again, and streams
    of its events end with an event `deleted`. 409 for a job that is protected, or has neither ended
    nor is paused; cancel it first.
    """
    service.delete(job_id, actor=actor)
