"""Every evaluation of a job as numbers by column, for pictures of the whole search."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gaitswarm.services.optimizer.analysis.distribution import thinned
from gaitswarm.services.optimizer.analysis.robustness.index import NORMALISED_OBJECTIVES
from gaitswarm.services.optimizer.analysis.utilities import objective_vectors, utilities
from gaitswarm.services.optimizer.jobs.columns import EvaluationColumns
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.views.base import View, framed


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

    job_id: str = Field(description="Identifier of the job.", examples=["k2q7zr5dm9xw"])
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
    unit = "A" if job.spec.kind == "identification" else "1"
    plain = [("iteration", "1", "index"), ("particle", "1", "index"), ("fitness", unit, "fitness")]
    worth = [(f"utility:{name}", unit, "utility") for name in job.spec.case_names]
    variables = [
        {name: getattr(v, name) for name in ParticleColumnView.model_fields}
        for v in job.spec.design_space().variables
    ]
    nothing: dict[str, object] = {"low": None, "high": None, "choices": []}
    unbounded = [
        [{"name": n, "unit": u, "kind": kind, **nothing} for n, u, kind in group]
        for group in (plain, worth)
    ]
    described = [*unbounded[0], *variables, *unbounded[1]]
    return [ParticleColumnView.model_validate(column) for column in described]


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
