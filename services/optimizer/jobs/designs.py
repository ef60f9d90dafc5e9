"""Single designs in requests."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, FiniteFloat, model_validator

from gaitswarm.services.optimizer.errors import simulation_errors
from gaitswarm.services.optimizer.jobs.preference import PREFERENCES, Preference, PreferenceChoice
from gaitswarm.services.optimizer.views import Request
from gaitswarm.sim.assembly import check_precision
from gaitswarm.sim.catalogue import GAIT_CATALOGUE, check_design, design_numbers, with_gait
from gaitswarm.sim.controllers import CONTROLLERS, ControllerName
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.kernel import Precision
from gaitswarm.sim.robot import DEFAULT_ROBOT, RobotSource, load_robot
from gaitswarm.sim.scenario import SCENARIOS, Scenario, ScenarioChoice, Scenarios
from gaitswarm.sim.simulate import Simulation, check_drives, check_reach, simulate
from gaitswarm.sim.variables import VariableName, VariableValue
from gaitswarm.sim.worlds.perturbations import check_worlds
from gaitswarm.sim.worlds.walks import MeasuredPerturbedWalk, ground_of

PUBLISHED_DESIGN = dict(CONTROLLERS["fuzzy-pi"].published["A"])


class DesignRequest(Request):
    """A design and the robot that it drives."""

    robot: RobotSource = DEFAULT_ROBOT
    """Robot to simulate, by name, or a variant with another law of friction or with backlash, or
    the text of the files of your own."""
    controller: ControllerName = "fuzzy-pi"
    """Motor controller that drives it; see /v1/controllers."""
    design: dict[VariableName, VariableValue] = Field(examples=[PUBLISHED_DESIGN])
    """Value of each of the controller's variables, and of any gait variable, which then replaces
    the scenario's value; names and units as in /v1/controllers. A categorical one takes a choice's
    name or index."""

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
        with simulation_errors("design"):
            law = CONTROLLERS[self.controller].compile(self.numbers)
        with simulation_errors("controller"):
            check_drives(law, self.robot)

    def walked(self, scenario: Scenario) -> Scenario:
        """A scenario with the design's gait parameters."""
        gait = {name: value for name, value in self.numbers.items() if name in GAIT_CATALOGUE}
        return with_gait(scenario, gait)

    def check_reach(self, scenario: Scenario, *, field: str) -> None:
        """Check that the legs reach the gait's trajectory."""
        names, values = tuple(self.design), tuple(self.numbers.values())
        with simulation_errors(field):
            check_reach(scenario, names, values, robot=self.robot)


class ScenariosRequest(Scenarios, DesignRequest):
    """A design and its scenarios."""

    scenarios: tuple[ScenarioChoice, ...] = Field(
        default=tuple(scenario.name for scenario in SCENARIOS),
        min_length=1,
        max_length=32,
        description="Scenarios: names or numbers of presets (see /v1/scenarios), or your own.",
        examples=[["normal-fast", "2"]],
    )

    def check_gaits(self) -> None:
        """Check every scenario's gait."""
        for index, scenario in enumerate(self.resolved_scenarios()):
            self.check_reach(scenario, field=f"scenarios.{index}")


class WorldRequest(DesignRequest):
    """A design in a perturbed world, by default the nominal one."""

    world: dict[VariableName, FiniteFloat] = Field(
        default_factory=dict,
        description="Perturbations of the model, as in a world of a certificate: values of"
        " perturbations by name; those that are not named are nominal.",
        examples=[{}, {"friction_factor": 0.75}],
    )

    @model_validator(mode="after")
    def _world_can_be(self) -> Self:
        try:
            check_worlds(tuple(self.world), np.array([tuple(self.world.values())], np.float64))
        except SimulationInputError as error:
            raise ValueError(f"world.{error}") from error
        return self

    def check_reach(self, scenario: Scenario, *, field: str) -> None:
        """Check also that the scenario's ground takes the world's roughness."""
        super().check_reach(scenario, field=field)
        with simulation_errors("world"):
            ground_of(scenario, self.world.get("roughness", 0.0))

    def perturbed_walk(
        self, scenario: Scenario, precision: Precision = "double"
    ) -> MeasuredPerturbedWalk:
        """The simulation of designs with these variables in the world."""
        return MeasuredPerturbedWalk(
            scenario.name,
            self.robot,
            self.controller,
            scenario,
            tuple(self.world.items()),
            tuple(self.design),
            precision,
        )

    def walk(
        self,
        scenario: Scenario,
        designs: NDArray[np.float64] | None = None,
        *,
        log: bool,
        precision: Precision = "double",
    ) -> Simulation:
        """Simulate the design, or others of the same variables, in a scenario of its world."""
        if designs is None:
            designs = np.array([tuple(self.numbers.values())], dtype=np.float64)
        if self.world:
            return self.perturbed_walk(scenario, precision).simulate(designs, log=log)
        return simulate(
            scenario,
            self.controller,
            tuple(self.design),
            designs,
            robot=self.robot,
            log=log,
            precision=precision,
        )


class WalksRequest(ScenariosRequest):
    """A design and the scenarios in which to simulate it."""

    precision: Precision = "double"
    """Of the physics' numbers: `double`, or `single`, which is about twice as fast and needs a C
    compiler."""

    def check_walks(self) -> None:
        """Check every scenario before the first simulation."""
        self.check_design()
        with simulation_errors("precision"):
            check_precision(load_robot(self.robot), self.precision)
        self.check_gaits()


class SimulationRequest(WalksRequest, WorldRequest):
    """A design, its scenarios, and how to judge it."""

    preference: PreferenceChoice = "A"
    """How objectives are weighed: A, B, C of table 4.5, chapter-3 for eq. 3.1, or your own."""
    log: bool = False
    """Whether to return the 500 Hz log of every scenario; logs are large."""

    def resolved_preference(self) -> Preference:
        """The preference in full."""
        return PREFERENCES[self.preference] if isinstance(self.preference, str) else self.preference
