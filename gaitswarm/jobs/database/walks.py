"""Single designs, computed in this process."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Unpack

from gaitswarm.errors import simulation_errors
from gaitswarm.jobs.walks import Walks
from gaitswarm.requests import arguments, design_arguments
from gaitswarm.requests.robustness import RobustnessOptions, run_robustness
from gaitswarm.requests.simulations import run_replay
from gaitswarm.requests.surface import run_surface
from gaitswarm.sim.controllers import ControllerName
from gaitswarm.sim.kernel.walk import Precision
from gaitswarm.sim.robot import DEFAULT_ROBOT
from gaitswarm.simulation import simulate_request
from gaitswarm.simulation_result import SimulationResult
from gaitswarm.specs import PreferenceInput, RobotInput, ScenarioInput
from gaitswarm.views.analysis import SurfaceView
from gaitswarm.views.replay import WalkReplay, decoded_replay
from gaitswarm.views.robustness import RobustnessView


class LocalWalks(Walks):
    """Designs walk here, and need no database."""

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
        """Let a design walk in this process."""
        return simulate_request(
            design_arguments.simulation(
                design,
                scenarios=scenarios,
                controller=controller,
                robot=robot,
                preference=preference,
                precision=precision,
                world=world,
                log=log,
            )
        )

    def robustness(
        self, design: Mapping[str, float | str], **options: Unpack[RobustnessOptions]
    ) -> RobustnessView:
        """Let designs around one walk in this process."""
        with simulation_errors("design"):
            return run_robustness(design_arguments.robustness(design, options))

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
        """Let a design walk in this process, to look at it."""
        request = design_arguments.replay(
            design, scenario=scenario, controller=controller, robot=robot, world=world, rate=rate
        )
        with simulation_errors("design"):
            return decoded_replay(run_replay(request))

    def surface(
        self,
        design: Mapping[str, float | str],
        *,
        controller: ControllerName = "fuzzy-pi",
        error_points: int = 65,
        current_points: int = 33,
        velocity_error: float = 0.0,
    ) -> SurfaceView:
        """Compute a fuzzy controller's surfaces."""
        request = design_arguments.surface(
            design,
            error_points=error_points,
            current_points=current_points,
            velocity_error=velocity_error,
        )
        return run_surface(arguments.controller(controller), request)
