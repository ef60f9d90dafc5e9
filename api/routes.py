"""Routes of the table of operations, most of them generic.

A route by hand needs more than its operation: headers, or a stream.
"""

from __future__ import annotations

import hashlib
import inspect
from collections.abc import Callable, Mapping
from functools import partial
from types import NoneType
from typing import Annotated, Any, Final, TypeVar, get_args

from anyio.to_thread import run_sync
from fastapi import APIRouter, Body, Depends, Header, Path, Query, Request, Response, status
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse, StreamingResponse
from pydantic import TypeAdapter, ValidationError, WrapValidator

from gaitswarm import operations
from gaitswarm.api.access import (
    Actor,
    NewPriority,
    Owner,
    OwnersQuota,
    PriorityCheck,
    UntilRevoked,
    may_administer,
    may_command,
    may_submit,
)
from gaitswarm.api.dependencies import (
    Computing,
    ExistingJob,
    FollowedJobs,
    JobActivities,
    JobId,
    RobotFolders,
    ServerLimits,
    ServerMetrics,
    ServerSettings,
    Service,
    Stopping,
)
from gaitswarm.api.documentation import Responses, binary, problems
from gaitswarm.api.events import EVENT_SCHEMA, EXAMPLE, EventStream, job_events
from gaitswarm.operations import LARGEST_INDEX, OPERATIONS, Operation
from gaitswarm.services.optimizer.jobs.documents import AnySpec
from gaitswarm.services.optimizer.jobs.fork import ForkRequest
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.jobs.notification import check_url
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.input import with_known_keys
from gaitswarm.sim.robot.check import MOST_ROBOTS, Location, check_files, files_of, objects_in
from gaitswarm.tables import MEDIA_TYPES, encoded_table
from gaitswarm.views.base import PREFIX
from gaitswarm.views.job import JobView

T = TypeVar("T")

