"""Routes of the table of operations, most of them generic; others need headers, or a stream."""

from __future__ import annotations

import hashlib
import inspect
import json
from collections.abc import Callable, Coroutine, Mapping
from functools import partial
from types import NoneType
from typing import Annotated, Any, Final, get_args

from anyio.to_thread import run_sync
from fastapi import APIRouter, Body, Depends, Header, Path, Query, Request, Response, status
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse, StreamingResponse
from fastapi.routing import APIRoute
from pydantic import TypeAdapter, ValidationError, WrapValidator

from gaitswarm.api import access, dependencies
from gaitswarm.api.documentation import Responses, binary, problems
from gaitswarm.api.events import EVENTS, EventsQuery, EventStream, job_events
from gaitswarm.jobs.base import job_view
from gaitswarm.jobs.operation import LARGEST_INDEX, OPERATIONS, Context, Limits, Operation
from gaitswarm.operations import ServedJobs
from gaitswarm.services.optimizer.jobs.audit import LOCAL
from gaitswarm.services.optimizer.jobs.documents import AnySpec
from gaitswarm.services.optimizer.jobs.fork import ForkRequest
from gaitswarm.services.optimizer.jobs.job import (
    DEFAULT_PRIORITY,
    HIGHEST_PRIORITY,
    LOWEST_PRIORITY,
    Job,
)
from gaitswarm.services.optimizer.jobs.notification import check_url
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.input import numbers_from_booleans, unique_names, with_known_keys
from gaitswarm.sim.robot.check import MOST_ROBOTS, Location, check_files, files_of, objects_in
from gaitswarm.views.base import PREFIX
from gaitswarm.views.job import JobView

_PATH: Final[Mapping[str, Any]] = {
    "job_id": dependencies.JobId,
    "iteration": Annotated[
        int, Path(ge=0, le=LARGEST_INDEX, description="Index of a committed iteration, from 0.")
    ],
    "controller": Annotated[
        str,
        Path(
            max_length=40,
            description="Name of a fuzzy controller; see /v1/controllers.",
            examples=["fuzzy-pi"],
        ),
    ],
    "digest": Annotated[
        str,
        Path(
            pattern=r"^[0-9a-f]{64}$",
            description="SHA-256 of the robot's robot.urdf, as in the header of a replay.",
            examples=[64 * "0"],
        ),
    ],
    "number": Annotated[
        int, Path(ge=0, le=100_000, description="Index in the list.", examples=[0])
    ],
    "recording_id": Annotated[
        str, Path(pattern=r"^[0-9a-f]{32}$", description="Id, as POST /v1/recordings returned it.")
    ],
}
"""Parameters of paths."""

_ACCESS: Final[Mapping[str, list[Any]]] = {
    "read": [],
    "submit": [Depends(access.may_submit)],
    "command": [Depends(access.may_command)],
    "restore": [Depends(access.may_restore)],
    "admin": [Depends(access.may_administer)],
}

_IfNoneMatch = Annotated[
    str | None,
    Header(max_length=1000, description="`ETag` of cached bytes; 304 if they are unchanged."),
]

_STATUSES: Final = {
    "NotFound": status.HTTP_404_NOT_FOUND,
    "Conflict": status.HTTP_409_CONFLICT,
}
"""Of errors that docstrings document."""

_FOR_THE_PAGE: Final = "\n\nFor the web page; it may change with the page."

_EARLIER: Final[Responses] = {
    200: {
        "model": JobView,
        "description": "The key was used before for the same request; its job is returned.",
    }
}

MOST_NAMES: Final = 10_000
"""Fields in a body, without start designs; each may yield an error."""

MOST_VARIABLES: Final = 128
"""Fields of a start design that do not count."""

_KIND: Final = inspect.Parameter.KEYWORD_ONLY


def validated(model: Any, name: str) -> Callable[..., Any]:
    """Return a dependency that validates the body of a request in a thread, not in the loop."""
    adapter: TypeAdapter[Any] = TypeAdapter(model)

    async def read(http: Request, **body: Any) -> Any:
        work = partial(_validated, model, adapter, body[name])
        return await run_sync(work, limiter=http.state.validations)

    # The signature gives FastAPI the body and its schema, without validating it.
    as_sent = Annotated[model, WrapValidator(lambda document, _: document), Body()]
    default = None if NoneType in get_args(model) else inspect.Parameter.empty
    read.__signature__ = inspect.Signature(  # type: ignore[attr-defined]
        [
            inspect.Parameter("http", _KIND, annotation=Request),
            inspect.Parameter(name, _KIND, annotation=as_sent, default=default),
        ]
    )
    return read


