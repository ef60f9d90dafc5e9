"""One convention changed at a time from the default, and how far off that leaves the targets."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.kinds.calibration import CalibrationSpec
from gaitswarm.sim.calibration.targets import TargetWalk
from gaitswarm.sim.calibration.walk import RESULTS, ROBOT, CalibrationWalk
from gaitswarm.sim.controllers import CONTROLLERS, ControllerName
from gaitswarm.sim.near_names import instead_of
from gaitswarm.sim.outcome import Outcome
from gaitswarm.sim.robot import load_robot
from gaitswarm.sim.scenario import SCENARIOS, Scenario, find_scenario
from gaitswarm.sim.variables import Variable

Floats = NDArray[np.float64]

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
"""What is tried of a convention that is a number; of a categorical one every choice is."""

KEPT: Final[Mapping[str, ControllerName]] = {"fuzzy-pso": "fuzzy-pi-3", "pi-pso": "pi"}
"""Published optima of table 3.6 that are no targets, with their controllers."""

_SHOWN: Final = (
    "torque",
    "acceleration",
    "angular_acceleration",
    "energy",
    "height_loss",
    "speed",
)

_CHAPTER_4: Final = "fuzzy-pi"


@dataclass(frozen=True, slots=True)
class Alternative:
    """One convention at another value than the default's.

    Attributes:
        variable: that is changed.
        value: of it; of a categorical one the index of the choice.
    """

    variable: Variable
    value: float

    @property
    def choice(self) -> dict[str, float]:
        """As walks take it."""
        return {self.variable.name: self.value}

    @property
    def shown(self) -> str:
        """The value as people read it."""
        value = self.variable.shown(self.value)
        return value if isinstance(value, str) else f"{value:g}"


def alternatives(
    spec: CalibrationSpec, names: Sequence[str] | None = None
) -> tuple[Alternative, ...]:
    """Every other choice of categorical conventions, and some values of the others."""
    variables = {variable.name: variable for variable in spec.design_space().variables}
    for name in names or ():
        if name not in variables:
            raise InvalidRequest(
                f"unknown convention {name!r}; {instead_of(name, variables)}", field="change"
            )
    default = default_choice(spec, _CHAPTER_4)
    return tuple(
        Alternative(variable, value)
        for name, variable in variables.items()
        if names is None or name in names
        for value in _VALUES.get(name, tuple(map(float, range(len(variable.choices)))))
        if value != default[name]
    )


def default_choice(spec: CalibrationSpec, controller: ControllerName) -> dict[str, float]:
    """Values of the spec's variables in the model as it is shipped."""
    robot = load_robot(spec.robot).description
    known: dict[str, Any] = SCENARIOS[0].model_dump() | {
        ROBOT: str(spec.robot),
        "planned_soles": robot.planned_soles,
        "contact_law": robot.contact_law,
        "energy": robot.supply.energy,
        "current_filter": robot.sensors.current_filter,
    }
    for owner in (_CHAPTER_4, controller):
        for variable in CONTROLLERS[owner].conventions:
            if variable.default is not None:
                known[variable.name] = variable.default
    return {v.name: v.number(known[v.name]) for v in spec.design_space().variables}


def simulated_targets(
    spec: CalibrationSpec, choices: Sequence[Mapping[str, float]], workers: Executor
) -> tuple[Floats, Floats]:
    """What choices of conventions come to."""
    cases = spec.layout().cases
    outcomes = list(
        workers.map(lambda case: _outcome(spec, case[0], case[1], case[2], choices), cases)
    )
    objectives = np.stack([outcome.objectives for outcome in outcomes], axis=1)
    failed = np.stack([outcome.statuses != 0 for outcome in outcomes], axis=1)
    return spec.simulated(objectives, failed), spec.judge(objectives, failed).fitness


def _outcome(
    spec: CalibrationSpec,
    name: str,
    walk: TargetWalk,
    scenario: Scenario,
    choices: Sequence[Mapping[str, float]],
) -> Outcome:
    """All choices in one batch, each with the default of what it does not give."""
    default = default_choice(spec, walk.controller)
    rows = np.array([list((default | dict(choice)).values()) for choice in choices])
    case = CalibrationWalk(
        name, spec.described, walk.controller, walk.numbers, scenario, tuple(default)
    )
    return case.run(rows)


def predicted(
    spec: CalibrationSpec, choices: Sequence[Mapping[str, float]]
) -> list[dict[str, dict[str, float | None]]]:
    """What published optima come to of which no value was a target."""
    found: list[dict[str, dict[str, float | None]]] = [{} for _ in choices]
    for name, controller in KEPT.items():
        design = dict(CONTROLLERS[controller].published[name])
        walk = TargetWalk(name=name, controller=controller, design=design, scenarios=("straight",))
        outcome = _outcome(spec, name, walk, find_scenario("straight"), choices)
        for one, row in zip(found, outcome.objectives.tolist(), strict=True):
            values = dict(zip((r.name for r in RESULTS), row, strict=True))
            one[name] = {k: values[k] if np.isfinite(values[k]) else None for k in _SHOWN}
    return found
