"""Choice of the kernel, setup of simulations, and objectives of their results."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from functools import partial
from typing import Final, Literal

import numpy as np

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.compiler.compilation import find_compiler, without_compiler
from gaitswarm.sim.controllers import ControlLaw
from gaitswarm.sim.controllers.fixed_point import CONTROL_PERIOD
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.gait.trajectory import Trajectory, carrying_torques, desired_angles
from gaitswarm.sim.kernel import Precision
from gaitswarm.sim.kernel.parameters import (
    GRAVITY,
    SHOVE_DURATION,
    gravity_on,
    internal_state_size,
    pack_parameters,
)
from gaitswarm.sim.kernel.walk import Coding, Kernel, WalkResult, WalkSetup, current_smoothing
from gaitswarm.sim.noise import LinkNoise
from gaitswarm.sim.outcome import N_MEASUREMENTS, N_OBJECTIVES, Status
from gaitswarm.sim.robot.description import JOINTS_PER_LEG
from gaitswarm.sim.robot.limbs import resting_height
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.robot.shapes import body_corners
from gaitswarm.sim.scenario import Scenario
from gaitswarm.sim.terrain import height_grid

Backend = Literal["auto", "native", "reference"]
"""`native` is the compiled kernel, `reference` the CasADi interpreter, `auto` either."""

PHYSICS_RATE: Final = 2500
"""Physics steps per second [Hz]; the control rate is 500 Hz."""

LANDING_RATE: Final = 40_000
"""Least physics steps per second [Hz] in control ticks in which a foot may land."""

KARNOPP_PHYSICS_RATE: Final = 5000
"""Rate [Hz] for robots with discontinuous friction at v_d, whose switching depends on the step."""

BACKLASH_PHYSICS_RATE: Final = 40_000
"""Rate [Hz] for robots with backlash: without their rotors, tibias are too stiff for 20 kHz on
soles with the damping of table 2.7."""

_SHOVE_TICKS: Final = round(SHOVE_DURATION / CONTROL_PERIOD)

SHORTEST_WALK: Final = 1e-3
"""Distance [m] below which a robot counts as not walking: energy per metre is undefined."""


def kernel_of(
    robot: Robot,
    backend: Backend = "auto",
    *,
    precision: Precision = "double",
    uneven: bool = False,
) -> Kernel:
    if backend == "reference" and precision != "double":
        raise SimulationInputError(
            f"precision: the reference kernel supports double only, not {precision}"
        )
    native = None if backend == "reference" else _native_kernel(robot, precision, uneven=uneven)
    if native is not None:
        return native
    if backend == "native":
        raise SimulationInputError(f"backend: no native kernel available; {without_compiler()}")
    if backend == "auto":
        check_precision(robot, precision)
        warnings.warn(
            f"{without_compiler()}; simulating with the interpreter, some hundred times slower",
            RuntimeWarning,
            stacklevel=3,
        )
    # The native kernel does not need CasADi and Pinocchio, which are slow to import.
    from gaitswarm.sim.kernel.reference import reference_kernel  # noqa: PLC0415

    return reference_kernel(robot, uneven=uneven)


def _native_kernel(robot: Robot, precision: Precision, *, uneven: bool = False) -> Kernel | None:
    from gaitswarm.sim.kernel.native import native_kernel  # noqa: PLC0415 - slow to import

    return native_kernel(robot, precision, uneven=uneven)


def has_native_kernel(robot: Robot, precision: Precision = "double") -> bool:
    """Check whether a compiled kernel is available for a robot, without compiling it."""
    return find_compiler() is not None or _native_kernel(robot, precision) is not None


def check_precision(robot: Robot, precision: Precision) -> None:
    if precision != "double" and not has_native_kernel(robot, precision):
        raise SimulationInputError(
            f"precision: {precision} needs the compiled kernel; {without_compiler()},"
            " or choose double"
        )


def control_steps(robot: Robot, physics_rate: int = PHYSICS_RATE) -> tuple[Coding, float]:
    """Return how a control tick is divided at a physics rate [Hz], and the step length [s]."""
    if robot.has_backlash:
        physics_rate = max(physics_rate, BACKLASH_PHYSICS_RATE)
    if robot.description.contact_law == "karnopp":
        physics_rate = max(physics_rate, KARNOPP_PHYSICS_RATE)
    inner_rate = robot.description.inner_rate
    physics_rate = inner_rate * math.ceil(physics_rate / inner_rate)
    substeps = round(physics_rate * CONTROL_PERIOD)
    refinement = max(1, math.ceil(LANDING_RATE / physics_rate))
    return Coding.of(robot, substeps, refinement), 1.0 / physics_rate


def check_stuck_leg(robot: Robot, scenario: Scenario) -> None:
    legs = [leg.name for leg in robot.legs]
    if scenario.stuck_leg is not None and scenario.stuck_leg not in legs:
        raise SimulationInputError(
            f"stuck_leg: {robot.description.name} has no leg {scenario.stuck_leg!r};"
            f" its legs are {', '.join(legs)}"
        )


def plan_walk(
    robot: Robot,
    scenario: Scenario,
    timestep: float,
    noise: LinkNoise | None = None,
    *,
    trajectory: Trajectory | None = None,
) -> Callable[[ControlLaw], WalkSetup] | None:
    """Set up all of a simulation but its control law, for all designs of one gait."""
    check_stuck_leg(robot, scenario)
    trajectory = trajectory or desired_angles(robot, scenario)
    if not trajectory.reachable:
        return None
    codes = trajectory.codes(robot.description.sensors.angle_counts)
    ticks, n_joints = codes.shape
    weight = (robot.mass + scenario.load) * -gravity_on(scenario.slope)[2]
    joints, grid = trajectory.start, height_grid(scenario.terrain)
    height = resting_height(robot, joints, weight, grid) + scenario.drop
    base = [0.0, 0.0, height, 0.0, 0.0, 0.0, 1.0]
    internal_state = np.zeros(internal_state_size(robot))
    if robot.has_backlash:
        internal_state[:n_joints] = joints
    shove = min(round(scenario.shove_at * ticks), ticks - _SHOVE_TICKS)
    shove_ticks = (shove, shove + _SHOVE_TICKS) if scenario.shove else (0, 0)
    displaced = noise is not None and noise.kind == "angle"
    start = np.concatenate([base, joints])
    parameters = pack_parameters(robot, scenario, timestep, start=joints, displaced=displaced)
    carrying = None
    if robot.is_torque_controlled:
        carrying = carrying_torques(robot, trajectory, GRAVITY)
        carrying.flags.writeable = False
    for shared in (start, internal_state, parameters, codes):
        shared.flags.writeable = False
    return partial(
        WalkSetup,
        start,
        internal_state,
        parameters,
        codes,
        fall_height=0.5 * scenario.hip_height,
        cycle=max(1, math.floor(ticks / scenario.cycles)),
        energy=robot.description.supply.energy,
        direction=-1 if scenario.direction == "backward" else 1,
        drop=scenario.drop,
        current_smoothing=current_smoothing(robot.description.sensors.current_filter, timestep),
        shove_ticks=shove_ticks,
        disturbance=None if noise is None else noise.samples(ticks, n_joints),
        feed_forward=carrying,
        terrain=grid,
        corners=body_corners(robot),
    )


def judge(
    setup: WalkSetup, result: WalkResult, substeps: int, timestep: float
) -> tuple[Status, Floats]:
    """Return status and objectives f1 to f6 (table 4.1), (6,), NaN where undefined."""
    objectives = np.full(N_OBJECTIVES, np.nan)
    if result.status is not Status.OK:
        return result.status, objectives
    steps = setup.ticks * substeps
    objectives[:3] = np.sqrt(result.sums[:3] / steps)
    objectives[5] = (setup.start[2] - setup.drop) - result.end[2]
    distance = setup.direction * result.sums[4] * timestep
    if distance < SHORTEST_WALK:
        return Status.STALLED, objectives
    objectives[3] = _energy_sum(setup, result) * timestep / distance
    objectives[4] = steps * timestep / distance
    return Status.OK, objectives


def measure(setup: WalkSetup, result: WalkResult, substeps: int, timestep: float) -> Floats:
    """Return `gaitswarm.sim.outcome.MEASUREMENTS` (10,), NaN for a walk that ended early."""
    if result.status is not Status.OK:
        return np.full(N_MEASUREMENTS, np.nan)
    steps, motors = setup.ticks * substeps, setup.desired.shape[1]
    forward_speed, _, absolute_current, heat, slip = result.sums[4:].tolist()
    forward_speed *= setup.direction
    current, torque, roll_tangent, pitch_sine = result.peaks.tolist()
    walked = forward_speed * timestep >= SHORTEST_WALK
    feet = motors // JOINTS_PER_LEG
    return np.array(
        [
            current,
            absolute_current / (steps * motors),
            heat / steps,
            _energy_sum(setup, result) / steps,
            forward_speed / steps,
            torque,
            math.degrees(math.atan(roll_tangent)),
            math.degrees(math.asin(min(pitch_sine, 1.0))),
            result.clearance if math.isfinite(result.clearance) else math.nan,
            slip / (feet * forward_speed) if walked else math.nan,
        ]
    )


def _energy_sum(setup: WalkSetup, result: WalkResult) -> float:
    """Electrical power that counts as spent, summed over physics steps [W]."""
    signed, absolute = float(result.sums[3]), float(result.sums[5])
    return {"signed": signed, "positive": 0.5 * (signed + absolute), "absolute": absolute}[
        setup.energy
    ]
