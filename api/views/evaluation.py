"""Designs and what they are worth."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from api.views.base import View, finite
from services.optimizer.job import Evaluation
from services.optimizer.job_spec import JobSpec
from services.optimizer.preference import Preference, log_utilities
from sim.outcome import OBJECTIVE_NAMES, OBJECTIVES, Status

StatusName = Literal["ok", "diverged", "fell", "unreachable", "stalled"]

_EXAMPLES: Final = {
    "torque": 8.71,
    "acceleration": 1.77,
    "angular_acceleration": 16.09,
    "energy": 41.96,
    "reciprocal_speed": 6.41,
    "height_loss": -0.0038,
}


def _objective(name: str) -> Any:
    """Field of an objective; meaning and unit come from the simulator's own table."""
    (objective,) = (o for o in OBJECTIVES if o.name == name)
    return Field(
        description=f"{objective.description} [{objective.unit}]; null if the walk has none.",
        examples=[_EXAMPLES[name]],
    )


class ObjectivesView(View):
    """Raw objectives of one walk, all to be minimized (thesis table 4.1)."""

    torque: float | None = _objective("torque")
    acceleration: float | None = _objective("acceleration")
    angular_acceleration: float | None = _objective("angular_acceleration")
    energy: float | None = _objective("energy")
    reciprocal_speed: float | None = _objective("reciprocal_speed")
    height_loss: float | None = _objective("height_loss")

    @classmethod
    def from_row(cls, row: NDArray[np.float64]) -> ObjectivesView:
        """row: (6,) as in `sim.outcome.OBJECTIVES`."""
        return cls(**dict(zip(OBJECTIVE_NAMES, map(finite, row.tolist()), strict=True)))


class ScenarioResultView(View):
    """How a design did in one scenario."""

    status: StatusName = Field(
        description="How the walk ended; everything but `ok` is a failed walk.", examples=["ok"]
    )
    explanation: str = Field(
        description="The status in a sentence, with what to do about it.",
        examples=["walked to the end"],
    )
    utility: float | None = Field(
        description="Bias-weighted product of f1..f5 under the job's preference (eq. 4.1), to be"
        " minimized [1]; null if the walk failed.",
        examples=[21.05],
    )
    objectives: ObjectivesView = Field(description="Raw objectives f1..f6.")

    @classmethod
    def from_walk(
        cls, status: int, objectives: NDArray[np.float64], log_utility: float
    ) -> ScenarioResultView:
        """objectives: (6,); log_utility: logarithm of eq. 4.1, +inf for a failed walk."""
        ended = Status(status)
        return cls.model_validate(
            {
                "status": ended.label,
                "explanation": ended.phrase,
                "utility": utility(log_utility),
                "objectives": ObjectivesView.from_row(objectives),
            }
        )


class EvaluationView(View):
    """One design, judged in every scenario of its job."""

    iteration: int = Field(description="Iteration of the job, from 0.", examples=[24])
    particle: int = Field(description="Particle of the swarm, from 0.", examples=[7])
    fitness: float | None = Field(
        description="Geometric mean of the scenarios' utilities (eq. 4.2), to be minimized [1];"
        " null if the design failed in any scenario.",
        examples=[20.87],
    )
    design: dict[str, float] = Field(
        description="Value of every variable, searched and fixed, by name; units as in"
        " /v1/controllers.",
        examples=[{"I": 0.171, "FI1R": 5837.0, "FI2R": 20111.0, "FOR": 781.0, "FOMF": 2.0}],
    )
    scenarios: dict[str, ScenarioResultView] = Field(
        description="Result in each scenario, by the scenario's name."
    )


class BestView(EvaluationView):
    """The best design that a job has found so far."""

    fitness: float = Field(
        description="Geometric mean of the scenarios' utilities (eq. 4.2), to be minimized [1].",
        examples=[20.87],
    )

    @classmethod
    def from_evaluation(cls, evaluation: Evaluation, spec: JobSpec) -> BestView:
        """spec: that of the evaluation's job."""
        (view,) = evaluation_views([evaluation], spec)
        return cls.model_validate(dict(view))


def evaluation_views(evaluations: Sequence[Evaluation], spec: JobSpec) -> list[EvaluationView]:
    """Views of evaluations of one job, in their order; utilities are derived by its preference."""
    names = spec.design_space().names
    scenarios = [scenario.name for scenario in spec.resolved_scenarios()]
    preference = spec.resolved_preference()
    return [
        EvaluationView(
            iteration=evaluation.iteration,
            particle=evaluation.particle,
            fitness=finite(evaluation.fitness),
            design=dict(zip(names, evaluation.design.tolist(), strict=True)),
            scenarios=scenario_results(
                scenarios, evaluation.statuses, evaluation.objectives, preference
            ),
        )
        for evaluation in evaluations
    ]


def scenario_results(
    names: Sequence[str],
    statuses: NDArray[np.uint8],
    objectives: NDArray[np.float64],
    preference: Preference,
) -> dict[str, ScenarioResultView]:
    """names, statuses (K,) and objectives (K, 6) of one design in K scenarios -> views by name."""
    logs = log_utilities(objectives, statuses != Status.OK, preference)
    return {
        name: ScenarioResultView.from_walk(int(status), row, log)
        for name, status, row, log in zip(names, statuses, objectives, logs.tolist(), strict=True)
    }


def utility(log_utility: float) -> float | None:
    """Number of its logarithm; None where it is not finite."""
    return math.exp(log_utility) if log_utility < 709.0 else None
