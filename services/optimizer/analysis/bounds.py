"""Bounds at which a design lies, and wider ones that can be simulated"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, Literal

from pydantic import Field

from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.services.optimizer.views import View
from gaitswarm.sim.variables import Variable

End = Literal["low", "high"]

NEAR: Final = 0.01
"""Share of a variable's range within which a value lies at the bound [1]."""

_STEPS: Final = (0.5, 0.25, 0.1)
"""Shares of the range by which a bound may move; the first that can be simulated is used."""


class WidenedView(View):
    """Wider bounds for a variable whose best value lies at a bound."""

    low: float = Field(description="Lower bound, in the variable's unit.", examples=[500.0])
    high: float = Field(description="Upper bound.", examples=[14750.0])


def bound_at(variable: Variable, value: float) -> End | None:
    """Return the bound at which a value lies."""
    # Every value of a categorical variable, or of one of two integers, is at an end.
    span = variable.high - variable.low
    if variable.kind == "categorical" or (variable.kind == "integer" and span < 2):
        return None
    if value <= variable.low + NEAR * span:
        return "low"
    return "high" if value >= variable.high - NEAR * span else None


def with_wider_bounds(spec: JobSpec, variable: Variable, at: End) -> JobSpec | None:
    """Return a job with the widest bounds of a variable that can be simulated; None if none can."""
    for low, high in _wider(variable, at):
        wider = variable.model_copy(update={"low": low, "high": high})
        chosen = [wider if v.name == variable.name else v for v in spec.design_space().variables]
        widened = spec.model_copy(update={"variables": tuple(chosen)})
        try:
            widened.check_can_be_simulated()
        except InvalidRequest:
            continue
        return widened
    return None


def wider_bounds(spec: Spec, variable: Variable, at: End) -> WidenedView | None:
    """Return the widest bounds that can be simulated; None if none can."""
    widened = with_wider_bounds(spec, variable, at) if isinstance(spec, JobSpec) else None
    if widened is None:
        return None
    (found,) = (v for v in widened.design_space().variables if v.name == variable.name)
    return WidenedView(low=found.low, high=found.high)


def _wider(variable: Variable, at: End) -> Iterator[tuple[float, float]]:
    low, high = variable.low, variable.high
    for step in _STEPS:
        further = step * (high - low)
        if variable.kind == "integer":
            further = max(1.0, round(further))
        if at == "high":
            yield low, _rounded(variable, high + further)
        # Positive variables stay positive.
        elif low <= 0.0 or low - further > 0.0:
            yield _rounded(variable, low - further), high
    if at == "low" and low > 0.0 and variable.kind != "integer":
        yield _rounded(variable, 0.5 * low), high


def _rounded(variable: Variable, bound: float) -> float:
    """Round a bound to six digits."""
    return bound if variable.kind == "integer" else float(f"{bound:.6g}")
