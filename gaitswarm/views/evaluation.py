"""Designs and what they are worth."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, TypeAdapter
from pydantic_core import to_json

from gaitswarm.services.optimizer.jobs.iteration import Evaluation
from gaitswarm.services.optimizer.jobs.judgement import exponential
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.sim.kernel.walk import Precision
from gaitswarm.sim.outcome import OBJECTIVES, Objective, Status
from gaitswarm.views.base import View, finite

StatusName = Literal["ok", "diverged", "fell", "unreachable", "stalled"]
_EXAMPLE: Final = {
    "torque": 8.71,
    "acceleration": 1.77,
    "angular_acceleration": 16.09,
    "energy": 41.96,
    "reciprocal_speed": 6.41,
    "height_loss": 0.0038,
}


class ObjectiveView(View):
    """One thing that a job minimizes in every case."""

    name: str = Field(description="Name, as in results.", examples=["torque"])
    unit: str = Field(description="Its unit.", examples=["N m"])
    description: str = Field(
        description="What it means.",
        examples=["f1: rms over time of the sum of the absolute gear torques"],
    )

    @classmethod
    def from_objective(cls, objective: Objective) -> ObjectiveView:
        """Make a view of an objective."""
        return cls(name=objective.name, unit=objective.unit, description=objective.description)


class ScenarioResultView(View):
    """How a design did in one case of its job: a walk in a scenario, or a fit to a recording."""

    status: StatusName = Field(
        description="How the walk ended; everything but `ok` is a failed walk.", examples=["ok"]
    )
    explanation: str = Field(
        description="The status in a sentence, with what to do about it.",
        examples=["walked to the end"],
    )
    utility: float | None = Field(
        description="To be minimized; null if the walk failed. A walk's is the bias-weighted"
        " product of objectives under the job's preference (eq. 3.8, 4.1) [1], a fit's the mean"
        " absolute error of currents over the job's links [A].",
        examples=[21.05],
    )
    objectives: dict[str, float | None] = Field(
        description="Raw objectives by name, all to be minimized; null where there is none. Units"
        " are in the job's `objectives`; a walk has those of table 4.1: "
        + ", ".join(f"{o.name} [{o.unit}]" for o in OBJECTIVES)
        + ".",
        examples=[_EXAMPLE],
    )


class EvaluationView(View):
    """One design, judged in every case of its job."""

    iteration: int = Field(description="Iteration of the job, from 0.", examples=[24])
    particle: int = Field(
        description="Number of the design in its iteration, from 0.", examples=[7]
    )
    fitness: float | None = Field(
        description="To be minimized: geometric mean of the scenarios' utilities (eq. 4.2) [1], or"
        " mean error of the fits (eq. 2.21) [A]; null if the design failed in any case.",
        examples=[20.87],
    )
    figure_of_merit: float | None = Field(
        default=None,
        description="To be maximized: F of eq. 3.1 [1], which is 1e5 / `fitness` under the"
        " preference chapter-3; null under any other, and if the design failed.",
        examples=[6.9],
    )
    design: dict[str, float | str] = Field(
        description="Value of every variable, searched and fixed, by name: of a categorical one the"
        " name of the choice; units as in /v1/controllers.",
        examples=[{"I": 0.171, "FI1R": 5837.0, "FI2R": 20111.0, "FOR": 781.0, "FOMF": 2.0}],
    )
    scenarios: dict[str, ScenarioResultView] = Field(
        description="Result in each case, by the scenario's name or the recording's short id."
    )


class SearchView(View):
    """What a search in single precision made of a design that is judged in double."""

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

    fitness: float = Field(
        description="As of any evaluation; never null.",
        examples=[20.87],
    )
    search: SearchView | None = Field(
        default=None,
        description="What the search made of the same design; null if it is in double precision,"
        " too.",
    )

    @classmethod
    def from_evaluation(cls, evaluation: Evaluation, spec: Spec) -> BestView:
        """Make a view of the best design.

        Args:
            evaluation: of a design that did not fail, with its reevaluation if the job searches in
                single precision.
            spec: of its job.
        """
        search, anew = None, evaluation.reevaluation
        if anew is not None:
            found = evaluation.fitness
            search = SearchView(
                precision=spec.precision,
                fitness=found,
                difference=found / anew.fitness - 1.0 if anew.fitness else 0.0,
            )
            evaluation = replace(
                evaluation,
                objectives=anew.objectives,
                statuses=anew.statuses,
                fitness=anew.fitness,
            )
        (view,) = evaluation_views([evaluation], spec)
        return cls.model_validate({**dict(view), "search": search})


_EVALUATIONS: Final = TypeAdapter(list[EvaluationView])


def evaluation_views(evaluations: Sequence[Evaluation], spec: Spec) -> list[EvaluationView]:
    """Make views of evaluations of one job."""
    # Validated at once: a call for each result takes longer than all else.
    return _EVALUATIONS.validate_python(_documents(evaluations, spec))


def encoded_evaluations(evaluations: Sequence[Evaluation], spec: Spec) -> bytes:
    """Encode views of evaluations of one job, of which none is made."""
    return to_json({"items": _documents(evaluations, spec)})


def _documents(evaluations: Sequence[Evaluation], spec: Spec) -> list[dict[str, object]]:
    """Fields of `EvaluationView`, in its order."""
    if not evaluations:
        return []
    space = spec.design_space()
    objectives = np.stack([evaluation.objectives for evaluation in evaluations])
    statuses = np.stack([evaluation.statuses for evaluation in evaluations])
    logs = spec.judge(objectives, statuses != Status.OK).log_utilities
    names, columns = spec.case_names, [objective.name for objective in spec.objectives]
    return [
        {
            "iteration": evaluation.iteration,
            "particle": evaluation.particle,
            "fitness": finite(evaluation.fitness),
            "figure_of_merit": spec.figure_of_merit(evaluation.fitness),
            "design": space.shown(evaluation.design.tolist()),
            "scenarios": _results(
                names, columns, evaluation.statuses, evaluation.objectives, log_utilities
            ),
        }
        for evaluation, log_utilities in zip(evaluations, logs, strict=True)
    ]


def case_results(
    names: Sequence[str],
    objectives: Sequence[Objective],
    statuses: NDArray[np.uint8],
    values: NDArray[np.float64],
    log_utilities: NDArray[np.float64],
) -> dict[str, ScenarioResultView]:
    """Make views of one design in K cases."""
    columns = [objective.name for objective in objectives]
    found = _results(names, columns, statuses, values, log_utilities)
    return {name: ScenarioResultView.model_validate(result) for name, result in found.items()}


def _results(
    names: Sequence[str],
    columns: Sequence[str],
    statuses: NDArray[np.uint8],
    values: NDArray[np.float64],
    log_utilities: NDArray[np.float64],
) -> dict[str, dict[str, object]]:
    """As `case_results`, not yet validated."""
    # Hardly any design lacks a number; to look at each takes longer than all else.
    framed = list if np.isfinite(values).all() else _finite_all
    return {
        name: {
            "status": (ended := Status(status)).label,
            "explanation": ended.phrase,
            "utility": utility(log),
            "objectives": dict(zip(columns, framed(row), strict=True)),
        }
        for name, status, row, log in zip(
            names, statuses.tolist(), values.tolist(), log_utilities.tolist(), strict=True
        )
    }


def _finite_all(row: Sequence[float]) -> list[float | None]:
    return list(map(finite, row))


def utility(log_utility: float) -> float | None:
    """Make a utility of its logarithm."""
    return finite(exponential(log_utility))
