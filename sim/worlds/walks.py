"""Simulation of designs in perturbed worlds, by the kernel or another engine."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.assembly import control_steps, plan_walk
from gaitswarm.sim.case import MeasuredCase, SimulatedCase
from gaitswarm.sim.catalogue import GAIT_CATALOGUE, with_gait
from gaitswarm.sim.controllers import ControllerName, control_law
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.kernel import Precision
from gaitswarm.sim.kernel.parameters import Layout, gravity_on
from gaitswarm.sim.kernel.sensors import DEVIATION, SensorErrors, byte_sums
from gaitswarm.sim.kernel.walk import Kernel, Walking, WalkSetup
from gaitswarm.sim.mujoco.engines import ENGINES, check_installed
from gaitswarm.sim.mujoco.mjcf import Soles
from gaitswarm.sim.outcome import N_OBJECTIVES, Objective, Outcome
from gaitswarm.sim.robot import RobotSource, load_robot
from gaitswarm.sim.robot.limbs import feet_in_body, height_on_soles, rotated
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.scenario import Scenario
from gaitswarm.sim.simulate import Simulation, plan_of_scenario, walking
from gaitswarm.sim.terrain import HeightGrid, Plane, Rough, height_grid, rough_grid
from gaitswarm.sim.worlds.perturbations import NOMINAL, check_worlds

_SCALED: Final[Mapping[str, tuple[str, ...]]] = {
    "friction_factor": ("friction",),
    "stiffness_factor": ("stiffness", "stick_stiffness"),
    "damping_factor": ("damping", "stick_damping"),
    "sole_factor": ("sole",),
    "backlash_factor": ("backlash",),
    "battery_voltage_factor": ("supply_voltage",),
    "battery_resistance_factor": ("supply_resistance",),
}
"""Kernel parameters scaled by a factor, where a robot has them."""

_START: Final = 1
"""Stream of a world's seed for start angles."""


def perturbed_setups(
    robot: Robot,
    scenario: Scenario,
    nominal: Sequence[WalkSetup],
    variables: Sequence[str],
    worlds: Floats,
) -> list[WalkSetup]:
    """Set up a simulation in each world (n, len(variables)); controller and gait stay nominal."""
    columns = dict(zip(variables, worlds.T, strict=True))
    values = {
        name: columns.get(name, np.full(len(worlds), default)) for name, default in NOMINAL.items()
    }
    parameters = np.stack([setup.parameters for setup in nominal])
    _perturb(robot, scenario, parameters, values)
    seeds = map(round, values["world_seed"].tolist())
    grounds = [
        ground_of(scenario, roughness, seed)
        for roughness, seed in zip(values["roughness"].tolist(), seeds, strict=True)
    ]
    starts = _starts(robot, scenario, nominal, parameters, values, grounds)
    internal_states = np.stack([setup.internal_state for setup in nominal])
    if robot.has_backlash:
        internal_states[:, : robot.n_joints] = starts[:, 7:]
    lifts, errors = values["start_height"].tolist(), _sensor_errors(values)
    columns_of = (nominal, starts, internal_states, parameters, lifts, errors, grounds)
    return [
        replace(
            setup,
            start=start,
            internal_state=internal_state,
            parameters=packed,
            drop=setup.drop + lift,
            sensors=sensors,
            terrain=ground,
        )
        for setup, start, internal_state, packed, lift, sensors, ground in zip(
            *columns_of, strict=True
        )
    ]


def check_grounds(scenarios: Sequence[Scenario], variables: Sequence[str], worlds: Floats) -> None:
    """Reject worlds (n, len(variables)) that roughen ground of another kind."""
    for scenario in scenarios:
        for roughness in worlds[:, [name == "roughness" for name in variables]].ravel().tolist():
            ground_of(scenario, roughness)


def ground_of(scenario: Scenario, roughness: float = 0.0, seed: int = 0) -> HeightGrid | None:
    """Return the uneven ground of a world, whose seed is the place at which the robot starts."""
    terrain = scenario.terrain
    if roughness and not isinstance(terrain, Plane | Rough):
        raise SimulationInputError(
            f"roughness: the ground of scenario {scenario.name!r} is of kind {terrain.kind};"
            " worlds add roughness to planes and rough ground only"
        )
    if roughness:
        known = terrain if isinstance(terrain, Rough) else Rough(kind="rough", amplitude=0.0)
        ground: HeightGrid | None = replace(rough_grid(known), scale=roughness)
    else:
        ground = height_grid(terrain)
    return ground and ground.placed(seed)


