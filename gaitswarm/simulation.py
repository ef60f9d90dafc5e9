"""Simulations of designs outside any job: `gaitswarm.simulate`, its results, and their JSON."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from typing import Annotated, Any, Final, Protocol, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field, WithJsonSchema

from gaitswarm.services.optimizer.analysis.evaluations import ScenarioResultView
from gaitswarm.services.optimizer.analysis.robustness import (
    RobustnessRequest,
    RobustnessView,
    robustness_view,
)
from gaitswarm.services.optimizer.errors import InvalidRequest, simulation_errors
from gaitswarm.services.optimizer.jobs.designs import SimulationRequest
from gaitswarm.services.optimizer.jobs.preference import Preference, figure_of_merit, judge
from gaitswarm.services.optimizer.run.evaluator import EvaluationRequest, TaskReport
from gaitswarm.services.optimizer.views import DesignValues, View, finite
from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.case import Case, MeasuredWalk, Walk
from gaitswarm.sim.catalogue import design_catalogue, design_shown
from gaitswarm.sim.controllers import CONTROLLERS, ControllerName
from gaitswarm.sim.gait.stability import Stability, static_stability
from gaitswarm.sim.kernel import Precision
from gaitswarm.sim.kernel.observation import WalkLog
from gaitswarm.sim.outcome import MEASUREMENT_NAMES, N_OBJECTIVES, OBJECTIVE_NAMES, Outcome, Status
from gaitswarm.sim.provenance import provenance_of
from gaitswarm.sim.robot import DEFAULT_ROBOT, RobotSource, load_robot
from gaitswarm.sim.scenario import SCENARIOS
from gaitswarm.sim.variables import Variable
from gaitswarm.specs import PreferenceInput, RobotInput, ScenarioInput, checked
from gaitswarm.tables import Table

ALL_SCENARIOS: Final = tuple(scenario.name for scenario in SCENARIOS)
"""The six scenarios of table 4.2."""

Progress = Callable[[int, int], None]
"""Called with the number of simulations done and their total."""


@dataclass(frozen=True, slots=True, eq=False)
class ScenarioResult:
    """Results of n designs in one scenario.

    Attributes:
        statuses: How each simulation ended; everything but `Status.OK` is a failure.
        objectives: (n,) raw objectives by name, to be minimized, NaN where there is none;
            `gaitswarm.OBJECTIVES` has their units.
        measurements: (n,) further quantities by name, NaN where a simulation
            ended early; `gaitswarm.MEASUREMENTS` has their units.
        utility: (n,) bias-weighted product (eq. 3.8, 4.1), to be minimized; NaN where the
            simulation failed.
        logs: Logs at 500 Hz, None for a gait out of reach; empty unless requested.
    """

    statuses: tuple[Status, ...]
    objectives: Mapping[str, Floats]
    measurements: Mapping[str, Floats]
    utility: Floats
    logs: tuple[WalkLog | None, ...]


@dataclass(frozen=True, slots=True, eq=False)
class SimulationResult:
    """Results of n designs in K scenarios; `result["normal-fast"]` is one scenario's part.

    Attributes:
        robot: The robot.
        controller: The controller.
        preference: By which utilities and fitness were computed.
        precision: Of the physics' numbers.
        variables: Names of the v variables of the designs.
        designs: (n, v) their values, in the variables' units.
        scenarios: Names of the K scenarios.
        statuses: (n, K) values of `Status`.
        objectives: (n, K, 6) raw objectives f1..f6 of table 4.1, to be minimized, in the units of
            `gaitswarm.OBJECTIVES`; NaN where there is none.
        measurements: (n, K, 10) currents, heat, power, speed, torque, attitude, foot clearance and
            slip, in the order and units of `gaitswarm.MEASUREMENTS`; NaN for a simulation that
            ended early.
        utilities: (n, K) bias-weighted products (eq. 3.8, 4.1), to be minimized; NaN where
            the simulation failed.
        fitness: (n,) geometric means of the utilities (eq. 4.2), to be minimized; NaN where any
            simulation failed.
        logs: Logs by scenario, in the order of the designs; empty unless requested.
    """

    robot: RobotSource
    controller: str
    preference: Preference
    precision: Precision
    variables: tuple[str, ...]
    designs: Floats
    scenarios: tuple[str, ...]
    statuses: NDArray[np.uint8]
    objectives: Floats
    measurements: Floats
    utilities: Floats
    fitness: Floats
    logs: Mapping[str, tuple[WalkLog | None, ...]] = field(repr=False, default_factory=dict)

    @property
    def figure_of_merit(self) -> Floats:
        """(n,) F of eq. 3.1, to be maximized; NaN unless the preference is `chapter-3`."""
        values = [figure_of_merit(fitness, self.preference) for fitness in self.fitness.tolist()]
        return np.array(values, dtype=np.float64)

    def __getitem__(self, scenario: str) -> ScenarioResult:
        k = self.scenarios.index(scenario) if scenario in self.scenarios else None
        if k is None:
            raise KeyError(f"{scenario!r}; simulated were {', '.join(self.scenarios)}")
        return ScenarioResult(
            statuses=tuple(Status(status) for status in self.statuses[:, k].tolist()),
            objectives=dict(zip(OBJECTIVE_NAMES, self.objectives[:, k].T, strict=True)),
            measurements=dict(zip(MEASUREMENT_NAMES, self.measurements[:, k].T, strict=True)),
            utility=self.utilities[:, k],
            logs=self.logs.get(scenario, ()),
        )

    def table(self) -> Table:
        """One row for every simulation, by design and scenario.

        Returns:
            A table with the columns design (index from 0), scenario, status, utility, the
            objectives and measurements by name, and `design.<variable>`.
        """
        n, k = self.statuses.shape
        columns: dict[str, NDArray[Any]] = {
            "design": np.repeat(np.arange(n), k),
            "scenario": np.tile(np.array(self.scenarios), n),
            "status": np.array([Status(s).label for s in self.statuses.ravel().tolist()]),
            "utility": self.utilities.ravel(),
        }
        results = np.concatenate([self.objectives, self.measurements], axis=2).reshape(n * k, -1)
        columns |= dict(zip((*OBJECTIVE_NAMES, *MEASUREMENT_NAMES), results.T, strict=True))
        for name, values in zip(self.variables, self.designs.T, strict=True):
            columns[f"design.{name}"] = np.repeat(values, k)
        return Table(columns)


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
    description: str = Field(examples=["angle of every joint"])
    """Meaning of the column."""
    values: LogValues = Field(examples=[[[0.0, 0.1], [0.01, 0.11]]])
    """One entry per row: a number, or nested lists where there are several joints, legs or
    coordinates; null where undefined."""


class WalkLogView(View):
    """Log of a simulation, column by column."""

    rate: int = Field(default=LOG_RATE, examples=[500])
    """Rows per second of simulated time [Hz]."""
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


class PlannedGaitView(View):
    """Properties of a planned gait, without simulation."""

    duty_factor: float = Field(examples=[0.56])
    """Support's share of the cycle, mean of all legs [1]."""
    fewest_feet: int = Field(description="That stand at any moment.", examples=[3])
    margin: float | None = Field(examples=[0.041])
    """Least distance of the centre of mass from the edge of the support polygon [m], negative
    outside; null while no foot stands."""
    stable: bool = Field(description="Whether the gait is statically stable: margin above 0.")


