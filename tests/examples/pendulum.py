"""A listed actuator that moves a pendulum, as on the test bench of Rhoban's BAM."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.assembly import control_steps, kernel_of
from gaitswarm.sim.controllers import ControlLaw
from gaitswarm.sim.controllers.fixed_point import CONTROL_PERIOD
from gaitswarm.sim.kernel.parameters import Layout, internal_state_size, pack_parameters
from gaitswarm.sim.kernel.walk import WalkSetup
from gaitswarm.sim.proposal.drive import DriveNumbers, actuator_tables
from gaitswarm.sim.robot.description import listed_actuator
from gaitswarm.sim.robot.robot import Robot, parse_robot
from gaitswarm.sim.scenario import SCENARIOS

GRAVITY: Final = 9.80665
"""Of the bench [m/s2]."""

TRAJECTORIES: Final[dict[str, Callable[[Floats], Floats]]] = {
    "sin_sin": lambda t: np.sin(t) * np.pi / 2.0 + np.sin(5.0 * t) * 0.5 * np.sin(2.0 * t),
    "sin_time_square": lambda t: np.sin(t**2),
    "half_sine": lambda t: np.sin(t / 2.0) * np.pi / 2.0,
    "up_and_down": lambda t: np.where(
        t < 3.0, np.pi / 2.0 * _smooth(t / 3.0), np.pi / 2.0 * (1.0 - 0.2 * _smooth(t / 3.0 - 1.0))
    ),
}
"""Angles [rad] by time [s], in BAM's bam/trajectory.py, for six seconds."""

SECONDS: Final = 6.0


def _smooth(share: Floats) -> Floats:
    return share * share * (3.0 - 2.0 * share)


@dataclass(frozen=True, slots=True)
class Pendulum:
    """A point mass on a rod."""

    mass: float  # [kg]
    arm_mass: float  # [kg]
    length: float  # [m]


def bench(actuator: str, voltage: float, pendulum: Pendulum) -> Robot:
    """A body of a million tons whose first joint has the pendulum; other joints bear nothing."""
    numbers = listed_actuator(actuator)
    drive = DriveNumbers(1.0, 1.0, 1.0, "", listed=actuator)
    tables = "\n".join(actuator_tables(numbers.kind, [[drive]]))
    tables = tables.replace(f"voltage = {numbers.voltage}", f"voltage = {voltage}")
    tables = tables.replace(f"full_scale = {numbers.voltage}", f"full_scale = {voltage}")
    tables = tables.replace("resistance = 0.01  ", "resistance = 0.0  ")
    legs = ""
    links = '<link name="body"><inertial><mass value="1e9"/>' + _inertia(1e9)
    for leg, p in (("left", pendulum), ("right", Pendulum(1e-9, 0.0, 0.1))):
        legs += f"""
[[legs]]
name = "{leg}"
joints = ["{leg}_1", "{leg}_2", "{leg}_3"]
foot = "{leg}_foot"
stance = [0.0, 0.0, 0.0]
phase = 0.0
actuators = ["{actuator}", "{actuator}", "{actuator}"]
"""
        whole = p.mass + p.arm_mass
        centre = (p.mass + p.arm_mass / 2.0) * p.length / whole
        about = (p.mass + p.arm_mass / 3.0) * p.length**2 - whole * centre**2
        parent, bodies = "body", [(whole, centre, about), *((1e-9, 0.0, 1e-12),) * 2]
        for number, (mass, below, inertia) in enumerate(bodies, start=1):
            links += (
                f'<link name="{leg}{number}"><inertial><origin xyz="0 0 {-below}"/>'
                f'<mass value="{mass}"/>{_inertia(inertia)}'
                f'<joint name="{leg}_{number}" type="revolute"><parent link="{parent}"/>'
                f'<child link="{leg}{number}"/><origin xyz="0 0 {-0.1 * (number > 1)}"/>'
                '<axis xyz="0 -1 0"/><limit lower="-4" upper="4" effort="1" velocity="1"/></joint>'
            )
            parent = f"{leg}{number}"
        links += (
            f'<link name="{leg}_foot"/><joint name="{leg}_end" type="fixed">'
            f'<parent link="{parent}"/><child link="{leg}_foot"/><origin xyz="0 0 -0.1"/></joint>'
        )
    contact = "stiffness = 1e3\ndamping = 1.0\nsole = 0.0\nfriction = 0.0\nslip_velocity = 0.1"
    toml = f'name = "bench"\nload_height = 0.0\n{tables}\n[contact]\n{contact}\n{legs}'
    return parse_robot(toml, f'<robot name="bench">{links}</robot>')


def _inertia(moment: float) -> str:
    moments = " ".join(f'i{axis}{axis}="{moment}"' for axis in "xyz")
    return f'<inertia {moments} ixy="0" ixz="0" iyz="0"/></inertial></link>'


def swing(robot: Robot, desired: Floats, law: ControlLaw) -> Floats:
    """Angles [rad] of the pendulum at every control tick, for desired ones (T,)."""
    coding, timestep = control_steps(robot, 10_000)
    kernel, n = kernel_of(robot), robot.n_joints
    parameters = pack_parameters(robot, SCENARIOS[0].model_copy(update={"load": 0.0}), timestep)
    at = Layout(robot).slices
    parameters[at["gravity"]] = [0.0, 0.0, -GRAVITY]
    parameters[at["push"]] = [0.0, 0.0, GRAVITY * robot.mass]
    codes = np.zeros((len(desired), n), dtype=np.int32)
    codes[:, 0] = np.rint(desired * coding.angle_counts)
    setup = WalkSetup(
        start=np.array([0.0, 0.0, 1e3, 0.0, 0.0, 0.0, 1.0, *[0.0] * n]),
        internal_state=np.zeros(internal_state_size(robot)),
        parameters=parameters,
        desired=codes,
        control_law=law,
        fall_height=0.0,
        cycle=len(desired),
        shove_ticks=(0, len(desired)),
    )
    (result,) = kernel.walk([setup], coding, log=True)
    assert result.states is not None
    return np.array(result.states[:, 7], dtype=np.float64)


def times() -> Floats:
    """Of all control ticks [s]."""
    return np.arange(round(SECONDS / CONTROL_PERIOD), dtype=np.float64) * CONTROL_PERIOD
