"""What is asked of a job that there is: pause, resume, extend, cancel, keep, delete it."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Body, Depends, status

from gaitswarm.api.access import Actor, Asking, OwnersQuota, check_may_prioritize, may_command
from gaitswarm.api.dependencies import JobId, Service
from gaitswarm.api.documentation import problems
from gaitswarm.api.reads import job_in_full
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
    """A running job ends and commits the iteration under way first (`pausing`), then is `paused`.

    409 if it is paused already, or has ended.
    """
    return job_in_full(service, service.command(job_id, Command.PAUSE, actor=actor))


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
    """Queue a paused or failed job again; it goes on bit for bit as if it had never stopped.

    Whoever takes it up compares what its numbers depend on with what is there now: other code,
    another robot file or another backend fail the job, which then says what has changed. A body
    `{"accept_changes": true}` lets it go on all the same. 409 if it is queued or running already,
    or has ended.
    """
    accept = resumption is not None and resumption.accept_changes
    job = service.command(job_id, Command.RESUME, accept_changes=accept, actor=actor, quota=quota)
    return job_in_full(service, job)


@router.post(
    "/jobs/{job_id}/extend",
    operation_id="extend_job",
    dependencies=[Depends(may_command)],
    summary="Give a job another budget",
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
    """A job that has succeeded is queued again and goes on from its last iteration; any other goes
    on as it would, up to the new budget.

    What is committed stays, and the iteration under way is committed as it was asked. Later ones
    follow the schedule of the new budget, over which the inertia of `pso` falls: so a job of 25
    iterations that is extended to 50 is another than one of 50 from its beginning, but the same
    every time. 409 if the job was cancelled.
    """
    job = service.extend(job_id, extension.iterations, actor=actor, quota=quota)
    return job_in_full(service, job)


@router.post(
    "/jobs/{job_id}/cancel",
    operation_id="cancel_job",
    dependencies=[Depends(may_command)],
    summary="Cancel a job",
    responses=problems(403, 404, 409, 422),
)
def cancel_job(job_id: JobId, service: Service, actor: Actor) -> JobView:
    """End a job for good. What it has committed stays; the iteration under way is dropped.

    409 if it has ended.
    """
    return job_in_full(service, service.command(job_id, Command.CANCEL, actor=actor))


@router.put(
    "/jobs/{job_id}/priority",
    operation_id="prioritize_job",
    dependencies=[Depends(may_command)],
    summary="Give a job another priority",
    responses=problems(400, 403, 404, 409, 413, 422),
)
def prioritize_job(
    wanted: PriorityRequest, job_id: JobId, service: Service, actor: Actor, token: Asking
) -> JobView:
    """Of waiting jobs the one of highest priority is run first, the oldest among equals. Running
    jobs share the workers: one that is a step higher has twice the share, from its next iteration
    on. None is interrupted for another.

    No result depends on it. Above 0 it needs a token of scope `admin`, where tokens are required.
    409 if the job has ended.
    """
    check_may_prioritize(token, wanted.priority)
    return job_in_full(service, service.prioritize(job_id, wanted.priority, actor=actor))


@router.put(
    "/jobs/{job_id}/keep",
    operation_id="keep_job",
    dependencies=[Depends(may_command)],
    summary="Protect a job from deletion",
    responses=problems(403, 404, 422),
)
def keep_job(job_id: JobId, service: Service, actor: Actor) -> JobView:
    """A job that is kept cannot be deleted, and stays however long ago it ended."""
    return job_in_full(service, service.keep(job_id, kept=True, actor=actor))


@router.delete(
    "/jobs/{job_id}/keep",
    operation_id="release_job",
    dependencies=[Depends(may_command)],
    summary="Let a job be deleted again",
    responses=problems(403, 404, 422),
)
def release_job(job_id: JobId, service: Service, actor: Actor) -> JobView:
    """A server with a time of retention deletes it when it ended longer ago than that."""
    return job_in_full(service, service.keep(job_id, kept=False, actor=actor))


@router.delete(
    "/jobs/{job_id}",
    operation_id="delete_job",
    dependencies=[Depends(may_command)],
    summary="Delete a job",
    status_code=status.HTTP_204_NO_CONTENT,
    response_description="The job is gone.",
    responses=problems(403, 404, 409, 422),
)
def delete_job(job_id: JobId, service: Service, actor: Actor) -> None:
    """Delete a job with its iterations and evaluations; nothing brings them back.

    Forks of it have copies of what they took over, certificates of its designs are jobs of their
    own: they stay. Its idempotency key can be used again, and streams of its events end with an
    event `deleted`. 409 for a job that has not ended and is not paused, which can be cancelled
    first, and for one that is kept.
    """
    service.delete(job_id, actor=actor)