def _perturb(
    robot: Robot, scenario: Scenario, packed: Floats, values: Mapping[str, Floats]
) -> None:
    """Change the nominal kernel parameters (n, P) to those of each world."""
    slices = Layout.of(robot).slices
    for factor, fields in _SCALED.items():
        for field in fields:
            if field in slices:
                packed[:, slices[field]] *= values[factor][:, np.newaxis]
    actuators = robot.actuators()
    efficiency = np.minimum(actuators.efficiency * values["efficiency_factor"][:, np.newaxis], 1.0)
    packed[:, slices["viscous"]] = values["viscous_friction_factor"][:, np.newaxis] * (
        actuators.motor_friction + (1.0 - efficiency) * actuators.gear_friction
    )
    _add_masses(robot, scenario, packed, values)
    slopes = zip(values["slope_added"], values["slope_added_direction"], strict=True)
    for row, (slope, direction) in zip(packed, slopes, strict=True):
        if slope > 0.0:
            row[slices["gravity"]] = _gravity(scenario, float(slope), float(direction))


def _add_masses(
    robot: Robot, scenario: Scenario, packed: Floats, values: Mapping[str, Floats]
) -> None:
    slices, body = Layout.of(robot).slices, robot.body
    further = values["body_mass_factor"][:, np.newaxis] - 1.0
    load = (scenario.load + values["load_added"])[:, np.newaxis]
    at = np.array([[0.0, 0.0, robot.description.load_height]])
    load_position = at + np.stack(
        [values[f"load_{way}"] for way in ("ahead", "left", "raised")], axis=1
    )
    packed[:, slices["base_mass"]] += further * body.mass + (load - scenario.load)
    packed[:, slices["base_moment"]] += further * (body.mass * body.centre) + (
        load * load_position - scenario.load * at
    )
    body_inertia = body.rotational[_ROWS, _COLUMNS] + body.mass * _parallel_axes(
        body.centre[np.newaxis]
    )
    packed[:, slices["base_inertia"]] += further * body_inertia + (
        load * _parallel_axes(load_position) - scenario.load * _parallel_axes(at)
    )


_ROWS, _COLUMNS = [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]
"""Order of an inertia: xx, yy, zz, xy, xz, yz."""


def _parallel_axes(offset: Floats) -> Floats:
    """Rotational inertia of unit point masses, (n, 3) [m] -> (n, 6) [m2]."""
    x, y, z = offset.T
    return np.stack([y * y + z * z, x * x + z * z, x * x + y * y, -x * y, -x * z, -y * z], axis=1)


def _gravity(scenario: Scenario, slope: float, direction: float) -> Floats:
    """Gravity on two slopes (3,) [m/s2], which add as vectors of steepest ascent."""
    x = y = 0.0
    for angle, towards in ((scenario.slope, scenario.slope_direction), (slope, direction)):
        x += angle * math.cos(math.radians(towards))
        y += angle * math.sin(math.radians(towards))
    return gravity_on(math.hypot(x, y), math.degrees(math.atan2(y, x)))


