"""Recorded walks, and which parameters fitted to them can be trusted."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Depends, Path, Query, Response, status

from api.access import Actor, may_submit
from api.bodies import validated
from api.dependencies import Analysing, ExistingJob, JobIdText, Service
from api.documentation import problems
from gaitswarm.views import PREFIX
from gaitswarm.views.identification import IdentifiabilityView, RecordingView
from sim.identification.recorded_walk import RecordedWalk

RecordingBody = Annotated[RecordedWalk, Depends(validated(RecordedWalk, "walk"))]

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

    The id is the content's hash: the same walk again is the same recording. `gaitswarm record`
    makes one of a measured log.
    """
    recording_id = service.record(walk, actor=actor)
    response.headers["Location"] = f"{PREFIX}/recordings/{recording_id}"
    return RecordingView.from_walk(recording_id, walk)


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
