"""Evaluations of a job as JSON"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, TypeAdapter

from gaitswarm.services.optimizer.jobs.iteration import Evaluation
from gaitswarm.services.optimizer.jobs.preference import exponential
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.services.optimizer.views import (
    DesignValues,
    Finite,
    IterationIndex,
    Particle,
    StatusName,
    View,
    finite,
)
from gaitswarm.sim.outcome import MEASUREMENTS, OBJECTIVES, Status


class ObjectiveView(View):
    """A column of results: a quantity that a job minimizes or measures in every case."""

    name: str = Field(description="Name, as in results.", examples=["torque"])
    unit: str = Field(description="Its unit.", examples=["N m"])
    description: str = Field(description="Its meaning.")


class ScenarioResultView(View):
    """Result of a design in one case of its job: a scenario, or a fit to a recording."""

    status: StatusName = Field(description="Status of the simulation; only `ok` is a success.")
    explanation: str = Field(description="The status in a sentence, with what to do about it.")
    utility: float | None = Field(examples=[21.05])
    """Minimized; null if the simulation failed. In a scenario the bias-weighted product of
    objectives (eq. 3.8, 4.1) [1], of a fit the mean absolute error [A]."""
    objectives: dict[str, float | None] = Field(
        description="Raw objectives by name, minimized; units are in the job's `objectives`, those"
        f" of table 4.1 {', '.join(f'{o.name} [{o.unit}]' for o in OBJECTIVES)}.",
        examples=[{"torque": 8.71, "acceleration": 1.77, "height_loss": 0.0038}],
    )
    measurements: dict[str, float | None] = Field(
        default_factory=dict,
        description="Further quantities by name, which are not minimized; units are in the job's"
        " `measurements`; of the simulator: "
        + ", ".join(f"{m.name} [{m.unit}]" for m in MEASUREMENTS)
        + ".",
        examples=[{"speed": 0.067, "peak_current": 2.1}],
    )


class EvaluationView(View):
    """One design, judged in every case of its job."""

    iteration: IterationIndex
    particle: Particle
    fitness: float | None = Field(examples=[20.87])
    """Minimized: geometric mean of the scenarios' utilities (eq. 4.2) [1], or mean error of the
    fits (eq. 2.21) [A]; null if the design failed in any case, or is infeasible."""
    violation: Finite = Field(default=None, examples=[0.0])
    """Sum of the relative excesses over all limits of the constraints, 0 for a feasible design [1];
    null without constraints, or if the design failed."""
    figure_of_merit: float | None = Field(default=None, examples=[6.9])
    """Maximized: F of eq. 3.1 [1] under the preference chapter-3, else null."""
    design: DesignValues
    scenarios: dict[str, ScenarioResultView]
    """Result in each case, by the scenario's name or the recording's short id."""


_EVALUATIONS: Final = TypeAdapter(list[EvaluationView])


def evaluation_views(evaluations: Sequence[Evaluation], spec: Spec) -> list[EvaluationView]:
    """Make views of evaluations of one job."""
    if not evaluations:
        return []
    space = spec.design_space()
    objectives = np.stack([evaluation.objectives for evaluation in evaluations])
    statuses = np.stack([evaluation.statuses for evaluation in evaluations])
    failed = statuses != Status.OK
    logs = spec.judge(objectives, failed).log_utilities
    violations = spec.violations(objectives, failed)
    by_design = [None] * len(evaluations) if violations is None else violations.tolist()
    columns = [[c.name for c in columns] for columns in (spec.objectives, spec.measurements)]
    documents = [
        {
            "iteration": evaluation.iteration,
            "particle": evaluation.particle,
            "fitness": finite(evaluation.fitness),
            "violation": violation,
            "figure_of_merit": spec.figure_of_merit(evaluation.fitness),
            "design": space.shown(evaluation.design.tolist()),
            "scenarios": case_results(
                spec.case_names, columns, evaluation.statuses, evaluation.objectives, log_utilities
            ),
        }
        for evaluation, log_utilities, violation in zip(evaluations, logs, by_design, strict=True)
    ]
    # One validation for all: a call for each result would dominate.
    return _EVALUATIONS.validate_python(documents)


def case_results(
    names: Sequence[str],
    columns: Sequence[Sequence[str]],
    statuses: NDArray[np.uint8],
    values: NDArray[np.float64],
    log_utilities: NDArray[np.float64],
) -> dict[str, dict[str, Any]]:
    """Return the fields of the `ScenarioResultView` of one design in each of K cases."""
    objectives, measurements = columns
    count = len(objectives)
    # Few designs lack a number; checking each would dominate.
    rows = values.tolist()
    if not np.isfinite(values).all():
        rows = [list(map(finite, row)) for row in rows]
    return {
        name: {
            "status": (status := Status(code)).label,
            "explanation": status.phrase,
            "utility": finite(exponential(log)),
            "objectives": dict(zip(objectives, row[:count], strict=True)),
            "measurements": dict(zip(measurements, row[count:], strict=True)),
        }
        for name, code, row, log in zip(
            names, statuses.tolist(), rows, log_utilities.tolist(), strict=True
        )
    }
