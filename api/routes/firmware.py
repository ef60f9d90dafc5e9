"""Designs as C firmware for a microcontroller."""

from __future__ import annotations

from functools import partial
from typing import Annotated, Final

from fastapi import APIRouter, Depends, Header, Query, Response, status

from gaitswarm.api.bodies import validated
from gaitswarm.api.dependencies import (
    Computing,
    ExistingJob,
    ServerSettings,
    Service,
    check_length,
)
from gaitswarm.api.documentation import Responses, binary, problems
from gaitswarm.api.responses import tagged_response
from gaitswarm.requests.firmware import (
    FirmwareRequest,
    firmware_request_of_best,
    firmware_view,
    run_firmware,
)
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.settings import Settings
from gaitswarm.sim.firmware import parsed_table_bits
from gaitswarm.views import PREFIX, BestView
from gaitswarm.views.firmware import FirmwareView
from gaitswarm.zip_archive import MEDIA_TYPE, zipped

router = APIRouter(prefix=PREFIX)

FirmwareBody = Annotated[FirmwareRequest, Depends(validated(FirmwareRequest, "request"))]

TableBits = Annotated[
    str | None,
    Query(
        pattern=r"^[0-9]{1,2}x[0-9]{1,2}$",
        description="Bits of the indices of a fuzzy table, for angle error and current; default"
        " 10x6. The simulations use this table.",
        examples=["8x6"],
    ),
]

IfNoneMatch = Annotated[
    str | None, Header(description="`ETag` of a cached archive; 304 if it is unchanged.")
]

_NOT_MODIFIED: Final[Responses] = {
    status.HTTP_304_NOT_MODIFIED: {"description": "The archive matches `If-None-Match`."}
}


@router.get(
    "/jobs/{job_id}/firmware",
    tags=["history"],
    operation_id="get_firmware",
    summary="Download the best design as firmware",
    response_class=Response,
    responses=binary("The folder, as an archive.", MEDIA_TYPE)
    | _NOT_MODIFIED
    | problems(404, 409, 422),
)
async def get_firmware(
    job: ExistingJob,
    service: Service,
    settings: ServerSettings,
    computing: Computing,
    table_bits: TableBits = None,
    if_none_match: IfNoneMatch = None,
) -> Response:
    """Return the best design of a job that tunes a drive as C99 for a leg's microcontroller.

    The archive has the files of `gaitswarm firmware` and is identical every time; unpack it and run
    `make test`. The simulated time is limited, as the response waits for a simulation of every
    scenario. 404 while no design is feasible in every scenario.
    """
    content = await computing.run(lambda: _archive(_of_best(service, job, settings, table_bits)))
    return _download(content, f"{job.id}-firmware.zip", if_none_match)


@router.get(
    "/jobs/{job_id}/firmware/summary",
    tags=["history"],
    operation_id="get_firmware_summary",
    summary="Summarize the best design's firmware",
    responses=problems(404, 409, 422),
)
async def get_firmware_summary(
    job: ExistingJob,
    service: Service,
    settings: ServerSettings,
    computing: Computing,
    table_bits: TableBits = None,
) -> FirmwareView:
    """Return files with sizes, tables, trajectories by scenario, and flash and RAM compared with
    the thesis's microcontroller, as `gaitswarm firmware --json`.
    """
    return await computing.run(lambda: _summary(_of_best(service, job, settings, table_bits)))


@router.post(
    "/firmware",
    tags=["simulations"],
    operation_id="write_firmware",
    summary="Download one design as firmware",
    response_class=Response,
    responses=binary("The folder, as an archive.", MEDIA_TYPE) | problems(400, 413, 422),
)
async def write_firmware(
    request: FirmwareBody, settings: ServerSettings, computing: Computing
) -> Response:
    """Return any design as C99 for a leg's microcontroller, with a test of its simulations.

    Nothing is stored. The simulated time is limited, as the response waits for the simulations.
    """
    _check_length(settings, request)
    content = await computing.run(partial(_archive, request))
    return _download(content, "firmware.zip", None)


@router.post(
    "/firmware/summary",
    tags=["simulations"],
    operation_id="summarize_firmware",
    summary="Summarize a design's firmware",
    responses=problems(400, 413, 422),
)
async def summarize_firmware(
    request: FirmwareBody, settings: ServerSettings, computing: Computing
) -> FirmwareView:
    """Return files with sizes, tables, trajectories by scenario, and flash and RAM compared with
    the thesis's microcontroller. Nothing is stored.
    """
    _check_length(settings, request)
    return await computing.run(partial(_summary, request))


def _of_best(
    service: JobService, job: Job, settings: Settings, table_bits: str | None
) -> FirmwareRequest:
    best = service.best(job.id)
    view = None if best is None else BestView.from_evaluation(best, job.spec)
    bits = None if table_bits is None else parsed_table_bits(table_bits)
    request = firmware_request_of_best(job.id, job.spec, view, {"table_bits": bits})
    _check_length(settings, request)
    return request


def _check_length(settings: Settings, request: FirmwareRequest) -> None:
    check_length(settings, request.walked_seconds, logged=False, field="scenarios")


def _archive(request: FirmwareRequest) -> bytes:
    return zipped(run_firmware(request).files)


def _summary(request: FirmwareRequest) -> FirmwareView:
    return firmware_view(request, run_firmware(request))


def _download(content: bytes, name: str, received: str | None) -> Response:
    headers = {"Content-Disposition": f'attachment; filename="{name}"'}
    return tagged_response(content, MEDIA_TYPE, received, headers)
