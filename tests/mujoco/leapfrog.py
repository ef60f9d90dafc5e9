"""The step of docs/model.md, implemented on MuJoCo's positions, inertia and bias forces.

A drift turns and moves the robot at constant velocities; a kick changes the velocities at fixed
positions. What damps is taken at the kick's middle: the accelerations solve
(M + dt/2 (J^T D J + motors)) a = f(v) - dt/2 J^T D a0, a0 being what the feet's speeds gain anyway.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.mujoco.forces import Drive, Gears, Ground
from gaitswarm.sim.robot.robot import Robot
from tests.mujoco.resistance import Resistance, apply_forces, feet_of

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Middle:
    """What is measured of a step, at its middle.

    velocity, acceleration: of the base's origin in the base's frame (3,) [m/s], [m/s2].
    angular_acceleration: of the base (3,) [rad/s2].
    attitude: base to world (3, 3).
    load: torques that the gearheads pass to the links (J,) [N m].
    current: of the motors (J,) [A].
    voltage: of the motors (J,) [V].
    """

    velocity: Floats
    acceleration: Floats
    angular_acceleration: Floats
    attitude: Floats
    load: Floats
    current: Floats
    voltage: Floats


class Leapfrog:
    """Steps MuJoCo's state, the gears and the ground's memory."""

    def __init__(
        self, m: mujoco.MjModel, d: mujoco.MjData, robot: Robot, gears: Gears, ground: Ground
    ) -> None:
        self._m, self._d, self._robot, self._gears, self._ground = m, d, robot, gears, ground
        self._resistance = Resistance(robot, ground)
        self._viscous, self._torque_constants = robot.actuators().viscous, robot.actuators().torque
        legs = robot.description.legs
        self._bodies = [int(m.site_bodyid[m.site(leg.foot).id]) for leg in legs]

    def drift(self, time: float) -> None:
        """Positions after a time [s] at a constant twist of the base in its own frame."""
        d = self._d
        attitude = attitude_of(d)
        linear, turn = attitude.T @ d.qvel[:3], time * d.qvel[3:6]
        along = time * linear
        d.qpos[:3] += attitude @ (along + 0.5 * cross(turn, along))
        mujoco.mju_quatIntegrate(d.qpos[3:7], d.qvel[3:6], time)
        d.qpos[7:] += time * d.qvel[6:]
        d.qvel[:3] = attitude_of(d) @ linear
        self._gears.drift(time)

    def foot_forces(self) -> Floats:
        """Of the ground, here and now, (L, 3) [N]. Positions are derived for MuJoCo."""
        mujoco.mj_step1(self._m, self._d)
        return self._ground.forces(*feet_of(self._d), 0.0)[0]

    def landing(self, time: float) -> bool:
        """Whether a foot may come down within a time [s], as seen at the last kick."""
        return self._ground.landing(*feet_of(self._d), time)

    def kick(self, duty: Floats, timestep: float, disturbance: Floats | float = 0.0) -> Middle:
        """Velocities after a step [s]; disturbance: torques on the links (J,) [N m]."""
        m, d = self._m, self._d
        half = 0.5 * timestep
        mujoco.mj_step1(m, d)
        force_on_feet, memory = self._ground.forces(*feet_of(d), timestep)
        damping = self._resistance(*feet_of(d), timestep)
        drive, torque = self._gears.actuate(duty, d.qpos[7:], d.qvel[6:])
        d.qfrc_applied[:6] = 0.0
        d.qfrc_applied[6:] = torque + disturbance
        apply_forces(m, d, self._bodies, force_on_feet)
        inertia = np.zeros((m.nv, m.nv))
        mujoco.mj_fullM(m, d, inertia)
        force = d.qfrc_applied - d.qfrc_bias
        inertia.reshape(-1)[6 * (m.nv + 1) :: m.nv + 1] += half * self._damping(drive)
        for leg in np.flatnonzero(damping.any(axis=(1, 2))).tolist():
            jacobian, gain = self._foot(leg)
            resistance = half * jacobian.T @ damping[leg]
            inertia += resistance @ jacobian
            force -= resistance @ gain
        acceleration = np.linalg.solve(inertia, force)
        self._ground.memory = memory
        own = self._gears.kick(drive, torque, timestep, implicit=0.5)
        spins = acceleration[6:] if own is None else own
        return self._accelerate(acceleration, drive, torque, spins, timestep)

    def _damping(self, drive: Drive) -> Floats:
        """Of the motors on the links; rotors behind backlash are damped by themselves."""
        return np.zeros_like(drive.damping) if self._gears.loose else drive.damping

    def _foot(self, leg: int) -> tuple[Floats, Floats]:
        """J of a foot (3, V), and what its velocity gains without accelerations (3,) [m/s2].

        In the axes of the tibia, which turn with it and in which its damper keeps its direction.
        """
        m, d = self._m, self._d
        position, velocity = feet_of(d)
        jacobian, faster, spin = (np.zeros((3, m.nv)) for _ in range(3))
        body = self._bodies[leg]
        mujoco.mj_jac(m, d, jacobian, spin, position[leg], body)
        mujoco.mj_jacDot(m, d, faster, None, position[leg], body)
        gain: Floats = faster @ d.qvel - cross(spin @ d.qvel, velocity[leg])
        return jacobian, gain

    def _accelerate(
        self,
        acceleration: Floats,
        drive: Drive,
        torque: Floats,
        spins: Floats,
        timestep: float,
    ) -> Middle:
        d, gears, half = self._d, self._gears, 0.5 * timestep
        attitude = attitude_of(d)
        linear, angular = attitude.T @ d.qvel[:3], d.qvel[3:6].copy()
        gain = attitude.T @ acceleration[:3] - cross(angular, linear)
        turn = acceleration[3:6]
        middle = linear + half * gain
        d.qvel[:3] = attitude @ (linear + timestep * gain)
        d.qvel[3:] += timestep * acceleration[3:]
        # Of the voltage's torque, without friction.
        falling = drive.damping - self._viscous
        return Middle(
            velocity=middle,
            acceleration=gain + cross(angular + half * turn, middle),
            angular_acceleration=turn,
            attitude=attitude,
            load=torque - (half * self._damping(drive) + gears.armature) * acceleration[6:],
            current=drive.current - falling / self._torque_constants * (half * spins),
            voltage=drive.voltage,
        )


def attitude_of(d: mujoco.MjData) -> Floats:
    """Base to world (3, 3)."""
    rotation = np.empty(9)
    mujoco.mju_quat2Mat(rotation, d.qpos[3:7])
    return rotation.reshape(3, 3)


def cross(one: Floats, other: Floats) -> Floats:
    """Cross product (3,); numpy's takes longer than the rest of a step."""
    product = np.empty(3)
    mujoco.mju_cross(product, one, other)
    return product
