"""One design walking on request: what is asked, and how it is done. Knows nothing of HTTP."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, model_validator

from gaitswarm.views import SimulationView
from services.optimizer.errors import InvalidRequest
from services.optimizer.jobs.preference import PREFERENCES, Preference, PreferenceChoice
from sim.assembly import Backend, check_precision
from sim.catalogue import check_design, design_numbers
from sim.controllers import CONTROLLERS, ControllerName
from sim.errors import SimulationInputError
from sim.kernel.walk import Precision
from sim.robot import DEFAULT_ROBOT, RobotSource, load_robot
from sim.scenario import SCENARIOS, Scenario, ScenarioChoice, find_scenario
from sim.simulate import Simulation, check_reach, simulate
from sim.variables import VariableName, VariableValue
from sim.worlds import WorldWalk, check_worlds

PUBLISHED_DESIGN = dict(CONTROLLERS["fuzzy-pi"].published["A"])


class WalkRequest(BaseModel):
    """One design, and the robot that it drives."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    robot: RobotSource = Field(
        default=DEFAULT_ROBOT,
        description="Robot to simulate, by name, or a variant with another law of friction or with"
        " backlash, or the text of the files of your own.",
    )
    controller: ControllerName = Field(
        default="fuzzy-pi", description="Motor controller that drives it; see /v1/controllers."
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
        """The design as the simulator takes it: of categorical variables the index of a choice."""
        return design_numbers(self.controller, self.design)

    def simulated_seconds(self, scenarios: Sequence[Scenario]) -> float:
        """How long the robot walks, the measure of what the request costs.

        Args:
            scenarios: The walks of the request, in full.

        Returns:
            Length of all walks together [s]; a cycle time of the design goes before a scenario's.
        """
        cycle_time = self.numbers.get("cycle_time")
        return sum(
            scenario.cycles * (scenario.cycle_time if cycle_time is None else cycle_time)
            for scenario in scenarios
        )

    def check_design(self) -> None:
        """Check that the controller can have the design's values.

        Raises:
            InvalidRequest: It cannot; its field is `design`.
        """
        try:
            CONTROLLERS[self.controller].compile(self.numbers)
        except SimulationInputError as error:
            raise InvalidRequest(str(error), field="design") from error

    def check_reach(self, scenario: Scenario, *, field: str) -> None:
        """Check that the legs reach the gait's trajectory.

        Args:
            scenario: The walk, in full.
            field: Field of the request that is to blame if they do not.

        Raises:
            InvalidRequest: They do not; names scenario, leg and distance.
        """
        names, values = tuple(self.design), tuple(self.numbers.values())
        try:
            check_reach(scenario, names, values, robot=self.robot)
        except SimulationInputError as error:
            raise InvalidRequest(str(error), field=field) from error


def resolved(entry: str | Scenario) -> Scenario:
    """A scenario in full.

    Args:
        entry: The scenario, or name or number of a preset.

    Returns:
        The scenario itself, a preset looked up.
    """
    return find_scenario(entry) if isinstance(entry, str) else entry


class WorldRequest(WalkRequest):
    """One design in a world, by default that of the model."""

    world: dict[VariableName, FiniteFloat] = Field(
        default_factory=dict,
        description="What is different from the model, as in a world of a certificate: values of"
        " perturbations by name; those that are not named are nominal.",
        examples=[{}, {"friction_factor": 0.75}],
    )

    @model_validator(mode="after")
    def _world_can_be(self) -> Self:
        try:
            check_worlds(tuple(self.world), self._worlds)
        except SimulationInputError as error:
            raise ValueError(f"world.{error}") from error
        return self

    @property
    def _worlds(self) -> NDArray[np.float64]:
        return np.array([tuple(self.world.values())], dtype=np.float64)

    def walk(
        self,
        scenario: Scenario,
        *,
        log: bool,
        backend: Backend = "auto",
        precision: Precision = "double",
    ) -> Simulation:
        """Let the design walk through a scenario of its world.

        Args:
            scenario: The walk, in full.
            log: Whether to keep its log.
            backend: Which kernel; of another world than the nominal one always the first that
                works on this machine.
            precision: Of the physics' numbers.

        Returns:
            The walk.
        """
        names, values = tuple(self.design), tuple(self.numbers.values())
        if self.world:
            design, known = tuple(self.numbers.items()), tuple(self.world)
            case = WorldWalk(self.robot, self.controller, design, scenario, known, precision)
            return case.simulate(self._worlds, log=log)
        return simulate(
            scenario,
            self.controller,
            names,
            np.array([values], dtype=np.float64),
            robot=self.robot,
            log=log,
            backend=backend,
            precision=precision,
        )


class WalksRequest(WalkRequest):
    """One design and the walks in which to try it."""

    scenarios: tuple[ScenarioChoice, ...] = Field(
        default=tuple(scenario.name for scenario in SCENARIOS),
        min_length=1,
        max_length=32,
        description="Walks: names or numbers of presets (see /v1/scenarios), or your own.",
        examples=[["normal-fast", "2"]],
    )
    precision: Precision = Field(
        default="double",
        description="Of the physics' numbers: `double`, or `single`, which is about twice as fast"
        " and needs a C compiler.",
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

    def check_walks(self) -> None:
        """Check every walk before the first is run.

        Raises:
            InvalidRequest: The design cannot be compiled, a gait leaves the legs' reach, or this
                machine has not the precision; names the field.
        """
        self.check_design()
        try:
            check_precision(load_robot(self.robot), self.precision)
        except SimulationInputError as error:
            text = str(error).removeprefix("precision: ")
            raise InvalidRequest(text, field="precision") from error
        for index, scenario in enumerate(self.resolved_scenarios()):
            self.check_reach(scenario, field=f"scenarios.{index}")


class SimulationRequest(WalksRequest, WorldRequest):
    """One design, the walks in which to try it, and how they are judged."""

    preference: PreferenceChoice = Field(
        default="A",
        description="How objectives are weighed: A, B, C of table 4.5, chapter-3 for eq. 3.1, or"
        " your own.",
    )
    log: bool = Field(
        default=False, description="Whether to return the 500 Hz log of every walk; it is large."
    )

    def resolved_preference(self) -> Preference:
        """The preference in full."""
        return PREFERENCES[self.preference] if isinstance(self.preference, str) else self.preference


def run_simulation(request: SimulationRequest, *, backend: Backend = "auto") -> SimulationView:
    """Let the design walk in every scenario.

    Args:
        request: The design and its walks.
        backend: `native` is the compiled kernel, `reference` the CasADi interpreter, `auto` the
            first that works on this machine.

    Returns:
        Status and objectives of every walk, with logs if the request asks for them.

    Raises:
        InvalidRequest: The design cannot be compiled, or a gait leaves the legs' reach; names the
            field.
    """
    request.check_walks()
    scenarios = request.resolved_scenarios()
    walks = [
        request.walk(scenario, log=request.log, backend=backend, precision=request.precision)
        for scenario in scenarios
    ]
    return SimulationView.from_walks(
        robot=request.robot,
        controller=request.controller,
        design=request.numbers,
        preference=request.resolved_preference(),
        precision=request.precision,
        names=[scenario.name for scenario in scenarios],
        statuses=np.concatenate([walk.outcome.statuses for walk in walks]),
        objectives=np.concatenate([walk.outcome.objectives for walk in walks]),
        measurements=np.concatenate([walk.measurements.array() for walk in walks]),
        logs=[log for walk in walks for log in walk.logs],
    )
