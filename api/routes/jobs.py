"""Jobs: submit, fork, estimate, list, look at."""

from __future__ import annotations

from functools import partial
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Header, Query, Request, Response, status

from gaitswarm.api.access import NewPriority, Owner, OwnersQuota
from gaitswarm.api.bodies import validated
from gaitswarm.api.dependencies import (
    Analysing,
    JobId,
    JobIdText,
    Remembered,
    ServerSettings,
    Service,
    Slots,
)
from gaitswarm.api.documentation import problems
from gaitswarm.api.reads import InFull, JobList, job_in_full
from gaitswarm.services.optimizer.jobs.documents import AnySpec
from gaitswarm.services.optimizer.jobs.fork import ForkRequest
from gaitswarm.services.optimizer.jobs.job import JobOrder, JobState
from gaitswarm.services.optimizer.jobs.labels import JobFilter
from gaitswarm.services.optimizer.jobs.notification import check_url
from gaitswarm.views import (
    PREFIX,
    EstimateView,
    JobSummaryView,
    JobView,
    PageView,
)
from gaitswarm.views.job import JobKind

router = APIRouter(prefix=PREFIX, tags=["jobs"])

IdempotencyKey = Annotated[
    str | None,
    Header(
        alias="Idempotency-Key",
        min_length=1,
        max_length=200,
        pattern=r"^[\x21-\x7e]+$",
        description="Any string of your own without blanks. A repeated request with the same key"
        " and the same job does not make a second job.",
        examples=["7d9f2b1e"],
    ),
]


async def notify_url(
    settings: ServerSettings,
    url: Annotated[
        str | None,
        Header(
            alias="Notify-URL",
            min_length=1,
            max_length=2000,
            description="Where a JSON document is sent when the job has ended; its host must be one"
            " that the server allows. What came of it: `/v1/jobs/{job_id}/notifications`.",
            examples=["https://ci.example/hook"],
        ),
    ] = None,
) -> str | None:
    """The URL that is told of the job's end, checked."""
    if url is not None:
        check_url(url, settings.webhook_hosts, field="Notify-URL")
    return url


NotifyUrl = Annotated[str | None, Depends(notify_url)]

SpecBody = Annotated[AnySpec, Depends(validated(AnySpec, "spec"))]
ForkBody = Annotated[ForkRequest, Depends(validated(ForkRequest, "request"))]


async def request_document(request: Request) -> Any:
    """The body as it was sent, before defaults and presets are filled in."""
    try:
        return await request.json()
    except ValueError:
        # No body, or none of JSON: it is the spec that is missing, which has an answer of its own.
        return None


