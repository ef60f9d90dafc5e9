"""Jobs: submit, fork, estimate, list, label; their activity, notifications and audit log."""

from __future__ import annotations

from functools import partial
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Header, Query, Request, Response, status

from gaitswarm.api.access import (
    Actor,
    NewPriority,
    Owner,
    OwnersQuota,
    may_administer,
    may_command,
)
from gaitswarm.api.bodies import validated
from gaitswarm.api.dependencies import (
    After,
    Analyzing,
    Computing,
    JobActivities,
    JobId,
    JobIdText,
    ServerSettings,
    Service,
)
from gaitswarm.api.documentation import problems
from gaitswarm.api.responses import json_response
from gaitswarm.services.optimizer.jobs.documents import AnySpec
from gaitswarm.services.optimizer.jobs.fork import ForkRequest
from gaitswarm.services.optimizer.jobs.job import Job, JobOrder, JobState
from gaitswarm.services.optimizer.jobs.labels import JobFilter, LabelsChange
from gaitswarm.services.optimizer.jobs.notification import check_url
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.views import PREFIX, EstimateView, JobSummaryView, JobView, PageView
from gaitswarm.views.job import JobFacetsView, JobKind
from gaitswarm.views.operations import ActivityView, AuditEntryView, Level, NotificationView

router = APIRouter(prefix=PREFIX, tags=["jobs"])

IdempotencyKey = Annotated[
    str | None,
    Header(
        alias="Idempotency-Key",
        min_length=1,
        max_length=200,
        pattern=r"^[\x21-\x7e]+$",
        description="Any string without blanks. A repeated request with the same key and the same"
        " job does not create a second job.",
        examples=["7d9f2b1e"],
    ),
]

Archived = Annotated[
    bool | None, Query(description="True: only archived jobs; false: only others.")
]


async def notify_url(
    settings: ServerSettings,
    url: Annotated[
        str | None,
        Header(
            alias="Notify-URL",
            min_length=1,
            max_length=2000,
            description="URL that receives a JSON document when the job has ended. The server must"
            " allow its host. `/v1/jobs/{job_id}/notifications` reports the delivery.",
            examples=["https://ci.example/hook"],
        ),
    ] = None,
) -> str | None:
    """Return the checked URL of the notification."""
    if url is not None:
        check_url(url, settings.webhook_hosts, field="Notify-URL")
    return url


NotifyUrl = Annotated[str | None, Depends(notify_url)]

SpecBody = Annotated[AnySpec, Depends(validated(AnySpec, "spec"))]
ForkBody = Annotated[ForkRequest, Depends(validated(ForkRequest, "request"))]


async def request_document(request: Request) -> Any:
    """Return the body as it was sent, before defaults and presets are filled in."""
    try:
        return await request.json()
    except ValueError:
        # Validation of the spec reports it.
        return None


SentDocument = Annotated[Any, Depends(request_document)]


def full_view(service: JobService, job: Job) -> JobView:
    """Return the view of a job with its best design."""
    has_best = job.progress.best_fitness is not None
    return JobView.from_job_and_best(job, service.best(job.id) if has_best else None)


def _submitted(service: JobService, response: Response, job: Job, *, new: bool) -> JobView:
    if not new:
        response.status_code = status.HTTP_200_OK
    response.headers["Location"] = f"{PREFIX}/jobs/{job.id}"
    return full_view(service, job)


@router.post(
    "/jobs",
    operation_id="submit_job",
    summary="Submit a job",
    status_code=status.HTTP_202_ACCEPTED,
    response_description="The job is queued; `Location` is its path.",
    responses={
        200: {
            "model": JobView,
            "description": "The key was used before for the same job, which is returned.",
        },
        **problems(400, 403, 409, 413, 422),
    },
)
def submit_job(
    spec: SpecBody,
    service: Service,
    response: Response,
    owner: Owner,
    quota: OwnersQuota,
    sent: SentDocument,
    notify: NotifyUrl,
    priority: NewPriority,
    idempotency_key: IdempotencyKey = None,
) -> JobView:
    """Check that the job can be simulated and queue it.

    Returns at once; a runner starts the job when it has capacity. With an `Idempotency-Key` that
    was used before, the same body returns the existing job with 200, even if presets have changed
    since; a body for another job returns 409.
    """
    job, new = service.submit(
        spec,
        idempotency_key=idempotency_key,
        request=sent,
        owner=owner,
        notify_url=notify,
        quota=quota,
        priority=priority,
    )
    return _submitted(service, response, job, new=new)