def _starts(
    robot: Robot,
    scenario: Scenario,
    nominal: Sequence[WalkSetup],
    parameters: Floats,
    values: Mapping[str, Floats],
    grounds: Sequence[HeightGrid | None],
) -> Floats:
    """Start positions (n, 7+J), at which each world's soles carry its weight, or above."""
    slices = Layout.of(robot).slices
    starts = np.stack([setup.start for setup in nominal])
    seeds = values["world_seed"].astype(np.uint64)
    deviates = byte_sums(seeds, 0, robot.n_joints, _START)[..., 0] / DEVIATION
    offsets = values["start_angle"][:, np.newaxis] * deviates
    starts[:, 7:] += offsets
    # A jammed leg stays at its initial angles.
    jammed = parameters[:, slices["jam_stiffness"]] > 0.0
    parameters[:, slices["jam_angle"]] += jammed * offsets
    further = (values["body_mass_factor"] - 1.0) * robot.body.mass
    mass = robot.mass + further + (scenario.load + values["load_added"])
    weight = mass * -parameters[:, slices["gravity"]][:, 2]
    tilts = np.radians(np.stack([values["start_roll"], values["start_pitch"]], axis=1))
    for start, packed, carried, tilt, ground in zip(
        starts, parameters, weight.tolist(), tilts, grounds, strict=True
    ):
        start[3:7], up = _attitude(*tilt.tolist())
        feet = feet_in_body(robot, start[7:])
        reach = packed[slices["sole"]] - feet @ up
        if ground is not None:
            x, y, _ = rotated(start[3:7], feet).T
            reach = reach + ground.height(x, y)
        start[2] = height_on_soles(reach, packed[slices["stiffness"]], carried)
    starts[:, 2] += [setup.drop for setup in nominal] + values["start_height"]
    return starts


def _attitude(roll: float, pitch: float) -> tuple[Floats, Floats]:
    """Roll, then pitch [rad]: quaternion x y z w, and the world's z in the body's frame."""
    x, a = math.sin(0.5 * roll), math.cos(0.5 * roll)
    y, b = math.sin(0.5 * pitch), math.cos(0.5 * pitch)
    up = [-math.sin(pitch), math.cos(pitch) * math.sin(roll), math.cos(pitch) * math.cos(roll)]
    return np.array([b * x, y * a, 0.0 - y * x, a * b]), np.array(up)


def _sensor_errors(values: Mapping[str, Floats]) -> list[SensorErrors]:
    names = ("angle_noise", "current_noise", "angle_delay", "current_delay", "world_seed")
    columns = zip(*(values[name].tolist() for name in names), strict=True)
    return [
        SensorErrors(angle, current, round(late_angle), round(late_current), round(seed))
        for angle, current, late_angle, late_current, seed in columns
    ]


class _WalkInWorlds(SimulatedCase):
    """Cases that set up their simulations in worlds."""

    __slots__ = ()

    precision: Precision

    @abstractmethod
    def _setups(self, robot: Robot, designs: Floats) -> Mapping[int, WalkSetup]:
        """Return setups by index of the design, without gaits out of the legs' reach."""

    def _simulating(
        self, designs: Floats, *, log: bool = False, kernel: Kernel | None = None
    ) -> Walking[Simulation]:
        robot = load_robot(self.robot)
        setups, precision = self._setups(robot, designs), self.precision
        return (
            yield from walking(
                robot, setups, len(designs), kernel=kernel, precision=precision, log=log
            )
        )


@dataclass(frozen=True, slots=True)
class PerturbedWalk(_WalkInWorlds):
    """Designs of a controller in a scenario of one world, unknown to the controller."""

    name: str  # unique in its job
    robot: RobotSource  # as described
    controller: ControllerName
    scenario: Scenario
    # perturbations by name; others are nominal
    world: tuple[tuple[str, float], ...]
    variables: tuple[str, ...]  # columns of the designs
    precision: Precision = "double"

    @property
    def duration(self) -> float:
        return self.scenario.duration

    def _setups(self, robot: Robot, designs: Floats) -> Mapping[int, WalkSetup]:
        _, timestep = control_steps(robot)
        of_gait: dict[tuple[float, ...], WalkSetup | None] = {}
        laws = []
        for row in designs.tolist():
            design = dict(zip(self.variables, row, strict=True))
            gait = {name: design.pop(name) for name in self.variables if name in GAIT_CATALOGUE}
            key, law = tuple(gait.values()), control_law(self.controller, tuple(design.items()))
            if key not in of_gait:
                plan = plan_of_scenario(robot, with_gait(self.scenario, gait), timestep)
                of_gait[key] = plan and plan(law)
            laws.append((key, law))
        nominal = {key: setup for key, setup in of_gait.items() if setup is not None}
        names, values = tuple(name for name, _ in self.world), [v for _, v in self.world]
        worlds = np.tile(np.array(values, dtype=np.float64), (len(nominal), 1))
        check_worlds(names, worlds)
        setups = perturbed_setups(robot, self.scenario, list(nominal.values()), names, worlds)
        in_world = dict(zip(nominal, setups, strict=True))
        return {
            index: replace(in_world[key], control_law=law)
            for index, (key, law) in enumerate(laws)
            if key in in_world
        }


