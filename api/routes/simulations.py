"""Simulations of single designs on request: results, robustness, replays."""

from __future__ import annotations

from functools import partial
from typing import Annotated

from fastapi import APIRouter, Depends, Response

from gaitswarm.api.bodies import validated
from gaitswarm.api.dependencies import (
    Computing,
    ServerSettings,
    check_length,
    check_sampled_length,
)
from gaitswarm.api.documentation import binary, problems
from gaitswarm.api.responses import NOT_STORED, BinaryResponse, json_response
from gaitswarm.requests.design import resolved
from gaitswarm.requests.robustness import RobustnessRequest, run_robustness
from gaitswarm.requests.simulations import (
    ReplayRequest,
    SimulationRequest,
    run_replay,
    run_simulation,
)
from gaitswarm.views import PREFIX, SimulationView
from gaitswarm.views.robustness import RobustnessView

router = APIRouter(prefix=PREFIX, tags=["simulations"])

SimulationBody = Annotated[SimulationRequest, Depends(validated(SimulationRequest, "request"))]
RobustnessBody = Annotated[RobustnessRequest, Depends(validated(RobustnessRequest, "request"))]
ReplayBody = Annotated[ReplayRequest, Depends(validated(ReplayRequest, "request"))]


@router.post(
    "/simulations",
    operation_id="simulate",
    summary="Simulate one design",
    response_model=SimulationView,
    responses=problems(400, 413, 422),
)
async def simulate_design(
    request: SimulationBody, settings: ServerSettings, computing: Computing
) -> Response:
    """Simulate one design in the given scenarios and return objectives, utilities and fitness.

    Nothing is stored. The simulated time is limited, as the response waits for the simulations;
    use a job to search.
    """
    seconds = request.simulated_seconds(request.resolved_scenarios())
    check_length(settings, seconds, logged=request.log, field="scenarios")
    # Serialized in the thread: a log has hundreds of thousands of numbers.
    return await computing.run(lambda: json_response(run_simulation(request)))


@router.post(
    "/robustness",
    operation_id="estimate_robustness",
    summary="Estimate the robustness of one design",
    response_model=RobustnessView,
    responses=problems(400, 413, 422),
)
async def estimate_robustness(
    request: RobustnessBody, settings: ServerSettings, computing: Computing
) -> Response:
    """Simulate a design and others around it, and estimate the norm of the Jacobian of the
    objectives with respect to the variables, both normalized (thesis 4.4.3).

    Nothing is stored. The simulated time is limited, as the response waits for the simulations.
    """
    seconds = request.simulated_seconds(request.resolved_scenarios())
    check_sampled_length(settings, seconds * (1 + request.samples))
    return await computing.run(lambda: json_response(run_robustness(request)))


@router.post(
    "/replays",
    operation_id="replay",
    summary="Replay one simulation",
    response_class=BinaryResponse,
    responses=binary(
        "Length of the header in bytes (uint32), the header (JSON, a ReplayHeaderView, padded with"
        " spaces to a multiple of 4), then frame after frame of float32 numbers in the order of the"
        " header's channels; all little-endian."
    )
    | problems(400, 413, 422),
)
async def replay_walk(
    request: ReplayBody, settings: ServerSettings, computing: Computing
) -> Response:
    """Simulate one design in one scenario and return the pose of every link, frame by frame.

    A failed simulation is replayed up to its end, with its status in the header. Nothing is stored;
    the simulated time is limited as for simulations with logs.
    """
    seconds = request.simulated_seconds([resolved(request.scenario)])
    check_length(settings, seconds, logged=True, field="scenario")
    frames = await computing.run(partial(run_replay, request))
    return BinaryResponse(frames, headers=NOT_STORED)
