"""What a job will cost."""

from __future__ import annotations

from pydantic import Field

from api.views.base import View
from services.optimizer.cost import Cost


class CostView(View):
    """What a job would cost if it were submitted."""

    evaluations: int = Field(description="Designs that are judged [1].", examples=[625])
    walks: int = Field(description="Each design in each scenario [1].", examples=[3750])
    simulated_seconds: float = Field(
        description="Length of all walks together [s]; less for designs that fall.",
        examples=[20250.0],
    )
    seconds: float | None = Field(
        description="How long it will take, once it runs and has the machine for itself [s]; null"
        " if that is unknown.",
        examples=[21.5],
    )
    basis: str = Field(
        description="What that is derived from.",
        examples=["the rate of 2 earlier jobs with the same kind of walks: 942 simulated s/s"],
    )

    @classmethod
    def from_cost(cls, cost: Cost) -> CostView:
        """As the service estimates it."""
        return cls(
            evaluations=cost.evaluations,
            walks=cost.walks,
            simulated_seconds=cost.simulated_seconds,
            seconds=cost.seconds,
            basis=cost.basis,
        )
