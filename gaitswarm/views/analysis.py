"""Analyses of a job's designs"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from gaitswarm.services.optimizer.analysis.distribution import QUANTILES, Distribution
from gaitswarm.services.optimizer.analysis.evaluations import ScenarioResultView, evaluation_views
from gaitswarm.services.optimizer.analysis.ranking import RankedDesign, RankedJob
from gaitswarm.services.optimizer.analysis.scenario_families import (
    Family,
    LeftOut,
    ScenarioFamilies,
)
from gaitswarm.services.optimizer.analysis.statistics import Interval
from gaitswarm.services.optimizer.jobs.columns import EvaluationColumns
from gaitswarm.services.optimizer.jobs.iteration import Evaluation
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.preference import PREFERENCES, Preference, PreferenceChoice
from gaitswarm.services.optimizer.views import View, finite
from gaitswarm.sim.controllers import ControllerName
from gaitswarm.sim.controllers.mamdani import Rule
from gaitswarm.sim.controllers.quantisation import OUTPUT_BITS
from gaitswarm.sim.controllers.surface import Memberships, Surface


class DistributionItemView(View):
    """Distribution of the designs of one iteration."""

    index: int = Field(description="Index of the iteration, from 0.", examples=[24])
    fitness: list[float | None] = Field(
        description="One fitness for each of `quantiles`; null where every design failed.",
        examples=[[20.9, 21.0, 21.4, 22.3, 24.0, 29.1, 41.7]],
    )
    mean: float | None = Field(description="Mean of its finite fitnesses.", examples=[23.2])
    failed: int = Field(
        description="Designs that failed in at least one scenario [1].", examples=[2]
    )
    diversity: float | None = Field(
        description="Standard deviation of the designs as a share of each searched variable's"
        " range, mean over these variables [1]: 0 when the search has converged; null for an"
        " iteration of a single design.",
        examples=[0.12],
    )


class DistributionView(View):
    """A page of the designs' distribution. The list is complete when `next` is null."""

    quantiles: list[float] = Field(
        description="Shares of the designs that `fitness` is given for.", examples=[list(QUANTILES)]
    )
    items: list[DistributionItemView] = Field(description="Iterations, in order.")
    next: str | None = Field(
        description="Give it as `after` to get the following page; null on the last page.",
        examples=["24"],
    )

    @classmethod
    def from_distribution(cls, found: Distribution, *, more: bool) -> DistributionView:
        """Make a page of a distribution."""
        rows = zip(
            found.index.tolist(),
            found.fitness.tolist(),
            found.mean.tolist(),
            found.failed.tolist(),
            found.diversity.tolist(),
            strict=True,
        )
        items = [
            DistributionItemView(
                index=index,
                fitness=[finite(value) for value in fitness],
                mean=finite(mean),
                failed=failed,
                diversity=finite(diversity),
            )
            for index, fitness, mean, failed, diversity in rows
        ]
        following = str(items[-1].index) if more else None
        return cls(quantiles=list(QUANTILES), items=items, next=following)


