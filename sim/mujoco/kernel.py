"""Kernel whose rigid bodies and integrator are MuJoCo's.

Some hundred times slower than the compiled kernel. MuJoCo computes the equations of motion, the
integration (semi-implicit Euler), and with soles also the contacts. Control ticks, sensors with
their errors, and the parameters of a world are the simulator's; motors, gears and ground are this
package's.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Final

import mujoco
import numpy as np

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.controllers.fixed_point import CONTROL_PERIOD
from gaitswarm.sim.kernel.control_tick import PythonKernel
from gaitswarm.sim.kernel.parameters import CONTACT_LAWS, Layout
from gaitswarm.sim.kernel.walk import PEAKS, Coding, WalkSetup
from gaitswarm.sim.mujoco.forces import Gears, Ground
from gaitswarm.sim.mujoco.mjcf import Rig, Soles, Surroundings, height_field, mjcf, reach_of
from gaitswarm.sim.mujoco.model import Feet, even_drags, with_contacts
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.robot.urdf import BodyInertia, parallel_axis
from gaitswarm.sim.terrain import HeightGrid

RATE: Final = 5_000
"""Steps per second [Hz] of MuJoCo's Euler, whose error is of first order in their length."""

BACKLASH_RATE: Final = 40_000
"""The same with backlash, where links are light without their rotors."""

LANDING_RATE: Final = 80_000
"""Steps per second [Hz] in control ticks in which a foot may touch down: its damper stops it sooner
than in a longer step, which causes nearly all of the error."""

_MAX_VELOCITY: Final = 1e10
"""mjMAXVAL: MuJoCo calls a state with a larger velocity unstable."""

_HORIZON: Final = 1.25 * CONTROL_PERIOD
"""Look-ahead for touchdowns [s]."""

_TICKS_PER_POLL: Final = 50
"""Control ticks between calls of `should_stop`."""


class WalkStopped(Exception):
    """`should_stop` ended a walk."""


class MujocoKernel(PythonKernel):
    """Walks in MuJoCo, at a given rate of steps [Hz] or at `RATE`, `BACKLASH_RATE` or more."""

    backend: Final = "mujoco"

    def __init__(
        self,
        robot: Robot,
        *,
        soles: Soles = "none",
        rate: int | None = None,
        should_stop: Callable[[], bool] = lambda: False,
    ) -> None:
        super().__init__(robot)
        self._soles, self._should_stop = soles, should_stop
        # Multiples of the inner rate.
        inner = robot.description.inner_rate
        usual = rate or (BACKLASH_RATE if robot.has_backlash else RATE)
        landing = LANDING_RATE if rate is None else rate
        self._rates = inner * math.ceil(usual / inner), inner * math.ceil(landing / inner)

    def _physics(self, setup: WalkSetup, coding: Coding) -> _Stepper:
        rates, should_stop = self._rates, self._should_stop
        return _Stepper(self._robot, setup, coding, self._soles, rates, should_stop)


