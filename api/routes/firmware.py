"""A design as C for a microcontroller: the files as an archive, and what they take."""

from __future__ import annotations

import hashlib
from functools import partial
from typing import Annotated, Final

from fastapi import APIRouter, Depends, Header, Query, Response, status

from gaitswarm.api.bodies import validated
from gaitswarm.api.dependencies import ExistingJob, ServerSettings, Service, Slots, check_length
from gaitswarm.api.documentation import Responses, binary, problems
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
        description="Bits of a fuzzy table's indices, of angle error and current, in place of"
        " 10x6; the walks are by this table.",
        examples=["8x6"],
    ),
]

IfNoneMatch = Annotated[
    str | None,
    Header(description="`ETag` of an archive received before; 304 if it is still the same."),
]

_NOT_MODIFIED: Final[Responses] = {
    status.HTTP_304_NOT_MODIFIED: {"description": "The archive is that of `If-None-Match`."}
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
    slots: Slots,
    table_bits: TableBits = None,
    if_none_match: IfNoneMatch = None,
) -> Response:
    """The best design of a job that tunes a drive as C99 for a leg's microcontroller, with the
    job's scenarios: the files of the folder that `gaitswarm firmware` writes, the same bytes every
    time. Unpack it and run `make test`.

    The answer waits for a walk in every scenario, whose time is limited as that of simulations.
    404 while no design has walked in every scenario.
    """
    content = await slots.run(lambda: _archive(_of_best(service, job, settings, table_bits)))
    return _download(content, f"{job.id}-firmware.zip", if_none_match)


@router.get(
    "/jobs/{job_id}/firmware/summary",
    tags=["history"],
    operation_id="get_firmware_summary",
    summary="See what the best design's firmware takes",
    responses=problems(404, 409, 422),
)
async def get_firmware_summary(
    job: ExistingJob,
    service: Service,
    settings: ServerSettings,
    slots: Slots,
    table_bits: TableBits = None,
) -> FirmwareView:
    """Files with their sizes, tables, trajectories by scenario, and flash and RAM against those of
    the thesis's microcontroller, as `gaitswarm firmware --json` prints; nothing is written.
    """
    return await slots.run(lambda: _summary(_of_best(service, job, settings, table_bits)))


@router.post(
    "/firmware",
    tags=["simulations"],
    operation_id="write_firmware",
    summary="Write one design as firmware",
    response_class=Response,
    responses=binary("The folder, as an archive.", MEDIA_TYPE) | problems(400, 413, 422),
)
async def write_firmware(request: FirmwareBody, settings: ServerSettings, slots: Slots) -> Response:
    """Any design as C99 for a leg's microcontroller, with a test that repeats its walks.

    Nothing is stored. The answer waits for the walks, whose time is limited as that of simulations.
    """
    _check_length(settings, request)
    content = await slots.run(partial(_archive, request))
    return _download(content, "firmware.zip", None)


@router.post(
    "/firmware/summary",
    tags=["simulations"],
    operation_id="summarize_firmware",
    summary="See what a design's firmware takes",
    responses=problems(400, 413, 422),
)
async def summarize_firmware(
    request: FirmwareBody, settings: ServerSettings, slots: Slots
) -> FirmwareView:
    """Files with their sizes, tables, trajectories by scenario, and flash and RAM against those of
    the thesis's microcontroller; nothing is stored.
    """
    _check_length(settings, request)
    return await slots.run(partial(_summary, request))


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
    """received: the request's `If-None-Match`."""
    tag = f'"{hashlib.sha256(content).hexdigest()}"'
    headers = {"ETag": tag}
    if received is not None and tag in received:
        return Response(status_code=status.HTTP_304_NOT_MODIFIED, headers=headers)
    headers["Content-Disposition"] = f'attachment; filename="{name}"'
    return Response(content, media_type=MEDIA_TYPE, headers=headers)
