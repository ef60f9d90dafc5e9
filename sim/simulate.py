"""Entry point: designs in one scenario -> objectives, statuses, measurements."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.assembly import (
    PHYSICS_RATE,
    Backend,
    check_stuck_leg,
    control_steps,
    judge,
    kernel_of,
    measure,
    plan_walk,
)
from gaitswarm.sim.catalogue import GAIT_CATALOGUE, with_gait
from gaitswarm.sim.compiler.compilation import target
from gaitswarm.sim.controllers import CONTROLLERS, ControlLaw, control_law, names_of
from gaitswarm.sim.controllers.fixed_point import CONTROL_PERIOD
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.gait.gaits import LegGait, leg_gaits
from gaitswarm.sim.gait.trajectory import desired_angles, require_reachable
from gaitswarm.sim.kernel import Precision
from gaitswarm.sim.kernel.observation import WalkLog, walk_log
from gaitswarm.sim.kernel.walk import (
    NO_JOINT_PD,
    NO_SERVO,
    Kernel,
    Walking,
    WalkRequest,
    WalkSetup,
    walk_together,
)
from gaitswarm.sim.near_names import instead_of
from gaitswarm.sim.noise import LinkNoise
from gaitswarm.sim.outcome import N_MEASUREMENTS, N_OBJECTIVES, Measurements, Outcome, Status
from gaitswarm.sim.robot import DEFAULT_ROBOT, RobotChoice, load_robot
from gaitswarm.sim.robot.robot import Robot, with_shafts
from gaitswarm.sim.scenario import Scenario

_PLANS_KEPT: Final = 64
"""Number of scenarios, and of gaits in several worlds, whose plans are cached; most take a quarter
of a megabyte."""


@dataclass(frozen=True, slots=True, eq=False)
class Simulation:
    """Results of designs, in their order."""

    outcome: Outcome
    measurements: Measurements  # see `gaitswarm.sim.outcome.MEASUREMENTS`
    # if requested; None for designs that were not simulated (unreachable), NaN after an early end
    logs: tuple[WalkLog | None, ...] = ()


def simulate(
    scenario: Scenario,
    controller: str | ControlLaw,
    variables: Sequence[str],
    designs: Floats,
    *,
    robot: RobotChoice = DEFAULT_ROBOT,
    planner: Robot | None = None,
    noise: LinkNoise | None = None,
    log: bool = False,
    backend: Backend = "auto",
    physics_rate: int = PHYSICS_RATE,
    precision: Precision = "double",
) -> Simulation:
    """Simulate designs in one scenario, in the calling thread.

    Args:
        scenario: Scenario to walk through.
        controller: Name of the controller, or a compiled control law; then all variables are of
            the gait.
        variables: Names of the designs' columns: variables of the controller and of the gait.
        designs: (n, len(variables)), in the variables' units.
        robot: Robot to simulate: its name, a `RobotVariant`, `RobotFiles` or a `Robot`.
        planner: Robot that the desired angles are planned for. Default: `robot`.
        noise: Noise between gearheads and links.
        log: Whether to record every simulation at 500 Hz.
        backend: `native` is the compiled kernel, `reference` the CasADi interpreter, `auto` the
            first that works on this machine.
        physics_rate: Physics steps per second [Hz], a multiple of the control rate.
        precision: Precision of the physics.

    Returns:
        Objectives, statuses, measurements and logs of all designs.

    Raises:
        SimulationInputError: An argument is invalid; names it.
    """
    (simulation,) = walk_together(
        [
            simulating(
                scenario,
                controller,
                variables,
                designs,
                robot=robot,
                planner=planner,
                noise=noise,
                log=log,
                backend=backend,
                physics_rate=physics_rate,
                precision=precision,
            )
        ]
    )
    return simulation


def simulating(
    scenario: Scenario,
    controller: str | ControlLaw,
    variables: Sequence[str],
    designs: Floats,
    *,
    robot: RobotChoice,
    planner: Robot | None = None,
    noise: LinkNoise | None = None,
    log: bool = False,
    backend: Backend = "auto",
    physics_rate: int = PHYSICS_RATE,
    precision: Precision = "double",
    kernel: Kernel | None = None,
) -> Walking[Simulation]:
    """Prepare `simulate` for `walk_together`, with a given kernel if there is one."""
    _check_arguments(controller, variables, designs, physics_rate)
    machine = load_robot(robot)
    if noise is not None and noise.kind == "angle":
        machine = with_shafts(machine)
    _, timestep = control_steps(machine, physics_rate)
    setups: dict[int, WalkSetup] = {}
    plans: dict[tuple[float, ...], Callable[[ControlLaw], WalkSetup] | None] = {}
    for index, row in enumerate(designs.tolist()):
        design = dict(zip(variables, row, strict=True))
        gait = {name: design.pop(name) for name in variables if name in GAIT_CATALOGUE}
        law = (
            controller
            if isinstance(controller, ControlLaw)
            else control_law(controller, tuple(design.items()))
        )
        key = tuple(gait.values())
        if key not in plans:
            walked = with_gait(scenario, gait)
            plans[key] = (
                plan_of_scenario(machine, walked, timestep)
                if not gait and noise is None and planner is None
                else plan_walk(
                    machine,
                    walked,
                    timestep,
                    noise,
                    trajectory=None if planner is None else desired_angles(planner, walked),
                )
            )
        plan = plans[key]
        if plan is not None:
            setups[index] = plan(law)
    return (
        yield from walking(
            machine,
            setups,
            len(designs),
            kernel=kernel,
            backend=backend,
            precision=precision,
            physics_rate=physics_rate,
            log=log,
        )
    )


def walking(
    robot: Robot,
    setups: Mapping[int, WalkSetup],
    count: int,
    *,
    kernel: Kernel | None = None,
    backend: Backend = "auto",
    precision: Precision = "double",
    physics_rate: int = PHYSICS_RATE,
    log: bool,
) -> Walking[Simulation]:
    """Simulate setups by design index, by `kernel` or the robot's; others are unreachable."""
    coding, timestep = control_steps(robot, physics_rate)
    statuses = np.full(count, Status.UNREACHABLE, dtype=np.uint8)
    objectives = np.full((count, N_OBJECTIVES), np.nan)
    measured = np.full((count, N_MEASUREMENTS), np.nan)
    logs: list[WalkLog | None] = [None] * count
    grounds = {setup.terrain is not None for setup in setups.values()}
    kernels = {
        uneven: kernel or kernel_of(robot, backend, precision=precision, uneven=uneven)
        for uneven in grounds
    }
    results = yield [
        WalkRequest(kernels[setup.terrain is not None], coding, setup, log)
        for setup in setups.values()
    ]
    for (index, setup), result in zip(setups.items(), results, strict=True):
        statuses[index], objectives[index] = judge(setup, result, coding.substeps, timestep)
        measured[index] = measure(setup, result, coding.substeps, timestep)
        if result.states is not None:
            logs[index] = walk_log(robot, setup, result.states)
    return Simulation(
        Outcome(objectives, statuses), Measurements.of(measured), tuple(logs) if log else ()
    )


