"""Committed iterations of a job, in short and with every design."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from datetime import datetime

from pydantic import Field
from pydantic_core import to_json

from gaitswarm.services.optimizer.jobs.iteration import Evaluation, Iteration
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.views.base import View, finite
from gaitswarm.views.evaluation import EvaluationView, evaluation_views


class IterationView(View):
    """One committed iteration of a job: the fitness of its designs at a glance."""

    index: int = Field(description="Index of the iteration, from 0.", examples=[24])
    designs: int = Field(
        description="Designs judged in it [1]: those that the method asked for at once.",
        examples=[25],
    )
    best: float | None = Field(
        description="Least fitness of this iteration [1]; null if every design failed.",
        examples=[21.3],
    )
    mean: float | None = Field(description="Mean of its finite fitnesses [1].", examples=[25.2])
    median: float | None = Field(description="Median of them [1].", examples=[23.9])
    worst: float | None = Field(description="Greatest of them [1].", examples=[41.7])
    best_so_far: float | None = Field(
        description="Least fitness of this and all earlier iterations [1].", examples=[20.9]
    )
    failed: int = Field(
        description="Designs that failed in at least one scenario [1].", examples=[2]
    )
    evaluate_seconds: float = Field(
        description="Time that its evaluation took [s].", examples=[1.23]
    )
    committed_at: datetime = Field(description="When it was committed, UTC.")
    digest: str | None = Field(
        default=None,
        description="SHA-256 of it, the spec and all iterations before it.",
        examples=["9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08"],
    )

    @classmethod
    def from_iteration(cls, iteration: Iteration) -> IterationView:
        """Make a view of an iteration.

        Args:
            iteration: as the store lists it.
        """
        return cls.model_validate(_at_a_glance(iteration))


class HistoryIterationView(IterationView):
    """One committed iteration with every design."""

    evaluations: list[EvaluationView] = Field(description="Every design, in order.")

    @classmethod
    def from_iteration_and_evaluations(
        cls, iteration: Iteration, evaluations: tuple[Evaluation, ...], spec: Spec
    ) -> HistoryIterationView:
        """Make a view of an iteration with its designs.

        Args:
            iteration: as the store lists it.
            evaluations: of its designs.
            spec: of the job.
        """
        particles = evaluation_views(evaluations, spec)
        return cls.model_validate({**_at_a_glance(iteration), "evaluations": particles})


def encoded_iterations(iterations: Sequence[Iteration]) -> Iterator[bytes]:
    """Encode views of iterations, of which none is made."""
    return (to_json(_at_a_glance(iteration)) for iteration in iterations)


def _at_a_glance(iteration: Iteration) -> dict[str, object]:
    """Fields of `IterationView`, in its order."""
    return {
        "index": iteration.index,
        "designs": iteration.designs,
        "best": finite(iteration.best),
        "mean": finite(iteration.mean),
        "median": finite(iteration.median),
        "worst": finite(iteration.worst),
        "best_so_far": finite(iteration.best_so_far),
        "failed": iteration.failed,
        "evaluate_seconds": iteration.evaluate_seconds,
        "committed_at": iteration.committed_at,
        "digest": iteration.digest,
    }
