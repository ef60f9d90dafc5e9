"""One design walking on request: what it is worth, how robust it is, and how it looks."""

from __future__ import annotations

from functools import partial
from typing import Annotated, Final

from fastapi import APIRouter, Depends, Response

from gaitswarm.api.bodies import validated
from gaitswarm.api.dependencies import ServerSettings, Slots, check_length, check_sampled_length
from gaitswarm.api.documentation import binary, problems
from gaitswarm.requests.design import resolved
from gaitswarm.requests.robustness import RobustnessRequest, run_robustness
from gaitswarm.requests.simulations import (
    ReplayRequest,
    SimulationRequest,
    run_replay,
    run_simulation,
)
from gaitswarm.views import PREFIX, SimulationView
from gaitswarm.views.base import MEDIA_TYPE
from gaitswarm.views.robustness import RobustnessView

router = APIRouter(prefix=PREFIX, tags=["simulations"])

SimulationBody = Annotated[SimulationRequest, Depends(validated(SimulationRequest, "request"))]
RobustnessBody = Annotated[RobustnessRequest, Depends(validated(RobustnessRequest, "request"))]
ReplayBody = Annotated[ReplayRequest, Depends(validated(ReplayRequest, "request"))]

NOT_STORED: Final = {"Cache-Control": "no-store"}


class BinaryResponse(Response):
    """Bytes, and documented as such."""

    media_type = MEDIA_TYPE


@router.post(
    "/simulations",
    operation_id="simulate",
    summary="Simulate one design",
    response_model=SimulationView,
    responses=problems(400, 413, 422),
)
async def simulate_design(
    request: SimulationBody, settings: ServerSettings, slots: Slots
) -> Response:
    """Let one design walk in the chosen scenarios and say what it is worth.

    Nothing is stored. The answer waits for the walks, so the time walked is limited; a search
    belongs in a job.
    """
    seconds = request.simulated_seconds(request.resolved_scenarios())
    check_length(settings, seconds, logged=request.log, field="scenarios")
    body = await slots.run(partial(_simulated, request))
    return Response(body, media_type="application/json")


@router.post(
    "/robustness",
    operation_id="estimate_robustness",
    summary="Estimate how robust one design is",
    response_model=RobustnessView,
    responses=problems(400, 413, 422),
)
async def estimate_robustness(
    request: RobustnessBody, settings: ServerSettings, slots: Slots
) -> Response:
    """Let a design and others around it walk, and estimate the norm of the Jacobian of the
    objectives with respect to the variables, both normalised (thesis 4.4.3).

    Nothing is stored. The answer waits for the walks, so the time walked is limited.
    """
    seconds = request.simulated_seconds(request.resolved_scenarios())
    check_sampled_length(settings, seconds * (1 + request.samples))
    body = await slots.run(lambda: run_robustness(request).model_dump_json())
    return Response(body, media_type="application/json")


@router.post(
    "/replays",
    operation_id="replay",
    summary="Replay one walk",
    response_class=BinaryResponse,
    responses=binary(
        "Length of the header in bytes (uint32), the header (JSON, a ReplayHeaderView, padded with"
        " spaces to a multiple of 4), then frame after frame of float32 numbers as the header's"
        " channels say; all little-endian."
    )
    | problems(400, 413, 422),
)
async def replay_walk(request: ReplayBody, settings: ServerSettings, slots: Slots) -> Response:
    """Let one design walk in one scenario, and get where every link was, frame by frame.

    A walk that failed is replayed up to its end, with its status in the header. Nothing is stored;
    the time walked is limited as for simulations with logs.
    """
    seconds = request.simulated_seconds([resolved(request.scenario)])
    check_length(settings, seconds, logged=True, field="scenario")
    frames = await slots.run(partial(run_replay, request))
    return BinaryResponse(frames, headers=NOT_STORED)


def _simulated(request: SimulationRequest) -> str:
    """Serialized in the worker thread: a log has hundreds of thousands of numbers."""
    return run_simulation(request).model_dump_json()
