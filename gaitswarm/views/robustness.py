"""Robustness of a design against small changes of its variables."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gaitswarm.services.optimizer.analysis.evaluations import ObjectiveView
from gaitswarm.services.optimizer.analysis.preferences import IndexView
from gaitswarm.services.optimizer.analysis.robustness_index import (
    LocalSample,
    Robustness,
    Sensitivity,
)
from gaitswarm.services.optimizer.analysis.utilities import NORMALISED_OBJECTIVES
from gaitswarm.services.optimizer.views import View, finite
from gaitswarm.sim.catalogue import design_shown
from gaitswarm.sim.kernel.walk import Precision
from gaitswarm.sim.robot import RobotSource
from gaitswarm.sim.variables import Variable

_NAMES = tuple(objective.name for objective in NORMALISED_OBJECTIVES)


class SampledVariableView(View):
    """A sampled variable and its normalisation."""

    name: str = Field(description="Name of the variable.", examples=["FI1R"])
    unit: str = Field(description="Its unit.", examples=["counts"])
    low: float = Field(description="Lower bound by which it is normalised.", examples=[1500.0])
    high: float = Field(description="Upper bound by which it is normalised.", examples=[6000.0])
    value: float = Field(description="Of the design.", examples=[5837.0])
    least: float = Field(description="Least value of the sample.", examples=[5613.2])
    most: float = Field(description="Greatest value of the sample.", examples=[5999.1])


class ScenarioRobustnessView(View):
    """Effect of small changes of the variables in one scenario.

    Numbers are relative changes of an objective over a variable's whole bounds; null where too few
    of the sample's simulations completed.
    """

    index: IndexView | None = Field(description="Frobenius norm of the Jacobian.")
    spectral_norm: float | None = Field(
        description="Largest singular value of the Jacobian: the greatest relative change of all"
        " objectives together, by one step of length one [1].",
        examples=[1.1],
    )
    by_objective: dict[str, float | None] = Field(
        description="Norm of each objective's row of the Jacobian [1].",
        examples=[{"torque": 0.2, "acceleration": 0.9}],
    )
    by_variable: dict[str, float | None] = Field(
        description="Norm of each variable's column of the Jacobian [1].",
        examples=[{"FI1R": 0.7, "FOR": 0.8}],
    )
    jacobian: dict[str, dict[str, float | None]] = Field(
        description="Of the objectives' logarithms, by objective and variable [1].",
        examples=[{"torque": {"FI1R": -0.1, "FOR": 0.2}}],
    )
    standard_error: dict[str, dict[str, float | None]] = Field(
        description="Of the Jacobian's entries [1].",
        examples=[{"torque": {"FI1R": 0.01, "FOR": 0.02}}],
    )
    unexplained: dict[str, float | None] = Field(
        description="Standard deviation of the relative changes in the sample that the Jacobian"
        " does not explain, by objective [1].",
        examples=[{"torque": 0.004}],
    )
    walked: int = Field(description="Walks of the sample with all objectives.", examples=[257])
    failed: int = Field(description="Walks of the sample without.", examples=[0])

    @classmethod
    def from_sensitivity(
        cls, found: Sensitivity, variables: Sequence[Variable]
    ) -> ScenarioRobustnessView:
        """Make a view of one scenario's part."""
        names = [variable.name for variable in variables]
        return cls(
            index=None if found.index is None else IndexView.model_validate(found.index),
            spectral_norm=finite(found.spectral_norm),
            by_objective=_by_name(_NAMES, found.by_objective),
            by_variable=_by_name(names, found.by_variable),
            jacobian=_by_names(names, found.jacobian),
            standard_error=_by_names(names, found.standard_error),
            unexplained=_by_name(_NAMES, found.unexplained),
            walked=found.walked,
            failed=found.failed,
        )


class RobustnessView(View):
    """Robustness index: norm of the Jacobian of the normalised objectives (thesis 4.4.3).

    Objectives are normalised by taking their logarithms, variables by their bounds.
    """

    robot: RobotSource = Field(description="The robot, as requested.", examples=["szabadka2"])
    controller: str = Field(description="Controller that drove it.", examples=["fuzzy-pi"])
    design: dict[str, float | str] = Field(
        description="Value of every variable by name.", examples=[{"FI1R": 5837.0}]
    )
    precision: Precision = Field(description="Of the physics' numbers.", examples=["double"])
    samples: int = Field(description="Designs sampled around the given one.", examples=[256])
    radius: float = Field(
        description="Half the width of the box around the design, as a share of the bounds [1].",
        examples=[0.02],
    )
    seed: int = Field(description="Of the sample.", examples=[1])
    variables: list[SampledVariableView] = Field(description="Those that were changed.")
    held: list[str] = Field(
        description="Variables that were not: categorical ones, and integers whose next value is"
        " farther than the radius.",
        examples=[["FOMF"]],
    )
    objectives: list[ObjectiveView] = Field(description="Those that count, f1 to f5.")
    index: IndexView | None = Field(
        description="Root mean square of the scenarios' indices; null if a scenario has none."
    )
    by_objective: dict[str, float | None] = Field(
        description="Root mean square over the scenarios [1].", examples=[{"torque": 0.2}]
    )
    by_variable: dict[str, float | None] = Field(
        description="Root mean square over the scenarios [1].", examples=[{"FI1R": 0.7}]
    )
    scenarios: dict[str, ScenarioRobustnessView] = Field(description="By the scenario's name.")

    @classmethod
    def from_robustness(
        cls,
        found: Robustness,
        sample: LocalSample,
        *,
        robot: RobotSource,
        controller: str,
        precision: Precision,
        seed: int,
        scenarios: Sequence[str],
    ) -> RobustnessView:
        """Make a view of an estimate.

        Args:
            found: the estimate.
            sample: designs that walked.
            robot: that walked, as it was asked for.
            controller: that drove it.
            precision: of the physics' numbers.
            seed: of the sample.
            scenarios: names, in the estimate's order.
        """
        names = [variable.name for variable in sample.varied]
        center = dict(zip(sample.names, sample.designs[0].tolist(), strict=True))
        return cls(
            robot=robot,
            controller=controller,
            design=design_shown(controller, center),
            precision=precision,
            samples=len(sample.designs) - 1,
            radius=sample.radius,
            seed=seed,
            variables=[_sampled(sample, variable) for variable in sample.varied],
            held=list(sample.held),
            objectives=[ObjectiveView.model_validate(o) for o in NORMALISED_OBJECTIVES],
            index=None if found.index is None else IndexView.model_validate(found.index),
            by_objective=_by_name(_NAMES, found.by_objective),
            by_variable=_by_name(names, found.by_variable),
            scenarios={
                name: ScenarioRobustnessView.from_sensitivity(part, sample.varied)
                for name, part in zip(scenarios, found.scenarios, strict=True)
            },
        )


def _sampled(sample: LocalSample, variable: Variable) -> SampledVariableView:
    values = sample.designs[:, sample.names.index(variable.name)]
    return SampledVariableView(
        name=variable.name,
        unit=variable.unit,
        low=variable.low,
        high=variable.high,
        value=float(values[0]),
        least=float(values.min()),
        most=float(values.max()),
    )


def _by_name(names: Sequence[str], values: NDArray[np.float64]) -> dict[str, float | None]:
    return {name: finite(value) for name, value in zip(names, values.tolist(), strict=True)}


def _by_names(
    variables: Sequence[str], values: NDArray[np.float64]
) -> dict[str, dict[str, float | None]]:
    rows = zip(_NAMES, values, strict=True)
    return {objective: _by_name(variables, row) for objective, row in rows}
