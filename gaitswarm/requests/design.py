"""Designs and scenarios in requests."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from gaitswarm.errors import simulation_errors
from gaitswarm.robots import DEFAULT_CONTROLLER
from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.sim.catalogue import check_design, design_numbers
from gaitswarm.sim.controllers import CONTROLLERS, ControllerName
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.gait_variables import GAIT_CATALOGUE, with_gait
from gaitswarm.sim.robot import DEFAULT_ROBOT, RobotSource
from gaitswarm.sim.scenario import SCENARIOS, Scenario, ScenarioChoice, find_scenario
from gaitswarm.sim.simulate import check_drives, check_reach
from gaitswarm.sim.variables import VariableName, VariableValue

PUBLISHED_DESIGN = dict(CONTROLLERS["fuzzy-pi"].published["A"])


class DesignRequest(BaseModel):
    """A design and the robot that it drives."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    robot: RobotSource = Field(
        default=DEFAULT_ROBOT,
        description="Robot to simulate, by name, or a variant with another law of friction or with"
        " backlash, or the text of the files of your own.",
    )
    controller: ControllerName = Field(
        default=DEFAULT_CONTROLLER,
        description="Motor controller that drives it; see /v1/controllers.",
    )
    design: dict[VariableName, VariableValue] = Field(
        description="Value of each of the controller's variables, and of any gait variable, which"
        " then replaces the scenario's value; names and units as in /v1/controllers. A categorical"
        " one takes a choice's name or index.",
        examples=[PUBLISHED_DESIGN],
    )

    @model_validator(mode="after")
    def _design_fits(self) -> Self:
        check_design(self.controller, self.design)
        return self

    @property
    def numbers(self) -> dict[str, float]:
        """The design as numbers: of categorical variables the index of a choice."""
        return design_numbers(self.controller, self.design)

    def simulated_seconds(self, scenarios: Sequence[Scenario]) -> float:
        """Simulated time, the measure of the request's cost."""
        cycle_time = self.numbers.get("cycle_time")
        return sum(
            scenario.cycles * (scenario.cycle_time if cycle_time is None else cycle_time)
            for scenario in scenarios
        )

    def check_design(self) -> None:
        """Check that the design suits the controller, and the controller the robot."""
        try:
            law = CONTROLLERS[self.controller].compile(self.numbers)
        except SimulationInputError as error:
            raise InvalidRequest(str(error), field="design") from error
        with simulation_errors("controller"):
            check_drives(law, self.robot)

    def walked(self, scenario: Scenario) -> Scenario:
        """A scenario with the design's gait parameters."""
        gait = {name: value for name, value in self.numbers.items() if name in GAIT_CATALOGUE}
        return with_gait(scenario, gait)

    def check_reach(self, scenario: Scenario, *, field: str) -> None:
        """Check that the legs reach the gait's trajectory."""
        names, values = tuple(self.design), tuple(self.numbers.values())
        try:
            check_reach(scenario, names, values, robot=self.robot)
        except SimulationInputError as error:
            raise InvalidRequest(str(error), field=field) from error


class ScenariosRequest(DesignRequest):
    """A design and its scenarios."""

    scenarios: tuple[ScenarioChoice, ...] = Field(
        default=tuple(scenario.name for scenario in SCENARIOS),
        min_length=1,
        max_length=32,
        description="Scenarios: names or numbers of presets (see /v1/scenarios), or your own.",
        examples=[["normal-fast", "2"]],
    )

    @model_validator(mode="after")
    def _names_are_unique(self) -> Self:
        names = [scenario.name for scenario in self.resolved_scenarios()]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"scenarios: {name!r} is named twice")
        return self

    def resolved_scenarios(self) -> tuple[Scenario, ...]:
        """The scenarios in full, presets looked up."""
        return tuple(map(resolved, self.scenarios))

    def check_gaits(self) -> None:
        """Check every scenario's gait."""
        for index, scenario in enumerate(self.resolved_scenarios()):
            self.check_reach(scenario, field=f"scenarios.{index}")


def resolved(entry: str | Scenario) -> Scenario:
    """A scenario in full."""
    return find_scenario(entry) if isinstance(entry, str) else entry
