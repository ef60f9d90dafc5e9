"""The 500 Hz log of a walk, derived from the states that the kernel logged."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.controllers.fixed_point import CONTROL_PERIOD
from gaitswarm.sim.kernel.parameters import Layout, internal_state_size
from gaitswarm.sim.kernel.walk import WalkSetup, current_smoothing
from gaitswarm.sim.robot.robot import Robot

if TYPE_CHECKING:
    from gaitswarm.sim.kernel.dynamics.physics_step import PhysicsModel


@dataclass(frozen=True, slots=True, eq=False)
class WalkLog:
    """Time series of one walk at every control tick (500 Hz); T ticks, J joints, L legs.

    Attributes:
        time: (T,) [s].
        base_position: (T, 3) [m].
        base_orientation: (T, 4) quaternion x y z w.
        base_velocity: in the body's frame, (T, 6) linear [m/s] and angular [rad/s].
        joint_angle: of the links, (T, J) [rad].
        motor_angle: seen by the encoders; with backlash not the link's, (T, J) [rad].
        joint_velocity: (T, J) [rad/s].
        desired_angle: (T, J) [rad].
        current: of the motors, (T, J) [A].
        voltage: of the motors, (T, J) [V].
        load_torque: passed by the gearheads to the links, (T, J) [N m].
        foot_force: in the world, (T, L, 3) [N].
        supply: voltage of the battery, (T,) [V].
    """

    time: Floats
    base_position: Floats
    base_orientation: Floats
    base_velocity: Floats
    joint_angle: Floats
    motor_angle: Floats
    joint_velocity: Floats
    desired_angle: Floats
    current: Floats
    voltage: Floats
    load_torque: Floats
    foot_force: Floats
    supply: Floats

    def until_end(self) -> WalkLog:
        """Return the log without the ticks after an early end."""
        columns = {column.name: getattr(self, column.name) for column in fields(self)}
        walked = np.all(
            [np.isfinite(c.reshape(len(c), -1)).all(axis=1) for c in columns.values()], axis=0
        )
        end = len(walked) if walked.all() else int(np.argmin(walked))
        return WalkLog(**{name: column[:end] for name, column in columns.items()})

    def body_acceleration(self) -> Floats:
        """Acceleration of the body's origin in its own frame, without gravity, (T, 3) [m/s2].

        dv/dt + omega x v of the logged twist, dv/dt by central differences over 4 ms.
        """
        linear, angular = self.base_velocity[:, :3], self.base_velocity[:, 3:]
        # A single tick is the first one, at rest.
        rate = np.gradient(linear, self.time, axis=0) if len(linear) > 1 else np.zeros_like(linear)
        return np.asarray(rate + np.cross(angular, linear))


class States(NamedTuple):
    """States logged by a kernel at every tick, after its control; T ticks, J joints."""

    base_position: Floats  # (T, 3) [m]
    base_orientation: Floats  # (T, 4) quaternion x y z w
    joint_angle: Floats  # of the links, (T, J) [rad]
    base_velocity: Floats  # in the body's frame, (T, 6) [m/s, rad/s]
    joint_velocity: Floats  # (T, J) [rad/s]
    internal_state: Floats  # (T, I)
    # absolute, before the converters of the current sensors and their errors, (T, J) [A]
    sensed_current: Floats
    duty: Floats  # (T, J) [1]


def split_states(robot: Robot, states: Floats) -> States:
    n = robot.n_joints
    widths = [3, 4, n, 6, n, internal_state_size(robot), n]
    return States(*np.split(states, np.cumsum(widths), axis=1))


def encoder_angles(robot: Robot, states: States) -> Floats:
    """Return the angles that the encoders see, (T, J) [rad]: those of the motors."""
    if robot.has_backlash:
        return states.internal_state[:, : robot.n_joints]
    return states.joint_angle


def walk_log(robot: Robot, setup: WalkSetup, states: Floats) -> WalkLog:
    """Compute currents, torques, forces and supply of every tick from its state and duty."""
    feet, ticks = len(robot.legs), len(states)
    parts = split_states(robot, states)
    position, orientation, angle, twist, rate, internal_state, _, duty = parts
    walked = int(np.isfinite(states).all(axis=1).sum())
    joints = robot.n_joints
    seen = [np.full((ticks, size), np.nan) for size in (joints, joints, joints, 3 * feet, 1)]
    if walked:
        # Imported here: with a compiled kernel, only logs need CasADi.
        from gaitswarm.sim.kernel.dynamics.physics_step import physics_model  # noqa: PLC0415

        model = physics_model(robot, uneven=setup.terrain is not None)
        disturbance = np.zeros_like(angle) if setup.disturbance is None else setup.disturbance
        q = np.concatenate([position, orientation, angle], axis=1)
        inputs = (q, np.concatenate([twist, rate], axis=1), internal_state, duty, disturbance)
        begin, end = setup.shove_ticks
        parameters = np.tile(setup.parameters, (walked, 1))
        pushes = Layout(robot).slices["push"]
        parameters[:begin, pushes] = parameters[end:, pushes] = 0.0
        arguments = [part[:walked].T for part in (*inputs, parameters)]
        if setup.terrain is not None:
            places = np.array(_mapped(model, "places", walked)(arguments[0])).T
            x, y, *_ = places.reshape(-1, 6).T
            arguments.append(np.stack(setup.terrain.under(x, y), axis=1).reshape(walked, -1).T)
        observed = _mapped(model, "observe", walked)(*arguments)
        for target, part in zip(seen, observed, strict=False):
            target[:walked] = np.array(part).T
    current, voltage, load, force, supply = seen
    return WalkLog(
        time=np.arange(ticks, dtype=np.float64) * CONTROL_PERIOD,
        base_position=position,
        base_orientation=orientation,
        base_velocity=twist,
        joint_angle=angle,
        motor_angle=encoder_angles(robot, parts),
        joint_velocity=rate,
        desired_angle=setup.desired / robot.description.sensors.angle_counts,
        current=current,
        voltage=voltage,
        load_torque=load,
        foot_force=force.reshape(ticks, feet, 3),
        supply=supply[:, 0],
    )


@lru_cache(maxsize=32)
def _mapped(model: PhysicsModel, function: str, instants: int) -> Any:
    return getattr(model, function).map(instants)


def sensed_currents(robot: Robot, current: Floats, voltage: Floats) -> Floats:
    """Return the inputs of the current sensors' converters: absolute currents behind the low-pass.

    Between two ticks the current (T, J) [A] is linear; it ends where the voltage jumps.
    """
    begins = np.abs(current)
    smoothing = current_smoothing(robot.description.sensors.current_filter, CONTROL_PERIOD)
    if smoothing >= 1.0:
        return begins
    if robot.is_torque_controlled:
        # Torques follow a PD between inner ticks, without a large jump at a control tick.
        ends = begins[1:]
    else:
        ends = np.abs(current[1:] - np.diff(voltage, axis=0) / robot.actuators().resistance)
    sensed = np.zeros_like(begins)
    for tick, mean in enumerate(0.5 * (begins[:-1] + ends)):
        sensed[tick + 1] = sensed[tick] + smoothing * (mean - sensed[tick])
    return sensed
