"""What a job has committed, and the stream of what it commits."""

from __future__ import annotations

from collections.abc import AsyncIterable
from typing import Annotated, Final

from fastapi import APIRouter, Header, Path, Query
from fastapi.responses import StreamingResponse
from fastapi.sse import EventSourceResponse, ServerSentEvent

from api.context import Context, ExistingJob, JobId, Service
from api.events import job_events
from api.openapi import problems
from gaitswarm.tables import MEDIA_TYPES, TableFormat, encoded_table
from gaitswarm.views import (
    PREFIX,
    BestView,
    CatalogueView,
    EvaluationView,
    IterationView,
    PageView,
    evaluation_views,
)
from services.optimizer.errors import NotFound

router = APIRouter(prefix=f"{PREFIX}/jobs/{{job_id}}", tags=["history"])

_LARGEST: Final = 2**31 - 1

_STREAM: Final = """\
event: iteration
data: {"index":24,"best":21.3,"mean":25.2,"median":23.9,"worst":41.7,"best_so_far":20.9,\
"failed":2,"evaluate_seconds":1.23,"committed_at":"2026-01-01T12:00:00Z"}
id: 24

event: state
data: {"id":"k2q7zr5dm9xw","state":"succeeded","error":null,"iterations":25}

"""

AfterIteration = Annotated[
    int | None,
    Query(ge=0, le=_LARGEST, description="Only iterations with a greater index."),
]


@router.get(
    "/iterations",
    operation_id="list_iterations",
    summary="List committed iterations",
    responses=problems(404, 422),
)
def list_iterations(
    job_id: JobId,
    service: Service,
    after: AfterIteration = None,
    limit: Annotated[int, Query(ge=1, le=1000, description="Most iterations on a page.")] = 100,
) -> PageView[IterationView]:
    """Fitness over the swarm, iteration by iteration, in pages; the data of a convergence plot."""
    page = service.iterations(job_id, after=after, limit=limit)
    return PageView(items=[IterationView.from_iteration(i) for i in page.items], next=page.next)


@router.get(
    "/iterations/{iteration}/evaluations",
    operation_id="list_evaluations",
    summary="List an iteration's evaluations",
    responses=problems(404, 422),
)
def list_evaluations(
    job: ExistingJob,
    service: Service,
    iteration: Annotated[
        int, Path(ge=0, le=_LARGEST, description="Index of a committed iteration, from 0.")
    ],
) -> CatalogueView[EvaluationView]:
    """Every particle: its design, its fitness, and status, utility and raw objectives by scenario.

    Raw objectives are as simulated; utilities follow from them and the job's preference.
    """
    return CatalogueView(items=evaluation_views(service.evaluations(job.id, iteration), job.spec))


@router.get(
    "/best", operation_id="get_best", summary="Take the best design", responses=problems(404, 422)
)
def get_best(job: ExistingJob, service: Service) -> BestView:
    """The design of least fitness so far, with its results in every scenario.

    404 while no design has walked in every scenario.
    """
    best = service.best(job.id)
    if best is None:
        raise NotFound(
            f"job {job.id} has no design yet that walks in every scenario; ask again after its"
            " next iteration, or see why designs fail in its evaluations"
        )
    return BestView.from_evaluation(best, job.spec)


@router.get(
    "/export",
    operation_id="export_job",
    summary="Download every evaluation",
    response_class=StreamingResponse,
    response_description="The table, as a file.",
    responses={
        200: {
            "content": {
                kind: {"schema": {"type": "string", "format": "binary"}}
                for kind in MEDIA_TYPES.values()
            }
        },
        **problems(404, 422),
    },
)
def export_job(
    job: ExistingJob,
    service: Service,
    file_format: Annotated[
        TableFormat, Query(alias="format", description="Format of the file.")
    ] = "csv",
) -> StreamingResponse:
    """One row per design: iteration, particle, fitness, `design.<variable>`, and for every scenario
    `<scenario>.status`, `<scenario>.utility` and `<scenario>.<objective>`; floats are exact.
    """
    return StreamingResponse(
        encoded_table(file_format, job.spec, service.column_pieces(job)),
        media_type=MEDIA_TYPES[file_format],
        headers={"Content-Disposition": f'attachment; filename="{job.id}.{file_format}"'},
    )


@router.get(
    "/events",
    operation_id="stream_events",
    summary="Follow a job",
    response_class=EventSourceResponse,
    response_description="Server-sent events `iteration` and `state`.",
    responses={200: {"content": {"text/event-stream": {"example": _STREAM}}}, **problems(404, 422)},
)
async def stream_events(
    job: ExistingJob,
    context: Context,
    last_event_id: Annotated[
        int | None,
        Header(
            alias="Last-Event-ID",
            ge=0,
            le=_LARGEST,
            description="Id of the last event received; the stream goes on with the next. Browsers"
            " send it by themselves when they reconnect.",
        ),
    ] = None,
    after: AfterIteration = None,
    follow: Annotated[
        bool, Query(description="False: end the stream when all that is committed has been sent.")
    ] = True,
    limit: Annotated[
        int | None,
        Query(ge=1, le=_LARGEST, description="End the stream after this many iterations."),
    ] = None,
) -> AsyncIterable[ServerSentEvent]:
    """Committed iterations as they come, as server-sent events.

    An event `iteration` is sent once for each committed iteration, in order; its id is the
    iteration's index, its data an IterationView. An event `state`, without an id, is sent on
    connecting and whenever the job's state changes; its data is a StateView. The stream ends after
    the event of a final state. A broken stream goes on without gap or repeat from `Last-Event-ID`
    (or `after`). Comments keep idle connections alive.
    """
    start = after if last_event_id is None else last_event_id
    events = job_events(context, job.id, after=start, follow=follow, limit=limit)
    async for event in events:
        yield event
