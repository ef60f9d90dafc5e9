"""Rankings of stored designs by another preference"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gaitswarm.services.optimizer.analysis.distribution import iteration_starts
from gaitswarm.services.optimizer.analysis.evaluations import EvaluationView, evaluation_views
from gaitswarm.services.optimizer.analysis.statistics import spearman
from gaitswarm.services.optimizer.analysis.utilities import fitness_by, infeasible_rows
from gaitswarm.services.optimizer.jobs.constraints import Constraints
from gaitswarm.services.optimizer.jobs.iteration import EvaluationColumns, evaluations_of
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.kinds.tuning_worlds import ScenarioAggregate, ScenarioWeights
from gaitswarm.services.optimizer.jobs.preference import PreferenceChoice
from gaitswarm.services.optimizer.views import Finite, IterationIndex, Request, View
from gaitswarm.sim.arrays import Floats


class RankingRequest(Request):
    """Preference and constraints by which to rank the designs of a job."""

    preference: PreferenceChoice | None = Field(
        default=None,
        description="How objectives are weighed: A, B, C of table 4.5, chapter-3 for eq. 3.1, or"
        " your own; null: as by the job.",
        examples=["B"],
    )
    constraints: Constraints | None = Field(
        default=None,
        description="Limits that a design must keep, as in a spec; null: those of the job, an empty"
        " list: none.",
        examples=[["speed>=0.05"]],
    )
    scenario_weights: ScenarioWeights | None = Field(
        default=None, description="As in a spec; null: those of the job."
    )
    scenario_aggregate: ScenarioAggregate | None = Field(
        default=None, description="As in a spec; null: that of the job."
    )
    top: int = Field(default=20, ge=1, le=1000, description="How many of the best to list.")


class RankedDesignView(EvaluationView):
    """A design and its ranks; among equals the earliest comes first."""

    fitness: float = Field(description="Under the requested preference [1].", examples=[20.8])
    rank: int = Field(description="Rank under the requested preference, from 1.")
    rank_before: int | None = Field(
        description="Rank under the job's own preference, from 1; null if it has none."
    )
    fitness_before: Finite = Field(description="By the job's own preference [1].")


class BestSoFarView(View):
    """Best fitness so far under the requested preference."""

    index: IterationIndex
    fitness: Finite = Field(description="Least fitness of this and all earlier iterations [1].")


class RankingView(View):
    """A job's designs ranked by another preference, without simulation."""

    preference: PreferenceChoice = Field(description="The requested preference.")
    evaluations: int = Field(description="Designs that were ranked.")
    infeasible: int = Field(
        description="Designs that did not fail and violate the requested constraints."
    )
    fitness_of_present_best: Finite = Field(
        description="By the requested preference, of the job's own best design [1].",
        examples=[23.1],
    )
    correlation: Finite = Field(
        description="Spearman's rank correlation of both rankings, over the designs in"
        " both [1]; null where it is undefined.",
        examples=[0.83],
    )
    top: list[RankedDesignView] = Field(description="The best designs, best first.")
    best_so_far: list[BestSoFarView] = Field(description="One entry an iteration, in order.")


def rank(columns: EvaluationColumns, spec: JobSpec, *, top: int) -> RankingView:
    """Rank all designs by their stored results."""
    preference, before = spec.resolved_preference(), columns.fitness
    fitness = fitness_by(columns, preference, aggregation=spec.aggregation)
    walked = np.isfinite(fitness)
    fitness[infeasible_rows(columns, spec)] = np.inf
    present = _best_first(before)
    ranks = np.zeros(len(columns), dtype=np.int64)
    ranks[present] = np.arange(1, len(present) + 1)
    rows = _best_first(fitness)[:top]
    views = evaluation_views(evaluations_of(replace(columns, fitness=fitness).rows(rows)), spec)
    starts = iteration_starts(columns)
    least = np.minimum.reduceat(fitness, starts) if len(starts) else fitness
    best_so_far = np.minimum.accumulate(least).tolist()
    both = np.isfinite(fitness) & np.isfinite(before)
    correlation = spearman(fitness[both], before[both]) if both.any() else None
    # One validation for all: a call for each iteration would dominate.
    return RankingView.model_validate(
        {
            "preference": spec.preference,
            "evaluations": len(columns),
            "infeasible": int(np.count_nonzero(walked & np.isinf(fitness))),
            "fitness_of_present_best": float(fitness[present[0]]) if len(present) else None,
            "correlation": correlation,
            "top": [
                {
                    **dict(view),
                    "rank": place,
                    "rank_before": int(ranks[row]) or None,
                    "fitness_before": before[row],
                }
                for place, (row, view) in enumerate(zip(rows.tolist(), views, strict=True), start=1)
            ],
            "best_so_far": [
                {"index": index, "fitness": value} for index, value in enumerate(best_so_far)
            ],
        }
    )


def _best_first(fitness: Floats) -> NDArray[np.intp]:
    """Rows of finite fitness, best first; ties by age."""
    order = np.argsort(fitness, kind="stable")
    return order[np.isfinite(fitness[order])]
