"""What happens to a job while it runs."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query

from gaitswarm.api.dependencies import JobActivities, JobId, Service
from gaitswarm.api.documentation import problems
from gaitswarm.views import PREFIX
from gaitswarm.views.operations import ActivityView, Level

router = APIRouter(prefix=PREFIX, tags=["jobs"])


@router.get(
    "/jobs/{job_id}/activity",
    operation_id="get_activity",
    summary="See what workers do for a job",
    responses=problems(404, 422),
)
def get_activity(
    job_id: JobId,
    service: Service,
    activities: JobActivities,
    level: Annotated[Level, Query(description="Messages that are less grave are left out.")] = (
        "INFO"
    ),
) -> ActivityView:
    """The last iterations and tasks by worker, the workers' health and the log of a job, as far as
    the process that answers has run it. Kept in its memory and bounded; `reason` says why there is
    nothing, if so.
    """
    service.job(job_id)
    known = None if activities is None else activities.of(job_id)
    return ActivityView.from_activity(job_id, known, level, runs_jobs=activities is not None)
