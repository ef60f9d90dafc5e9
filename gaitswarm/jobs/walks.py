"""The part of the port that is about single designs, outside any job."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Unpack

from gaitswarm.sim.controllers import ControllerName
from gaitswarm.sim.kernel.walk import Precision
from gaitswarm.sim.robot import DEFAULT_ROBOT

if TYPE_CHECKING:
    from gaitswarm.requests.firmware import FirmwareOptions
    from gaitswarm.requests.robustness import RobustnessOptions
    from gaitswarm.simulation_result import SimulationResult
    from gaitswarm.specs import PreferenceInput, RobotInput, ScenarioInput
    from gaitswarm.views.analysis import SurfaceView
    from gaitswarm.views.firmware import FirmwareView
    from gaitswarm.views.replay import WalkReplay
    from gaitswarm.views.robustness import RobustnessView


class Walks(ABC):
    """Single designs on request, computed where the jobs are: in this process, or by the server."""

    @abstractmethod
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
        """Let one design walk where the jobs are; see `gaitswarm.simulate` for many.

        Args:
            design: Value of each of the controller's variables, and of any gait variable, in the
                variables' units.
            scenarios: One scenario or several: names or numbers of presets, or `Scenario`; default
                all presets.
            controller: Motor controller that drives the robot.
            robot: A shipped robot by name, a `RobotVariant`, or the folder of another.
            preference: How objectives are weighed: A, B, C of table 4.5, `chapter-3` (eq. 3.1), or
                `Preference`.
            precision: Of the physics' numbers: "double", or "single", which is about twice as fast
                and needs a C compiler where the walk runs.
            world: What is different from the model, as `values` of a certificate's worlds: numbers
                by perturbation, nominal where there is none; None for the model itself.
            log: Whether to record every walk at 500 Hz.

        Returns:
            Arrays of one design.

        Raises:
            InvalidRequest: An argument makes no sense, the gait leaves the legs' reach, or the
                walks last longer than the server allows.
        """

    @abstractmethod
    def robustness(
        self, design: Mapping[str, float | str], **options: Unpack[RobustnessOptions]
    ) -> RobustnessView:
        """Estimate where the jobs are how robust a design is; see `gaitswarm.robustness`.

        Args:
            design: As for `simulate`.
            **options: Walks and sample, see `RobustnessOptions`.

        Returns:
            The robustness index by scenario, objective and variable.

        Raises:
            InvalidRequest: As `simulate`, or the sample makes no sense.
        """

    @abstractmethod
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
        """Let one design walk, to look at it: where every link is, frame by frame.

        Args:
            design: As for `simulate`.
            scenario: Name or number of a preset, or `Scenario`.
            controller: Motor controller that drives the robot.
            robot: A shipped robot by name, a `RobotVariant`, or the folder of another.
            world: As for `simulate`.
            rate: Frames a second, 1 to 500 [Hz].

        Returns:
            Channels by name, one row a frame, up to the end of a walk that failed.

        Raises:
            InvalidRequest: As `simulate`.
        """

    @abstractmethod
    def surface(
        self,
        design: Mapping[str, float | str],
        *,
        controller: ControllerName = "fuzzy-pi",
        error_points: int = 65,
        current_points: int = 33,
        velocity_error: float = 0.0,
    ) -> SurfaceView:
        """Take the surfaces of a fuzzy controller, by its rules and by its table.

        Args:
            design: Value of each of the controller's variables, in their units.
            controller: A fuzzy controller.
            error_points: Points of the grid over the error's range, 3 to 129.
            current_points: Points of the grid over the current's range, 2 to 65.
            velocity_error: At which the surfaces of fuzzy-pi-3 are taken [counts/s].

        Returns:
            Sets, rules and surfaces of every output.

        Raises:
            InvalidRequest: The controller is not fuzzy, or an argument makes no sense.
        """

    @abstractmethod
    def write_firmware(
        self,
        design: Mapping[str, float | str] | str,
        output: str | os.PathLike[str],
        **options: Unpack[FirmwareOptions],
    ) -> FirmwareView:
        """Write a design as C for the robot's microcontrollers; see `gaitswarm.write_firmware`.

        It is made where the jobs are, and the folder is written here.

        Args:
            design: As for `simulate`; or the identifier of a job, whose best design is taken, with
                its robot and scenarios.
            output: Folder to write; one that holds firmware is replaced, as a whole or not at all.
            **options: Scenarios and tables, see `FirmwareOptions`.

        Returns:
            Files, their sizes, and what they take of the thesis's microcontroller.

        Raises:
            InvalidRequest: As `simulate`, or the job tunes no drive, or the folder holds anything
                but firmware or cannot be written.
            NotFound: There is no such job, or it has no design yet that walks in every scenario.
        """
