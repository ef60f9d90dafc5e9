"""Committed iterations and their evaluations"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import asdict, replace
from datetime import datetime
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gaitswarm.services.optimizer.analysis.distribution import thinned
from gaitswarm.services.optimizer.analysis.evaluations import EvaluationView, evaluation_views
from gaitswarm.services.optimizer.analysis.utilities import (
    NORMALISED_OBJECTIVES,
    objective_vectors,
    utilities,
)
from gaitswarm.services.optimizer.jobs.columns import EvaluationColumns
from gaitswarm.services.optimizer.jobs.iteration import Evaluation, Iteration
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.services.optimizer.views import Finite, IterationIndex, JobName, View, framed
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


class ParticleColumnView(View):
    """What one column of numbers is."""

    name: str = Field(
        description="`iteration`, `particle`, `fitness`, a searched variable's name,"
        " `utility:<scenario>`, or `objective:<name>`.",
        examples=["FI1R"],
    )
    unit: str = Field(description="Unit of its numbers.", examples=["counts"])
    low: float | None = Field(description="Lower bound of a variable; else null.")
    high: float | None = Field(description="Upper bound of a variable; else null.")
    kind: Literal[
        "index", "fitness", "continuous", "integer", "categorical", "utility", "objective"
    ] = Field(
        description="What its numbers are; `continuous`, `integer` and `categorical` are variables,"
        " `objective` is an objective's geometric mean over the scenarios."
    )
    choices: list[str] = Field(
        description="Names of a categorical variable's choices, whose indices its numbers are;"
        " else none.",
        examples=[["linear_zone", "karnopp", "stick"]],
    )


class ParticlesHeaderView(View):
    """What the numbers after it are."""

    job_id: JobName
    rows: int = Field(description="Evaluations that follow: numbers of each column [1].")
    total: int = Field(description="Evaluations there are, of which the rows are chosen [1].")
    iterations: tuple[int, int] | None = Field(
        description="First and last iteration among the rows; null without any.",
        examples=[(0, 24)],
    )
    columns: list[ParticleColumnView] = Field(description="The columns, in order.")


def encoded_particles(
    job: Job,
    columns: EvaluationColumns,
    *,
    after: int | None,
    most: int,
    objectives: bool = False,
) -> bytes:
    """Encode evaluations for pictures of the whole search."""
    wanted = columns.after(after)
    chosen = wanted.rows(thinned(wanted, most))
    rows = len(chosen)
    header = ParticlesHeaderView(
        job_id=job.id,
        rows=rows,
        total=len(wanted),
        iterations=(int(chosen.iteration[0]), int(chosen.iteration[-1])) if rows else None,
        columns=[*_described(job), *(_objectives_described(job) if objectives else ())],
    )
    numbers = _numbers(job, chosen)
    if objectives and isinstance(job.spec, JobSpec):
        vectors = objective_vectors(chosen, worlds=job.spec.worlds).T
        numbers = np.concatenate([numbers, np.where(np.isfinite(vectors), vectors, np.nan)])
    return framed(header, numbers)


def _described(job: Job) -> list[ParticleColumnView]:
    def plain(kind: str, names: Iterable[str], unit: str) -> Iterator[ParticleColumnView]:
        nothing: dict[str, object] = {"low": None, "high": None, "choices": []}
        for name in names:
            column = {"name": name, "unit": unit, "kind": kind, **nothing}
            yield ParticleColumnView.model_validate(column)

    unit = "A" if job.spec.kind == "identification" else "1"
    return [
        *plain("index", ("iteration", "particle"), "1"),
        *plain("fitness", ("fitness",), unit),
        *map(ParticleColumnView.model_validate, job.spec.design_space().variables),
        *plain("utility", (f"utility:{name}" for name in job.spec.case_names), unit),
    ]


def _objectives_described(job: Job) -> list[ParticleColumnView]:
    return [
        ParticleColumnView(
            name=f"objective:{objective.name}",
            unit=objective.unit,
            low=None,
            high=None,
            kind="objective",
            choices=[],
        )
        for objective in (NORMALISED_OBJECTIVES if isinstance(job.spec, JobSpec) else ())
    ]


def _numbers(job: Job, chosen: EvaluationColumns) -> NDArray[np.float64]:
    """(columns, rows)."""
    searched = len(job.spec.design_space().variables)
    numbers = np.concatenate(
        [
            [chosen.iteration, chosen.particle, chosen.fitness],
            chosen.designs[:, :searched].T,
            utilities(chosen, job.spec).T,
        ]
    )
    numbers[~np.isfinite(numbers)] = np.nan
    return numbers