class RankingRequest(BaseModel):
    """Preference by which to rank the designs of a job."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    preference: PreferenceChoice = Field(
        description="How objectives are weighed: A, B, C of table 4.5, chapter-3 for eq. 3.1, or"
        " your own.",
        examples=["B"],
    )
    top: int = Field(default=20, ge=1, le=1000, description="How many of the best to list.")

    def resolved_preference(self) -> Preference:
        """The preference in full."""
        return PREFERENCES[self.preference] if isinstance(self.preference, str) else self.preference


class RankedDesignView(View):
    """A design and its ranks; among equals the earliest comes first."""

    rank: int = Field(description="Rank under the requested preference, from 1.")
    iteration: int = Field(description="Iteration of the job, from 0.", examples=[24])
    particle: int = Field(
        description="Number of the design in its iteration, from 0.", examples=[7]
    )
    fitness: float = Field(description="Under the requested preference [1].", examples=[20.8])
    figure_of_merit: float | None = Field(
        default=None,
        description="To be maximized: F of eq. 3.1 [1] if chapter-3 was requested, else null.",
        examples=[6.9],
    )
    rank_before: int | None = Field(
        description="Rank under the job's own preference, from 1; null if it has none."
    )
    fitness_before: float | None = Field(description="By the job's own preference [1].")
    design: dict[str, float | str] = Field(
        description="Value of every variable, by name; units as in /v1/controllers.",
        examples=[{"I": 0.171, "FI1R": 5837.0, "FI2R": 20111.0, "FOR": 781.0, "FOMF": 2.0}],
    )
    scenarios: dict[str, ScenarioResultView] = Field(
        description="Result in each scenario; utilities are by the preference that was asked for."
    )


class BestSoFarView(View):
    """Best fitness so far under the requested preference."""

    index: int = Field(description="Index of the iteration, from 0.", examples=[24])
    fitness: float | None = Field(
        description="Least fitness of this and all earlier iterations [1].", examples=[20.9]
    )


class RankingView(View):
    """A job's designs ranked by another preference, without simulation."""

    preference: PreferenceChoice = Field(description="The requested preference.")
    evaluations: int = Field(description="Designs that were ranked [1].", examples=[625])
    fitness_of_present_best: float | None = Field(
        description="By the preference that was asked for, of the design that is the job's best by"
        " its own [1]; null if it has none.",
        examples=[23.1],
    )
    correlation: float | None = Field(
        description="Spearman's rank correlation of both rankings, over the designs in"
        " both [1]; null where it is undefined.",
        examples=[0.83],
    )
    top: list[RankedDesignView] = Field(description="The best designs, best first.")
    best_so_far: list[BestSoFarView] = Field(description="One entry an iteration, in order.")

    @classmethod
    def from_ranked_job(cls, request: RankingRequest, ranked: RankedJob) -> RankingView:
        """Make the answer to a request.

        Args:
            request: as it was sent.
            ranked: the job's designs by the request's preference.
        """
        ranking, columns = ranked.ranking, ranked.columns
        so_far = ranking.best_so_far.tolist()
        return cls(
            preference=request.preference,
            evaluations=len(columns),
            fitness_of_present_best=finite(ranking.present_best),
            correlation=ranking.correlation,
            top=_top(ranking.top, columns, _judging_by(ranked.spec, request)),
            best_so_far=[BestSoFarView(index=i, fitness=finite(f)) for i, f in enumerate(so_far)],
        )


def _judging_by(spec: JobSpec, request: RankingRequest) -> JobSpec:
    return spec.model_copy(update={"preference": request.resolved_preference()})


def _top(
    ranked: tuple[RankedDesign, ...], columns: EvaluationColumns, spec: JobSpec
) -> list[RankedDesignView]:
    evaluations = [
        Evaluation(
            iteration=int(columns.iteration[design.row]),
            particle=int(columns.particle[design.row]),
            design=columns.designs[design.row],
            objectives=columns.objectives[design.row],
            statuses=columns.statuses[design.row],
            fitness=design.fitness,
        )
        for design in ranked
    ]
    return [
        RankedDesignView(
            rank=design.rank,
            iteration=view.iteration,
            particle=view.particle,
            fitness=design.fitness,
            figure_of_merit=view.figure_of_merit,
            rank_before=design.rank_before,
            fitness_before=finite(float(columns.fitness[design.row])),
            design=view.design,
            scenarios=view.scenarios,
        )
        for design, view in zip(ranked, evaluation_views(evaluations, spec), strict=True)
    ]


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
    """Wider bounds for a variable whose best value lies at a bound."""

    low: float = Field(description="Lower bound, in the variable's unit.", examples=[500.0])
    high: float = Field(description="Upper bound.", examples=[14750.0])


class VariableImportanceView(View):
    """Influence of one variable on the results."""

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
        " an effect of one may be due to the other; null if there is none.",
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
    """A subset of a job's scenarios, and the design that is best in them."""

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
    """Effect of leaving out one scenario."""

    scenario: str = Field(description="Name of the scenario left out.", examples=["loaded-fast"])
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
    """Families of one size."""

    size: int = Field(description="Scenarios of each.", examples=[3])
    families: int = Field(description="Families of this size that were evaluated.", examples=[20])
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
    left_out: list[LeftOutView] = Field(description="Each scenario left out in turn.")
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


class MembershipView(View):
    """One fuzzy set."""

    name: str = Field(description="Name of the set, as rules call it.", examples=["positive"])
    degrees: list[float] = Field(
        description="Degree of membership of every value, from 0 to 1 [1].", examples=[[0.0, 1.0]]
    )


class UniverseView(View):
    """An input's range and sets."""

    name: str = Field(description="error, current or velocity.", examples=["error"])
    unit: str = Field(description="Unit of range and values.", examples=["counts"])
    range: tuple[float, float] = Field(
        description="Where the universe ends: inputs saturate there, and an output's centroid is"
        " taken over it, which may reach beyond the output's range.",
        examples=[[-5837.0, 5837.0]],
    )
    values: list[float] = Field(
        description="Points of the range; those of error and current are the surfaces' grid, in"
        " whole counts.",
        examples=[[-5837.0, 0.0, 5837.0]],
    )
    memberships: list[MembershipView] = Field(description="Its fuzzy sets.")


