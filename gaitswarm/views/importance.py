"""Which variables of a job matter, and whether its winner lies at a bound."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from gaitswarm.services.optimizer.analysis.interval import Interval
from gaitswarm.views.base import View


class IndexIntervalView(View):
    """A first-order Sobol' index [1] with its interval."""

    value: float = Field(
        description="Share of the variance of the output's rank that goes with this variable"
        " alone, 0 to 1.",
        examples=[0.41],
    )
    low: float = Field(description="Lower end of the interval of 95 %.", examples=[0.35])
    high: float = Field(description="Upper end.", examples=[0.47])

    @classmethod
    def from_interval(cls, interval: Interval) -> IndexIntervalView:
        """Make a view of an index."""
        return cls(value=interval.value, low=interval.low, high=interval.high)


class WidenedView(View):
    """Bounds with which a search goes on where the winner is held back."""

    low: float = Field(description="Lower bound, in the variable's unit.", examples=[500.0])
    high: float = Field(description="Upper bound.", examples=[14750.0])


class VariableImportanceView(View):
    """What one variable has to do with what designs came to."""

    name: str = Field(description="Name of the variable.", examples=["FI1R"])
    unit: str = Field(description="Its unit.", examples=["counts"])
    low: float = Field(description="Lower bound of the search.", examples=[1500.0])
    high: float = Field(description="Upper bound.", examples=[6000.0])
    fitness: IndexIntervalView | None = Field(
        description="Its index for the fitness, among designs that walk in every case; null where"
        " there are too few, or all are worth the same."
    )
    failing: IndexIntervalView | None = Field(
        description="Its index for whether a design fails, among all; null where none does, all"
        " do, or there are too few."
    )
    objectives: dict[str, IndexIntervalView | None] = Field(
        description="Its index for each objective over all scenarios, among designs that walk in"
        " every scenario; empty for a job that tunes no drive."
    )
    moved_with: str | None = Field(
        description="The variable whose values went with its own the most among all designs: what"
        " one of the two does, the other seems to do; null if there is none.",
        examples=["FI2R"],
    )
    correlation: float | None = Field(
        description="Spearman's rank correlation of the two [1].", examples=[0.62]
    )
    winner: float | None = Field(
        description="Its value in the job's best design, of a categorical variable the index of"
        " the choice; null without one.",
        examples=[5950.0],
    )
    at: Literal["low", "high"] | None = Field(
        description="The bound that the winner lies at, within a hundredth of the range; null for"
        " neither, and for a categorical variable.",
        examples=["high"],
    )
    widened: WidenedView | None = Field(
        description="Bounds beyond that one that can be simulated, half the range further or less;"
        " null where none is known: the winner is inside, the job tunes no drive, or the bound is"
        " one of the controller.",
    )


class ImportanceView(View):
    """Which variables of a job matter, from what it has stored; nothing is simulated.

    First-order Sobol' indices of the outputs' ranks among the designs that were tried: a search
    does not draw at random, so variables that moved together share their indices.
    """

    designs: int = Field(description="Designs that walk in every case [1].", examples=[613])
    failed: int = Field(description="Designs that do not [1].", examples=[12])
    sampled: int = Field(
        description="Designs that the indices are of, failed ones among them [1]; fewer than there"
        " are in a long job.",
        examples=[625],
    )
    objectives: list[str] = Field(
        description="Names of the objectives, in order; none for a job that tunes no drive.",
        examples=[["torque", "acceleration"]],
    )
    iteration: int | None = Field(
        description="Iteration of the best design, from 0; null without one.", examples=[24]
    )
    particle: int | None = Field(
        description="Number of the best design in its iteration, from 0.", examples=[7]
    )
    variables: list[VariableImportanceView] = Field(
        description="Those that were searched, in the job's order."
    )