def _validated(model: Any, adapter: TypeAdapter[Any], document: Any) -> Any:
    _check_bounds(document)
    try:
        value = adapter.validate_python(document)
        for where in numbers_from_booleans(document, adapter.dump_python(value)):
            raise _refusal(where, "must be a number", document)
        return value
    except ValidationError as error:
        entries = with_known_keys(error.errors(include_url=False), model)
        raise RequestValidationError(
            [{**entry, "loc": ("body", *entry["loc"])} for entry in entries], body=document
        ) from error


def _check_bounds(document: Any) -> None:
    """Limit what is costly to validate: many fields, and robots."""
    names, robots = 0, list[tuple[Location, str, str]]()
    for where, part in objects_in(document):
        # Only the first invalid start design is reported, so they do not count.
        names += len(part) if where[-2:-1] != ("start",) else max(0, len(part) - MOST_VARIABLES)
        files = files_of(part)
        if files is not None:
            robots.append((where, *files))
        if names > MOST_NAMES:
            problem = f"more than {MOST_NAMES} fields in the body; send fewer"
            raise _refusal(where, problem, document)
        if len(robots) > MOST_ROBOTS:
            problem = f"more than {MOST_ROBOTS} custom robots; send fewer"
            raise _refusal(where, problem, document)
    for where, toml, urdf in robots:
        try:
            check_files(toml, urdf)
        except RobotFileError as error:
            raise _refusal(where, str(error), document) from error


def _refusal(where: Location, problem: str, document: Any) -> RequestValidationError:
    entry = {"type": "value_error", "loc": ("body", *where), "msg": problem, "input": None}
    return RequestValidationError([entry], body=document)


async def request_context(
    request: Request,
    token: access.RequestToken,
    quota: access.OwnersQuota,
    settings: dependencies.ServerSettings,
) -> Context:
    """Return what the server adds to the arguments of an operation."""
    limits = Limits(
        simulated=settings.api_max_simulated_seconds,
        logged=settings.api_max_logged_seconds,
        sampled=settings.api_max_sampled_seconds,
    )
    return Context(
        actor=LOCAL if token is None else token.name,
        quota=quota,
        limits=limits,
        check_priority=partial(access.check_may_prioritize, token),
        activity=request.state.activity,
        robots=settings.robots,
    )


def _endpoint(operation: Operation) -> Callable[..., Any]:
    """Return the generic endpoint of an operation, with a signature for FastAPI."""

    async def answer(
        service: JobService,
        context: Context,
        computing: dependencies.ComputingCapacity,
        if_none_match: str | None = None,
        request: Any = None,
        **path: Any,
    ) -> Response:
        # Encoded in the thread: an answer may have hundreds of thousands of numbers.
        jobs = ServedJobs(service, context)
        work = partial(_response, operation, jobs, path, request, if_none_match)
        return await (computing.run(work) if operation.heavy else run_sync(work))

    kinds: dict[str, Any] = {
        "service": dependencies.Service,
        "context": Annotated[Context, Depends(request_context)],
        "computing": dependencies.Computing,
    } | {name: _PATH[name] for name in operation.path_names}
    if operation.request is not None and operation.method == "GET":
        kinds["request"] = Annotated[operation.request, Query()]
    elif operation.request is not None:
        kind = operation.request | None if operation.optional else operation.request
        name = operation.names[0] if operation.is_whole else "request"
        kinds["request"] = Annotated[kind, Depends(validated(kind, name))]
    parameters = [inspect.Parameter(name, _KIND, annotation=kind) for name, kind in kinds.items()]
    if operation.cached:
        parameters.append(
            inspect.Parameter("if_none_match", _KIND, annotation=_IfNoneMatch, default=None)
        )
    answer.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    return answer


def _response(
    operation: Operation,
    jobs: ServedJobs,
    path: Mapping[str, Any],
    request: Any,
    received_tag: str | None,
) -> Response:
    """Compute and encode an answer."""
    given = operation.arguments(path, request)
    answer = operation.function(jobs, **given)
    headers = {}
    if operation.location is not None:
        headers["Location"] = PREFIX + operation.location(answer)
    if operation.filename is not None:
        name = operation.filename.format(**given)
        headers["Content-Disposition"] = f'attachment; filename="{name}"'
    if operation.reads and operation.method == "POST":
        headers["Cache-Control"] = "no-store"
    if answer is None:
        return Response(status_code=operation.status, headers=headers)
    if operation.media_types:
        media_type = operation.media_types[request.format]
        return StreamingResponse(answer, headers=headers, media_type=media_type)
    if operation.result is not bytes:
        content, media_type = operation.adapter.dump_json(answer, by_alias=True), "application/json"
        return Response(content, operation.status, headers, media_type)
    if operation.cached:
        headers["Cache-Control"] = "private, no-cache"
        headers["ETag"] = f'"{hashlib.sha256(answer).hexdigest()}"'
        if received_tag is not None and headers["ETag"] in received_tag:
            return Response(status_code=status.HTTP_304_NOT_MODIFIED, headers=headers)
    return Response(answer, operation.status, headers, operation.media_type)


