"""Committed iterations and their evaluations"""

from __future__ import annotations

from dataclasses import asdict, replace
from datetime import datetime

from pydantic import Field

from gaitswarm.services.optimizer.analysis.evaluations import EvaluationView, evaluation_views
from gaitswarm.services.optimizer.jobs.iteration import Evaluation, Iteration
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.services.optimizer.views import Finite, IterationIndex, View
from gaitswarm.sim.kernel.walk import Precision


class SearchView(View):
    """Fitness in single precision of a design that is judged in double."""

    precision: Precision = Field(description="Of the search.", examples=["single"])
    fitness: float = Field(
        description="Of the design in that precision; units as of `fitness`.", examples=[20.8712]
    )
    difference: float = Field(
        description="By how much that is more than in double precision, relative [1].",
        examples=[0.00006],
    )


class BestView(EvaluationView):
    """The best design that a job has found so far, always judged in double precision."""

    fitness: float = Field(description="As of any evaluation; never null.", examples=[20.87])
    search: SearchView | None = Field(
        default=None, description="Fitness that a search in single precision was given."
    )

    @classmethod
    def from_evaluation(cls, evaluation: Evaluation, spec: Spec) -> BestView:
        """Make a view of a design that did not fail, by its reevaluation if there is one."""
        search, reevaluation = None, evaluation.reevaluation
        if reevaluation is not None:
            found = evaluation.fitness
            search = SearchView(
                precision=spec.precision,
                fitness=found,
                difference=found / reevaluation.fitness - 1.0 if reevaluation.fitness else 0.0,
            )
            evaluation = replace(
                evaluation,
                objectives=reevaluation.objectives,
                statuses=reevaluation.statuses,
                fitness=reevaluation.fitness,
            )
        (view,) = evaluation_views([evaluation], spec)
        return cls.model_validate({**dict(view), "search": search})


class IterationView(View):
    """Summary of one committed iteration. Fitness is minimized; null if every design failed."""

    index: IterationIndex
    designs: int = Field(description="Designs of the iteration [1].", examples=[25])
    best: Finite = Field(description="Least fitness of this iteration [1].", examples=[21.3])
    mean: Finite = Field(description="Mean of its finite fitnesses [1].", examples=[25.2])
    median: Finite = Field(description="Median of them [1].", examples=[23.9])
    worst: Finite = Field(description="Greatest of them [1].", examples=[41.7])
    best_so_far: Finite = Field(
        description="Least fitness of this and all earlier iterations [1].", examples=[20.9]
    )
    failed: int = Field(description="Designs that failed in some scenario [1].", examples=[2])
    evaluate_seconds: float = Field(description="Time of its evaluation [s].", examples=[1.23])
    committed_at: datetime = Field(description="When it was committed, UTC.")
    digest: str | None = Field(
        default=None,
        description="SHA-256 of it, the spec and all iterations before it.",
        examples=["9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08"],
    )


class HistoryIterationView(IterationView):
    """One committed iteration with every design."""

    evaluations: list[EvaluationView] = Field(description="Every design, in order.")

    @classmethod
    def from_iteration_and_evaluations(
        cls, iteration: Iteration, evaluations: tuple[Evaluation, ...], spec: Spec
    ) -> HistoryIterationView:
        """Make a view of an iteration with its designs."""
        particles = evaluation_views(evaluations, spec)
        return cls.model_validate({**asdict(iteration), "evaluations": particles})
