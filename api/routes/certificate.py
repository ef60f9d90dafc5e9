"""What a design comes to in many worlds."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query

from gaitswarm.api.dependencies import Analysing, ExistingJob, Service
from gaitswarm.api.documentation import problems
from gaitswarm.requests.analysis import run_certificate
from gaitswarm.services.optimizer.analysis.certificate import MOST_WORST
from gaitswarm.views import PREFIX
from gaitswarm.views.certificate import CertificateView

router = APIRouter(prefix=PREFIX)


@router.get(
    "/jobs/{job_id}/certificate",
    tags=["analysis"],
    dependencies=[Analysing],
    operation_id="get_certificate",
    summary="See what a design comes to in many worlds",
    responses=problems(404, 409, 422),
)
def get_certificate(
    job: ExistingJob,
    service: Service,
    worlds: Annotated[
        int | None, Query(ge=1, le=1_000_000, description="Worlds to take, the first ones.")
    ] = None,
    most: Annotated[int, Query(ge=0, le=MOST_WORST, description="Worst worlds to name.")] = 5,
) -> CertificateView:
    """How often the design of a job of kind `certificate` fails, how bad it gets, and where.

    From the worlds that have walked so far. `replay` of a world is a command; its `values` do
    the same in POST /v1/replays, as `world`.
    """
    return run_certificate(service, job.id, worlds=worlds, most=most)
