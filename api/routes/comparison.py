"""Jobs beside each other."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Response

from gaitswarm.api.dependencies import Analysing, JobId, JobIdText, Service
from gaitswarm.api.documentation import problems
from gaitswarm.requests.comparison import MOST_JOBS, run_comparison, run_convergences
from gaitswarm.views import PREFIX
from gaitswarm.views.comparison import ConvergencesView, JobComparisonView

router = APIRouter(prefix=PREFIX, tags=["analysis"])


@router.get(
    "/jobs/{job_id}/comparison",
    dependencies=[Analysing],
    operation_id="compare_jobs",
    summary="Set jobs beside each other",
    response_model=JobComparisonView,
    responses=problems(404, 409, 422),
)
def compare_jobs(
    job_id: JobId,
    service: Service,
    also: Annotated[
        list[JobIdText] | None,
        Query(max_length=MOST_JOBS - 1, description="Further jobs, each once."),
    ] = None,
) -> Response:
    """How jobs converged by iterations, evaluations and time, how the fitness of their designs is
    distributed, and how their specs differ; from what is stored.
    """
    found = run_comparison(service, [job_id, *(also or ())])
    return Response(found.model_dump_json(), media_type="application/json")


@router.get(
    "/job-convergences",
    dependencies=[Analysing],
    operation_id="list_convergences",
    summary="See how jobs came to their best, shortly",
    responses=problems(422),
)
def list_convergences(
    service: Service,
    job: Annotated[
        list[JobIdText], Query(min_length=1, max_length=200, description="The jobs' identifiers.")
    ],
    points: Annotated[int, Query(ge=2, le=100, description="Iterations of each, at most.")] = 24,
) -> ConvergencesView:
    """For pictures of a word's size beside a list of jobs."""
    return run_convergences(service, job, points)
