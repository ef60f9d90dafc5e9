"""One design walking on request."""

from __future__ import annotations

from functools import partial

from anyio.to_thread import run_sync
from fastapi import APIRouter, Response

from api.context import ApiContext, Context
from api.openapi import problems
from api.simulation import SimulationRequest, run_simulation
from api.views import PREFIX, SimulationView
from services.optimizer.errors import EvaluatorUnavailable, InvalidRequest

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
    _check_cost(request, context)
    slots = context.simulation_slots()
    waiting = slots.statistics().tasks_waiting
    if slots.available_tokens == 0 and waiting >= context.settings.simulation_queue:
        raise EvaluatorUnavailable("too many simulations are waiting; try again in a few seconds")
    body = await run_sync(partial(_simulated, request), limiter=slots)
    return Response(body, media_type="application/json")


def _simulated(request: SimulationRequest) -> str:
    """Serialized in the worker thread: a log has hundreds of thousands of numbers."""
    return run_simulation(request).model_dump_json()


def _check_cost(request: SimulationRequest, context: ApiContext) -> None:
    settings = context.settings
    limit = settings.max_logged_seconds if request.log else settings.max_simulated_seconds
    seconds = request.simulated_seconds()
    if seconds > limit:
        raise InvalidRequest(
            f"the walks last {seconds:g} s together, more than the {limit:g} s allowed"
            f"{' with logs' if request.log else ''}; choose fewer scenarios or cycles",
            field="scenarios",
        )
