"""Single designs, computed by a gaitswarm server."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from typing import TypeVar, Unpack

from gaitswarm.jobs.server import design_calls
from gaitswarm.jobs.server.call import Call
from gaitswarm.jobs.walks import Walks
from gaitswarm.requests import design_arguments
from gaitswarm.requests.robustness import RobustnessOptions
from gaitswarm.sim.controllers import ControllerName
from gaitswarm.sim.kernel.walk import Precision
from gaitswarm.sim.robot import DEFAULT_ROBOT
from gaitswarm.simulation_result import SimulationResult
from gaitswarm.specs import PreferenceInput, RobotInput, ScenarioInput
from gaitswarm.views.analysis import SurfaceView
from gaitswarm.views.replay import WalkReplay
from gaitswarm.views.robustness import RobustnessView

T = TypeVar("T")


class ServerWalks(Walks, ABC):
    """Designs walk on the server, which bounds for how long."""

    @abstractmethod
    def _send(self, call: Call[T]) -> T:
        """The result of a call."""

    def simulate(
        self,
        design: Mapping[str, float | str],
        *,
        scenarios: ScenarioInput | Iterable[ScenarioInput] | None = None,
        controller: ControllerName = "fuzzy-pi",
        robot: RobotInput = DEFAULT_ROBOT,
        preference: PreferenceInput = "A",
        precision: Precision = "double",
        world: Mapping[str, float] | None = None,
        log: bool = False,
    ) -> SimulationResult:
        """Let a design walk on the server, which bounds how long."""
        request = design_arguments.simulation(
            design,
            scenarios=scenarios,
            controller=controller,
            robot=robot,
            preference=preference,
            precision=precision,
            world=world,
            log=log,
        )
        return self._send(design_calls.simulate(request))

    def robustness(
        self, design: Mapping[str, float | str], **options: Unpack[RobustnessOptions]
    ) -> RobustnessView:
        """Let designs around one walk on the server, which bounds how many and how long."""
        return self._send(design_calls.robustness(design_arguments.robustness(design, options)))

    def replay(
        self,
        design: Mapping[str, float | str],
        *,
        scenario: ScenarioInput = "normal-fast",
        controller: ControllerName = "fuzzy-pi",
        robot: RobotInput = DEFAULT_ROBOT,
        world: Mapping[str, float] | None = None,
        rate: float = 50.0,
    ) -> WalkReplay:
        """Let a design walk on the server, to look at it."""
        request = design_arguments.replay(
            design, scenario=scenario, controller=controller, robot=robot, world=world, rate=rate
        )
        return self._send(design_calls.replay(request))

    def surface(
        self,
        design: Mapping[str, float | str],
        *,
        controller: ControllerName = "fuzzy-pi",
        error_points: int = 65,
        current_points: int = 33,
        velocity_error: float = 0.0,
    ) -> SurfaceView:
        """Ask the server for a fuzzy controller's surfaces."""
        request = design_arguments.surface(
            design,
            error_points=error_points,
            current_points=current_points,
            velocity_error=velocity_error,
        )
        return self._send(design_calls.surface(controller, request))