@router.post(
    "/jobs/{job_id}/fork",
    dependencies=[Analyzing],
    operation_id="fork_job",
    summary="Fork a job",
    status_code=status.HTTP_202_ACCEPTED,
    response_description="The fork is queued; `Location` is its path.",
    responses={
        200: {
            "model": JobView,
            "description": "The key was used before for the same fork, which is returned.",
        },
        **problems(400, 403, 404, 409, 413, 422),
    },
)
def fork_job(
    request: ForkBody,
    job_id: JobId,
    service: Service,
    response: Response,
    owner: Owner,
    quota: OwnersQuota,
    sent: SentDocument,
    notify: NotifyUrl,
    priority: NewPriority,
    idempotency_key: IdempotencyKey = None,
) -> JobView:
    """Queue a job that starts from iterations of this one, which stays unchanged.

    With the same settings the fork continues bit for bit. Under another preference the stored
    objectives are judged again and passed to the search if its method supports that; otherwise, and
    with another optimizer, robot or other scenarios, a new search starts from the best designs. The
    fork's `lineage` says which, and why. 409 if the search cannot be continued, or if its
    provenance has changed and the request does not accept that.
    """
    job, new = service.fork(
        job_id,
        request,
        idempotency_key=idempotency_key,
        sent=sent,
        owner=owner,
        notify_url=notify,
        quota=quota,
        priority=priority,
    )
    return _submitted(service, response, job, new=new)


@router.post(
    "/estimates",
    operation_id="estimate_job",
    summary="Estimate a job",
    responses=problems(400, 413, 422),
)
async def estimate_job(spec: SpecBody, service: Service, computing: Computing) -> EstimateView:
    """Check a job as on submission, and estimate its cost. Nothing is stored.

    The time follows from the rate of earlier jobs with the same robot and controller; if there are
    none, a short simulation is timed on the server, which may have to compile the robot's kernel.
    """
    return EstimateView.from_estimate(await computing.run(partial(service.estimate, spec)))


@router.get(
    "/jobs",
    operation_id="list_jobs",
    summary="List jobs",
    response_model=PageView[JobSummaryView],
    responses=problems(422),
)
def list_jobs(
    service: Service,
    state: Annotated[JobState | None, Query(description="Only jobs in this state.")] = None,
    kind: Annotated[JobKind | None, Query(description="Only jobs of this kind.")] = None,
    parent: Annotated[JobIdText | None, Query(description="Only forks of the job of this id.")] = (
        None
    ),
    search: Annotated[
        str,
        Query(
            max_length=200,
            description="Only jobs whose name, id, note or tags contain this, ignoring case.",
        ),
    ] = "",
    order: Annotated[
        JobOrder,
        Query(
            description="`created`: newest first; `fitness`: best first; `name`: by name, ignoring"
            " case; `state`: unfinished jobs first; `evaluations`, `iterations`, `priority`,"
            " `rate`: largest first; `gain` over the `reference`: largest first; `time_left`:"
            " shortest first. Jobs without the value come last."
        ),
    ] = JobOrder.CREATED,
    reverse: Annotated[
        bool,
        Query(description="Reverse the order; jobs without the value still come last."),
    ] = False,
    robot: Annotated[
        str | None,
        Query(max_length=200, description="Only jobs of this robot; `own` for all custom robots."),
    ] = None,
    controller: Annotated[
        str | None, Query(max_length=200, description="Only jobs that tune this controller.")
    ] = None,
    preference: Annotated[
        str | None,
        Query(
            max_length=200,
            description="Only jobs of this preference; `own` for all custom preferences.",
        ),
    ] = None,
    tag: Annotated[str | None, Query(max_length=200, description="Only jobs with this tag.")] = (
        None
    ),
    archived: Archived = None,
    after: After = None,
    limit: Annotated[int, Query(ge=1, le=200, description="Maximum number of jobs.")] = 50,
) -> Response:
    """Return a page of jobs with their progress. New jobs do not shift later pages."""
    page = service.jobs(
        state=state,
        kind=kind,
        parent=parent,
        search=search,
        where=JobFilter(
            archived=archived, robot=robot, controller=controller, preference=preference, tag=tag
        ),
        order=order,
        reverse=reverse,
        after=after,
        limit=limit,
    )
    items = [JobSummaryView.from_job(job) for job in page.items]
    return json_response(PageView[JobSummaryView](items=items, next=page.next))


