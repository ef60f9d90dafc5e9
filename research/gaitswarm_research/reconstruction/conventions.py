"""Choices of conventions: the default, its single changes, and their effect on the targets.

A choice maps names of the calibration's variables to numbers (indices of categorical choices);
variables that it leaves out have the default's value.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from gaitswarm import (
    CONTROLLERS,
    SCENARIOS,
    CalibrationSpec,
    InvalidRequest,
    TargetWalk,
    Variable,
)
from gaitswarm.plugins import Outcome, load_robot

Floats = NDArray[np.float64]

Choice: TypeAlias = Mapping[str, float]

_VALUES: Final[Mapping[str, tuple[float, ...]]] = {
    "current_filter": (0.0, 0.005, 0.05),
    "large_begins": (0.0, 0.3, 0.6),
    "small_ends": (0.25, 1.0),
    "positive_peak": (0.5,),
    "extreme_peak": (1.0, 3.0),
    "universe": (1.0, 2.0, 4.5),
    "trajectory_rate": (28.0, 100.0),
    "start_phase": (0.5,),
    "stride": (0.04, 0.08, 0.12, 0.16),
    "height": (0.02, 0.03),
    "duty_factor": (0.5, 0.65),
    "fir_ms": (33.0, 93.0),
}
"""Values that are tried of numerical conventions; of a categorical one all choices are."""

UNFITTED: Final = {"fuzzy-pso": "fuzzy-pi-3", "pi-pso": "pi"}
"""Published optima of table 3.6 that are not targets, with their controllers."""

_PREDICTED: Final = (
    "torque",
    "acceleration",
    "angular_acceleration",
    "energy",
    "height_loss",
    "speed",
)

CHAPTER_4: Final = "fuzzy-pi"
"""Controller of chapter 4."""


@dataclass(frozen=True, slots=True)
class Alternative:
    """One convention at another value than the default's.

    Attributes:
        value: Value of the variable; of a categorical one the index of the choice.
    """

    variable: Variable
    value: float

    @property
    def choice(self) -> dict[str, float]:
        """The alternative as a choice of conventions."""
        return {self.variable.name: self.value}

    @property
    def shown(self) -> str:
        """The value as text."""
        value = self.variable.shown(self.value)
        return value if isinstance(value, str) else f"{value:g}"


def alternatives(
    spec: CalibrationSpec, names: Sequence[str] | None = None
) -> tuple[Alternative, ...]:
    """List the other choices of categorical conventions, and some values of numerical ones."""
    variables = {variable.name: variable for variable in spec.design_space().variables}
    for name in names or ():
        if name not in variables:
            raise InvalidRequest(
                f"unknown convention {name!r}; known are {', '.join(variables)}", field="change"
            )
    default = default_choice(spec, CHAPTER_4)
    return tuple(
        Alternative(variable, value)
        for name, variable in variables.items()
        if names is None or name in names
        for value in _VALUES.get(name, tuple(map(float, range(len(variable.choices)))))
        if value != default[name]
    )


def default_choice(spec: CalibrationSpec, controller: str) -> dict[str, float]:
    """Values of all variables in the model as it ships."""
    robot = load_robot(spec.robot).description
    values: dict[str, Any] = SCENARIOS[0].model_dump() | {
        "robot": str(spec.robot),
        "planned_soles": robot.planned_soles,
        "contact_law": robot.contact_law,
        "energy": robot.supply.energy,
        "current_filter": robot.sensors.current_filter,
    }
    for owner in (CHAPTER_4, controller):
        for variable in CONTROLLERS[owner].conventions:
            if variable.default is not None:
                values[variable.name] = variable.default
    return {v.name: v.number(values[v.name]) for v in spec.design_space().variables}


def simulated_targets(
    spec: CalibrationSpec, choices: Sequence[Choice], workers: Executor
) -> tuple[Floats, Floats]:
    """Simulate the targets under every choice: (n, T) values, and (n,) misfits [tolerances]."""
    outcomes = _outcomes(spec, choices, workers)
    objectives = np.stack([outcome.objectives for outcome in outcomes], axis=1)
    failed = np.stack([outcome.statuses != 0 for outcome in outcomes], axis=1)
    return spec.simulated(objectives, failed), spec.judge(objectives, failed).fitness


def _outcomes(spec: CalibrationSpec, choices: Sequence[Choice], workers: Executor) -> list[Outcome]:
    """Outcomes of all choices in every case, in the order of `spec.case_names`."""
    controllers = [walk.controller for _, walk, _ in spec.layout().cases]
    defaults = [default_choice(spec, controller) for controller in controllers]
    rows = [
        np.array([list((default | dict(choice)).values()) for choice in choices])
        for default in defaults
    ]
    return list(workers.map(lambda case, designs: case.run(designs), spec.cases({}), rows))


def predicted(
    spec: CalibrationSpec, choices: Sequence[Choice], workers: Executor
) -> list[dict[str, dict[str, float | None]]]:
    """Simulate the published optima that are no targets, for every choice by optimum and result."""
    walks = [
        TargetWalk(
            name=name,
            controller=controller,
            design=dict(CONTROLLERS[controller].published[name]),
            scenarios=("straight",),
        )
        for name, controller in UNFITTED.items()
    ]
    # The fitted walks stay: their controllers have the conventions that are varied.
    extended = spec.model_copy(update={"walks": (*spec.walks, *walks)})
    outcomes = dict(zip(extended.case_names, _outcomes(extended, choices, workers), strict=True))
    names = [objective.name for objective in spec.objectives]
    columns = {name: names.index(name) for name in _PREDICTED}
    return [
        {
            optimum: {
                name: float(value) if np.isfinite(value) else None
                for name, column in columns.items()
                for value in [outcomes[optimum].objectives[row, column]]
            }
            for optimum in UNFITTED
        }
        for row in range(len(choices))
    ]