class RuleView(View):
    """IF every input is in its set THEN the output is in another; a weight scales its strength."""

    # `if` is a word of Python.
    model_config = ConfigDict(validate_by_name=True, validate_by_alias=True)

    antecedents: dict[str, str] = Field(
        alias="if",
        description="Set of every input that matters to it, by input.",
        examples=[{"error": "positive", "current": "large"}],
    )
    then: str = Field(description="Set of the output.", examples=["negative-extreme"])
    weight: float = Field(description="From 0 to 1 [1].", examples=[0.927])

    @classmethod
    def from_rule(cls, rule: Rule) -> RuleView:
        """Make a view of a rule."""
        return cls(antecedents=dict(rule.antecedents), then=rule.consequent, weight=rule.weight)


class QuantisationView(View):
    """The lookup table that replaces the inference, and its error."""

    error_bits: int = Field(description="Of the error's index [bit].", examples=[10])
    current_bits: int = Field(description="Of the current's index [bit].", examples=[6])
    velocity_bits: int | None = Field(
        description="Of the velocity error's index [bit]; null if it does not matter.",
        examples=[None],
    )
    output_bits: int = Field(description="Of an entry [bit].", examples=[8])
    bytes: int = Field(description="Memory of the table (eq. 5.1) [B].", examples=[65536])
    largest_difference: float = Field(
        description="Of table and inference over the grid [unit of the output].", examples=[5.37]
    )
    rms_difference: float = Field(
        description="Of table and inference over the grid [unit of the output].", examples=[2.07]
    )


class FuzzyOutputView(UniverseView):
    """An output with its rules, and its surface over error and current."""

    name: str = Field(
        description="Variable of the design that is its range: FOR's FO, FzzP or FzzI.",
        examples=["FO"],
    )
    values: list[float] = Field(
        description="Points over which the inference takes the centre of area.",
        examples=[[-781.0, 0.0, 781.0]],
    )
    rules: list[RuleView] = Field(description="Its rules, in the thesis's order.")
    inference: list[list[float]] = Field(
        description="Exact inference: a row for each error, a number for each current.",
        examples=[[[-386.8, -100.0], [386.8, 100.0]]],
    )
    table: list[list[float]] = Field(
        description="The lookup table on the same grid.",
        examples=[[[-387.4, -98.4], [387.4, 98.4]]],
    )
    quantisation: QuantisationView = Field(description="What of the rules the table keeps.")

    @classmethod
    def from_surface(cls, surface: Surface) -> FuzzyOutputView:
        """Make a view of one output."""
        axes = surface.source.axes
        velocity = axes.get("velocity")
        return cls.model_construct(
            **dict(_universe(surface.output)),
            rules=[RuleView.from_rule(rule) for rule in surface.source.system.rules],
            inference=surface.inference.tolist(),
            table=surface.table.tolist(),
            quantisation=QuantisationView(
                error_bits=axes["error"].bits,
                current_bits=axes["current"].bits,
                velocity_bits=None if velocity is None else velocity.bits,
                output_bits=OUTPUT_BITS,
                bytes=surface.bytes,
                largest_difference=surface.largest_difference,
                rms_difference=surface.rms_difference,
            ),
        )


class SurfaceView(View):
    """Fuzzy sets, rules and control surfaces of a design."""

    controller: ControllerName = Field(description="Controller.", examples=["fuzzy-pi"])
    inputs: list[UniverseView] = Field(description="All inputs of any output.")
    velocity_error: float | None = Field(
        description="At which the surfaces are drawn [counts/s], in whole counts a tick of 2 ms;"
        " null if the controller does not see it.",
        examples=[None],
    )
    outputs: list[FuzzyOutputView] = Field(
        description="fuzzy-pi has one, fuzzy-pi-3 the voltage FzzP and the integrated FzzI."
    )

    @classmethod
    def from_surfaces(cls, controller: ControllerName, surfaces: Sequence[Surface]) -> SurfaceView:
        """Make a view of a controller.

        Args:
            controller: its name.
            surfaces: of every output, on the same grid.
        """
        inputs = {name: m for surface in surfaces for name, m in surface.inputs.items()}
        held = {name: value for surface in surfaces for name, value in surface.held.items()}
        return cls(
            controller=controller,
            inputs=[_universe(memberships) for memberships in inputs.values()],
            velocity_error=held.get("velocity"),
            outputs=[FuzzyOutputView.from_surface(surface) for surface in surfaces],
        )


def _universe(memberships: Memberships) -> UniverseView:
    universe = memberships.universe
    return UniverseView(
        name=universe.name,
        unit=universe.unit,
        range=memberships.limits,
        values=memberships.values.tolist(),
        memberships=[
            MembershipView(name=name, degrees=np.asarray(degrees).tolist())
            for name, degrees in memberships.degrees.items()
        ],
    )
