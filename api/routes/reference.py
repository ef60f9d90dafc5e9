"""What a job's best is measured against."""

from __future__ import annotations

from functools import partial

from fastapi import APIRouter

from gaitswarm.api.dependencies import JobId, Service, Slots
from gaitswarm.api.documentation import problems
from gaitswarm.views import PREFIX
from gaitswarm.views.catalogue import JobReferenceView

router = APIRouter(prefix=PREFIX, tags=["analysis"])


@router.get(
    "/jobs/{job_id}/reference",
    operation_id="get_reference",
    summary="Compare a job's best with the published or the start design",
    responses=problems(404, 422),
)
async def get_reference(job_id: JobId, service: Service, slots: Slots) -> JobReferenceView:
    """The published design of the job's controller and preference, or of a robot of one's own the
    middle of the job's bounds, in the job's own walks, and by which share the best so far is
    better. It walks once, and is stored with the job; lists have it
    from then on.
    """
    found = await slots.run(partial(service.reference, job_id))
    return JobReferenceView.from_comparison(*found)
