"""How much one client may let walk at once."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from anyio.to_thread import run_sync

from api.context import ApiContext
from gaitswarm.settings import Settings
from services.optimizer.errors import EvaluatorUnavailable, InvalidRequest

T = TypeVar("T")


async def computed(context: ApiContext, work: Callable[[], T]) -> T:
    """The result of `work` in a thread, of which only so many compute at the same time.

    Raises EvaluatorUnavailable if too many are waiting already.
    """
    slots = context.simulation_slots()
    waiting = slots.statistics().tasks_waiting
    if slots.available_tokens == 0 and waiting >= context.settings.api_simulation_queue:
        raise EvaluatorUnavailable("too many simulations are waiting; try again in a few seconds")
    return await run_sync(work, limiter=slots)


def check_length(settings: Settings, seconds: float, *, logged: bool, field: str) -> None:
    """Raise InvalidRequest of `field` for walks that last too long together [s]."""
    limit = settings.api_max_logged_seconds if logged else settings.api_max_simulated_seconds
    if seconds > limit:
        raise InvalidRequest(
            f"the walks last {seconds:g} s together, more than the {limit:g} s allowed"
            f"{' with logs' if logged else ''}; choose fewer scenarios or cycles",
            field=field,
        )
