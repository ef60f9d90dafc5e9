"""What a job would cost."""

from __future__ import annotations

from functools import partial

from fastapi import APIRouter

from api.context import Context
from api.limits import computed
from api.openapi import problems
from gaitswarm.views import PREFIX, EstimateView
from services.optimizer.jobs.documents import AnySpec

router = APIRouter(prefix=f"{PREFIX}/estimates", tags=["jobs"])


@router.post(
    "",
    operation_id="estimate_job",
    summary="Estimate a job",
    responses=problems(400, 413, 422),
)
async def estimate_job(spec: AnySpec, context: Context) -> EstimateView:
    """Check a job as submitting it would, and say what it would cost. Nothing is stored.

    The time is by the rate of earlier jobs with the same robot and controller; without one, a short
    walk is measured on the server, for which it may have to compile the robot's kernel first.
    """
    return EstimateView.from_estimate(
        await computed(context, partial(context.service.estimate, spec))
    )