@dataclass(frozen=True, slots=True)
class MeasuredPerturbedWalk(MeasuredCase, PerturbedWalk):
    """A perturbed walk with its measurements."""


@dataclass(frozen=True, slots=True)
class WorldWalk(_WalkInWorlds):
    """One design in one scenario; the world varies.

    Desired angles and control law are those of the robot as described: the controller does not know
    the world. All worlds share the robot's kernel.
    """

    robot: RobotSource  # as described
    controller: ControllerName
    design: tuple[tuple[str, float], ...]
    scenario: Scenario
    # columns of the worlds, names of `PERTURBATIONS`; others are nominal
    variables: tuple[str, ...]
    precision: Precision = "double"

    @property
    def name(self) -> str:
        return self.scenario.name

    @property
    def duration(self) -> float:
        """Simulated time of one world [s], with the design's cycle time if it has one."""
        cycle_time = dict(self.design).get("cycle_time", self.scenario.cycle_time)
        return self.scenario.cycles * cycle_time

    def _setups(self, robot: Robot, designs: Floats) -> Mapping[int, WalkSetup]:
        check_worlds(self.variables, designs)
        gait = {name: value for name, value in self.design if name in GAIT_CATALOGUE}
        gains = tuple((n, value) for n, value in self.design if n not in GAIT_CATALOGUE)
        scenario = with_gait(self.scenario, gait)
        law = control_law(self.controller, gains)
        _, timestep = control_steps(robot)
        plan = plan_walk(robot, scenario, timestep)
        if plan is None:
            return {}
        nominal = [plan(law)] * len(designs)
        setups = perturbed_setups(robot, scenario, nominal, self.variables, designs)
        return dict(enumerate(setups))


@dataclass(frozen=True, slots=True)
class EngineWalk:
    """Worlds with a column that selects the engine.

    Other engines take some hundred times as long, so that their simulations can be stopped.
    """

    walk: WorldWalk  # its worlds are without the engine's column
    engine_column: int  # index of that column: 0 for the kernel, k for the k-th of `ENGINES`

    @property
    def name(self) -> str:
        return self.walk.name

    @property
    def robots(self) -> tuple[RobotSource, ...]:
        return self.walk.robots

    @property
    def duration(self) -> float:
        return self.walk.duration

    @property
    def precision(self) -> Precision:
        """Precision of the kernel; other engines have double precision only."""
        return self.walk.precision

    @property
    def objectives(self) -> tuple[Objective, ...]:
        return self.walk.objectives

    def run(self, designs: Floats) -> Outcome:
        return self.run_until(designs, lambda: False)

    def run_until(self, designs: Floats, should_stop: Callable[[], bool]) -> Outcome:
        """Simulate worlds (n, v), including the engine's column, until `should_stop`."""
        engines = designs[:, self.engine_column].astype(np.intp)
        worlds = np.delete(designs, self.engine_column, axis=1)
        objectives = np.full((len(designs), N_OBJECTIVES), np.nan)
        statuses = np.zeros(len(designs), dtype=np.uint8)
        for engine in np.unique(engines).tolist():
            rows = np.flatnonzero(engines == engine)
            kernel = self._kernel(engine, should_stop) if engine else None
            outcome = self.walk.simulate(worlds[rows], kernel=kernel).outcome
            objectives[rows], statuses[rows] = outcome.objectives, outcome.statuses
        return Outcome(objectives, statuses)

    def _kernel(self, engine: int, should_stop: Callable[[], bool]) -> Kernel:
        check_installed()
        # MuJoCo is only needed for these simulations.
        from gaitswarm.sim.mujoco.kernel import MujocoKernel  # noqa: PLC0415

        robot = load_robot(self.walk.robot)
        own_contacts = tuple(ENGINES)[engine - 1] == "mujoco-contacts"
        soles: Soles = "spheres" if own_contacts else "none"
        return MujocoKernel(robot, soles=soles, should_stop=should_stop)
