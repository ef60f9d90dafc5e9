"""Simulations of one design, outside any job."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Final

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, WithJsonSchema

from gaitswarm.services.optimizer.analysis.evaluations import ScenarioResultView, case_results
from gaitswarm.services.optimizer.jobs.preference import Preference, figure_of_merit, judge
from gaitswarm.services.optimizer.views import Finite, View, finite
from gaitswarm.sim.catalogue import design_shown
from gaitswarm.sim.gait.stability import Stability
from gaitswarm.sim.kernel.observation import WalkLog
from gaitswarm.sim.kernel.walk import Precision
from gaitswarm.sim.outcome import MEASUREMENT_NAMES, OBJECTIVE_NAMES, Status
from gaitswarm.sim.robot import RobotSource

LOG_RATE: Final = 500
"""Rows of a log per second of simulated time [Hz]."""

LogValues = Annotated[list[Any], WithJsonSchema({"type": "array", "items": {}})]

QUANTITIES: Final[dict[str, tuple[str, str]]] = {
    "time": ("s", "time since the start"),
    "base_position": ("m", "position of the body in the world: x, y, z"),
    "base_orientation": ("1", "orientation of the body in the world: quaternion x, y, z, w"),
    "base_velocity": ("m/s, rad/s", "velocity in the body frame: 3 linear, then 3 angular"),
    "joint_angle": ("rad", "angle of every joint"),
    "motor_angle": ("rad", "angle of every joint at its encoder, before any backlash"),
    "joint_velocity": ("rad/s", "angular velocity of every joint"),
    "desired_angle": ("rad", "desired angle of every joint"),
    "current": ("A", "motor current of every joint"),
    "voltage": ("V", "motor voltage of every joint"),
    "load_torque": ("N m", "gear torque of every joint"),
    "foot_force": ("N", "force of the ground on every foot in the world frame: x, y, z"),
    "supply": ("V", "voltage of the battery"),
}
"""Arrays of a `WalkLog`, unit and description of each."""


class LogColumnView(View):
    """One recorded quantity."""

    unit: str = Field(description="Unit of the values.", examples=["rad"])
    description: str = Field(
        description="Meaning of the column.", examples=["angle of every joint"]
    )
    values: LogValues = Field(
        description="One entry per row: a number, or nested lists where there are several joints,"
        " legs or coordinates; null where undefined.",
        examples=[[[0.0, 0.1], [0.01, 0.11]]],
    )


class WalkLogView(View):
    """Log of a simulation, column by column."""

    rate: int = Field(
        default=LOG_RATE, description="Rows per second of simulated time [Hz].", examples=[500]
    )
    columns: dict[str, LogColumnView] = Field(
        description="Recorded quantities by name: " + ", ".join(QUANTITIES) + "."
    )

    @classmethod
    def from_log(cls, log: WalkLog) -> WalkLogView:
        """Make a view of all arrays of a log; what is not finite is null."""
        # model_construct does not check hundreds of thousands of numbers.
        return cls.model_construct(
            rate=LOG_RATE,
            columns={
                name: LogColumnView.model_construct(
                    unit=unit, description=description, values=_nullable(getattr(log, name))
                )
                for name, (unit, description) in QUANTITIES.items()
            },
        )


class MeasurementsView(View):
    """Measurements of a simulation besides its objectives; null where it ended early."""

    peak_current: Finite = Field(
        default=None,
        description="Largest absolute current of any motor at any physics step [A].",
        examples=[0.83],
    )
    mean_current: Finite = Field(
        default=None, description="Mean absolute current of all motors [A].", examples=[0.12]
    )
    motor_heat: Finite = Field(
        default=None, description="Mean heat in all windings, R I^2 [W].", examples=[1.6]
    )
    power: Finite = Field(
        default=None, description="Mean electrical power of all motors [W].", examples=[12.4]
    )
    speed: Finite = Field(default=None, description="Mean forward speed [m/s].", examples=[0.187])

    @classmethod
    def from_row(cls, row: NDArray[np.float64]) -> MeasurementsView:
        """Make a view of one walk's measurements."""
        return cls(**dict(zip(MEASUREMENT_NAMES, row.tolist(), strict=True)))


