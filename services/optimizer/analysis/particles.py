"""Evaluations of a job as binary columns, for pictures of the whole search"""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gaitswarm.services.optimizer.analysis.distribution import thinned
from gaitswarm.services.optimizer.analysis.utilities import (
    NORMALISED_OBJECTIVES,
    objective_vectors,
    utilities,
)
from gaitswarm.services.optimizer.jobs.iteration import EvaluationColumns
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.views import JobName, View, framed


class ParticleColumnView(View):
    """Meaning of one column of numbers."""

    name: str = Field(
        description="`iteration`, `particle`, `fitness`, a searched variable's name,"
        " `utility:<scenario>`, or `objective:<name>`."
    )
    unit: str = Field(description="Unit of its numbers.", examples=["counts"])
    low: float | None = Field(description="Lower bound of a variable; else null.")
    high: float | None = Field(description="Upper bound of a variable; else null.")
    kind: Literal[
        "index", "fitness", "continuous", "integer", "categorical", "utility", "objective"
    ] = Field(
        description="`continuous`, `integer` and `categorical` are variables,"
        " `objective` is an objective's geometric mean over the scenarios."
    )
    choices: list[str] = Field(
        description="Names of a categorical variable's choices; its numbers are their indices."
    )


class ParticlesHeaderView(View):
    """Meaning of the numbers that follow."""

    job_id: JobName
    rows: int = Field(description="Evaluations that follow: numbers of each column.")
    total: int = Field(description="Evaluations from which the rows were chosen.")
    iterations: tuple[int, int] | None = Field(
        description="First and last iteration among the rows; null without any.",
        examples=[(0, 24)],
    )
    columns: list[ParticleColumnView] = Field(description="The columns, in order.")


def encoded_particles(
    job: Job, columns: EvaluationColumns, *, most: int, objectives: bool = False
) -> bytes:
    """Encode at most `most` evaluations, with f1 to f5 of a tuning job on request."""
    chosen, spec = columns.rows(thinned(columns, most)), job.spec
    rows = len(chosen)
    described: list[ParticleColumnView] = []
    numbers: list[NDArray[Any]] = []

    def add(name: str, unit: str, kind: str, values: NDArray[Any]) -> None:
        none: dict[str, Any] = {"low": None, "high": None, "choices": []}
        column = {"name": name, "unit": unit, "kind": kind, **none}
        described.append(ParticleColumnView.model_validate(column))
        numbers.append(values)

    unit = "A" if spec.kind == "identification" else "1"
    add("iteration", "1", "index", chosen.iteration)
    add("particle", "1", "index", chosen.particle)
    add("fitness", unit, "fitness", chosen.fitness)
    variables = spec.design_space().variables
    described += map(ParticleColumnView.model_validate, variables)
    numbers += list(chosen.designs[:, : len(variables)].T)
    for name, values in zip(spec.case_names, utilities(chosen, spec).T, strict=True):
        add(f"utility:{name}", unit, "utility", values)
    if objectives and isinstance(spec, JobSpec):
        vectors = objective_vectors(chosen, worlds=spec.worlds).T
        for objective, values in zip(NORMALISED_OBJECTIVES, vectors, strict=True):
            add(f"objective:{objective.name}", objective.unit, "objective", values)
    header = ParticlesHeaderView(
        job_id=job.id,
        rows=rows,
        total=len(columns),
        iterations=(int(chosen.iteration[0]), int(chosen.iteration[-1])) if rows else None,
        columns=described,
    )
    table = np.stack(numbers).astype(np.float64)
    table[~np.isfinite(table)] = np.nan
    return framed(header, table)
