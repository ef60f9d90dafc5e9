"""How near calibrations come to their targets."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query

from gaitswarm.api.dependencies import Analysing, ExistingJob, JobIdText, Service
from gaitswarm.api.documentation import problems
from gaitswarm.requests.identification import run_targets
from gaitswarm.services.optimizer.analysis.targets import LeaveOut
from gaitswarm.views import PREFIX
from gaitswarm.views.calibration import TargetsView

router = APIRouter(prefix=PREFIX)


@router.get(
    "/jobs/{job_id}/targets",
    tags=["analysis"],
    dependencies=[Analysing],
    operation_id="get_targets",
    summary="See how near a calibration comes to its targets",
    responses=problems(404, 409, 422),
)
def get_targets(
    job: ExistingJob,
    service: Service,
    also: Annotated[
        list[JobIdText] | None,
        Query(max_length=31, description="Further runs of the same problem, of other seeds."),
    ] = None,
    leave_out: Annotated[
        LeaveOut | None,
        Query(
            description="Predict every target by the design that is best without it: without the"
            " `target` alone, or without all targets of its `walk`. Nothing is simulated."
        ),
    ] = None,
) -> TargetsView:
    """What the best design of all runs comes to in every target of a job of kind `calibration`.

    Differences are counted in tolerances. What each choice of a categorical variable comes to at
    best is told by `/parameters`.
    """
    return run_targets(service, [job.id, *(also or ())], leave_out)
