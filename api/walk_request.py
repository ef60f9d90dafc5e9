"""What a request for walks of one design says of the design. Knows nothing of HTTP."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Self

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, model_validator

from services.optimizer.errors import InvalidRequest
from sim.controllers import CONTROLLERS, ControllerName
from sim.errors import SimulationInputError
from sim.robot import RobotSource
from sim.scenario import GAIT_VARIABLE_NAMES, Scenario, ScenarioName, find_scenario
from sim.simulate import check_reach
from sim.variables import VariableName

PUBLISHED_DESIGN = dict(CONTROLLERS["fuzzy-pi"].published["A"])


class WalkRequest(BaseModel):
    """One design, and the robot that it drives."""

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
        examples=[PUBLISHED_DESIGN],
    )

    @model_validator(mode="after")
    def _design_fits(self) -> Self:
        check_names(self.controller, self.design)
        return self

    def simulated_seconds(self, scenarios: Sequence[Scenario]) -> float:
        """Length of all walks together [s], the measure of what the request costs."""
        cycle_time = self.design.get("cycle_time")
        return sum(
            scenario.cycles * (scenario.cycle_time if cycle_time is None else cycle_time)
            for scenario in scenarios
        )

    def check_design(self) -> None:
        """Raise InvalidRequest for values that the controller cannot have."""
        try:
            CONTROLLERS[self.controller].compile(self.design)
        except SimulationInputError as error:
            raise InvalidRequest(str(error), field="design") from error

    def check_reach(self, scenario: Scenario, *, field: str) -> None:
        """Raise InvalidRequest of `field` for a gait that leaves the legs' reach."""
        names, values = tuple(self.design), tuple(self.design.values())
        try:
            check_reach(scenario, names, values, robot=self.robot)
        except SimulationInputError as error:
            raise InvalidRequest(str(error), field=field) from error


def check_names(controller: ControllerName, design: Mapping[str, float]) -> None:
    """Raise ValueError for a variable that the controller and the gait don't know, or lack."""
    needed = [variable.name for variable in CONTROLLERS[controller].variables]
    for name in design:
        if name not in needed and name not in GAIT_VARIABLE_NAMES:
            known = ", ".join([*needed, *sorted(GAIT_VARIABLE_NAMES)])
            raise ValueError(f"design: unknown variable {name!r}; known are {known}")
    missing = [name for name in needed if name not in design]
    if missing:
        raise ValueError(f"design: {', '.join(missing)} missing; {controller} needs it")


def resolved(entry: ScenarioName | Scenario) -> Scenario:
    """The scenario in full, a preset looked up."""
    return find_scenario(entry) if isinstance(entry, str) else entry
