"""Recorded walks, to which parameters of a robot are fitted."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path, Response, status

from api.context import Service
from api.openapi import problems
from gaitswarm.views import PREFIX
from gaitswarm.views.identification import RecordingView
from sim.identification.recorded_walk import RecordedWalk

router = APIRouter(prefix=f"{PREFIX}/recordings", tags=["recordings"])


@router.post(
    "",
    operation_id="add_recording",
    summary="Keep a recorded walk",
    status_code=status.HTTP_201_CREATED,
    responses=problems(400, 413, 422),
)
def add_recording(walk: RecordedWalk, service: Service, response: Response) -> RecordingView:
    """Motor currents of a measured walk, for jobs of kind `identification`.

    The id is the content's hash: the same walk again is the same recording. `gaitswarm record`
    makes one of a measured log.
    """
    recording_id = service.record(walk)
    response.headers["Location"] = f"{PREFIX}/recordings/{recording_id}"
    return RecordingView.from_walk(recording_id, walk)


@router.get(
    "/{recording_id}",
    operation_id="get_recording",
    summary="Look at a recorded walk",
    responses=problems(404, 422),
)
def get_recording(
    recording_id: Annotated[
        str,
        Path(pattern=r"^[0-9a-f]{32}$", description="Id, as POST /v1/recordings answered it."),
    ],
    service: Service,
) -> RecordedWalk:
    """The whole recording, as it was given."""
    return service.recording(recording_id)
