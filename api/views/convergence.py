"""Which fitted parameters can be trusted, as people and programs see it."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from api.views.base import View
from services.optimizer.convergence import THRESHOLDS, Convergence, ParameterConvergence


class IntervalView(View):
    """Values of a parameter among designs within a threshold, in the parameter's unit."""

    low: float = Field(description="Least of them.", examples=[10.9])
    high: float = Field(description="Greatest of them.", examples=[11.3])


class ParameterView(View):
    """One parameter over all runs."""

    name: str = Field(description="Name of the variable.", examples=["battery_voltage"])
    unit: str = Field(description="Its unit.", examples=["V"])
    low: float = Field(description="Lower bound of the search.", examples=[8.0])
    high: float = Field(description="Upper bound of the search.", examples=[13.0])
    best: float = Field(description="Value in the best design of all runs.", examples=[11.1])
    bests: list[float] = Field(
        description="Value in each run's best design.", examples=[[11.1, 11.2, 11.0]]
    )
    intervals: list[IntervalView] = Field(
        description="One for each of `thresholds`, over all runs."
    )
    trust: Literal["trusted", "rough", "unknown"] | None = Field(
        description="How far the runs agree at the threshold of 5 %: within 15 %, within 35 %, or"
        " not within 35 % of the range that was searched; null for a single run, which cannot"
        " tell.",
        examples=["trusted"],
    )
    explanation: str | None = Field(
        description="The same in a sentence.",
        examples=["all runs agree on a small part of the range"],
    )

    @classmethod
    def from_parameter(cls, found: ParameterConvergence) -> ParameterView:
        """As the optimizer's service finds it."""
        trust = found.trust
        return cls(
            name=found.variable.name,
            unit=found.variable.unit,
            low=found.variable.low,
            high=found.variable.high,
            best=found.best,
            bests=list(found.bests),
            intervals=[IntervalView(low=low, high=high) for low, high in found.intervals],
            trust=None if trust is None else trust.value,
            explanation=None if trust is None else trust.phrase,
        )


class ConvergenceView(View):
    """How runs of one problem, that differ in their seed, converge (thesis fig. 2.14)."""

    jobs: list[str] = Field(description="The runs.", examples=[["k2q7zr5dm9xw"]])
    fitness: list[float] = Field(description="Each run's least fitness.", examples=[[0.0312]])
    thresholds: list[float] = Field(
        description="Distances from a run's best fitness, as shares of it [1].",
        examples=[list(THRESHOLDS)],
    )
    designs: list[int] = Field(
        description="Number of designs of all runs within each of them [1].",
        examples=[[3214, 2851, 2617]],
    )
    parameters: list[ParameterView] = Field(description="Every variable that was searched.")

    @classmethod
    def from_convergence(cls, jobs: list[str], found: Convergence) -> ConvergenceView:
        """jobs: ids of the runs, in order."""
        return cls(
            jobs=jobs,
            fitness=list(found.fitness),
            thresholds=list(THRESHOLDS),
            designs=list(found.designs),
            parameters=[ParameterView.from_parameter(p) for p in found.parameters],
        )