@lru_cache(maxsize=_PLANS_KEPT)
def plan_of_scenario(
    robot: Robot, scenario: Scenario, timestep: float
) -> Callable[[ControlLaw], WalkSetup] | None:
    """Walks in the scenario's own gait, or in a design's, which several worlds share."""
    return plan_walk(robot, scenario, timestep)


def check_reach(
    scenario: Scenario,
    variables: Sequence[str],
    design: Sequence[float],
    *,
    robot: RobotChoice,
) -> None:
    """Check that a robot can start a walk: the stuck leg exists, and legs reach all targets."""
    machine = load_robot(robot)
    check_stuck_leg(machine, scenario)
    gait = {
        name: value for name, value in zip(variables, design, strict=True) if name in GAIT_CATALOGUE
    }
    require_reachable(machine, with_gait(scenario, gait))


def check_gait(
    scenario: Scenario, design: Mapping[str, float], *, robot: RobotChoice
) -> tuple[LegGait, ...]:
    """Check that a gait suits a robot's legs, whether or not they reach it."""
    gait = {name: value for name, value in design.items() if name in GAIT_CATALOGUE}
    return leg_gaits(load_robot(robot), with_gait(scenario, gait))


def check_drives(law: ControlLaw, robot: RobotChoice) -> None:
    if law.joint_pd is not None and not load_robot(robot).is_torque_controlled:
        raise SimulationInputError(NO_JOINT_PD)
    if law.servo is not None and load_robot(robot).servos is None:
        raise SimulationInputError(NO_SERVO)


def prepare(
    robot: RobotChoice = DEFAULT_ROBOT,
    *,
    backend: Backend = "auto",
    precision: Precision = "double",
) -> str:
    return kernel_of(load_robot(robot), backend, precision=precision).backend


def lanes(precision: Precision = "double") -> int:
    return target().lanes * (2 if precision == "single" else 1)


def _check_arguments(
    controller: str | ControlLaw,
    variables: Sequence[str],
    designs: Floats,
    physics_rate: int,
) -> None:
    if isinstance(controller, ControlLaw):
        own, label = frozenset[str](), "the gait"
    elif controller in CONTROLLERS:
        own, label = names_of(CONTROLLERS[controller]), controller
    else:
        raise SimulationInputError(f"controller: {CONTROLLERS.unknown(controller)}")
    for name in variables:
        if name not in own and name not in GAIT_CATALOGUE:
            known = own | set(GAIT_CATALOGUE)
            raise SimulationInputError(
                f"{name}: not a variable of {label}; {instead_of(name, sorted(known))}"
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
