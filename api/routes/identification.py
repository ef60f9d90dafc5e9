"""Recorded walks, and which parameters fitted to them can be trusted."""

from __future__ import annotations

from functools import partial
from typing import Annotated, Final

from anyio.to_thread import run_sync
from fastapi import APIRouter, Depends, Path, Query, Response, status

from gaitswarm.api.access import Actor, may_submit
from gaitswarm.api.bodies import validated
from gaitswarm.api.dependencies import (
    Analysing,
    ExistingJob,
    JobIdText,
    ServerSettings,
    Service,
    Slots,
    check_length,
)
from gaitswarm.api.documentation import problems
from gaitswarm.requests.identification import MeasuredWalkRequest, read_measured_walk
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.sim.identification.recorded_walk import RecordedWalk
from gaitswarm.views import PREFIX, PageView
from gaitswarm.views.identification import (
    IdentifiabilityView,
    MeasuredWalkView,
    RecordingEntryView,
    RecordingView,
)

RecordingBody = Annotated[RecordedWalk, Depends(validated(RecordedWalk, "walk"))]

MeasuredWalkBody = Annotated[
    MeasuredWalkRequest, Depends(validated(MeasuredWalkRequest, "request"))
]

MEASURED: Final = f"{PREFIX}/measured-walks"
"""The path whose bodies hold a measured log, and may be as large as one."""

RecordingId = Annotated[
    str, Path(pattern=r"^[0-9a-f]{32}$", description="Id, as POST /v1/recordings answered it.")
]

router = APIRouter(prefix=PREFIX)


@router.post(
    "/recordings",
    tags=["recordings"],
    operation_id="add_recording",
    summary="Keep a recorded walk",
    status_code=status.HTTP_201_CREATED,
    dependencies=[Depends(may_submit)],
    responses=problems(400, 403, 413, 422),
)
def add_recording(
    walk: RecordingBody, service: Service, response: Response, actor: Actor
) -> RecordingView:
    """Motor currents of a measured walk, for jobs of kind `identification`.

    The id is the content's hash: the same walk again is the same recording. `gaitswarm record` and
    POST /v1/measured-walks make one of a measured log.
    """
    return _kept(walk, service, response, actor)


@router.get(
    "/recordings",
    tags=["recordings"],
    operation_id="list_recordings",
    summary="List recorded walks",
    responses=problems(422),
)
def list_recordings(
    service: Service,
    search: Annotated[
        str,
        Query(
            max_length=200,
            description="Only recordings whose id, scenario or controller contain this, whatever"
            " its case.",
        ),
    ] = "",
    after: Annotated[
        str | None, Query(max_length=200, description="`next` of the page before.")
    ] = None,
    limit: Annotated[int, Query(ge=1, le=200, description="Most recordings on a page.")] = 50,
) -> PageView[RecordingEntryView]:
    """Recordings without their numbers, the newest first. Later ones do not shift later pages.

    Whoever may read sees all of them, as with jobs.
    """
    page = service.recordings(search=search, after=after, limit=limit)
    return PageView(items=[RecordingEntryView.from_entry(e) for e in page.items], next=page.next)


@router.post(
    MEASURED.removeprefix(PREFIX),
    tags=["recordings"],
    operation_id="record_measured_walk",
    summary="Read a measured log and keep its walk",
    status_code=status.HTTP_201_CREATED,
    dependencies=[Depends(may_submit)],
    responses=problems(400, 403, 413, 422),
)
async def record_measured_walk(
    request: MeasuredWalkBody,
    service: Service,
    settings: ServerSettings,
    slots: Slots,
    response: Response,
    actor: Actor,
) -> MeasuredWalkView:
    """Read a log as the robot's instruments wrote it, and make a recording of it.

    The walk that was measured is simulated, and the lag between the two found; the recording has
    the measured currents of the whole cycles that they share. The log itself is not kept. Bodies
    may be larger here than elsewhere (GAITSWARM_API_MAX_LOG_BYTES).
    """
    seconds = request.simulated_seconds([request.walk_scenario])
    check_length(settings, seconds, logged=True, field="scenario")
    read = await slots.run(partial(read_measured_walk, request))
    kept = await run_sync(_kept, read.walk, service, response, actor)
    return MeasuredWalkView.from_log(kept, read.log, read.pair)


@router.get(
    "/recordings/{recording_id}",
    tags=["recordings"],
    operation_id="get_recording",
    summary="Look at a recorded walk",
    responses=problems(404, 409, 422),
)
def get_recording(recording_id: RecordingId, service: Service) -> RecordedWalk:
    """The whole recording, as it was given."""
    return service.recording(recording_id)


@router.get(
    "/recordings/{recording_id}/summary",
    tags=["recordings"],
    operation_id="get_recording_summary",
    summary="Look at a recorded walk without its numbers",
    responses=problems(404, 409, 422),
)
def get_recording_summary(recording_id: RecordingId, service: Service) -> RecordingView:
    """What was walked, how long, and the mean current; the answer that the recording got."""
    return RecordingView.from_walk(recording_id, service.recording(recording_id))


def _kept(walk: RecordedWalk, service: JobService, response: Response, actor: str) -> RecordingView:
    """Stored, with its path in the answer."""
    recording_id = service.record(walk, actor=actor)
    response.headers["Location"] = f"{PREFIX}/recordings/{recording_id}"
    return RecordingView.from_walk(recording_id, walk)


@router.get(
    "/jobs/{job_id}/parameters",
    tags=["analysis"],
    dependencies=[Analysing],
    operation_id="get_parameters",
    summary="See which parameters can be trusted",
    responses=problems(404, 409, 422),
)
def get_parameters(
    job: ExistingJob,
    service: Service,
    also: Annotated[
        list[JobIdText] | None,
        Query(max_length=31, description="Further runs of the same problem, of other seeds."),
    ] = None,
) -> IdentifiabilityView:
    """The interval of every variable among designs within twelve thresholds of the best.

    For jobs of kind `identification` above all. A single run always narrows down; only runs of
    different seeds that narrow down to the same values show that a parameter can be trusted.
    """
    jobs = [job, *(service.job(other) for other in also or ())]
    return IdentifiabilityView.from_identifiability(
        [j.id for j in jobs], service.identifiability(jobs)
    )