@router.get(
    "/job-facets",
    operation_id="count_jobs",
    summary="Count jobs by facet",
    responses=problems(422),
)
def count_jobs(service: Service, archived: Archived = None) -> JobFacetsView:
    """Count jobs by state, robot, controller, preference and tag."""
    return JobFacetsView.from_counts(service.facets(archived=archived))


@router.get(
    "/jobs/{job_id}",
    operation_id="get_job",
    summary="Get a job",
    responses=problems(404, 422),
)
def get_job(job_id: JobId, service: Service) -> JobView:
    """Return state, progress, rates, estimated time left, best design and error."""
    return full_view(service, service.job(job_id))


@router.patch(
    "/jobs/{job_id}",
    operation_id="label_job",
    dependencies=[Depends(may_command)],
    summary="Change name, note, tags or archival of a job",
    responses=problems(400, 403, 404, 413, 422),
)
def label_job(change: LabelsChange, job_id: JobId, service: Service, actor: Actor) -> JobView:
    """Apply a JSON merge patch to the labels of a job. Its spec and results do not change."""
    return full_view(service, service.label(job_id, change, actor=actor))


@router.get(
    "/jobs/{job_id}/activity",
    operation_id="get_activity",
    summary="Get the activity of a job's workers",
    responses=problems(404, 422),
)
def get_activity(
    job_id: JobId,
    service: Service,
    activities: JobActivities,
    level: Annotated[Level, Query(description="Least severe level of messages.")] = "INFO",
) -> ActivityView:
    """Return the last iterations and tasks by worker, the workers' health and the log of a job.

    Held in the memory of the process that runs the job, and bounded; `reason` explains an empty
    answer.
    """
    service.job(job_id)
    known = None if activities is None else activities.of(job_id)
    return ActivityView.from_activity(job_id, known, level, runs_jobs=activities is not None)


@router.get(
    "/jobs/{job_id}/notifications",
    operation_id="list_notifications",
    summary="List notifications of a job's end",
    responses=problems(404, 422),
)
def list_notifications(job_id: JobId, service: Service) -> list[NotificationView]:
    """Return one notification for each time that a job with a `Notify-URL` ended."""
    notifications = service.store.outbox.about(job_id)
    return [NotificationView.from_notification(notification) for notification in notifications]


@router.get(
    "/audit",
    operation_id="read_audit",
    summary="Read the audit log",
    dependencies=[Depends(may_administer)],
    responses=problems(403, 422),
)
def read_audit(
    service: Service,
    job_id: Annotated[
        JobIdText | None, Query(description="Only changes of the job of this id.")
    ] = None,
    after: After = None,
    limit: Annotated[int, Query(ge=1, le=200, description="Maximum number of entries.")] = 50,
) -> PageView[AuditEntryView]:
    """Return changes to jobs and tokens, newest first.

    Requires a token of scope `admin`, where tokens are required.
    """
    page = service.store.audit(job_id=job_id, after=after, limit=limit)
    return PageView(items=[AuditEntryView.from_entry(e) for e in page.items], next=page.next)
