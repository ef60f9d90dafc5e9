"""`gaitswarm.simulate` and `robustness`: simulations outside any job."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from contextlib import closing
from typing import Final, Protocol, TypeAlias, Unpack, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gaitswarm.designs import SimulationRequest
from gaitswarm.errors import InvalidRequest, simulation_errors
from gaitswarm.robustness_index import (
    Progress,
    RobustnessOptions,
    RobustnessRequest,
    RobustnessView,
    run_robustness,
)
from gaitswarm.services.optimizer.jobs.preference import judge
from gaitswarm.services.optimizer.run.evaluator import EvaluationRequest
from gaitswarm.sim.assembly import Backend
from gaitswarm.sim.case import Case, MeasuredWalk
from gaitswarm.sim.catalogue import design_catalogue
from gaitswarm.sim.controllers import CONTROLLERS, ControllerName
from gaitswarm.sim.kernel.observation import WalkLog
from gaitswarm.sim.kernel.walk import Precision
from gaitswarm.sim.outcome import N_OBJECTIVES, Outcome, Status
from gaitswarm.sim.provenance import provenance_of
from gaitswarm.sim.robot import DEFAULT_ROBOT
from gaitswarm.sim.scenario import SCENARIOS, Scenario
from gaitswarm.sim.simulate import Simulation
from gaitswarm.sim.simulate import simulate as simulate_walk
from gaitswarm.sim.worlds import MeasuredPerturbedWalk
from gaitswarm.simulation_result import SimulationResult
from gaitswarm.specs import (
    PreferenceInput,
    RobotInput,
    ScenarioInput,
    checked,
)

Floats = NDArray[np.float64]

ALL_SCENARIOS: Final = tuple(scenario.name for scenario in SCENARIOS)
"""The six scenarios of table 4.2."""


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
    backend: Backend = "auto",
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
        preference: How objectives are weighed: A, B, C of table 4.5, `chapter-3` (eq. 3.1), or
            `Preference`.
        precision: Of the physics' numbers: "double", or "single", which is about twice as fast and
            needs the compiled kernel.
        world: Perturbations of the model, as `values` of a certificate's worlds: numbers by
            perturbation, nominal where there is none; None for the model itself.
        log: Whether to record every simulation at 500 Hz.
        backend: `native` is the compiled kernel, `reference` the CasADi interpreter, `auto` the
            first that works on this machine; `auto` alone in another world than the model's.
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
    if backend not in get_args(Backend):
        raise InvalidRequest(
            f"{backend!r} is none of {', '.join(get_args(Backend))}", field="backend"
        )
    if request.world and backend != "auto":
        raise InvalidRequest("perturbed worlds choose it themselves; leave it out", field="backend")
    if cpus is not None and cpus < 1:
        raise InvalidRequest("must be at least 1", field="cpus")
    with simulation_errors("designs"):
        return _simulated(request, variables, rows, backend, cpus)


def robustness(
    design: Mapping[str, float | str],
    *,
    cpus: int | None = None,
    progress: Progress | None = None,
    **options: Unpack[RobustnessOptions],
) -> RobustnessView:
    """Estimate how robust a design is against small changes of its variables (thesis 4.4.3).

    The index is the Frobenius norm of the Jacobian of the objectives' logarithms, f1 to f5 of table
    4.1, by the variables as shares of their bounds: the smaller, the more robust. It comes from a
    linear regression over designs that are drawn around the given one, as objectives are not
    smooth.

    Args:
        design: Value of each of the controller's variables, and of any gait variable, in the
            variables' units.
        cpus: Threads; default all processors.
        progress: Called with the number of simulations done and their total.
        **options: Scenarios and sample, see `RobustnessOptions`.

    Returns:
        The index with its interval, by scenario, objective and variable.

    Raises:
        InvalidRequest: An argument is invalid; names it.
        EvaluatorUnavailable: The compiler does not compile the robot's kernel.
    """
    request = checked(RobustnessRequest, {"design": design, **options})
    with simulation_errors("design"):
        return run_robustness(request, cpus=cpus, progress=progress)


def _columns(designs: DesignInput, controller: ControllerName) -> dict[str, Floats]:
    """(n,) values by variable."""
    try:
        found = _indexed(_by_variable(designs), controller)
        arrays = [np.atleast_1d(np.asarray(values, np.float64)) for values in found.values()]
        columns = np.broadcast_arrays(*arrays)
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
    return dict(zip(found, columns, strict=True))


def _indexed(columns: dict[str, ArrayLike], controller: ControllerName) -> dict[str, ArrayLike]:
    """Replace names of choices by their indices."""
    known = design_catalogue(controller) if controller in CONTROLLERS else {}
    found = dict(columns)
    for name, values in columns.items():
        given = np.asarray(values)
        if name in known and known[name].kind == "categorical" and given.dtype.kind in "UO":
            found[name] = [known[name].number(value) for value in np.atleast_1d(given).tolist()]
    return found


def _by_variable(designs: DesignInput) -> dict[str, ArrayLike]:
    if not isinstance(designs, Sequence):
        return {name: designs[name] for name in designs.keys()}  # noqa: SIM118 - not all iterate
    for design in designs[1:]:
        if design.keys() != designs[0].keys():
            raise KeyError("designs differ in their variables")
    return {name: [design[name] for design in designs] for name in (designs[0] if designs else ())}


def _simulated(
    request: SimulationRequest,
    variables: tuple[str, ...],
    designs: Floats,
    backend: Backend,
    cpus: int | None,
) -> SimulationResult:
    """Simulate all designs; `request` is that of the first."""
    scenarios = request.resolved_scenarios()
    logs: dict[str, tuple[WalkLog | None, ...]] = {}
    if len(designs) == 1 or request.log or backend != "auto":
        parts = []
        for scenario in scenarios:
            walk = _walked(request, scenario, variables, designs, backend)
            columns = [walk.outcome.objectives, walk.measurements.array()]
            parts.append(Outcome(np.concatenate(columns, axis=1), walk.outcome.statuses))
            if request.log:
                logs[scenario.name] = walk.logs
    else:
        parts = list(_in_parallel(request, scenarios, variables, designs, cpus))
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
        utilities=_finite(judged.utilities),
        fitness=_finite(judged.fitness),
        logs=logs,
    )


def _walked(
    request: SimulationRequest,
    scenario: Scenario,
    variables: tuple[str, ...],
    designs: Floats,
    backend: Backend,
) -> Simulation:
    """Simulate all designs in one scenario in this thread."""
    if request.world:
        return _in_world(request, scenario, variables).simulate(designs, log=request.log)
    return simulate_walk(
        scenario,
        request.controller,
        variables,
        designs,
        robot=request.robot,
        log=request.log,
        backend=backend,
        precision=request.precision,
    )


def _in_world(
    request: SimulationRequest, scenario: Scenario, variables: tuple[str, ...]
) -> MeasuredPerturbedWalk:
    return MeasuredPerturbedWalk(
        scenario.name,
        request.robot,
        request.controller,
        scenario,
        tuple(request.world.items()),
        variables,
        request.precision,
    )


def _in_parallel(
    request: SimulationRequest,
    scenarios: Sequence[Scenario],
    variables: tuple[str, ...],
    designs: Floats,
    cpus: int | None,
) -> Sequence[Outcome]:
    """Objectives and measurements for every scenario, computed in threads."""
    from gaitswarm.services.runtime import open_evaluator

    cases: tuple[Case, ...]
    if request.world:
        cases = tuple(_in_world(request, scenario, variables) for scenario in scenarios)
    else:
        cases = tuple(
            MeasuredWalk(request.robot, request.controller, s, variables, request.precision)
            for s in scenarios
        )
    with closing(open_evaluator("in-process", cpus=cpus)) as evaluator:
        provenance = provenance_of(request.robot, precision=request.precision)
        asked = EvaluationRequest("", cases, designs, provenance)
        return evaluator.evaluate(asked, lambda: False)


def _finite(values: Floats) -> Floats:
    return np.where(np.isfinite(values), values, np.nan)