class _Stepper:
    """MuJoCo's state of one walk, with gears and ground."""

    def __init__(
        self,
        robot: Robot,
        setup: WalkSetup,
        coding: Coding,
        soles: Soles,
        step_rates: tuple[int, int],
        should_stop: Callable[[], bool],
    ) -> None:
        self._setup, self._coding = setup, coding
        self._step_rates, self._should_stop = step_rates, should_stop
        self._numbers = numbers = Layout(robot).fields(setup.parameters)
        self._pushed = soles == "none"
        self._m = m = _model(robot, setup, soles)
        self._d = mujoco.MjData(m)
        x, y, z, w = setup.start[3:7].tolist()
        self._d.qpos[:] = [*setup.start[:3], w, x, y, z, *setup.start[7:]]
        self._velocity, self._acceleration = self._d.qvel, self._d.qacc
        self._applied = self._d.qfrc_applied
        self._angles, self._rates = self._d.qpos[7:], self._velocity[6:]
        # Body 0 is the world, body 1 the robot's.
        self._ahead, self._up = self._d.xmat[1, 0:6:3], self._d.xmat[1, 6:9]
        # Positions [m] and velocities [m/s] of the feet, by MuJoCo's sensors.
        self._of_feet: tuple[Floats, Floats] = tuple(self._d.sensordata.reshape(2, -1, 3))
        self._terrain = None if setup.terrain is None else _Terrain(m, self._d, setup.terrain)
        self._gears = Gears(robot, numbers, setup.start[7:])
        self._ground = Ground(robot.description.contact_law, numbers)
        self._resistance = robot.actuators().resistance
        self._torque_constants = robot.actuators().torque
        feet = [leg.foot for leg in robot.description.legs]
        self._feet = [int(m.site_bodyid[m.site(foot).id]) for foot in feet]
        self._displaced = bool(numbers["displaced"].any())
        self.diverged = False
        # `PEAKS` of the last step, and heights of the soles (L,) [m] at its beginning.
        self.peaks, self.heights = np.zeros(len(PEAKS)), np.zeros(len(feet))
        self._jammed = bool(numbers["jam_stiffness"].any())

    def state(self) -> tuple[Floats, Floats, Floats]:
        """In the kernel's convention: quaternion x y z w, the body's twist in its own frame."""
        qpos, qvel, gears = self._d.qpos, self._d.qvel, self._gears
        attitude = np.empty(9)
        mujoco.mju_quat2Mat(attitude, qpos[3:7])
        return (
            np.concatenate([qpos[:3], qpos[4:7], qpos[3:4], qpos[7:]]),
            np.concatenate([attitude.reshape(3, 3).T @ qvel[:3], qvel[3:]]),
            np.concatenate([*gears.memory, *gears.dry.memory, self._ground.memory.ravel()]),
        )

    def knees(self) -> Floats:
        return np.asarray(self._d.xpos[self._feet])

    def _on_ground(self) -> tuple[Floats, Floats, Floats | None]:
        """Positions and velocities of the feet in the ground's axes, and these axes (L, 3, 3)."""
        position, velocity = self._of_feet
        if self._terrain is None:
            return position, velocity, None
        heights, axes = self._terrain.below(position)
        above = position.copy()
        above[:, :2], above[:, 2] = 0.0, (position[:, 2] - heights) * axes[:, 2, 2]
        return above, np.einsum("lij,lj->li", axes, velocity), axes

    def motors(self) -> tuple[Floats, Floats]:
        gears = self._gears
        return (gears.angles, gears.rates) if gears.loose else (self._angles, self._rates)

    def begin(self, tick: int) -> tuple[int, float]:
        if tick % _TICKS_PER_POLL == 0 and self._should_stop():
            raise WalkStopped
        setup = self._setup
        self._disturbance = None if setup.disturbance is None else setup.disturbance[tick]
        begin, end = setup.shove_ticks
        self._shoved = begin <= tick < end
        self._derive()
        position, velocity, _ = self._on_ground()
        rate = self._step_rates[self._ground.landing(position, velocity, _HORIZON)]
        self._m.opt.timestep = 1.0 / rate
        steps = round(CONTROL_PERIOD * rate)
        self._share = self._coding.substeps / steps
        smoothing = setup.current_smoothing
        if smoothing < 1.0:
            smoothing = -math.expm1(self._share * math.log1p(-smoothing))
        return steps, smoothing

    def step(self, duty: Floats) -> tuple[Floats, Floats]:
        """Step once, measuring at the step's beginning."""
        m, d, numbers, timestep = self._m, self._d, self._numbers, self._m.opt.timestep
        self._derive()
        angles, rates, applied = self._angles, self._rates, self._applied
        disturbance = self._disturbance
        displaced = 0.0 if disturbance is None or not self._displaced else disturbance
        drive, on_links = self._gears.actuate(duty, angles, rates, displaced)
        torque = on_links
        if disturbance is not None and not self._displaced:
            torque = torque + disturbance
        applied[:3] = numbers["push"] if self._shoved else 0.0
        applied[3:6] = 0.0
        applied[6:] = torque
        if self._jammed:
            applied[6:] -= (
                numbers["jam_stiffness"] * (angles - numbers["jam_angle"])
                + numbers["jam_damping"] * rates
            )
        position, velocity, axes = self._on_ground()
        if self._pushed:
            self._push_feet(position, velocity, axes)
        dry, firm = self._gears.dry, not self._gears.loose
        if firm and dry.torques.size:
            motors = self._torque_constants * drive.current
            m.dof_frictionloss[6:] = dry.limits(motors, rates)
        (ahead_x, ahead_y), (x, y) = self._ahead.tolist(), self._velocity[:2].tolist()
        forward = (ahead_x * x + ahead_y * y) / math.hypot(ahead_x, ahead_y)
        pitch, roll, level = self._up.tolist()
        self.heights = position[:, 2] - numbers["sole"]
        slip = np.hypot(velocity[:, 0], velocity[:, 1]) @ (self.heights < 0.0)
        mujoco.mj_fwdActuation(m, d)
        mujoco.mj_fwdAcceleration(m, d)
        mujoco.mj_fwdConstraint(m, d)
        mujoco.mj_Euler(m, d)
        self.diverged = not self._velocity @ self._velocity < _MAX_VELOCITY * _MAX_VELOCITY
        self._gears.kick(drive, on_links, timestep)
        self._gears.drift(timestep)
        gain = self._acceleration
        if firm and dry.torques.size:
            rows = slice(d.ne, d.ne + d.nf)
            dry.torques[d.efc_id[rows] - 6] = d.efc_force[rows]
            torque = torque + dry.torques
        loads = torque - self._gears.armature * gain[6:]
        if firm:
            dry.loads = loads
        strains = np.abs(loads)
        load = float(strains.sum())
        acceleration, turn = gain[:3], gain[3:6]
        current = np.abs(drive.current)
        power = drive.voltage * drive.current
        integrands = np.array(
            [
                load * load,
                acceleration @ acceleration,
                turn @ turn,
                power.sum(),
                forward,
                np.abs(power).sum(),
                current.sum(),
                self._resistance @ (current * current),
                slip,
            ]
        )
        self.peaks = np.array([current.max(), strains.max(), abs(roll / level), abs(pitch)])
        return self._share * integrands, current

    def _derive(self) -> None:
        """mj_step1 without its checks, which would write to a file of the user."""
        m, d = self._m, self._d
        if self._terrain is not None and not self._pushed:
            mujoco.mj_kinematics(m, d)
            self._terrain.lay_planes(d.site_xpos)
        mujoco.mj_fwdPosition(m, d)
        mujoco.mj_sensorPos(m, d)
        mujoco.mj_fwdVelocity(m, d)
        mujoco.mj_sensorVel(m, d)

    def _push_feet(self, position: Floats, velocity: Floats, axes: Floats | None) -> None:
        """Add the ground's forces, from `_on_ground`, to those already applied."""
        m, d, places = self._m, self._d, self._of_feet[0]
        forces, self._ground.memory = self._ground.forces(position, velocity, m.opt.timestep)
        for foot in forces[:, 2].nonzero()[0].tolist():
            force = forces[foot] if axes is None else axes[foot].T @ forces[foot]
            mujoco.mj_applyFT(
                m, d, force, _NO_TORQUE, places[foot], self._feet[foot], self._applied
            )


