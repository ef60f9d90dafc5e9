"""A walk in MuJoCo, with everything but the rigid bodies written anew from docs/model.md.

Motors, gears, battery, ground, controllers and objectives are computed in NumPy, here and in the
modules beside; nothing of the simulator's kernel takes part. From its own log of the same walk come
the start and the desired angles.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol

import mujoco
import numpy as np
from numpy.typing import NDArray

from sim.kernel.observation import WalkLog
from sim.robot import Robot
from sim.scenario import Scenario
from tests.mujoco.export import Feet, model
from tests.mujoco.ground import GROUNDS, ground_forces
from tests.mujoco.motors import gears_of

Floats = NDArray[np.float64]
Integration = Literal["mujoco", "body frame"]

CONTROL_PERIOD = 0.002
"""[s]"""


class Controller(Protocol):
    """What sets the duty cycles at every control tick."""

    def __call__(self, tick: int, angles: Floats, current: Floats) -> Floats:
        """Encoders' angles (J,) [rad], sensed |currents| (J,) [A] -> duty (J,) [1]."""


@dataclass(frozen=True, slots=True, eq=False)
class Trace:
    """States at the control ticks (T rows) and objectives f1..f6 of one walk in MuJoCo.

    base_position (T, 3) [m]; base_orientation (T, 4) x y z w; joint_angle, motor_angle (T, J)
    [rad]; foot_force (T, L, 3) [N] if the ground's forces were ours.
    """

    base_position: Floats
    base_orientation: Floats
    joint_angle: Floats
    motor_angle: Floats
    foot_force: Floats
    objectives: Floats


def timestep_of(robot: Robot) -> float:
    """[s]; links without their rotors answer the ground too fast for 5 kHz."""
    return 2.5e-5 if robot.has_backlash else 2e-4


def drag_of(robot: Robot, scenario: Scenario) -> float:
    """Drag [N s/m] of `linear_zone` at a foot that carries its even share of the weight.

    The zone's drag is mu F_z / v_lin; MuJoCo's is one number for all loads.
    """
    contact = robot.description.contact
    weight = 9.81 * np.cos(np.deg2rad(scenario.slope))
    weight *= float(model(robot, scenario=scenario).body_mass.sum())
    standing = scenario.duty_factor * len(robot.legs)
    return float(contact.friction * weight / standing / contact.slip_velocity)


def walk(
    robot: Robot,
    scenario: Scenario,
    log: WalkLog,
    controller: Controller,
    *,
    integration: Integration = "mujoco",
    feet: Feet | None = None,
    ticks: int | None = None,
) -> Trace:
    """Walk in MuJoCo from the log's first state.

    integration: MuJoCo's own semi-implicit Euler, or the same in the base's frame, as our kernel
        has it; they differ in second order of the step.
    feet: MuJoCo's own contacts in place of our law of ground forces.
    """
    m = model(robot, scenario=scenario, timestep=timestep_of(robot), feet=feet)
    d = mujoco.MjData(m)
    n, legs = robot.n_joints, len(robot.legs)
    substeps = round(CONTROL_PERIOD / m.opt.timestep)
    ticks = len(log.time) if ticks is None else ticks
    d.qpos[:] = np.concatenate(
        [log.base_position[0], log.base_orientation[0, [3, 0, 1, 2]], log.joint_angle[0]]
    )
    ground = GROUNDS[robot.description.contact_law](robot, m.opt.timestep)
    push = ground_forces(m, d, robot, ground) if feet is None else None
    gears = gears_of(robot, d.qpos[7:], m.opt.timestep)
    advance = _advance_in_body_frame if integration == "body frame" else mujoco.mj_step2
    measures = _Measures(gears.armature)
    sensed, forces = np.zeros(n), np.zeros((legs, 3))
    settling = robot.description.sensors.current_filter
    share = 1.0 - np.exp(-m.opt.timestep / settling) if settling > 0.0 else 1.0
    states, turned = np.empty((ticks, 7 + n)), np.empty((ticks, n))
    trodden = np.empty((ticks, legs, 3))
    for tick in range(ticks):
        states[tick], turned[tick] = d.qpos, gears.encoders(d.qpos[7:])
        duty = controller(tick, turned[tick], sensed)
        for substep in range(substeps):
            mujoco.mj_step1(m, d)
            actuation = gears.actuate(duty, d.qpos[7:], d.qvel[6:])
            sensed = sensed + share * (np.abs(actuation.current) - sensed)
            d.qfrc_applied[:6] = 0.0
            d.qfrc_applied[6:] = actuation.torque
            if push is not None:
                forces = push()
            if substep == 0:
                trodden[tick] = forces
            before = d.qpos[3:7].copy(), d.qvel[:3].copy()
            power = float(actuation.voltage @ actuation.current)
            advance(m, d)
            measures.add(*before, d.qacc, actuation.torque, power)
    objectives = measures.objectives(m.opt.timestep, d.qpos[2] - states[0, 2])
    return Trace(states[:, :3], states[:, [4, 5, 6, 3]], states[:, 7:], turned, trodden, objectives)


def _advance_in_body_frame(m: mujoco.MjModel, d: mujoco.MjData) -> None:
    """Semi-implicit Euler of the base's twist in its own frame, with MuJoCo's accelerations."""
    mujoco.mj_forwardSkip(m, d, mujoco.mjtStage.mjSTAGE_VEL, 1)
    dt = m.opt.timestep
    rotation, turned = np.empty(9), np.empty(3)
    mujoco.mju_quat2Mat(rotation, d.qpos[3:7])
    attitude = rotation.reshape(3, 3)
    linear, angular = attitude.T @ d.qvel[:3], d.qvel[3:6].copy()
    mujoco.mju_cross(turned, angular, linear)
    linear += dt * (attitude.T @ d.qacc[:3] - turned)
    d.qvel[3:] += dt * d.qacc[3:]
    d.qpos[:3] += attitude @ linear * dt
    mujoco.mju_quatIntegrate(d.qpos[3:7], d.qvel[3:6], dt)
    mujoco.mju_quat2Mat(rotation, d.qpos[3:7])
    d.qvel[:3] = rotation.reshape(3, 3) @ linear
    d.qpos[7:] += dt * d.qvel[6:]
    d.time += dt


class _Measures:
    """Objectives of table 4.1, summed over the physics steps."""

    def __init__(self, armature: Floats) -> None:
        self._armature = armature
        self._sums = np.zeros(5)
        self._steps = 0

    def add(
        self, attitude: Floats, velocity: Floats, qacc: Floats, torque: Floats, power: float
    ) -> None:
        """attitude w x y z and velocity of the base in the world, before the step."""
        w, x, y, z = attitude
        ahead = np.array([1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z)])
        load = float(np.abs(torque - self._armature * qacc[6:]).sum())
        self._sums += (
            load * load,
            float(qacc[:3] @ qacc[:3]),
            float(qacc[3:6] @ qacc[3:6]),
            power,
            float(velocity[:2] @ ahead) / float(np.hypot(*ahead)),
        )
        self._steps += 1

    def objectives(self, timestep: float, rise: float) -> Floats:
        """f1..f6."""
        rms = np.sqrt(self._sums[:3] / self._steps)
        distance = self._sums[4] * timestep
        energy = self._sums[3] * timestep / distance
        return np.array([*rms, energy, self._steps * timestep / distance, rise])