class SimulatedScenarioView(ScenarioResultView):
    """Result of the design in one scenario, with its log if requested."""

    gait: PlannedGaitView | None = None
    """The planned gait: duty factor and static stability."""
    log: WalkLogView | None = None
    """Log at 500 Hz; null unless requested, or if the robot never moved."""


class SimulationView(View):
    """Results of one design."""

    robot: RobotSource = Field(description="The robot, as requested.", examples=["szabadka2"])
    controller: str = Field(description="Controller that drove it.", examples=["fuzzy-pi"])
    design: DesignValues
    preference: Preference = Field(description="By which utilities and fitness were computed.")
    precision: Precision = Field(description="Of the physics' numbers.", examples=["double"])
    fitness: float | None = Field(examples=[20.87])
    """Geometric mean of the scenarios' utilities (eq. 4.2), to be minimized [1]; null if any walk
    failed."""
    figure_of_merit: float | None = Field(default=None, examples=[6.9])
    """To be maximized: F of eq. 3.1 [1], which is 1e5 / `fitness` under the preference chapter-3;
    null under any other, and if any walk failed."""
    scenarios: dict[str, SimulatedScenarioView]
    """Result in each scenario, by the scenario's name."""

    @classmethod
    def from_result(cls, result: SimulationResult, gaits: Iterable[Stability]) -> SimulationView:
        """Make a view of one design's simulations, with its gait in each scenario."""
        design = dict(zip(result.variables, result.designs[0].tolist(), strict=True))
        return cls(
            robot=result.robot,
            controller=result.controller,
            design=design_shown(result.controller, design),
            preference=result.preference,
            precision=result.precision,
            fitness=finite(result.fitness.item()),
            figure_of_merit=finite(result.figure_of_merit.item()),
            scenarios={
                name: SimulatedScenarioView.model_validate(
                    {
                        "status": part.statuses[0].label,
                        "explanation": part.statuses[0].phrase,
                        "utility": finite(part.utility.item()),
                        "objectives": {n: finite(v.item()) for n, v in part.objectives.items()},
                        "measurements": {n: finite(v.item()) for n, v in part.measurements.items()},
                        "gait": PlannedGaitView.model_validate(gait),
                        "log": next((WalkLogView.from_log(log) for log in part.logs if log), None),
                    }
                )
                for name, gait in zip(result.scenarios, gaits, strict=True)
                for part in (result[name],)
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


class Columns(Protocol):
    """Columns by variable: a mapping of arrays, a data frame, a `Table`."""

    def keys(self) -> Iterable[str]:
        """Names of the columns."""

    def __getitem__(self, name: str, /) -> ArrayLike:
        """One column: a number, or one number a design."""


DesignInput: TypeAlias = Columns | Sequence[Mapping[str, float | str]]
"""One design or many."""


def simulate(
    designs: DesignInput,
    *,
    scenarios: ScenarioInput | Iterable[ScenarioInput] = ALL_SCENARIOS,
    controller: ControllerName = "fuzzy-pi",
    robot: RobotInput = DEFAULT_ROBOT,
    preference: PreferenceInput = "A",
    precision: Precision = "double",
    world: Mapping[str, float] | None = None,
    log: bool = False,
    cpus: int | None = None,
) -> SimulationResult:
    """Simulate one design or many.

    A design that falls, diverges or leaves the legs' reach has a status; it is not an error.

    Args:
        designs: Value of each of the controller's variables, and of any gait variable, which then
            replaces the scenarios' value, in the variables' units. One design is a mapping of
            numbers; many are a mapping of arrays of one length, a data frame, or a sequence of
            mappings.
        scenarios: One scenario or several: names or numbers of presets, or `Scenario`.
        controller: Motor controller that drives the robot.
        robot: A shipped robot by name, a `RobotVariant`, or the folder that holds robot.toml and
            robot.urdf of another.
        preference: How objectives are weighed: A, B, C (table 4.5), `chapter-3` or `Preference`.
        precision: Of the physics' numbers: "double", or "single", which is about twice as fast and
            needs the compiled kernel.
        world: Perturbations of the model, as `values` of a certificate's worlds: numbers by
            perturbation, nominal where there is none; None for the model itself.
        log: Whether to record every simulation at 500 Hz.
        cpus: Threads, for many designs without a log; default all processors.

    Returns:
        Statuses, objectives, utilities and fitness of every design.

    Raises:
        InvalidRequest: An argument is invalid; names it.
        EvaluatorUnavailable: The compiler does not compile the robot's kernel.
    """
    columns = _columns(designs, controller)
    variables = tuple(columns)
    rows = np.stack(list(columns.values()), axis=1)
    arguments = {
        "design": dict(zip(variables, rows[0].tolist(), strict=True)),
        "scenarios": scenarios,
        "controller": controller,
        "robot": robot,
        "preference": preference,
        "precision": precision,
        "world": world,
        "log": log,
    }
    request = checked(SimulationRequest, arguments)
    if not np.isfinite(rows).all():
        row, column = np.argwhere(~np.isfinite(rows))[0]
        raise InvalidRequest(
            f"{variables[column]} is not a finite number in design {row}", field="designs"
        )
    if cpus is not None and cpus < 1:
        raise InvalidRequest("must be at least 1", field="cpus")
    with simulation_errors("designs"):
        return _simulated(request, rows, cpus=cpus)


def run_simulation(request: SimulationRequest) -> SimulationView:
    request.check_walks()
    robot = load_robot(request.robot)
    design = np.array([tuple(request.numbers.values())], dtype=np.float64)
    return SimulationView.from_result(
        _simulated(request, design),
        [static_stability(robot, request.walked(s)) for s in request.resolved_scenarios()],
    )


def _simulated(
    request: SimulationRequest, designs: Floats, *, cpus: int | None = None
) -> SimulationResult:
    """Simulate designs with the variables of the request's, many of them in threads."""
    scenarios, variables = request.resolved_scenarios(), tuple(request.design)
    logs: dict[str, tuple[WalkLog | None, ...]] = {}
    if len(designs) == 1 or request.log:
        parts = []
        for scenario in scenarios:
            walk = request.walk(scenario, designs, log=request.log, precision=request.precision)
            columns = [walk.outcome.objectives, walk.measurements.array()]
            parts.append(Outcome(np.concatenate(columns, axis=1), walk.outcome.statuses))
            if request.log:
                logs[scenario.name] = walk.logs
    else:
        cases = [
            request.perturbed_walk(scenario, request.precision)
            if request.world
            else MeasuredWalk(
                request.robot, request.controller, scenario, variables, request.precision
            )
            for scenario in scenarios
        ]
        parts = list(evaluated(cases, designs, [request.robot], request.precision, cpus=cpus))
    statuses = np.stack([part.statuses for part in parts], axis=1)
    columns_by_walk = np.stack([part.objectives for part in parts], axis=1)
    objectives, measurements = np.split(columns_by_walk, [N_OBJECTIVES], axis=2)
    preference = request.resolved_preference()
    judged = judge(objectives, statuses != Status.OK, preference)
    return SimulationResult(
        robot=request.robot,
        controller=request.controller,
        preference=preference,
        precision=request.precision,
        variables=variables,
        designs=designs,
        scenarios=tuple(scenario.name for scenario in scenarios),
        statuses=statuses,
        objectives=objectives,
        measurements=measurements,
        utilities=np.where(np.isfinite(judged.utilities), judged.utilities, np.nan),
        fitness=np.where(np.isfinite(judged.fitness), judged.fitness, np.nan),
        logs=logs,
    )


def evaluated(
    cases: Sequence[Case],
    designs: Floats,
    robots: Iterable[RobotSource],
    precision: Precision,
    *,
    cpus: int | None = None,
    progress: Progress | None = None,
) -> tuple[Outcome, ...]:
    """Evaluate designs in threads of this process."""
    from gaitswarm.services.runtime import open_evaluator

    done, planned = 0, len(designs) * len(cases)

    def report(task: TaskReport) -> None:
        nonlocal done
        done += task.walks if task.error is None else 0
        if progress is not None:
            progress(done, planned)

    provenance = provenance_of(*robots, precision=precision)
    request = EvaluationRequest("", tuple(cases), designs, provenance, on_task=report)
    with closing(open_evaluator("in-process", cpus=cpus)) as evaluator:
        return evaluator.evaluate(request, lambda: False)


def _columns(designs: DesignInput, controller: ControllerName) -> dict[str, Floats]:
    """(n,) values by variable; choices as their indices."""
    catalogue = design_catalogue(controller) if controller in CONTROLLERS else {}
    arrays = {}
    try:
        for name, values in _by_variable(designs).items():
            given, variable = np.atleast_1d(np.asarray(values)), catalogue.get(name)
            if variable is not None and variable.kind == "categorical" and given.dtype.kind in "UO":
                given = np.array([variable.number(choice) for choice in given.tolist()])
            arrays[name] = given.astype(np.float64)
        columns = np.broadcast_arrays(*arrays.values())
    except (TypeError, ValueError, AttributeError, KeyError) as error:
        raise InvalidRequest(
            "must be one design as a mapping of numbers, or many as a mapping of arrays of one"
            f" length or as mappings with the same variables: {error}",
            field="designs",
        ) from error
    if not columns or not columns[0].size:
        raise InvalidRequest("must have at least one design", field="designs")
    if columns[0].ndim > 1:
        raise InvalidRequest("values of a variable must have one axis", field="designs")
    return dict(zip(arrays, columns, strict=True))


def _by_variable(designs: DesignInput) -> dict[str, ArrayLike]:
    if not isinstance(designs, Sequence):
        return {name: designs[name] for name in designs.keys()}  # noqa: SIM118 - not all iterate
    for design in designs[1:]:
        if design.keys() != designs[0].keys():
            raise KeyError("designs differ in their variables")
    return {name: [design[name] for design in designs] for name in (designs[0] if designs else ())}


def robustness(
    design: Mapping[str, float | str],
    *,
    scenarios: ScenarioInput | Iterable[ScenarioInput] = ALL_SCENARIOS,
    controller: ControllerName = "fuzzy-pi",
    robot: RobotInput = DEFAULT_ROBOT,
    precision: Precision = "double",
    variables: Sequence[str | Variable] | None = None,
    samples: int = 256,
    radius: float = 0.02,
    seed: int = 1,
    cpus: int | None = None,
    progress: Progress | None = None,
) -> RobustnessView:
    """Estimate how robust a design is against small changes of its variables (thesis 4.4.3).

    The index is the Frobenius norm of the Jacobian of the objectives' logarithms, f1 to f5 of table
    4.1, by the variables as shares of their bounds: the smaller, the more robust. It comes from a
    linear regression over designs that are drawn around the given one, as objectives are not
    smooth.

    Args:
        design: Values of the controller's variables, and of any gait variables, in their units.
        scenarios: One scenario or several: names or numbers of presets, or `Scenario`.
        controller: Motor controller that drives the robot.
        robot: A shipped robot by name, a `RobotVariant`, or the folder of another.
        precision: Of the physics' numbers.
        variables: Variables to vary, normalised by their bounds: names, or `Variable` with
            bounds of your own; default all of the controller's.
        samples: Designs to sample around the given one.
        radius: Largest distance from it, as a share of each variable's bounds.
        seed: Of the sample.
        cpus: Threads; default all processors.
        progress: Called with the number of simulations done and their total.

    Returns:
        The index with its interval, by scenario, objective and variable.

    Raises:
        InvalidRequest: An argument is invalid; names it.
        EvaluatorUnavailable: The compiler does not compile the robot's kernel.
    """
    arguments = {
        "design": design,
        "scenarios": scenarios,
        "controller": controller,
        "robot": robot,
        "precision": precision,
        "variables": variables,
        "samples": samples,
        "radius": radius,
        "seed": seed,
    }
    request = checked(RobustnessRequest, arguments)
    with simulation_errors("design"):
        return run_robustness(request, cpus=cpus, progress=progress)


def run_robustness(
    request: RobustnessRequest, *, cpus: int | None = None, progress: Progress | None = None
) -> RobustnessView:
    """Simulate a design and a sample around it, and estimate its robustness."""
    request.check_walks()
    sample = request.sample()
    cases = [
        Walk(request.robot, request.controller, scenario, sample.names, request.precision)
        for scenario in request.resolved_scenarios()
    ]
    robots = [request.robot]
    outcomes = evaluated(
        cases, sample.designs, robots, request.precision, cpus=cpus, progress=progress
    )
    return robustness_view(request, sample, outcomes)
