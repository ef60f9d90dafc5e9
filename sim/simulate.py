"""The entry point: a batch of designs in one scenario -> objectives and statuses."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from sim.compiler.compilation import target
from sim.controllers import CONTROLLERS, ControlLaw
from sim.controllers.fixed_point import CONTROL_PERIOD
from sim.errors import SimulationInputError
from sim.gait.trajectory import Trajectory, desired_angles, require_reachable
from sim.kernel.native import native_kernel
from sim.kernel.observation import WalkLog, walk_log
from sim.kernel.parameters import gravity_on, pack_parameters
from sim.kernel.walk import Coding, Kernel, WalkResult, WalkSetup
from sim.noise import LinkNoise
from sim.outcome import N_OBJECTIVES, Outcome, Status
from sim.robot import Robot, RobotFiles, RobotVariant, load_robot
from sim.robot.posture import resting_height
from sim.scenario import GAIT_VARIABLE_NAMES, Scenario

Backend = Literal["auto", "native", "reference"]

PHYSICS_RATE: Final = 5000
"""Physics steps a second [Hz]; the control rate is 500 Hz."""

BACKLASH_PHYSICS_RATE: Final = 20_000
"""Rate [Hz] for robots with backlash: without their rotors, tibias answer the ground too fast for
5 kHz."""

RobotChoice = str | RobotVariant | RobotFiles | Robot
"""How a robot is named to the simulator."""

SHORTEST_WALK: Final = 1e-3
"""Distance [m] under which a robot counts as not walking: energy per metre has no value."""


@dataclass(frozen=True, slots=True, eq=False)
class Simulation:
    """Outcome of every design and, if asked for, every walk's log, in the order of the designs.

    A design that was never simulated (unreachable) has no log; one that ended early has NaN after.
    """

    outcome: Outcome
    logs: tuple[WalkLog | None, ...] = ()


def simulate(
    scenario: Scenario,
    controller: str,
    variables: Sequence[str],
    designs: NDArray[np.float64],
    *,
    robot: RobotChoice = "szabadka2",
    planner: Robot | None = None,
    noise: LinkNoise | None = None,
    log: bool = False,
    backend: Backend = "auto",
    physics_rate: int = PHYSICS_RATE,
) -> Simulation:
    """Let every design walk through a scenario.

    robot: a shipped robot by name, a variant of one, or a `Robot` of your own; with backlash it is
        simulated at `BACKLASH_PHYSICS_RATE` at least.
    planner: the robot that the desired angles are for, if its legs differ from the robot's.
    designs: (n, len(variables)); columns are controller variables (all of them) and gait
        variables (any of them, replacing the scenario's value).
    backend: `native` is the compiled kernel, `reference` the CasADi interpreter, `auto` the first
        that works on this machine (with a warning if it is the slow one).

    Raises SimulationInputError that names the variable for a design that cannot be simulated.
    """
    _check_arguments(controller, variables, designs, physics_rate)
    machine = load_robot(robot)
    kernel = kernel_of(machine, backend)
    substeps, timestep = control_steps(machine, physics_rate)
    statuses = np.full(len(designs), Status.UNREACHABLE, dtype=np.uint8)
    objectives = np.full((len(designs), N_OBJECTIVES), np.nan)
    setups: dict[int, WalkSetup] = {}
    courses: dict[tuple[float, ...], Callable[[ControlLaw], WalkSetup] | None] = {}
    for index, row in enumerate(designs.tolist()):
        design = dict(zip(variables, row, strict=True))
        gait = {name: design.pop(name) for name in variables if name in GAIT_VARIABLE_NAMES}
        control_law = CONTROLLERS[controller].compile(design)  # type: ignore[index]
        key = tuple(gait.values())
        if key not in courses:
            walked = with_gait(scenario, gait)
            courses[key] = course_of(
                machine,
                kernel,
                walked,
                timestep,
                noise,
                trajectory=None if planner is None else desired_angles(planner, walked),
            )
        course = courses[key]
        if course is not None:
            setups[index] = course(control_law)
    results = kernel.walk(list(setups.values()), Coding.of(machine, substeps), log=log)
    logs: list[WalkLog | None] = [None] * len(designs)
    for (index, setup), result in zip(setups.items(), results, strict=True):
        statuses[index], objectives[index] = judge(setup, result, substeps, timestep)
        if result.states is not None:
            logs[index] = walk_log(machine, setup, result.states)
    return Simulation(Outcome(objectives, statuses), tuple(logs) if log else ())


def with_gait(scenario: Scenario, gait: Mapping[str, float]) -> Scenario:
    """The scenario with some gait parameters replaced. Raises SimulationInputError."""
    if not gait:
        return scenario
    values: dict[str, float] = dict(gait)
    if "fir_ms" in values:
        if not float(values["fir_ms"]).is_integer():
            raise SimulationInputError(f"fir_ms: {values['fir_ms']:g} is not a whole number of ms")
        values["fir_ms"] = int(values["fir_ms"])
    try:
        return Scenario.model_validate(scenario.model_dump() | values)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        raise SimulationInputError(f"{where}: {first['msg']}") from error


def check_reach(
    scenario: Scenario,
    variables: Sequence[str],
    design: Sequence[float],
    *,
    robot: RobotChoice,
) -> None:
    """Raise UnreachablePose if the gait of this design leaves the legs' reach in this scenario."""
    gait = {
        name: value
        for name, value in zip(variables, design, strict=True)
        if name in GAIT_VARIABLE_NAMES
    }
    require_reachable(load_robot(robot), with_gait(scenario, gait))


def prepare(robot: RobotChoice = "szabadka2", *, backend: Backend = "auto") -> str:
    """Build (or find in the cache) the kernel; returns the backend in use, native or reference."""
    return kernel_of(load_robot(robot), backend).backend


def lanes() -> int:
    """Walkers that the kernel steps together; chunks of a batch should be multiples of it."""
    return target().lanes


def _check_arguments(
    controller: str,
    variables: Sequence[str],
    designs: NDArray[np.float64],
    physics_rate: int,
) -> None:
    if controller not in CONTROLLERS:
        raise SimulationInputError(
            f"controller: unknown {controller!r}; known are {', '.join(CONTROLLERS)}"
        )
    known = {v.name for v in CONTROLLERS[controller].variables} | GAIT_VARIABLE_NAMES
    for name in variables:
        if name not in known:
            raise SimulationInputError(
                f"{name}: not a variable of {controller}; known are {', '.join(sorted(known))}"
            )
    if designs.ndim != 2 or designs.shape[1] != len(variables):
        raise SimulationInputError(
            f"designs: shape {designs.shape} does not match {len(variables)} variables"
        )
    if not np.isfinite(designs).all():
        row, column = np.argwhere(~np.isfinite(designs))[0]
        raise SimulationInputError(f"{variables[column]}: not a finite number in design {row}")
    if physics_rate < 1000 or physics_rate % round(1.0 / CONTROL_PERIOD):
        raise SimulationInputError(
            f"physics_rate: {physics_rate} Hz is not a multiple of the control rate from 1000 Hz"
        )


def control_steps(robot: Robot, physics_rate: int = PHYSICS_RATE) -> tuple[int, float]:
    """Physics steps a control tick, and their length [s]."""
    if robot.has_backlash:
        physics_rate = max(physics_rate, BACKLASH_PHYSICS_RATE)
    return round(physics_rate * CONTROL_PERIOD), 1.0 / physics_rate


def kernel_of(robot: Robot, backend: Backend = "auto") -> Kernel:
    """The robot's kernel, built if there is none yet; with a warning if it is the slow one."""
    if backend != "reference":
        native = native_kernel(robot)
        if native is not None:
            return native
        if backend == "native":
            raise SimulationInputError("backend: no C compiler found for the native kernel")
        warnings.warn(
            "no C compiler found: simulating with the interpreter, some hundred times slower;"
            " install gcc or clang, or `pip install gaitswarm[compiler]`",
            RuntimeWarning,
            stacklevel=3,
        )
    # The native kernel does without CasADi and Pinocchio, which are slow to import.
    from sim.kernel.reference import reference_kernel  # noqa: PLC0415

    return reference_kernel(robot)


def course_of(
    robot: Robot,
    kernel: Kernel,
    scenario: Scenario,
    timestep: float,
    noise: LinkNoise | None = None,
    *,
    trajectory: Trajectory | None = None,
) -> Callable[[ControlLaw], WalkSetup] | None:
    """All of a walk but its control law, which designs of one gait share.

    trajectory: desired angles, if they are not those for this robot's legs.
    None for a gait out of the legs' reach.
    """
    trajectory = trajectory or desired_angles(robot, scenario)
    if not trajectory.reachable:
        return None
    ticks, n_joints = trajectory.angles.shape
    weight = (robot.mass + scenario.load) * -gravity_on(scenario.slope)[2]
    joints = trajectory.angles[0]
    internal_state = np.zeros(kernel.internal_state_size)
    if robot.has_backlash:
        internal_state[:n_joints] = joints
    codes = np.rint(trajectory.angles * robot.description.sensors.angle_counts)
    return partial(
        WalkSetup,
        np.concatenate(
            [
                [0.0, 0.0, resting_height(robot, joints, weight), 0.0, 0.0, 0.0, 1.0],
                joints,
            ]
        ),
        internal_state,
        pack_parameters(robot, scenario, timestep),
        codes.astype(np.int32),
        fall_height=0.5 * scenario.hip_height,
        disturbance=None if noise is None else noise.torques(ticks, n_joints),
    )


def judge(
    setup: WalkSetup, result: WalkResult, substeps: int, timestep: float
) -> tuple[Status, NDArray[np.float64]]:
    """Status and objectives f1..f6 (table 4.1) from the sums over physics steps."""
    objectives = np.full(N_OBJECTIVES, np.nan)
    if result.status is not Status.OK:
        return result.status, objectives
    steps = setup.ticks * substeps
    objectives[:3] = np.sqrt(result.sums[:3] / steps)
    objectives[5] = result.end[2] - setup.start[2]
    distance = result.sums[4] * timestep
    if distance < SHORTEST_WALK:
        return Status.STALLED, objectives
    objectives[3] = result.sums[3] * timestep / distance
    objectives[4] = steps * timestep / distance
    return Status.OK, objectives