def documented(operation: Operation) -> dict[str, Any]:
    """Return the arguments of an operation's route."""
    has_body = operation.request is not None and operation.method != "GET"
    docstring = operation.docstring
    is_bytes = operation.result is bytes or bool(operation.media_types)
    statuses = {
        _STATUSES[name]: text for name, text in docstring.errors.items() if name in _STATUSES
    }
    is_refusable = operation.heavy or operation.access == "command"
    responses = problems(
        *statuses,
        *((400, 413) if has_body else ()),
        *((404,) if operation.path_names else ()),
        *((422,) if operation.request is not None or operation.path_names else ()),
        *((403,) if operation.access != "read" else ()),
        *((409,) if "job_id" in operation.path_names and is_refusable else ()),
    )
    for code, text in statuses.items():
        responses[code]["description"] = f"{text} {responses[code]['description']}"
    if is_bytes:
        media_types = operation.media_types.values() or [operation.media_type]
        responses |= binary(docstring.result, *media_types)
    if operation.cached:
        responses[status.HTTP_304_NOT_MODIFIED] = {"description": "`If-None-Match` has the ETag."}
    has_model = not is_bytes and operation.result is not NoneType
    return {
        "path": PREFIX + operation.path,
        "methods": [operation.method],
        "operation_id": operation.id,
        "summary": operation.summary,
        "description": docstring.text + (_FOR_THE_PAGE if operation.page else ""),
        "response_description": docstring.result or "Successful Response",
        "tags": [operation.tag],
        "status_code": operation.status,
        "dependencies": _ACCESS[operation.access],
        "responses": responses,
        "response_model": operation.result if has_model else None,
        "response_class": JSONResponse if has_model else Response,
        "openapi_extra": {"x-used-by": "page"} if operation.page else None,
    }


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

NotifyUrl = Annotated[
    str | None,
    Header(
        alias="Notify-URL",
        min_length=1,
        max_length=2000,
        description="URL that receives a JSON document when the job has ended. The server must"
        " allow its host. `/v1/jobs/{job_id}/notifications` reports the delivery.",
        examples=["https://ci.example/hook"],
    ),
]

JobPriority = Annotated[
    int,
    Header(
        alias="Job-Priority",
        ge=LOWEST_PRIORITY,
        le=HIGHEST_PRIORITY,
        description="Priority of the job: queued jobs start in order of priority, and each step"
        " doubles the share of workers of a running job. Values above 0 require a token of scope"
        " `admin`, where tokens are required.",
        examples=[0],
    ),
]


async def request_document(request: Request) -> Any:
    """Return the body as it was sent, before defaults and presets are filled in."""
    try:
        return await request.json()
    except ValueError:
        # Validation of the spec reports it.
        return None


async def submission(
    token: access.RequestToken,
    owner: access.Owner,
    quota: access.OwnersQuota,
    settings: dependencies.ServerSettings,
    idempotency_key: IdempotencyKey = None,
    notify_url: NotifyUrl = None,
    priority: JobPriority = DEFAULT_PRIORITY,
) -> dict[str, Any]:
    """Return what accompanies a new job."""
    access.check_may_prioritize(token, priority)
    if notify_url is not None:
        check_url(notify_url, settings.webhook_hosts, field="Notify-URL")
    return {
        "owner": owner,
        "quota": quota,
        "notify_url": notify_url,
        "priority": priority,
        "idempotency_key": idempotency_key,
    }


Submission = Annotated[dict[str, Any], Depends(submission)]
SentDocument = Annotated[Any, Depends(request_document)]


def _job_view(service: JobService, response: Response, job: Job, is_new: bool) -> JobView:
    if not is_new:
        response.status_code = status.HTTP_200_OK
    response.headers["Location"] = f"{PREFIX}/jobs/{job.id}"
    return job_view(service, job)


class _StrictRequest(Request):
    """A request whose JSON has no name twice in an object."""

    async def json(self) -> Any:
        try:
            if not hasattr(self, "_json"):
                self._json = json.loads(await self.body(), object_pairs_hook=unique_names)
            return self._json
        except json.JSONDecodeError:
            raise
        except ValueError as error:
            # FastAPI answers no other error by its text.
            raise json.JSONDecodeError(str(error), "", 0) from error


