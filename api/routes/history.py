"""What a job has committed."""

from __future__ import annotations

from functools import partial
from typing import Annotated

from fastapi import APIRouter, Path, Query, Request, Response
from fastapi.responses import StreamingResponse

from gaitswarm.api.dependencies import (
    LARGEST_INDEX,
    AfterIteration,
    Analysing,
    ExistingJob,
    JobId,
    Remembered,
    ServerSettings,
    Service,
    Slots,
)
from gaitswarm.api.documentation import binary, problems
from gaitswarm.api.reads import Best, Evaluations, Iterations
from gaitswarm.evidence.contents import evidence
from gaitswarm.evidence.history import run_verification
from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.settings import Settings
from gaitswarm.tables import MEDIA_TYPES, TableFormat, encoded_table
from gaitswarm.views import (
    PREFIX,
    BestView,
    CatalogueView,
    EvaluationView,
    IterationView,
    PageView,
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
    request: Request,
    job_id: JobId,
    service: Service,
    remembered: Remembered,
    after: AfterIteration = None,
    limit: Annotated[int, Query(ge=1, le=1000, description="Most iterations on a page.")] = 100,
) -> Response:
    """Fitness of the designs, iteration by iteration, in pages; the data of a convergence plot."""
    asked = Iterations(after, limit)
    return asked.answer(remembered, service, service.job(job_id)).answer(request)


@router.get(
    "/iterations/{iteration}/evaluations",
    operation_id="list_evaluations",
    summary="List an iteration's evaluations",
    response_model=CatalogueView[EvaluationView],
    responses=problems(404, 409, 422),
)
def list_evaluations(
    request: Request,
    job_id: JobId,
    service: Service,
    remembered: Remembered,
    iteration: Annotated[
        int, Path(ge=0, le=LARGEST_INDEX, description="Index of a committed iteration, from 0.")
    ],
) -> Response:
    """Every design: its values, its fitness, and status, utility and raw objectives by scenario.

    Raw objectives are as simulated; utilities follow from them and the job's preference.
    """
    asked = Evaluations(iteration)
    return asked.answer(remembered, service, service.job(job_id)).answer(request)


@router.get(
    "/best",
    operation_id="get_best",
    summary="Take the best design",
    response_model=BestView,
    responses=problems(404, 409, 422),
)
def get_best(request: Request, job_id: JobId, service: Service, remembered: Remembered) -> Response:
    """The design of least fitness so far, with its results in every scenario.

    404 while no design has walked in every scenario.
    """
    return Best().answer(remembered, service, service.job(job_id)).answer(request)


@router.get(
    "/export",
    operation_id="export_job",
    summary="Download every evaluation",
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
    """One row per design: iteration, particle, fitness, `design.<variable>`, and for every scenario
    `<scenario>.status`, `<scenario>.utility` and `<scenario>.<objective>`; floats are exact.
    """
    return StreamingResponse(
        encoded_table(file_format, job.spec, service.column_pieces(job)),
        media_type=MEDIA_TYPES[file_format],
        headers={"Content-Disposition": f'attachment; filename="{job.id}.{file_format}"'},
    )


@router.post(
    "/verify",
    operation_id="verify_history",
    summary="Verify what is stored",
    response_model=HistoryVerificationView,
    responses=problems(400, 404, 409, 413, 422, 503),
)
async def verify_history(
    request: VerificationRequest,
    job: ExistingJob,
    service: Service,
    settings: ServerSettings,
    slots: Slots,
) -> Response:
    """Compute the digests of a job's iterations again, and name the first that is not the stored
    one; with `head`, say whether a digest that was noted down earlier is among them.

    With `replay` so many evaluations walk again, and are compared to the bit. The answer waits for
    these walks, so the time walked is limited.
    """
    check = partial(_check_length, settings)

    def found() -> Response:
        view = run_verification(service, job.id, request, check=check)
        return Response(view.model_dump_json(), media_type="application/json")

    return await slots.run(found)


def _check_length(settings: Settings, seconds: float) -> None:
    """Raises InvalidRequest."""
    limit = settings.api_max_sampled_seconds
    if seconds > limit:
        raise InvalidRequest(
            f"the walks of these evaluations last {seconds:g} s together, more than the {limit:g} s"
            " allowed; choose fewer",
            field="replay",
        )


@router.get(
    "/evidence",
    dependencies=[Analysing],
    operation_id="get_evidence",
    summary="Download evidence",
    response_class=Response,
    responses=binary("The archive.", ZIP) | problems(404, 409, 422),
)
def get_evidence(job: ExistingJob, service: Service) -> Response:
    """One file that proves the run: spec, robot, provenance, every evaluation, the finished
    certificates of its designs, pictures, and a page that opens offline; `gaitswarm verify` checks
    it anywhere. 409 before the first iteration.
    """
    return Response(
        evidence(service, job.id),
        media_type=ZIP,
        headers={"Content-Disposition": f'attachment; filename="{job.id}.zip"'},
    )
