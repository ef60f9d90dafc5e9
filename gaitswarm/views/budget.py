"""What a job would cost, and how much of its budget is spent."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from pydantic import Field

from gaitswarm.services.optimizer.jobs.estimate import Estimate
from gaitswarm.views.base import View


@dataclass(frozen=True, slots=True)
class Spent:
    """How much of a budget is spent. Its text is `12 of 25 iterations`.

    Attributes:
        done: Units that are committed.
        planned: Units of the whole budget.
        unit: `iterations` where each of them has as many designs as it may have; else `designs`,
            as there may be many more and smaller iterations than the budget names.
    """

    done: int
    planned: int
    unit: Literal["iterations", "designs"]

    def __str__(self) -> str:
        return f"{self.done} of {self.planned} {self.unit}"


def budget_spent(
    iterations: int,
    evaluations: int,
    *,
    particles: int,
    iterations_planned: int,
    evaluations_planned: int,
) -> Spent:
    """Say how much of a job's budget is spent."""
    whole = iterations <= iterations_planned and evaluations == iterations * particles
    if particles == 0 or whole:
        return Spent(iterations, iterations_planned, "iterations")
    return Spent(evaluations, evaluations_planned, "designs")


class EstimateView(View):
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
    def from_estimate(cls, estimate: Estimate) -> EstimateView:
        """Make a view of an estimate."""
        return cls(
            evaluations=estimate.evaluations,
            walks=estimate.walks,
            simulated_seconds=estimate.simulated_seconds,
            seconds=estimate.seconds,
            basis=estimate.basis,
        )
