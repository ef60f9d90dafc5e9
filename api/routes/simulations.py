"""One design walking on request."""

from __future__ import annotations

from functools import partial

from fastapi import APIRouter, Response

from api.context import Context
from api.limits import check_length, computed
from api.openapi import problems
from gaitswarm.requests.walk import SimulationRequest, run_simulation
from gaitswarm.views import PREFIX, SimulationView

router = APIRouter(prefix=f"{PREFIX}/simulations", tags=["simulations"])


@router.post(
    "",
    operation_id="simulate",
    summary="Simulate one design",
    response_model=SimulationView,
    responses=problems(400, 413, 422),
)
async def simulate_design(request: SimulationRequest, context: Context) -> Response:
    """Let one design walk in the chosen scenarios and say what it is worth.

    Nothing is stored. The answer waits for the walks, so the time walked is limited; a search
    belongs in a job.
    """
    seconds = request.simulated_seconds(request.resolved_scenarios())
    check_length(context.settings, seconds, logged=request.log, field="scenarios")
    body = await computed(context, partial(_simulated, request))
    return Response(body, media_type="application/json")


def _simulated(request: SimulationRequest) -> str:
    """Serialized in the worker thread: a log has hundreds of thousands of numbers."""
    return run_simulation(request).model_dump_json()
