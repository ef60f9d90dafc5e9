"""Single designs, computed in threads of this process."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from functools import partial
from typing import Unpack

from anyio import to_thread

from gaitswarm.jobs.database.walks import LocalWalks
from gaitswarm.requests.robustness import RobustnessOptions
from gaitswarm.sim.controllers import ControllerName
from gaitswarm.sim.kernel.walk import Precision
from gaitswarm.sim.robot import DEFAULT_ROBOT
from gaitswarm.simulation_result import SimulationResult
from gaitswarm.specs import PreferenceInput, RobotInput, ScenarioInput
from gaitswarm.views.analysis import SurfaceView
from gaitswarm.views.replay import WalkReplay
from gaitswarm.views.robustness import RobustnessView


class AsyncLocalWalks(ABC):
    """Designs walk here, while the event loop goes on."""

    @abstractmethod
    async def _jobs(self) -> LocalWalks:
        """By whom they are walked."""

    async def simulate(
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
        """Let a design walk in a thread of this process."""
        jobs = await self._jobs()
        call = partial(
            jobs.simulate,
            design,
            scenarios=scenarios,
            controller=controller,
            robot=robot,
            preference=preference,
            precision=precision,
            world=world,
            log=log,
        )
        return await to_thread.run_sync(call)

    async def robustness(
        self, design: Mapping[str, float | str], **options: Unpack[RobustnessOptions]
    ) -> RobustnessView:
        """Let designs around one walk in threads of this process."""
        jobs = await self._jobs()
        return await to_thread.run_sync(partial(jobs.robustness, design, **options))

    async def replay(
        self,
        design: Mapping[str, float | str],
        *,
        scenario: ScenarioInput = "normal-fast",
        controller: ControllerName = "fuzzy-pi",
        robot: RobotInput = DEFAULT_ROBOT,
        world: Mapping[str, float] | None = None,
        rate: float = 50.0,
    ) -> WalkReplay:
        """Let a design walk in a thread of this process, to look at it."""
        jobs = await self._jobs()
        call = partial(
            jobs.replay,
            design,
            scenario=scenario,
            controller=controller,
            robot=robot,
            world=world,
            rate=rate,
        )
        return await to_thread.run_sync(call)

    async def surface(
        self,
        design: Mapping[str, float | str],
        *,
        controller: ControllerName = "fuzzy-pi",
        error_points: int = 65,
        current_points: int = 33,
        velocity_error: float = 0.0,
    ) -> SurfaceView:
        """Compute a fuzzy controller's surfaces in a thread."""
        jobs = await self._jobs()
        call = partial(
            jobs.surface,
            design,
            controller=controller,
            error_points=error_points,
            current_points=current_points,
            velocity_error=velocity_error,
        )
        return await to_thread.run_sync(call)
