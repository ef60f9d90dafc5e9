"""Questions about all evaluations of a job at once."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field

from gaitswarm.services.optimizer.analysis.distribution import QUANTILES, Distribution
from gaitswarm.services.optimizer.analysis.ranking import RankedDesign, RankedJob
from gaitswarm.services.optimizer.jobs.columns import EvaluationColumns
from gaitswarm.services.optimizer.jobs.iteration import Evaluation
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.preference import PREFERENCES, Preference, PreferenceChoice
from gaitswarm.views.base import View, finite
from gaitswarm.views.evaluation import ScenarioResultView, evaluation_views


class DistributionItemView(View):
    """The designs of one iteration."""

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
        " range, mean over these variables [1]: 0 when the search has come together; null for an"
        " iteration of a single design.",
        examples=[0.12],
    )


class DistributionView(View):
    """How designs are spread, in pages. It is complete when `next` is null."""

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
    """By what to judge the designs of a job anew."""

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
    """A design and its places in two rankings; the first of equals is the earliest."""

    rank: int = Field(description="Place by the preference that was asked for, from 1.")
    iteration: int = Field(description="Iteration of the job, from 0.", examples=[24])
    particle: int = Field(
        description="Number of the design in its iteration, from 0.", examples=[7]
    )
    fitness: float = Field(description="By the preference that was asked for [1].", examples=[20.8])
    figure_of_merit: float | None = Field(
        default=None,
        description="To be maximized: F of eq. 3.1 [1] if chapter-3 was asked for, else null.",
        examples=[6.9],
    )
    rank_before: int | None = Field(
        description="Place by the job's own preference, from 1; null if that has none."
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
    """Progress as it would have looked."""

    index: int = Field(description="Index of the iteration, from 0.", examples=[24])
    fitness: float | None = Field(
        description="Least fitness of this and all earlier iterations [1].", examples=[20.9]
    )


class RankingView(View):
    """A job's designs, judged by another preference. Nothing is simulated, nothing is stored."""

    preference: PreferenceChoice = Field(description="As it was asked for.")
    evaluations: int = Field(description="Designs that were judged [1].", examples=[625])
    fitness_of_present_best: float | None = Field(
        description="By the preference that was asked for, of the design that is the job's best by"
        " its own [1]; null if it has none.",
        examples=[23.1],
    )
    correlation: float | None = Field(
        description="Spearman's rank correlation of both rankings, over the designs that are in"
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
