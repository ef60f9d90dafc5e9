"""A walk in MuJoCo with the steps of docs/model.md, an oracle of the whole simulator.

Rigid bodies are MuJoCo's; motors, gears, battery and ground are those of sim/mujoco, controllers
and objectives are computed here and in neighbouring modules. The simulator's kernel takes no part,
but its log provides the start and the desired angles.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import mujoco
import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.kernel.observation import WalkLog
from gaitswarm.sim.mujoco.forces import Gears
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.scenario import Scenario
from tests.mujoco.leapfrog import Leapfrog, Middle
from tests.mujoco.numbers import model, own_gears, own_ground

Floats = NDArray[np.float64]

CONTROL_PERIOD = 0.002
"""[s]"""

LANDING_RATE = 40_000
"""Steps a second [Hz] at least in control ticks in which a foot may come down."""

LANDING_HORIZON = 0.0025
"""How far ahead that is seen [s]."""


class Controller(Protocol):
    """What sets the duty cycles at every control tick."""

    def __call__(self, tick: int, angles: Floats, current: Floats) -> Floats:
        """Encoders' angles (J,) [rad], sensed |currents| (J,) [A] -> duty (J,) [1]."""


@dataclass(frozen=True, slots=True, eq=False)
class Trace:
    """States at the control ticks (T rows) and objectives f1..f6 of one walk in MuJoCo.

    base_position (T, 3) [m]; base_orientation (T, 4) x y z w; joint_angle, motor_angle (T, J)
    [rad]; foot_force (T, L, 3) [N].
    """

    base_position: Floats
    base_orientation: Floats
    joint_angle: Floats
    motor_angle: Floats
    foot_force: Floats
    objectives: Floats


def physics_rate_of(robot: Robot) -> int:
    """Steps a second where no foot comes down [Hz], as docs/model.md has them."""
    if robot.has_backlash:
        return 40_000
    return 5000 if robot.description.contact_law == "karnopp" else 2500


def walk(
    robot: Robot, scenario: Scenario, log: WalkLog, controller: Controller, ticks: int | None = None
) -> Trace:
    """Walk in MuJoCo from the log's first state, in the steps of docs/model.md.

    MuJoCo has the kinematics, inertia and bias forces; the step is `leapfrog.Leapfrog`.
    """
    rate = physics_rate_of(robot)
    m = model(robot, scenario=scenario)
    d = _at_the_start(m, log)
    gears, ground = own_gears(robot, d.qpos[7:]), own_ground(robot)
    step = Leapfrog(m, d, robot, gears, ground)
    substeps, shorter = round(CONTROL_PERIOD * rate), math.ceil(LANDING_RATE / rate)
    measures, record = _Measures(), _Record(robot, len(log.time) if ticks is None else ticks)
    sensed, landing = np.zeros(robot.n_joints), False
    for tick in range(record.ticks):
        record.add(tick, d, gears, step.foot_forces())
        duty = controller(tick, record.motor_angle[tick], sensed)
        rounds = shorter if landing else 1
        timestep = 1.0 / rate / rounds
        share = settled_share(robot, timestep)
        for _ in range(rounds):
            step.drift(0.5 * timestep)
            for left in reversed(range(substeps)):
                middle = step.kick(duty, timestep)
                landing = step.landing(LANDING_HORIZON)
                step.drift(timestep if left else 0.5 * timestep)
                sensed = sensed + share * (np.abs(middle.current) - sensed)
                measures.add(middle, timestep)
    return record.trace(measures.objectives(record.states[0, 2] - d.qpos[2]))


def settled_share(robot: Robot, timestep: float) -> float:
    """Of its distance from the current that the sensors' low-pass goes in a step [s]."""
    settling = robot.description.sensors.current_filter
    return 1.0 - math.exp(-timestep / settling) if settling > 0.0 else 1.0


def _at_the_start(m: mujoco.MjModel, log: WalkLog) -> mujoco.MjData:
    d = mujoco.MjData(m)
    d.qpos[:] = np.concatenate(
        [log.base_position[0], log.base_orientation[0, [3, 0, 1, 2]], log.joint_angle[0]]
    )
    return d


class _Record:
    """States at the control ticks."""

    def __init__(self, robot: Robot, ticks: int) -> None:
        self.ticks = ticks
        self.states = np.empty((ticks, 7 + robot.n_joints))
        self.motor_angle = np.empty((ticks, robot.n_joints))
        self.foot_force = np.empty((ticks, len(robot.legs), 3))

    def add(self, tick: int, d: mujoco.MjData, gears: Gears, forces: Floats) -> None:
        self.states[tick] = d.qpos
        self.motor_angle[tick] = gears.angles if gears.loose else d.qpos[7:]
        self.foot_force[tick] = forces

    def trace(self, objectives: Floats) -> Trace:
        states = self.states
        return Trace(
            states[:, :3],
            states[:, [4, 5, 6, 3]],
            states[:, 7:],
            self.motor_angle,
            self.foot_force,
            objectives,
        )


class _Measures:
    """Objectives of table 4.1, summed over the physics steps."""

    def __init__(self) -> None:
        self._sums = np.zeros(5)
        self._time = 0.0

    def add(self, middle: Middle, timestep: float) -> None:
        """Of a step [s]."""
        ahead = middle.attitude[:2, 0]
        load = float(np.abs(middle.load).sum())
        self._sums += timestep * np.array(
            [
                load * load,
                middle.acceleration @ middle.acceleration,
                middle.angular_acceleration @ middle.angular_acceleration,
                middle.voltage @ middle.current,
                (middle.attitude @ middle.velocity)[:2] @ ahead / np.hypot(*ahead),
            ]
        )
        self._time += timestep

    def objectives(self, sunk: float) -> Floats:
        """f1..f6; sunk: how far the body is below where it was [m]."""
        rms = np.sqrt(self._sums[:3] / self._time)
        distance = self._sums[4]
        return np.array([*rms, self._sums[3] / distance, self._time / distance, sunk])
