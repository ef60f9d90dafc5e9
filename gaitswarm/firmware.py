"""Designs as folders for hardware: C code for microcontrollers, desired angles for servos."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from operator import itemgetter
from pathlib import Path

from pydantic import Field

from gaitswarm.robots import check_new, write_new
from gaitswarm.services.optimizer.errors import simulation_errors
from gaitswarm.services.optimizer.jobs.designs import ScenariosRequest
from gaitswarm.services.optimizer.views import Finite, View
from gaitswarm.sim.controllers import ControllerName
from gaitswarm.sim.firmware.folder import (
    Firmware,
    check_drives_by_pwm,
    check_table_bits,
    firmware_of,
)
from gaitswarm.sim.gait.setpoints import Setpoints, setpoints, trajectory_files
from gaitswarm.sim.input import Line
from gaitswarm.sim.robot import DEFAULT_ROBOT, load_robot
from gaitswarm.simulation import ALL_SCENARIOS
from gaitswarm.specs import RobotInput, ScenarioInput, checked


class FirmwareRequest(ScenariosRequest):
    """A design and the scenarios whose trajectories and simulations its firmware includes."""

    label: Line = Field(default="design", max_length=200, description="Display name of the design.")
    table_bits: tuple[int, int] | None = Field(default=None, examples=[[8, 6]])
    """Of the indices of angle error and current in a fuzzy controller's table, in place of 10 and
    6; simulations use this table."""

    @property
    def walked_seconds(self) -> float:
        """Length of all simulations [s]; with another table each is compared with the default's."""
        seconds = self.simulated_seconds(self.resolved_scenarios())
        return seconds if self.table_bits is None else 2.0 * seconds

    def check(self) -> None:
        """Check the design, its gaits and its table before anything is simulated."""
        with simulation_errors("robot"):
            check_drives_by_pwm(self.robot)
        self.check_design()
        self.check_gaits()
        if self.table_bits is not None:
            with simulation_errors("table_bits"):
                check_table_bits(self.controller, self.table_bits)


def run_firmware(request: FirmwareRequest) -> Firmware:
    """Write a design as C code, with simulations to test it."""
    request.check()
    with simulation_errors("scenarios"):
        return firmware_of(
            request.robot,
            request.controller,
            request.numbers,
            request.resolved_scenarios(),
            label=request.label,
            table_bits=request.table_bits,
        )


class FirmwareTableView(View):
    """A fuzzy table."""

    name: str = Field(description="direct, or integrated.", examples=["direct"])
    shape: list[int] = Field(description="Entries by angle error, current and change of error.")
    bytes: int = Field(description="Memory, eq. 5.1 [B].", examples=[65536])


class FirmwareTrajectoryView(View):
    """Desired angles in a scenario."""

    scenario: str = Field(description="Name of the scenario.", examples=["normal-fast"])
    rows: int = Field(description="Rows of the table, 500 a second.", examples=[755])
    columns: int = Field(description="Angles of a row; joints that move alike share one.")
    repeats_from: int | None
    """Row that follows the last one; null if the trajectory does not repeat."""
    bytes: int = Field(description="Memory of all joints, eq. 5.1 [B].", examples=[9060])
    bytes_of_a_leg: int = Field(description="Memory of one leg's joints [B].", examples=[4530])


class FirmwareWalkView(View):
    """A simulation that the firmware's test repeats."""

    scenario: str = Field(description="Name of the scenario.", examples=["normal-fast"])
    status: str = Field(description="Its status.", examples=["ok"])
    ticks: int = Field(description="Simulated control ticks.", examples=[2250])
    samples: int = Field(description="Outputs that are compared.", examples=[40500])


class FirmwareMemoryView(View):
    """Memory that firmware needs on a leg's microcontroller, without its code."""

    processor: str = Field(description="Type of the microcontroller.", examples=["MSP430F2618"])
    flash: int = Field(description="Of the microcontroller [B].", examples=[118784])
    ram: int = Field(description="Of the microcontroller [B].", examples=[8192])
    cycles: int = Field(description="Of the microcontroller in a sample.", examples=[32000])
    tables: int = Field(description="Of the fuzzy tables [B].", examples=[65536])
    trajectories: int = Field(description="Of all joints and scenarios [B].", examples=[71820])
    trajectories_of_a_leg: int = Field(description="Of one leg's joints in all scenarios [B].")
    remembered: int = Field(description="RAM, from tick to tick [B].", examples=[40])
    fits: bool = Field(description="Whether controller and tables fit, without trajectories.")
    remarks: list[str] = Field(description="Problems with remedies.", examples=[[]])


