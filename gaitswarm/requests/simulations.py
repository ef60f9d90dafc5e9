"""Simulations of single designs"""

from __future__ import annotations

from typing import Final, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, FiniteFloat, model_validator

from gaitswarm.meshes import urdf_digest
from gaitswarm.requests.design import DesignRequest, ScenariosRequest, resolved
from gaitswarm.robots import DEFAULT_PREFERENCE
from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.preference import PREFERENCES, Preference, PreferenceChoice
from gaitswarm.sim.assembly import check_precision
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.gait.stability import static_stability
from gaitswarm.sim.kernel.walk import Precision
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.replay import CONTROL_RATE, replay
from gaitswarm.sim.robot import RobotFiles, load_robot
from gaitswarm.sim.scenario import Scenario, ScenarioChoice
from gaitswarm.sim.simulate import Simulation, simulate
from gaitswarm.sim.variables import VariableName
from gaitswarm.sim.worlds import WorldWalk, check_worlds
from gaitswarm.views import SimulationView
from gaitswarm.views.replay import encoded_replay


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
        precision: Precision = "double",
    ) -> Simulation:
        """Simulate the design in a scenario of its world."""
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
            precision=precision,
        )


class WalksRequest(ScenariosRequest):
    """A design and the scenarios in which to simulate it."""

    precision: Precision = Field(
        default="double",
        description="Of the physics' numbers: `double`, or `single`, which is about twice as fast"
        " and needs a C compiler.",
    )

    def check_walks(self) -> None:
        """Check every scenario before the first simulation."""
        self.check_design()
        try:
            check_precision(load_robot(self.robot), self.precision)
        except SimulationInputError as error:
            text = str(error).removeprefix("precision: ")
            raise InvalidRequest(text, field="precision") from error
        self.check_gaits()


class SimulationRequest(WalksRequest, WorldRequest):
    """A design, its scenarios, and how to judge it."""

    preference: PreferenceChoice = Field(
        default=DEFAULT_PREFERENCE,
        description="How objectives are weighed: A, B, C of table 4.5, chapter-3 for eq. 3.1, or"
        " your own.",
    )
    log: bool = Field(
        default=False,
        description="Whether to return the 500 Hz log of every scenario; logs are large.",
    )

    def resolved_preference(self) -> Preference:
        """The preference in full."""
        return PREFERENCES[self.preference] if isinstance(self.preference, str) else self.preference


def run_simulation(request: SimulationRequest) -> SimulationView:
    """Simulate the design in every scenario."""
    request.check_walks()
    scenarios = request.resolved_scenarios()
    walks = [
        request.walk(scenario, log=request.log, precision=request.precision)
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
        gaits=[
            static_stability(load_robot(request.robot), request.walked(scenario))
            for scenario in scenarios
        ],
    )


MOST_POSES: Final = 1_000_000
"""Poses of links in a replay; one of 40 s at 500 Hz has half as many of a shipped robot."""


class ReplayRequest(WorldRequest):
    """A design and the scenario to replay."""

    scenario: ScenarioChoice = Field(
        default="normal-fast",
        description="Name or number of a preset (see /v1/scenarios), or your own.",
        examples=["normal-fast"],
    )
    rate: float = Field(
        default=50.0,
        ge=1.0,
        le=CONTROL_RATE,
        description="Frames a second; each is the nearest tick of 2 ms, whose time is exact [Hz].",
    )


def run_replay(request: ReplayRequest) -> bytes:
    """Simulate the design and encode its replay."""
    scenario = resolved(request.scenario)
    request.check_design()
    request.check_reach(scenario, field="scenario")
    robot = load_robot(request.robot)
    poses = request.rate * request.simulated_seconds([scenario]) * len(robot.urdf.links)
    if poses > MOST_POSES:
        raise InvalidRequest(
            f"the replay would have {poses:.3g} poses of links, more than {MOST_POSES}; choose"
            " fewer frames a second or cycles",
            field="rate",
        )
    walk = request.walk(scenario, log=True)
    (log,) = walk.logs
    if log is None:
        raise AssertionError("a gait within reach was not simulated")
    return encoded_replay(
        replay(robot, log, rate=request.rate, load=scenario.load),
        robot,
        request.walked(scenario),
        rate=request.rate,
        status=Status(walk.outcome.statuses[0]),
        objectives=walk.outcome.objectives[0],
        urdf=urdf_digest(request.robot.urdf) if isinstance(request.robot, RobotFiles) else None,
    )
