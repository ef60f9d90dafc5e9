"""One design walking on request: what is asked, and how it is done. Knows nothing of HTTP."""

from __future__ import annotations

from typing import Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, field_validator, model_validator

from api.views import SimulationView
from services.optimizer.errors import InvalidRequest
from services.optimizer.preference import PREFERENCES, Preference, PreferenceName
from sim.controllers import CONTROLLERS, ControllerName
from sim.errors import SimulationInputError
from sim.robot import RobotSource
from sim.scenario import (
    GAIT_VARIABLE_NAMES,
    SCENARIOS,
    Scenario,
    ScenarioName,
    find_scenario,
)
from sim.simulate import Backend, check_reach, simulate
from sim.variables import VariableName


class SimulationRequest(BaseModel):
    """One design and the walks in which to try it."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    robot: RobotSource = Field(
        default="szabadka2",
        description="Robot to simulate, by name, or a variant with another law of friction or with"
        " gearlash, or the text of the files of your own.",
    )
    controller: ControllerName = Field(
        default="fuzzy-pi", description="Motor controller that drives it; see /v1/controllers."
    )
    design: dict[VariableName, FiniteFloat] = Field(
        description="Value of each of the controller's variables, and of any gait variable, which"
        " then replaces the scenario's value; names and units as in /v1/controllers.",
        examples=[
            {
                "I": 0.171,
                "FI1R": 5837,
                "FI2R": 20111,
                "FOR": 781,
                "FOMF": 2,
                "FW1": 0.187,
                "FW23": 0.961,
                "FW4": 0.789,
                "FW56": 0.927,
            }
        ],
    )
    scenarios: tuple[ScenarioName | Scenario, ...] = Field(
        default=tuple(scenario.name for scenario in SCENARIOS),
        min_length=1,
        max_length=32,
        description="Walks: names or numbers of presets (see /v1/scenarios), or your own.",
        examples=[["normal-fast", "2"]],
    )
    preference: PreferenceName | Preference = Field(
        default="A", description="How objectives are weighed: A, B, C of table 4.5, or your own."
    )
    log: bool = Field(
        default=False, description="Whether to return the 500 Hz log of every walk; it is large."
    )

    @field_validator("scenarios")
    @classmethod
    def _presets_exist(cls, entries: tuple[str | Scenario, ...]) -> tuple[str | Scenario, ...]:
        for entry in entries:
            if isinstance(entry, str):
                find_scenario(entry)
        return entries

    @model_validator(mode="after")
    def _can_be_run(self) -> Self:
        names = [scenario.name for scenario in self.resolved_scenarios()]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"scenarios: {name!r} is named twice")
        needed = [variable.name for variable in CONTROLLERS[self.controller].variables]
        for name in self.design:
            if name not in needed and name not in GAIT_VARIABLE_NAMES:
                known = ", ".join([*needed, *sorted(GAIT_VARIABLE_NAMES)])
                raise ValueError(f"design: unknown variable {name!r}; known are {known}")
        missing = [name for name in needed if name not in self.design]
        if missing:
            raise ValueError(f"design: {', '.join(missing)} missing; {self.controller} needs it")
        return self

    def resolved_scenarios(self) -> tuple[Scenario, ...]:
        """The scenarios in full, presets looked up."""
        return tuple(find_scenario(s) if isinstance(s, str) else s for s in self.scenarios)

    def resolved_preference(self) -> Preference:
        """The preference in full."""
        return PREFERENCES[self.preference] if isinstance(self.preference, str) else self.preference

    def simulated_seconds(self) -> float:
        """Length of all walks together [s], the measure of what the request costs."""
        cycle_time = self.design.get("cycle_time")
        return sum(
            scenario.cycles * (scenario.cycle_time if cycle_time is None else cycle_time)
            for scenario in self.resolved_scenarios()
        )


def run_simulation(request: SimulationRequest, *, backend: Backend = "auto") -> SimulationView:
    """Let the design walk in every scenario.

    Raises InvalidRequest that names the field for a design that cannot be compiled or a gait that
    leaves the legs' reach.
    """
    scenarios = request.resolved_scenarios()
    names = tuple(request.design)
    values = tuple(request.design.values())
    _check(request, scenarios, names, values)
    walks = [
        simulate(
            scenario,
            request.controller,
            names,
            np.array([values], dtype=np.float64),
            robot=request.robot,
            log=request.log,
            backend=backend,
        )
        for scenario in scenarios
    ]
    return SimulationView.from_walks(
        robot=request.robot,
        controller=request.controller,
        design=request.design,
        preference=request.resolved_preference(),
        names=[scenario.name for scenario in scenarios],
        statuses=np.concatenate([walk.outcome.statuses for walk in walks]),
        objectives=np.concatenate([walk.outcome.objectives for walk in walks]),
        logs=[log for walk in walks for log in walk.logs],
    )


def _check(
    request: SimulationRequest,
    scenarios: tuple[Scenario, ...],
    names: tuple[str, ...],
    values: tuple[float, ...],
) -> None:
    """All walks before the first is run."""
    try:
        CONTROLLERS[request.controller].compile(request.design)
    except SimulationInputError as error:
        raise InvalidRequest(str(error), field="design") from error
    for index, scenario in enumerate(scenarios):
        try:
            check_reach(scenario, names, values, robot=request.robot)
        except SimulationInputError as error:
            raise InvalidRequest(str(error), field=f"scenarios.{index}") from error