class _Route(APIRoute):
    """A route for such requests."""

    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        handler = super().get_route_handler()

        async def handle(request: Request) -> Response:
            return await handler(_StrictRequest(request.scope, request.receive))

        return handle


router: Final = APIRouter(route_class=_Route)


@router.post(
    f"{PREFIX}/jobs",
    operation_id="submit_job",
    summary="Submit a job",
    tags=["core"],
    status_code=status.HTTP_202_ACCEPTED,
    dependencies=_ACCESS["submit"],
    response_description="The job is queued; `Location` is its path.",
    responses=_EARLIER | problems(400, 403, 409, 413, 422),
)
def submit_job(
    spec: Annotated[AnySpec, Depends(validated(AnySpec, "spec"))],
    service: dependencies.Service,
    response: Response,
    submission: Submission,
    sent: SentDocument,
) -> JobView:
    """Check that the job can be simulated and queue it.

    Returns at once; a runner starts the job when it has capacity. With an `Idempotency-Key` that
    was used before, the same body returns the existing job with 200, even if presets have changed
    since; a body for another job returns 409.
    """
    return _job_view(service, response, *service.submit(spec, request=sent, **submission))


@router.post(
    f"{PREFIX}/jobs/{{job_id}}/fork",
    operation_id="fork_job",
    summary="Fork a job",
    tags=["operations"],
    status_code=status.HTTP_202_ACCEPTED,
    dependencies=_ACCESS["submit"],
    response_description="The job is queued; `Location` is its path.",
    responses=_EARLIER | problems(400, 403, 404, 409, 413, 422),
)
async def fork_job(
    fork: Annotated[ForkRequest, Depends(validated(ForkRequest, "fork"))],
    job_id: dependencies.JobId,
    service: dependencies.Service,
    computing: dependencies.Computing,
    response: Response,
    submission: Submission,
    sent: SentDocument,
) -> JobView:
    """Queue a job that starts from iterations of this one, which stays unchanged.

    With the same settings the fork continues bit for bit. Under another preference the stored
    objectives are judged again and passed to the search if its method supports that; otherwise, and
    with another optimizer, robot or other scenarios, a new search starts from the best designs. The
    fork's `lineage` says which, and why. 409 if the search cannot be continued, or if its
    provenance has changed and the request does not accept that.
    """

    def work() -> JobView:
        return _job_view(service, response, *service.fork(job_id, fork, sent=sent, **submission))

    return await computing.run(work)


@router.get(
    f"{PREFIX}/jobs/{{job_id}}/events",
    operation_id="stream_events",
    summary="Follow a job",
    tags=["core"],
    # The schema of EventStream would be a string.
    response_class=StreamingResponse,
    response_model=None,
    response_description="Server-sent events `iteration`, `state` and `deleted`.",
    responses=EVENTS | problems(404, 422),
)
async def stream_events(
    job: dependencies.ExistingJob,
    service: dependencies.Service,
    settings: dependencies.ServerSettings,
    topics: dependencies.FollowedJobs,
    stopping: dependencies.Stopping,
    metrics: dependencies.ServerMetrics,
    until_revoked: access.UntilRevoked,
    query: Annotated[EventsQuery, Query()],
    last_event_id: Annotated[
        int | None,
        Header(
            alias="Last-Event-ID",
            ge=0,
            le=LARGEST_INDEX,
            description="Id of the last event received; the stream continues with the next."
            " Browsers send it when they reconnect.",
        ),
    ] = None,
) -> EventStream:
    """Stream committed iterations as server-sent events.

    An event `iteration` is sent once for each committed iteration, in order; its id is the
    iteration's index, its data an IterationView. An event `state`, without an id, is sent on
    connecting and whenever the job's state or its reason to wait changes; its data is a StateView.
    The stream ends after the event of a final state. A broken stream continues without gap or
    repetition from `Last-Event-ID` (or `after`). Comments keep idle connections alive. The stream
    of a deleted job ends with an event `deleted`, whose data has its `id`. A stopping server sends
    a comment and the field `retry`. With a revoked token the stream ends within seconds.
    """
    if last_event_id is not None:
        query = query.model_copy(update={"after": last_event_id})
    seconds = settings.api_event_poll_seconds
    followed = topics.follow(service, job.id, poll_seconds=seconds)
    events = job_events(followed, job.id, query, metrics, stopping, pause_seconds=seconds)
    return EventStream(events, until_revoked)


for _operation in OPERATIONS:
    router.add_api_route(endpoint=_endpoint(_operation), **documented(_operation))