class FirmwareView(View):
    """A folder of C for a microcontroller."""

    folder: str | None = Field(default=None, description="Its path; null on a server.")
    label: str = Field(description="Display name of the design.", examples=["published A"])
    controller: ControllerName = Field(description="Of the design.", examples=["fuzzy-pi"])
    design: dict[str, float] = Field(examples=[{"P": 0.454, "I": 0.147}])
    """Values by variable; of a categorical one the index of a choice."""
    files: dict[str, int] = Field(examples=[{"tick.c": 4600}])
    """Size of every file [B]."""
    tables: list[FirmwareTableView] = Field(description="Fuzzy tables; none for P, PI, PID.")
    table_difference: dict[str, Finite] | None
    """By objective, largest relative difference from simulations with the table of 10 x 6 bits [1];
    null with that table."""
    trajectories: list[FirmwareTrajectoryView] = Field(description="By scenario.")
    walks: list[FirmwareWalkView] = Field(description="By scenario.")
    samples: int = Field(description="Of all simulations.", examples=[280800])
    memory: FirmwareMemoryView = Field(description="Compared with the thesis's microcontroller.")


def firmware_view(
    request: FirmwareRequest, firmware: Firmware, folder: str | None = None
) -> FirmwareView:
    return FirmwareView(
        folder=folder,
        label=request.label,
        controller=request.controller,
        design=request.numbers,
        files={name: len(content) for name, content in firmware.files.items()},
        tables=[
            FirmwareTableView(name=name, shape=list(part.values.shape), bytes=part.values.nbytes)
            for name, part in firmware.law.tables.items()
        ],
        table_difference=firmware.table_difference,
        trajectories=[
            FirmwareTrajectoryView(
                scenario=table.name,
                rows=len(table.rows),
                columns=table.rows.shape[1],
                repeats_from=table.repeats_from if table.repeats else None,
                bytes=table.bytes,
                bytes_of_a_leg=table.bytes_of_a_leg,
            )
            for table in firmware.trajectories
        ],
        walks=[
            FirmwareWalkView(
                scenario=log.scenario.name,
                status=log.status.label,
                ticks=log.ticks,
                samples=log.pwm.size,
            )
            for log in firmware.logs
        ],
        samples=firmware.samples,
        memory=FirmwareMemoryView.model_validate(firmware.memory),
    )


def write_firmware(
    design: Mapping[str, float | str],
    output: str | os.PathLike[str],
    *,
    scenarios: ScenarioInput | Iterable[ScenarioInput] = ALL_SCENARIOS,
    controller: ControllerName = "fuzzy-pi",
    robot: RobotInput = DEFAULT_ROBOT,
    label: str = "design",
    table_bits: tuple[int, int] | None = None,
) -> FirmwareView:
    """Write a design as C99 for a leg's microcontroller (thesis chapter 5), with a test of it.

    The design is simulated in every scenario; the folder's `make test` gives its controller the
    sensor readings and compares its outputs with the simulated ones, sample by sample.

    Args:
        design: Values of the controller's variables, and of any gait variables, in their units.
        output: New or empty folder, which is written as a whole or not at all.
        scenarios: One scenario or several, whose trajectories are written and whose walks are
            repeated: names or numbers of presets, or `Scenario`.
        controller: Motor controller that drives the robot.
        robot: A shipped robot by name, a `RobotVariant`, or the folder of another.
        label: Display name of the design.
        table_bits: Of the indices of angle error and current in a fuzzy controller's table, in
            place of 10 and 6, where there is less flash; the difference of simulations is then
            reported.

    Returns:
        Files, their sizes, and their memory on the thesis's microcontroller.

    Raises:
        InvalidRequest: An argument is invalid, a gait leaves the legs' reach, or the folder
            is not empty or cannot be written; names the argument.
        EvaluatorUnavailable: The compiler does not compile the robot's kernel.
    """
    arguments = {
        "design": design,
        "scenarios": scenarios,
        "controller": controller,
        "robot": robot,
        "label": label,
        "table_bits": table_bits,
    }
    request = checked(FirmwareRequest, arguments)
    folder = Path(output)
    check_new(folder)
    firmware = run_firmware(request)
    write_new(folder, firmware.files)
    return firmware_view(request, firmware, str(folder))


class TrajectoriesRequest(ScenariosRequest):
    """A design whose gaits are written for servos."""

    rate: float = Field(default=50.0, ge=1.0, le=500.0)
    """Rows a second, changed so that a cycle has a whole number of them [Hz]."""
    held: bool = Field(default=True, description="Whether held joints have columns as well.")

    def setpoints(self) -> dict[str, Setpoints]:
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
    too_fast: dict[str, tuple[float, float]]
    """By joint that cannot follow, its speed and its motor's without load [rad/s]."""


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