class _Terrain:
    """Uneven ground as MuJoCo's height field has it: rays from above find height and normal."""

    def __init__(self, m: mujoco.MjModel, d: mujoco.MjData, grid: HeightGrid) -> None:
        self._m, self._d, self._grid = m, d, grid
        self._geom = int(m.geom("ground").id)
        # Height from which rays fall [m]: MuJoCo takes longer for a longer ray.
        self._sky = float(m.geom_pos[self._geom, 2] + m.hfield_size[0, 2] + 0.01)

    def below(self, places: Floats) -> tuple[Floats, Floats]:
        """Return heights (L,) [m] and axes (L, 3, 3) of the ground: x and y turned, and normals."""
        heights, axes = np.empty(len(places)), np.empty((len(places), 3, 3))
        for foot, place in enumerate(places):
            above, normal = np.array([place[0], place[1], self._sky]), np.empty(3)
            fall = mujoco.mj_rayHfield(self._m, self._d, self._geom, above, _DOWN, normal)
            heights[foot] = self._sky - fall
            if fall < 0.0:  # beyond the field
                heights[foot], along, across = self._grid.under(place[0], place[1])
                normal = np.array([-along, -across, 1.0])
            normal /= math.sqrt(normal @ normal)
            ahead = np.array([normal[2], 0.0, -normal[0]]) / math.hypot(normal[0], normal[2])
            axes[foot] = ahead, np.cross(normal, ahead), normal
        return heights, axes

    def lay_planes(self, places: Floats) -> None:
        """Lay each foot's plane along the ground below it."""
        heights, axes = self.below(places)
        self._d.mocap_pos[:] = np.column_stack([places[:, :2], heights])
        for turn, rows in zip(self._d.mocap_quat, axes, strict=True):
            mujoco.mju_mat2Quat(turn, rows.T.ravel())


_DOWN: Final = np.array([0.0, 0.0, -1.0])

_NO_TORQUE: Final = np.zeros(3)


def _model(robot: Robot, setup: WalkSetup, soles: Soles) -> mujoco.MjModel:
    """The robot with the masses, gravity, feet and ground of a walk."""
    surroundings = _surroundings(robot, Layout(robot).fields(setup.parameters))
    if setup.terrain is not None:
        reach = reach_of(setup.ticks * CONTROL_PERIOD)
        surroundings = replace(surroundings, ground=setup.terrain, reach=reach)
    rig = Rig(tangent_planes=setup.terrain is not None and soles != "none")
    if soles != "none":
        feet = Feet(even_drags(robot, surroundings), points=soles == "points")
        rig = with_contacts(robot, surroundings, rig, feet)
    model = mujoco.MjModel.from_xml_string(mjcf(robot, surroundings, rig))
    if surroundings.ground is not None:
        model.hfield_data[:] = height_field(surroundings, "none").heights.ravel()
    return model


def _surroundings(robot: Robot, numbers: Mapping[str, Floats]) -> Surroundings:
    mass = float(numbers["base_mass"][0])
    centre = numbers["base_moment"] / mass
    xx, yy, zz, xy, xz, yz = numbers["base_inertia"].tolist()
    about_origin = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    body = BodyInertia(mass, centre, about_origin - mass * parallel_axis(centre))
    names = CONTACT_LAWS[robot.description.contact_law].parameters
    contacts = tuple(
        contact.model_copy(update={name: float(numbers[name][leg]) for name in names})
        for leg, contact in enumerate(robot.contacts())
    )
    return Surroundings(body, numbers["gravity"], contacts)
