"""The history of a job: iterations, evaluations, the best design, exports, evidence."""

from __future__ import annotations

from functools import partial
from typing import Annotated

from fastapi import APIRouter, Path, Query, Response
from fastapi.responses import StreamingResponse
from pydantic_core import to_json

from gaitswarm.api.dependencies import (
    LARGEST_INDEX,
    AfterIteration,
    Analyzing,
    Computing,
    ExistingJob,
    JobId,
    ServerSettings,
    Service,
)
from gaitswarm.api.documentation import binary, problems
from gaitswarm.api.responses import json_response
from gaitswarm.evidence.contents import evidence
from gaitswarm.evidence.history import run_verification
from gaitswarm.services.optimizer.errors import InvalidRequest, NotFound
from gaitswarm.settings import Settings
from gaitswarm.tables import MEDIA_TYPES, TableFormat, encoded_table
from gaitswarm.views import (
    PREFIX,
    BestView,
    CatalogueView,
    EvaluationView,
    IterationView,
    PageView,
    encoded_evaluations,
    encoded_iterations,
)
from gaitswarm.views.verification import HistoryVerificationView, VerificationRequest
from gaitswarm.zip_archive import MEDIA_TYPE as ZIP

router = APIRouter(prefix=f"{PREFIX}/jobs/{{job_id}}", tags=["history"])


@router.get(
    "/iterations",
    operation_id="list_iterations",
    summary="List committed iterations",
    response_model=PageView[IterationView],
    responses=problems(404, 422),
)
def list_iterations(
    job_id: JobId,
    service: Service,
    after: AfterIteration = None,
    limit: Annotated[int, Query(ge=1, le=1000, description="Maximum number of iterations.")] = 100,
) -> Response:
    """Return a page of iterations with statistics of their fitness, for convergence plots."""
    page = service.iterations(job_id, after=after, limit=limit)
    items = b",".join(encoded_iterations(page.items))
    body = b'{"items":[' + items + b'],"next":' + to_json(page.next) + b"}"
    return Response(body, media_type="application/json")


@router.get(
    "/iterations/{iteration}/evaluations",
    operation_id="list_evaluations",
    summary="List the evaluations of an iteration",
    response_model=CatalogueView[EvaluationView],
    responses=problems(404, 409, 422),
)
def list_evaluations(
    job: ExistingJob,
    service: Service,
    iteration: Annotated[
        int, Path(ge=0, le=LARGEST_INDEX, description="Index of a committed iteration, from 0.")
    ],
) -> Response:
    """Return every design with its values, its fitness, and its results in each scenario.

    Objectives are raw; utilities follow from them and the job's preference.
    """
    body = encoded_evaluations(service.evaluations(job.id, iteration), job.spec)
    return Response(body, media_type="application/json")


@router.get(
    "/best",
    operation_id="get_best",
    summary="Get the best design",
    responses=problems(404, 409, 422),
)
def get_best(job: ExistingJob, service: Service) -> BestView:
    """Return the design of least fitness so far, with its results in every scenario.

    404 while no design is feasible in every scenario.
    """
    best = service.best(job.id)
    if best is None:
        raise NotFound(
            f"job {job.id} has no feasible design yet; try again after its next iteration, or see"
            " the statuses of its evaluations"
        )
    return BestView.from_evaluation(best, job.spec)


@router.get(
    "/export",
    operation_id="export_job",
    summary="Download all evaluations",
    response_class=StreamingResponse,
    responses=binary("The table, as a file.", *MEDIA_TYPES.values()) | problems(404, 409, 422),
)
def export_job(
    job: ExistingJob,
    service: Service,
    file_format: Annotated[
        TableFormat, Query(alias="format", description="Format of the file.")
    ] = "csv",
) -> StreamingResponse:
    """Return one row per design: iteration, particle, fitness, `design.<variable>`, and for every
    scenario `<scenario>.status`, `<scenario>.utility` and `<scenario>.<objective>`. Floats are
    exact.
    """
    return StreamingResponse(
        encoded_table(file_format, job.spec, service.column_pieces(job)),
        media_type=MEDIA_TYPES[file_format],
        headers={"Content-Disposition": f'attachment; filename="{job.id}.{file_format}"'},
    )


@router.post(
    "/verify",
    operation_id="verify_history",
    summary="Verify the stored history",
    response_model=HistoryVerificationView,
    responses=problems(400, 404, 409, 413, 422, 503),
)
async def verify_history(
    request: VerificationRequest,
    job: ExistingJob,
    service: Service,
    settings: ServerSettings,
    computing: Computing,
) -> Response:
    """Recompute the digests of a job's iterations and report the first that differs.

    With `head`, report whether a digest noted earlier is among them. With `replay`, simulate that
    number of evaluations again and compare every bit; their simulated time is limited.
    """
    check = partial(_check_length, settings)
    return await computing.run(
        lambda: json_response(run_verification(service, job.id, request, check=check))
    )


def _check_length(settings: Settings, seconds: float) -> None:
    limit = settings.api_max_sampled_seconds
    if seconds > limit:
        raise InvalidRequest(
            f"the simulations of these evaluations last {seconds:g} s in total, more than the"
            f" {limit:g} s allowed; choose fewer",
            field="replay",
        )


@router.get(
    "/evidence",
    dependencies=[Analyzing],
    operation_id="get_evidence",
    summary="Download evidence",
    response_class=Response,
    responses=binary("The archive.", ZIP) | problems(404, 409, 422),
)
def get_evidence(job: ExistingJob, service: Service) -> Response:
    """Return an archive that documents the run: spec, robot, provenance, every evaluation, finished
    certificates of its designs, figures, and a page for offline use. `gaitswarm verify` checks it
    anywhere. 409 before the first iteration.
    """
    return Response(
        evidence(service, job.id),
        media_type=ZIP,
        headers={"Content-Disposition": f'attachment; filename="{job.id}.zip"'},
    )
