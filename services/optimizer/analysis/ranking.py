"""Rankings of stored designs by another preference"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gaitswarm.services.optimizer.analysis.evaluations import EvaluationView, evaluation_views
from gaitswarm.services.optimizer.analysis.statistics import rank_correlation
from gaitswarm.services.optimizer.analysis.utilities import fitness_by
from gaitswarm.services.optimizer.jobs.iteration import Evaluation, EvaluationColumns
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.preference import PREFERENCES, Preference, PreferenceChoice
from gaitswarm.services.optimizer.views import Finite, IterationIndex, Request, View

Floats = NDArray[np.float64]


class RankingRequest(Request):
    """Preference by which to rank the designs of a job."""

    preference: PreferenceChoice = Field(
        description="How objectives are weighed: A, B, C of table 4.5, chapter-3 for eq. 3.1, or"
        " your own.",
        examples=["B"],
    )
    top: int = Field(default=20, ge=1, le=1000, description="How many of the best to list.")

    def resolved_preference(self) -> Preference:
        """The preference in full."""
        return PREFERENCES[self.preference] if isinstance(self.preference, str) else self.preference


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
    fitness_of_present_best: Finite = Field(
        description="By the requested preference, of the job's own best design [1].",
        examples=[23.1],
    )
    correlation: float | None = Field(
        description="Spearman's rank correlation of both rankings, over the designs in"
        " both [1]; null where it is undefined.",
        examples=[0.83],
    )
    top: list[RankedDesignView] = Field(description="The best designs, best first.")
    best_so_far: list[BestSoFarView] = Field(description="One entry an iteration, in order.")


def rank(columns: EvaluationColumns, spec: JobSpec, request: RankingRequest) -> RankingView:
    """Rank all designs by their stored objectives."""
    preference = request.resolved_preference()
    fitness, before = fitness_by(columns, preference, worlds=spec.worlds), columns.fitness
    present, ordered = _best_first(before, 1), np.sort(before)
    rows = _best_first(fitness, request.top).tolist()
    evaluations = [
        Evaluation(
            iteration=int(columns.iteration[row]),
            particle=int(columns.particle[row]),
            design=columns.designs[row],
            objectives=columns.objectives[row],
            statuses=columns.statuses[row],
            fitness=float(fitness[row]),
        )
        for row in rows
    ]
    views = evaluation_views(evaluations, spec.model_copy(update={"preference": preference}))
    return RankingView(
        preference=request.preference,
        evaluations=len(columns),
        fitness_of_present_best=float(fitness[present[0]]) if len(present) else None,
        correlation=rank_correlation(fitness, before),
        top=[
            RankedDesignView.model_validate(
                {
                    **dict(view),
                    "rank": place,
                    "rank_before": _place(row, before, ordered),
                    "fitness_before": before[row],
                }
            )
            for place, (row, view) in enumerate(zip(rows, views, strict=True), start=1)
        ],
        best_so_far=[
            BestSoFarView(index=index, fitness=value)
            for index, value in enumerate(best_so_far(columns.iteration, fitness).tolist())
        ],
    )


def best_so_far(iteration: NDArray[np.int64], fitness: Floats) -> Floats:
    """Return the least fitness up to each distinct iteration.

    iteration: (r,) ascending. fitness: (r,), +inf for a failed design.
    """
    if not len(iteration):
        return np.empty(0)
    starts = np.flatnonzero(np.diff(iteration, prepend=-1))
    return np.minimum.accumulate(np.minimum.reduceat(fitness, starts))


def _best_first(fitness: Floats, most: int) -> NDArray[np.intp]:
    """Rows of the least finite fitness, best first; ties by age."""
    rows = np.flatnonzero(np.isfinite(fitness))
    if len(rows) > most:
        # Sorting all of them would take longer than judging them.
        worst = np.partition(fitness[rows], most - 1)[most - 1]
        rows = rows[fitness[rows] <= worst]
    return rows[np.argsort(fitness[rows], kind="stable")][:most]


def _place(row: int, fitness: Floats, ordered: Floats) -> int | None:
    """Rank of a row among finite fitness, from 1; ties by age."""
    value = fitness[row]
    if not np.isfinite(value):
        return None
    return int(np.searchsorted(ordered, value) + np.count_nonzero(fitness[:row] == value)) + 1