@router.post(
    "/jobs",
    operation_id="submit_job",
    summary="Submit a job",
    status_code=status.HTTP_202_ACCEPTED,
    response_description="The job is queued; `Location` says where to follow it.",
    responses={
        200: {
            "model": JobView,
            "description": "The key was used before for the same job: this is that job.",
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
    sent: Annotated[Any, Depends(request_document)],
    notify: NotifyUrl,
    priority: NewPriority,
    idempotency_key: IdempotencyKey = None,
) -> JobView:
    """Check that the job can be simulated and queue it.

    The answer comes at once; a runner takes the job up when it has room. With an
    `Idempotency-Key` used before, the same body answers 200 with the job that it made, even if
    presets have changed since; a body that asks for another job answers 409.
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
    if not new:
        response.status_code = status.HTTP_200_OK
    response.headers["Location"] = f"{PREFIX}/jobs/{job.id}"
    return job_in_full(service, job)


@router.post(
    "/jobs/{job_id}/fork",
    dependencies=[Analysing],
    operation_id="fork_job",
    summary="Fork a job",
    status_code=status.HTTP_202_ACCEPTED,
    response_description="The fork is queued; `Location` says where to follow it.",
    responses={
        200: {
            "model": JobView,
            "description": "The key was used before for the same fork: this is that job.",
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
    sent: Annotated[Any, Depends(request_document)],
    notify: NotifyUrl,
    priority: NewPriority,
    idempotency_key: IdempotencyKey = None,
) -> JobView:
    """Queue a job that begins with iterations of this one, of which nothing is changed.

    With the same settings it goes on as this one did, bit for bit. Under another preference the
    stored objectives are judged anew and the search is told that, if its method can be; else, and
    with another optimizer, robot or other scenarios, a new search starts from the best designs. The
    fork's `lineage` says which, and why. 409 if the search cannot be taken over, or what its
    numbers depend on has changed and that is not accepted.
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
    if not new:
        response.status_code = status.HTTP_200_OK
    response.headers["Location"] = f"{PREFIX}/jobs/{job.id}"
    return job_in_full(service, job)


@router.post(
    "/estimates",
    operation_id="estimate_job",
    summary="Estimate a job",
    responses=problems(400, 413, 422),
)
async def estimate_job(spec: SpecBody, service: Service, slots: Slots) -> EstimateView:
    """Check a job as submitting it would, and say what it would cost. Nothing is stored.

    The time is by the rate of earlier jobs with the same robot and controller; without one, a short
    walk is measured on the server, for which it may have to compile the robot's kernel first.
    """
    return EstimateView.from_estimate(await slots.run(partial(service.estimate, spec)))


@router.get(
    "/jobs",
    operation_id="list_jobs",
    summary="List jobs",
    response_model=PageView[JobSummaryView],
    responses=problems(422),
)
def list_jobs(
    request: Request,
    service: Service,
    remembered: Remembered,
    state: Annotated[JobState | None, Query(description="Only jobs in this state.")] = None,
    kind: Annotated[JobKind | None, Query(description="Only jobs of this kind.")] = None,
    parent: Annotated[
        JobIdText | None, Query(description="Only jobs that were forked from the job of this id.")
    ] = None,
    search: Annotated[
        str,
        Query(
            max_length=200,
            description="Only jobs whose name, id, note or tags contain this, whatever its case.",
        ),
    ] = "",
    order: Annotated[
        JobOrder,
        Query(
            description="`created`: newest first; `fitness`: best first, jobs without one last;"
            " `name`: by name, jobs without one last; `state`: those that wait or run first;"
            " `evaluations`, `iterations`, `priority`, `rate`: most first; `gain` over the"
            " `reference`: greatest first; `time_left`: those that end soonest first."
        ),
    ] = JobOrder.CREATED,
    reverse: Annotated[
        bool,
        Query(
            description="Whether the order is reversed; jobs without what they are sorted by stay"
            " last."
        ),
    ] = False,
    robot: Annotated[
        str | None,
        Query(max_length=200, description="Only jobs of this robot; `own` for all of users' own."),
    ] = None,
    controller: Annotated[
        str | None, Query(max_length=200, description="Only jobs that tune this controller.")
    ] = None,
    preference: Annotated[
        str | None,
        Query(max_length=200, description="Only jobs of this preference; `own` for any other."),
    ] = None,
    tag: Annotated[
        str | None, Query(max_length=200, description="Only jobs that have this tag.")
    ] = None,
    archived: Annotated[
        bool | None, Query(description="Only jobs that are archived, or that are not.")
    ] = None,
    after: Annotated[
        str | None, Query(max_length=200, description="`next` of the page before.")
    ] = None,
    limit: Annotated[int, Query(ge=1, le=200, description="Most jobs on a page.")] = 50,
) -> Response:
    """Jobs with their progress, in pages. Jobs submitted meanwhile do not shift later pages."""
    where = JobFilter(
        archived=archived, robot=robot, controller=controller, preference=preference, tag=tag
    )
    listed = JobList(state, kind, parent, search, where, order, reverse, after, limit)
    return listed.encoded(remembered, listed.read(service)).answer(request)


@router.get(
    "/jobs/{job_id}",
    operation_id="get_job",
    summary="Look at a job",
    response_model=JobView,
    responses=problems(404, 422),
)
def get_job(request: Request, job_id: JobId, service: Service, remembered: Remembered) -> Response:
    """State, progress, rates, estimated time left, best design so far, and why it failed if so."""
    return InFull().answer(remembered, service, service.job(job_id)).answer(request)
