"""What there is to look at: a walk again, and a controller's surfaces."""

from __future__ import annotations

from functools import partial
from typing import Annotated, Any, Final

from fastapi import APIRouter, Path, Response

from api.context import Context
from api.limits import check_length, computed
from api.openapi import problems
from gaitswarm.requests.replay import ReplayRequest, run_replay
from gaitswarm.requests.surface import SurfaceRequest, run_surface
from gaitswarm.requests.walk import resolved
from gaitswarm.views import PREFIX
from gaitswarm.views.surface import SurfaceView
from services.optimizer.errors import NotFound
from sim.controllers import CONTROLLERS, ControllerName

router = APIRouter(prefix=PREFIX)

_BINARY: Final = "application/octet-stream"
_NOT_STORED: Final = {"Cache-Control": "no-store"}

_REPLAY: Final[dict[int | str, dict[str, Any]]] = {
    200: {
        "description": "Length of the header in bytes (uint32), the header (JSON, a"
        " ReplayHeaderView, padded with spaces to a multiple of 4), then frame after frame of"
        " float32 numbers as the header's channels say; all little-endian.",
        "content": {_BINARY: {"schema": {"type": "string", "format": "binary"}}},
    }
}


class BinaryResponse(Response):
    """Bytes, and documented as such."""

    media_type = _BINARY


@router.post(
    "/replays",
    tags=["simulations"],
    operation_id="replay",
    summary="Replay one walk",
    response_class=BinaryResponse,
    responses=_REPLAY | problems(400, 413, 422),
)
async def replay_walk(request: ReplayRequest, context: Context) -> Response:
    """Let one design walk in one scenario, and get where every link was, frame by frame.

    A walk that failed is replayed up to its end, with its status in the header. Nothing is stored;
    the time walked is limited as for simulations with logs.
    """
    seconds = request.simulated_seconds([resolved(request.scenario)])
    check_length(context.settings, seconds, logged=True, field="scenario")
    frames = await computed(context, partial(run_replay, request))
    return BinaryResponse(frames, headers=_NOT_STORED)


@router.post(
    "/controllers/{controller}/surface",
    tags=["catalogue"],
    operation_id="controller_surface",
    summary="Get a fuzzy controller's surface",
    response_model=SurfaceView,
    responses=problems(400, 404, 413, 422),
)
async def controller_surface(
    controller: Annotated[
        str,
        Path(
            max_length=40,
            description="Name of a fuzzy controller; see /v1/controllers.",
            examples=["fuzzy-pi"],
        ),
    ],
    request: SurfaceRequest,
    context: Context,
) -> Response:
    """How a design answers to angle error and motor current: by its rules, and by its table.

    Sets and rules are those of the thesis; the table is what the microcontroller looks up in place
    of the inference.
    """
    if controller not in CONTROLLERS:
        raise NotFound(f"no controller {controller!r}; known are {', '.join(CONTROLLERS)}")
    body = await computed(context, partial(_surface, controller, request))
    return Response(body, media_type="application/json", headers=_NOT_STORED)


def _surface(controller: ControllerName, request: SurfaceRequest) -> str:
    """Serialized in the worker thread, as it has thousands of numbers."""
    return run_surface(controller, request).model_dump_json(by_alias=True)
