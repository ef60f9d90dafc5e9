"""Damping of the ground's forces, for the implicit step.

The step is ours alone, and so are these derivatives; MuJoCo's own steps do without.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache

import mujoco
import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.mujoco.forces import Ground
from gaitswarm.sim.robot.bounds import ContactLaw
from gaitswarm.sim.robot.robot import Robot
from tests.mujoco.numbers import model

Floats = NDArray[np.float64]
Drag = tuple[Floats, Floats]
"""(L,) each: how friction falls with a velocity in any direction [N s/m], and what is added to that
along the slip, over the slip's square [N s3/m3]."""


class Resistance:
    """Of the ground under a robot."""

    def __init__(self, robot: Robot, ground: Ground) -> None:
        self._ground, self._mobility = ground, mobility(robot)

    def __call__(self, position: Floats, velocity: Floats, timestep: float) -> Floats:
        """-dF/dv of all feet (L, 3, 3), without that by which friction follows the normal force."""
        ground, slip = self._ground, velocity[:, :2]
        touching, normal = ground.press(position, velocity)
        limit = ground.numbers["friction"] * normal
        # A step in which friction may stop a foot must not take it as constant.
        stopping = limit * timestep * self._mobility
        drag, further = _DRAGS[ground.law](ground, touching, limit, slip, stopping, timestep)
        damping = np.zeros((len(normal), 3, 3))
        damping[:, 2, 2] = np.where(normal > 0.0, ground.numbers["damping"], 0.0)
        damping[:, :2, :2] = drag[:, None, None] * np.eye(2)
        damping[:, :2, :2] += np.einsum("l,li,lj->lij", further, slip, slip)
        return damping


def _linear_zone(
    ground: Ground,
    touching: NDArray[np.bool_],
    limit: Floats,
    slip: Floats,
    stopping: Floats,
    timestep: float,
) -> Drag:
    speed, zone = np.hypot(slip[:, 0], slip[:, 1]), ground.numbers["slip_velocity"]
    bound = np.maximum(speed, zone)
    drag = limit / bound
    full = np.where(speed > zone, np.maximum(1.0 - stopping / bound, 0.0), 0.0)
    return drag, -full * drag / bound**2


def _karnopp(
    ground: Ground,
    touching: NDArray[np.bool_],
    limit: Floats,
    slip: Floats,
    stopping: Floats,
    timestep: float,
) -> Drag:
    return np.zeros_like(limit), np.zeros_like(limit)


def _dead_zone(
    ground: Ground,
    touching: NDArray[np.bool_],
    limit: Floats,
    slip: Floats,
    stopping: Floats,
    timestep: float,
) -> Drag:
    none, full = ground.numbers["stick_velocity"], ground.numbers["slip_velocity"]
    speed, width = np.hypot(slip[:, 0], slip[:, 1]), full - none
    bound = np.maximum(speed, none)
    drag = limit * np.clip((bound - none) / width, 0.0, 1.0) / bound
    grows = (speed > none) & (speed < full)
    slope = np.where(grows, limit / width, 0.0) - drag
    return drag, np.maximum(1.0 - stopping / bound, 0.0) * slope / bound**2


def _stick(
    ground: Ground,
    touching: NDArray[np.bool_],
    limit: Floats,
    slip: Floats,
    stopping: Floats,
    timestep: float,
) -> Drag:
    spring, damper = ground.numbers["stick_stiffness"], ground.numbers["stick_damping"]
    longer = ground.memory + timestep * slip
    pull = spring[:, None] * longer + damper[:, None] * slip
    size = np.hypot(pull[:, 0], pull[:, 1])
    share = np.divide(limit, size, out=np.ones_like(size), where=size > limit)
    return np.where(touching, share * damper, 0.0), np.zeros_like(limit)


_DRAGS: Mapping[ContactLaw, Callable[..., Drag]] = {
    "linear_zone": _linear_zone,
    "karnopp": _karnopp,
    "dead_zone": _dead_zone,
    "stick": _stick,
}


@lru_cache(maxsize=4)
def mobility(robot: Robot) -> Floats:
    """Acceleration per force of every foot against the rotors' inertia, the leg stretched and the
    body held, (L,) [1/kg]; so much or less a force accelerates it."""
    exported, actuators = model(robot), robot.actuators()
    rotors = dict(zip(robot.joint_names, actuators.armature.tolist(), strict=True))
    found = []
    for leg in robot.description.legs:
        reach = float(np.linalg.norm(exported.site(leg.foot).pos))
        total = 0.0
        for name in reversed(leg.joints):
            total += reach**2 / rotors[name]
            body = exported.jnt_bodyid[exported.joint(name).id]
            reach += float(np.linalg.norm(exported.body_pos[body]))
        found.append(total)
    result = np.array(found)
    result.flags.writeable = False
    return result


def feet_of(d: mujoco.MjData) -> tuple[Floats, Floats]:
    """Feet's positions and velocities, (L, 3) each, by MuJoCo's sensors."""
    position, velocity = d.sensordata.reshape(2, -1, 3)
    return position, velocity


def apply_forces(
    m: mujoco.MjModel, d: mujoco.MjData, bodies: Sequence[int], forces: Floats
) -> None:
    """Add forces on the feet (L, 3) [N] to qfrc_applied. bodies: that these are on, by leg."""
    position, _ = feet_of(d)
    nothing, applied = np.zeros(3), d.qfrc_applied
    for leg in np.flatnonzero(forces[:, 2]).tolist():
        mujoco.mj_applyFT(m, d, forces[leg], nothing, position[leg], bodies[leg], applied)
