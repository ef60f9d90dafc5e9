"""Recorded walks: measured logs and motor currents for identification."""

from __future__ import annotations

from functools import partial
from typing import Annotated, Final

from anyio.to_thread import run_sync
from fastapi import APIRouter, Depends, Path, Query, Response, status

from gaitswarm.api.access import Actor, may_submit
from gaitswarm.api.bodies import validated
from gaitswarm.api.dependencies import (
    After,
    Computing,
    ServerSettings,
    Service,
    check_length,
)
from gaitswarm.api.documentation import problems
from gaitswarm.requests.identification import MeasuredWalkRequest, read_measured_walk
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.sim.identification.recorded_walk import RecordedWalk
from gaitswarm.views import PREFIX, PageView
from gaitswarm.views.identification import MeasuredWalkView, RecordingEntryView, RecordingView

RecordingBody = Annotated[RecordedWalk, Depends(validated(RecordedWalk, "walk"))]

MeasuredWalkBody = Annotated[
    MeasuredWalkRequest, Depends(validated(MeasuredWalkRequest, "request"))
]

MEASURED: Final = f"{PREFIX}/measured-walks"
"""Path with a body limit of its own, for measured logs."""

RecordingId = Annotated[
    str, Path(pattern=r"^[0-9a-f]{32}$", description="Id, as POST /v1/recordings returned it.")
]

router = APIRouter(prefix=PREFIX, tags=["recordings"])


@router.post(
    "/recordings",
    operation_id="add_recording",
    summary="Add a recording",
    status_code=status.HTTP_201_CREATED,
    dependencies=[Depends(may_submit)],
    responses=problems(400, 403, 413, 422),
)
def add_recording(
    walk: RecordingBody, service: Service, response: Response, actor: Actor
) -> RecordingView:
    """Store motor currents of a measured walk, for jobs of kind `identification`.

    The id is a hash of the content: the same walk yields the same recording. `gaitswarm record` and
    POST /v1/measured-walks make a recording from a measured log.
    """
    return _stored(walk, service, response, actor)


@router.get(
    "/recordings",
    operation_id="list_recordings",
    summary="List recordings",
    responses=problems(422),
)
def list_recordings(
    service: Service,
    search: Annotated[
        str,
        Query(
            max_length=200,
            description="Only recordings whose id, scenario or controller contain this, ignoring"
            " case.",
        ),
    ] = "",
    after: After = None,
    limit: Annotated[int, Query(ge=1, le=200, description="Maximum number of recordings.")] = 50,
) -> PageView[RecordingEntryView]:
    """Return a page of recordings without their numbers, newest first. New ones do not shift later
    pages.

    Every token with read access sees all of them, as with jobs.
    """
    page = service.recordings(search=search, after=after, limit=limit)
    return PageView(items=[RecordingEntryView.from_entry(e) for e in page.items], next=page.next)


@router.post(
    MEASURED.removeprefix(PREFIX),
    operation_id="record_measured_walk",
    summary="Make a recording from a measured log",
    status_code=status.HTTP_201_CREATED,
    dependencies=[Depends(may_submit)],
    responses=problems(400, 403, 413, 422),
)
async def record_measured_walk(
    request: MeasuredWalkBody,
    service: Service,
    settings: ServerSettings,
    computing: Computing,
    response: Response,
    actor: Actor,
) -> MeasuredWalkView:
    """Read a log of the robot's instruments and store a recording of it.

    The walk is simulated to find the lag of the log; the recording has the measured currents of the
    whole cycles that both share. The log itself is not stored. Bodies may be larger than elsewhere
    (GAITSWARM_API_MAX_LOG_BYTES).
    """
    seconds = request.simulated_seconds([request.walk_scenario])
    check_length(settings, seconds, logged=True, field="scenario")
    measured = await computing.run(partial(read_measured_walk, request))
    stored = await run_sync(_stored, measured.walk, service, response, actor)
    return MeasuredWalkView.from_log(stored, measured.log, measured.pair)


@router.get(
    "/recordings/{recording_id}",
    operation_id="get_recording",
    summary="Get a recording",
    responses=problems(404, 409, 422),
)
def get_recording(recording_id: RecordingId, service: Service) -> RecordedWalk:
    """Return the whole recording with its numbers."""
    return service.recording(recording_id)


@router.get(
    "/recordings/{recording_id}/summary",
    operation_id="get_recording_summary",
    summary="Get a recording without its numbers",
    responses=problems(404, 409, 422),
)
def get_recording_summary(recording_id: RecordingId, service: Service) -> RecordingView:
    """Return scenario, duration and mean current, as POST /v1/recordings did."""
    return RecordingView.from_walk(recording_id, service.recording(recording_id))


def _stored(
    walk: RecordedWalk, service: JobService, response: Response, actor: str
) -> RecordingView:
    recording_id = service.record(walk, actor=actor)
    response.headers["Location"] = f"{PREFIX}/recordings/{recording_id}"
    return RecordingView.from_walk(recording_id, walk)
