"""A measured walk as input of a fit: robot, scenario, design, and motor currents."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, ValidationError, model_validator

from gaitswarm.sim.controllers import CONTROLLERS, ControllerName, names_of
from gaitswarm.sim.controllers.fixed_point import CONTROL_PERIOD
from gaitswarm.sim.errors import MeasuredLogError, SimulationInputError
from gaitswarm.sim.gait_variables import GAIT_CATALOGUE
from gaitswarm.sim.input import message_of
from gaitswarm.sim.robot import RobotSource, load_robot
from gaitswarm.sim.scenario import Scenario
from gaitswarm.sim.simulate import check_reach
from gaitswarm.sim.variables import VariableName

if TYPE_CHECKING:
    from gaitswarm.sim.measurement.synchronise import Synchronised

_DECIMALS: Final = 5
"""Of a stored current [A]: far below the converter's resolution, and a third of the text."""

Amperes = Annotated[float, Field(ge=0.0, le=1000.0, allow_inf_nan=False)]
Currents = Annotated[tuple[Amperes, ...], Field(fail_fast=True)]


class RecordedWalk(BaseModel):
    """Absolute motor currents of one walk, on the time axis of the simulated one.

    Created from a measured log by `record`, which synchronises the two and keeps whole cycles.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    schema_version: Literal[1] = Field(default=1, description="Version of this schema.")
    scenario: Scenario = Field(description="The walk, as a job would name it.")
    controller: ControllerName = Field(description="Controller that drove the robot.")
    design: dict[VariableName, FiniteFloat] = Field(
        description="Value of each of its variables, and of any gait variable, as it walked."
    )
    first_tick: int = Field(
        ge=0, le=10_000_000, description="Control tick (500 a second) of the walk at the first row."
    )
    joints: tuple[str, ...] = Field(
        min_length=1, max_length=256, description="Joints of the columns, in the robot's order."
    )
    current: tuple[Currents, ...] = Field(
        fail_fast=True,
        min_length=1,
        max_length=100_000,
        description="Absolute motor currents [A], one row a tick, one number a joint.",
        examples=[[[0.12, 0.4, 0.31], [0.12, 0.38, 0.3]]],
    )
    synthetic: bool = Field(
        default=False, description="Whether the log was computed, not measured on a robot."
    )

    @model_validator(mode="after")
    def _is_whole(self) -> RecordedWalk:
        for number, row in enumerate(self.current):
            if len(row) != len(self.joints):
                raise ValueError(
                    f"current.{number}: {len(row)} numbers for {len(self.joints)} joints"
                )
        controller = CONTROLLERS[self.controller]
        needed = {variable.name for variable in controller.variables}
        missing = sorted(needed - self.design.keys())
        if missing:
            raise ValueError(f"design: {', '.join(missing)} missing; {self.controller} needs it")
        for name in self.design:
            if name not in names_of(controller) and name not in GAIT_CATALOGUE:
                raise ValueError(f"design: unknown variable {name!r}")
        last, walked = self.first_tick + len(self.current), self.walked_seconds
        if last > round(walked / CONTROL_PERIOD):
            raise ValueError(
                f"current: row {last - self.first_tick - 1} is after the end of the walk at"
                f" {walked:g} s; give the scenario as many cycles as were measured"
            )
        return self

    @property
    def walked_seconds(self) -> float:
        """Length of the simulated walk [s]."""
        cycle_time = self.design.get("cycle_time", self.scenario.cycle_time)
        return self.scenario.cycles * cycle_time

    @property
    def gait(self) -> dict[str, float]:
        """The design's gait variables."""
        return {name: v for name, v in self.design.items() if name in GAIT_CATALOGUE}

    @property
    def gains(self) -> dict[str, float]:
        """The design's controller variables."""
        return {name: v for name, v in self.design.items() if name not in GAIT_CATALOGUE}

    def check_reach(self, robot: RobotSource) -> None:
        """Check that a robot's legs reach all of the walk, and that it can be fitted to currents.

        Args:
            robot: The robot.

        Raises:
            UnreachablePose: A foot's target lies outside its leg's reach.
            SimulationInputError: The robot's actuators are torque-controlled.
        """
        if load_robot(robot).is_torque_controlled:
            raise SimulationInputError(
                "identification fits the currents of DC motors; those of torque-controlled"
                " actuators follow from the command"
            )
        check_reach(self.scenario, tuple(self.design), tuple(self.design.values()), robot=robot)

    @cached_property
    def amperes(self) -> NDArray[np.float64]:
        """`current` as an array (T, J) [A], read-only."""
        array = np.array(self.current, dtype=np.float64)
        array.flags.writeable = False
        return array


Recordings = Mapping[str, RecordedWalk]
"""By id."""


def record(
    pair: Synchronised, scenario: Scenario, controller: str, design: Mapping[str, float]
) -> RecordedWalk:
    """Return the measured currents of two synchronised logs, on the simulated one's time axis."""
    try:
        return RecordedWalk(
            scenario=scenario,
            controller=controller,
            design=dict(design),
            first_tick=round(float(pair.simulated.time[0]) / CONTROL_PERIOD),
            joints=pair.measured.joints,
            current=np.round(pair.measured.current, _DECIMALS).tolist(),
            synthetic=pair.measured.synthetic,
        )
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        field = ".".join(map(str, first["loc"]))
        raise MeasuredLogError(
            f"the compared cycles are not a valid recording: {field}: {message_of(first)}"
        ) from error
