"""Which scenarios of a job matter."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from pydantic import Field

from gaitswarm.services.optimizer.analysis.interval import Interval
from gaitswarm.services.optimizer.analysis.robustness.scenario_families import (
    Family,
    LeftOut,
    ScenarioFamilies,
)
from gaitswarm.services.optimizer.jobs.columns import EvaluationColumns
from gaitswarm.views.base import View, finite


class LossView(View):
    """By how much a design is worse than the job's best, as a share [1]; null where it fails."""

    value: float | None = Field(description="The estimate.", examples=[0.012])
    low: float | None = Field(description="Lower end of the interval of 95 %.", examples=[0.0])
    high: float | None = Field(description="Upper end.", examples=[0.031])

    @classmethod
    def from_loss(cls, loss: Interval) -> LossView:
        """Make a view of a loss."""
        return cls(value=finite(loss.value), low=finite(loss.low), high=finite(loss.high))


class FamilyView(View):
    """Some of a job's scenarios, and the design that is best by them alone."""

    scenarios: list[str] = Field(
        description="Their names, in the job's order.", examples=[["normal-slow", "slope-fast"]]
    )
    correlation: float | None = Field(
        description="Spearman's rank correlation of the fitness over these and over all scenarios,"
        " among designs that walk in all [1]; null where it is undefined.",
        examples=[0.97],
    )
    iteration: int = Field(description="Iteration of the winner, from 0.", examples=[21])
    particle: int = Field(
        description="Number of the winner in its iteration, from 0.", examples=[4]
    )
    regret: LossView = Field(
        description="By how much the winner is worse than the job's best in the fitness over all"
        " scenarios."
    )

    @classmethod
    def from_family(
        cls, family: Family, names: Sequence[str], columns: EvaluationColumns
    ) -> FamilyView:
        """Make a view of a family."""
        return cls(
            scenarios=[names[index] for index in family.scenarios],
            correlation=family.correlation,
            iteration=int(columns.iteration[family.winner]),
            particle=int(columns.particle[family.winner]),
            regret=LossView.from_loss(family.regret),
        )


class LeftOutView(View):
    """What the job would have done without one of its scenarios."""

    scenario: str = Field(description="Name of the one.", examples=["loaded-fast"])
    family: FamilyView = Field(description="The others.")
    loss: LossView = Field(
        description="By how much the others' winner is worse than the job's best in the scenario"
        " that was left out; less than 0 if it is better."
    )
    similar: str | None = Field(
        description="The scenario whose utilities are most like it in rank; null if there is none.",
        examples=["loaded-slow"],
    )
    similarity: float | None = Field(
        description="Spearman's rank correlation of the two [1].", examples=[0.93]
    )

    @classmethod
    def from_left_out(
        cls, left: LeftOut, names: Sequence[str], columns: EvaluationColumns
    ) -> LeftOutView:
        """Make a view of one scenario's absence."""
        return cls(
            scenario=names[left.scenario],
            family=FamilyView.from_family(left.family, names, columns),
            loss=LossView.from_loss(left.loss),
            similar=None if left.similar is None else names[left.similar],
            similarity=left.similarity,
        )


class FamilySizeView(View):
    """Families of so many scenarios."""

    size: int = Field(description="Scenarios of each.", examples=[3])
    families: int = Field(description="How many were looked at.", examples=[20])
    median: float | None = Field(
        description="Median of their regrets [1]; null if the winners of half of them fail.",
        examples=[0.02],
    )
    worst: float | None = Field(
        description="Greatest of their regrets [1]; null if a winner fails.", examples=[0.21]
    )
    within: int = Field(
        description="Families whose regret is within the tolerance up to the upper end of its"
        " interval.",
        examples=[4],
    )


class ScenarioFamiliesView(View):
    """Which scenarios of a job matter, from what it has stored; nothing is simulated."""

    scenarios: list[str] = Field(description="Of the job, in order.", examples=[["normal-fast"]])
    designs: int = Field(description="Designs that walk in all of them.", examples=[618])
    failed: int = Field(description="Designs that do not.", examples=[7])
    tolerance: float = Field(
        description="Largest regret of a smallest family [1].", examples=[0.01]
    )
    left_out: list[LeftOutView] = Field(description="Each scenario left out in its turn.")
    sizes: list[FamilySizeView] = Field(
        description="Families by their size; of more than 64, so many that were drawn."
    )
    smallest: FamilyView | None = Field(
        description="The family of fewest scenarios whose regret is within the tolerance up to the"
        " upper end of its interval, of these the one of least regret; null if there is none."
    )

    @classmethod
    def from_families(
        cls, found: ScenarioFamilies, names: Sequence[str], columns: EvaluationColumns
    ) -> ScenarioFamiliesView:
        """Make a view of what was found.

        Args:
            found: regrets and losses.
            names: of the scenarios, in order.
            columns: the evaluations that were judged.
        """
        smallest = found.smallest
        return cls(
            scenarios=list(names),
            designs=found.designs,
            failed=found.failed,
            tolerance=found.tolerance,
            left_out=[LeftOutView.from_left_out(left, names, columns) for left in found.left_out],
            sizes=[
                _size(size, found)
                for size in sorted({len(family.scenarios) for family in found.families})
            ],
            smallest=None if smallest is None else FamilyView.from_family(smallest, names, columns),
        )


def _size(size: int, found: ScenarioFamilies) -> FamilySizeView:
    regrets = [f.regret for f in found.families if len(f.scenarios) == size]
    values = np.array([regret.value for regret in regrets])
    median = (
        np.quantile(values, 0.5, method="higher") if np.isinf(values).any() else np.median(values)
    )
    return FamilySizeView(
        size=size,
        families=len(regrets),
        median=finite(float(median)),
        worst=finite(float(values.max(initial=-math.inf))),
        within=sum(regret.high <= found.tolerance for regret in regrets),
    )