class PlannedGaitView(View):
    """Properties of a planned gait, without simulation."""

    duty_factor: float = Field(
        description="Support's share of the cycle, mean of all legs [1].", examples=[0.56]
    )
    fewest_feet: int = Field(description="That stand at any moment.", examples=[3])
    margin: float | None = Field(
        description="Least distance of the centre of mass from the edge of the support polygon [m],"
        " negative outside; null while no foot stands.",
        examples=[0.041],
    )
    stable: bool = Field(description="Whether the gait is statically stable: margin above 0.")


class SimulatedScenarioView(ScenarioResultView):
    """Result of the design in one scenario, with its log if requested."""

    measurements: MeasurementsView = Field(
        default_factory=MeasurementsView,
        description="Currents, heat, power and speed of the walk.",
    )
    gait: PlannedGaitView | None = Field(
        default=None, description="The planned gait: duty factor and static stability."
    )

    log: WalkLogView | None = Field(
        default=None,
        description="Log at 500 Hz; null unless requested, or if the robot never moved.",
    )


class SimulationView(View):
    """Results of one design."""

    robot: RobotSource = Field(description="The robot, as requested.", examples=["szabadka2"])
    controller: str = Field(description="Controller that drove it.", examples=["fuzzy-pi"])
    design: dict[str, float | str] = Field(
        description="Value of every variable by name.", examples=[{"FI1R": 5837.0}]
    )
    preference: Preference = Field(description="By which utilities and fitness were computed.")
    precision: Precision = Field(description="Of the physics' numbers.", examples=["double"])
    fitness: float | None = Field(
        description="Geometric mean of the scenarios' utilities (eq. 4.2), to be minimized [1];"
        " null if any walk failed.",
        examples=[20.87],
    )
    figure_of_merit: float | None = Field(
        default=None,
        description="To be maximized: F of eq. 3.1 [1], which is 1e5 / `fitness` under the"
        " preference chapter-3; null under any other, and if any walk failed.",
        examples=[6.9],
    )
    scenarios: dict[str, SimulatedScenarioView] = Field(
        description="Result in each scenario, by the scenario's name."
    )

    @classmethod
    def from_walks(
        cls,
        *,
        robot: RobotSource,
        controller: str,
        design: Mapping[str, float],
        preference: Preference,
        precision: Precision,
        names: Sequence[str],
        statuses: NDArray[np.uint8],
        objectives: NDArray[np.float64],
        measurements: NDArray[np.float64],
        logs: Sequence[WalkLog | None],
        gaits: Sequence[Stability] = (),
    ) -> SimulationView:
        """Make a view of one design's walks, one in each of K scenarios."""
        judged = judge(objectives[None], (statuses != Status.OK)[None], preference)
        results = case_results(
            names, OBJECTIVE_NAMES, statuses, objectives, judged.log_utilities[0]
        )
        recorded = [None if log is None else WalkLogView.from_log(log) for log in logs]
        planned = list[PlannedGaitView | None](map(PlannedGaitView.model_validate, gaits))
        return cls(
            robot=robot,
            controller=controller,
            design=design_shown(controller, design),
            preference=preference,
            precision=precision,
            fitness=finite(float(judged.fitness[0])),
            figure_of_merit=figure_of_merit(float(judged.fitness[0]), preference),
            scenarios={
                name: SimulatedScenarioView.model_construct(
                    **results[name],
                    measurements=MeasurementsView.from_row(row),
                    gait=gait,
                    log=log,
                )
                for name, row, gait, log in zip(
                    names,
                    measurements,
                    planned or [None] * len(names),
                    recorded or [None] * len(names),
                    strict=True,
                )
            },
        )


def _nullable(array: NDArray[np.float64]) -> list[Any]:
    """Nested lists of the array; None for what is not finite."""
    if np.isfinite(array).all():
        rows: list[Any] = array.tolist()
        return rows
    values = array.astype(object)
    values[~np.isfinite(array)] = None
    marked: list[Any] = values.tolist()
    return marked
