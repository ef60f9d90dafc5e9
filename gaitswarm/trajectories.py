"""`gaitswarm.write_trajectories`: desired angles for position-controlled servos in a folder."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from operator import itemgetter
from pathlib import Path

from pydantic import Field

from gaitswarm.robots import check_new, write_new
from gaitswarm.services.optimizer.errors import simulation_errors
from gaitswarm.services.optimizer.jobs.designs import ScenariosRequest
from gaitswarm.services.optimizer.views import View
from gaitswarm.sim.controllers import ControllerName
from gaitswarm.sim.gait.setpoints import Setpoints, setpoints, trajectory_files
from gaitswarm.sim.robot import DEFAULT_ROBOT, load_robot
from gaitswarm.simulation import ALL_SCENARIOS
from gaitswarm.specs import RobotInput, ScenarioInput, checked


class TrajectoriesRequest(ScenariosRequest):
    """A design whose gaits are written for servos."""

    rate: float = Field(
        default=50.0,
        ge=1.0,
        le=500.0,
        description="Rows a second, changed so that a cycle has a whole number of them [Hz].",
    )
    held: bool = Field(default=True, description="Whether held joints have columns as well.")

    def setpoints(self) -> dict[str, Setpoints]:
        """Desired angles by scenario."""
        self.check_design()
        self.check_gaits()
        robot = load_robot(self.robot)
        with simulation_errors("rate"):
            return {
                scenario.name: setpoints(robot, self.walked(scenario), self.rate, held=self.held)
                for scenario in self.resolved_scenarios()
            }


class ScenarioTrajectoryView(View):
    """Desired angles of a scenario."""

    scenario: str = Field(description="Name of the scenario.")
    step: float = Field(description="Time between rows [s].")
    rows: dict[str, int] = Field(description="By part: start, cycle and stop.")
    fastest_joint: str = Field(description="The joint that turns fastest.")
    largest_speed: float = Field(description="Its largest speed [rad/s].")
    too_fast: dict[str, tuple[float, float]] = Field(
        description="By joint that cannot follow, its speed and its motor's without load [rad/s]."
    )


class TrajectoriesView(View):
    """A folder of desired angles."""

    folder: str = Field(description="Its path.")
    joints: list[str] = Field(description="Joints in the order of columns.")
    files: dict[str, int] = Field(description="Size of every file [B].")
    scenarios: list[ScenarioTrajectoryView] = Field(description="By scenario.")


def _scenario_view(name: str, points: Setpoints) -> ScenarioTrajectoryView:
    fastest, largest, _ = max(points.speeds, key=itemgetter(1))
    return ScenarioTrajectoryView(
        scenario=name,
        step=points.step,
        rows={part: len(rows) for part, rows in points.parts.items()},
        fastest_joint=fastest,
        largest_speed=largest,
        too_fast={joint: (speed, top) for joint, speed, top in points.speeds if speed > top},
    )


def write_trajectories(
    design: Mapping[str, float | str],
    output: str | os.PathLike[str],
    *,
    scenarios: ScenarioInput | Iterable[ScenarioInput] = ALL_SCENARIOS,
    controller: ControllerName = "fuzzy-pi",
    robot: RobotInput = DEFAULT_ROBOT,
    rate: float = 50.0,
    held: bool = True,
) -> TrajectoriesView:
    """Write a design's desired joint angles for position-controlled servos, with zeros, signs and
    names of the URDF's joints.

    A scenario's `NAME-start.csv`, `NAME-cycle.csv` and `NAME-stop.csv` have a time [s] and angles
    [rad] by row: from the stance into the gait, a cycle to be repeated, and back to the stance.
    `NAME.yaml` is all of this as a ROS 2 message, with as many cycles as the scenario has.
    `speeds.csv` compares every joint's largest speed with its motor's speed without load.

    Args:
        design: As of `write_firmware`; only its gait variables matter.
        output: New or empty folder, which is written as a whole or not at all.
        scenarios: One scenario or several: names or numbers of presets, or `Scenario`.
        controller: Of the design.
        robot: A shipped robot by name, a `RobotVariant`, or the folder of another.
        rate: Rows a second, changed so that a cycle has a whole number of them [Hz].
        held: Whether held joints have columns as well, which a ROS 2 controller of the legs alone
            refuses.

    Returns:
        Joints, files, rows, the largest speed of a joint, and joints that are too fast for
        their motors.

    Raises:
        InvalidRequest: An argument is invalid, a gait leaves the legs' reach, or the folder
            is not empty or cannot be written; names the argument.
    """
    arguments = {
        "design": design,
        "scenarios": scenarios,
        "controller": controller,
        "robot": robot,
        "rate": rate,
        "held": held,
    }
    request = checked(TrajectoriesRequest, arguments)
    folder = Path(output)
    check_new(folder)
    points = request.setpoints()
    files = trajectory_files(points)
    write_new(folder, files)
    return TrajectoriesView(
        folder=str(folder),
        joints=list(next(iter(points.values())).joints),
        files={name: len(content) for name, content in files.items()},
        scenarios=[_scenario_view(name, of) for name, of in points.items()],
    )