_PATH: Final[Mapping[str, Any]] = {
    "job_id": JobId,
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

_FILLED_IN: Final[Mapping[str, Any]] = {
    "activities": JobActivities,
    "actor": Actor,
    "check_priority": PriorityCheck,
    "folders": RobotFolders,
    "limits": ServerLimits,
    "quota": OwnersQuota,
}
"""Keyword-only arguments of operations."""

_ACCESS: Final[Mapping[str, list[Any]]] = {
    "read": [],
    "submit": [Depends(may_submit)],
    "command": [Depends(may_command)],
    "admin": [Depends(may_administer)],
}

_IfNoneMatch = Annotated[
    str | None,
    Header(max_length=1000, description="`ETag` of cached bytes; 304 if they are unchanged."),
]

MOST_NAMES: Final = 10_000
"""Fields in a body, without start designs; each may yield an error."""

MOST_VARIABLES: Final = 128
"""Fields of a start design that do not count."""

_KIND: Final = inspect.Parameter.KEYWORD_ONLY


def validated(model: Any, name: str) -> Callable[..., Any]:
    """Return a dependency that reads the body of a request and validates it in a thread.

    In the event loop, validation would delay every other request.
    """
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
        return adapter.validate_python(document)
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


def _endpoint(operation: Operation[Any]) -> Callable[..., Any]:
    """Return the generic endpoint of an operation, with a signature for FastAPI."""

    async def answer(
        service: JobService, computing: Computing, if_none_match: str | None = None, **given: Any
    ) -> Response:
        # Encoded in the thread: an answer may have hundreds of thousands of numbers.
        work = partial(_response, operation, service, given, if_none_match)
        return await (computing.run(work) if operation.heavy else run_sync(work))

    kinds: dict[str, Any] = {"service": Service, "computing": Computing}
    for name, parameter in operation.parameters.items():
        kind = parameter.annotation
        if parameter is not operation.request:
            kinds[name] = _PATH[name] if name in _PATH else _FILLED_IN[name]
        elif operation.method == "GET":
            kinds[name] = Annotated[kind, Query()]
        else:
            kinds[name] = Annotated[kind, Depends(validated(kind, name))]
    parameters = [inspect.Parameter(name, _KIND, annotation=kind) for name, kind in kinds.items()]
    if operation.cached:
        parameters.append(
            inspect.Parameter("if_none_match", _KIND, annotation=_IfNoneMatch, default=None)
        )
    answer.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    return answer


def _response(
    operation: Operation[Any],
    service: JobService,
    given: Mapping[str, Any],
    received_tag: str | None,
) -> Response:
    """Compute and encode an answer."""
    answer = operation.answer(service, **given)
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
    if operation.result is not bytes:
        content, media_type = operation.adapter.dump_json(answer, by_alias=True), "application/json"
        return Response(content, operation.status, headers, media_type)
    if operation.cached:
        headers["Cache-Control"] = "private, no-cache"
        headers["ETag"] = f'"{hashlib.sha256(answer).hexdigest()}"'
        if received_tag is not None and headers["ETag"] in received_tag:
            return Response(status_code=status.HTTP_304_NOT_MODIFIED, headers=headers)
    return Response(answer, operation.status, headers, operation.media_type)


def documented(
    operation: Operation[Any], *, responses: Responses | None = None, **options: Any
) -> dict[str, Any]:
    """Return the arguments of a route: those that follow from its operation, and others."""
    has_body = operation.request is not None and operation.method != "GET"
    is_refusable = operation.heavy or operation.access == "command"
    statuses = {
        *operation.refusals,
        *((400, 413) if has_body else ()),
        *((404,) if operation.path_names else ()),
        *((422,) if operation.request is not None or operation.path_names else ()),
        *((403,) if operation.access != "read" else ()),
        *((409,) if "job_id" in operation.path_names and is_refusable else ()),
    }
    documents = (responses or {}) | problems(*sorted(statuses))
    if operation.content:
        documents = binary(operation.content, operation.media_type) | documents
    if operation.cached:
        documents[status.HTTP_304_NOT_MODIFIED] = {"description": "`If-None-Match` has the ETag."}
    description = inspect.cleandoc(operation.answer.__doc__ or "")
    if operation.page:
        description += "\n\nFor the web page; it may change with the page."
    return {
        "path": PREFIX + operation.path,
        "methods": [operation.method],
        "operation_id": operation.id,
        "summary": operation.summary,
        "description": description,
        "tags": [operation.tag],
        "status_code": operation.status,
        "dependencies": _ACCESS[operation.access],
        "responses": documents,
        "response_model": None if operation.result in (bytes, NoneType) else operation.result,
        "response_class": Response if operation.result in (bytes, NoneType) else JSONResponse,
        "openapi_extra": {"x-used-by": "page"} if operation.page else None,
        **options,
    }


_BY_HAND: Final[dict[str, tuple[Callable[..., Any], dict[str, Any]]]] = {}


def by_hand(operation: Operation[Any], **options: Any) -> Callable[[T], T]:
    """Serve an operation by the decorated endpoint."""

    def add(endpoint: Any) -> Any:
        _BY_HAND[operation.id] = endpoint, options
        return endpoint

    return add


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


async def request_document(request: Request) -> Any:
    """Return the body as it was sent, before defaults and presets are filled in."""
    try:
        return await request.json()
    except ValueError:
        # Validation of the spec reports it.
        return None


async def submission(
    owner: Owner,
    quota: OwnersQuota,
    notify: Annotated[str | None, Depends(notify_url)],
    priority: NewPriority,
    idempotency_key: IdempotencyKey = None,
) -> dict[str, Any]:
    """Return what accompanies a new job."""
    return {
        "owner": owner,
        "quota": quota,
        "notify_url": notify,
        "priority": priority,
        "idempotency_key": idempotency_key,
    }


Submission = Annotated[dict[str, Any], Depends(submission)]
SentDocument = Annotated[Any, Depends(request_document)]


def _queued(what: str) -> dict[str, Any]:
    return {
        "response_description": "The job is queued; `Location` is its path.",
        "responses": {
            200: {
                "model": JobView,
                "description": f"The key was used before for the same {what}, which is returned.",
            }
        },
    }


def _submitted(service: JobService, response: Response, job: Job, new: bool) -> JobView:
    if not new:
        response.status_code = status.HTTP_200_OK
    response.headers["Location"] = f"{PREFIX}/jobs/{job.id}"
    return operations.full_view(service, job)


@by_hand(operations.submit_job, **_queued("job"))
def submit_job(
    spec: Annotated[AnySpec, Depends(validated(AnySpec, "spec"))],
    service: Service,
    response: Response,
    submission: Submission,
    sent: SentDocument,
) -> JobView:
    return _submitted(service, response, *service.submit(spec, request=sent, **submission))


@by_hand(operations.fork_job, **_queued("fork"))
async def fork_job(
    fork: Annotated[ForkRequest, Depends(validated(ForkRequest, "fork"))],
    job_id: JobId,
    service: Service,
    computing: Computing,
    response: Response,
    submission: Submission,
    sent: SentDocument,
) -> JobView:
    def work() -> JobView:
        return _submitted(service, response, *service.fork(job_id, fork, sent=sent, **submission))

    return await computing.run(work)


@by_hand(
    operations.export_job,
    response_class=StreamingResponse,
    response_model=None,
    responses=binary("The table, as a file.", *MEDIA_TYPES.values()),
)
def export_job(
    job: ExistingJob, service: Service, query: Annotated[operations.ExportQuery, Query()]
) -> StreamingResponse:
    return StreamingResponse(
        encoded_table(query.format, job.spec, service.column_pieces(job)),
        media_type=MEDIA_TYPES[query.format],
        headers={"Content-Disposition": f'attachment; filename="{job.id}.{query.format}"'},
    )


@by_hand(
    operations.stream_events,
    # The schema of EventStream would be a string.
    response_class=StreamingResponse,
    response_model=None,
    response_description="Server-sent events `iteration`, `state` and `deleted`.",
    responses={
        200: {"content": {"text/event-stream": {"example": EXAMPLE, "itemSchema": EVENT_SCHEMA}}}
    },
)
async def stream_events(
    job: ExistingJob,
    service: Service,
    settings: ServerSettings,
    topics: FollowedJobs,
    stopping: Stopping,
    metrics: ServerMetrics,
    until_revoked: UntilRevoked,
    query: Annotated[operations.EventsQuery, Query()],
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
    if last_event_id is not None:
        query = query.model_copy(update={"after": last_event_id})
    seconds = settings.api_event_poll_seconds
    followed = topics.follow(service, job.id, poll_seconds=seconds)
    events = job_events(followed, job.id, query, metrics, stopping, pause_seconds=seconds)
    return EventStream(events, until_revoked)


def _router() -> APIRouter:
    router = APIRouter()
    for operation in OPERATIONS:
        endpoint, options = _BY_HAND.get(operation.id) or (_endpoint(operation), {})
        router.add_api_route(endpoint=endpoint, **documented(operation, **options))
    return router


router: Final = _router()
