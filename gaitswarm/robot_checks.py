"""Whether a robot of one's own can be used: loaded, let stand, and looked at."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from gaitswarm.errors import simulation_errors
from gaitswarm.meshes import find_mesh, mesh_names
from gaitswarm.sim.controllers.joint_pd import LARGEST_GAIN
from gaitswarm.sim.gait.trajectory import desired_angles, require_reachable
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.proposal.drive import GRAVITY
from gaitswarm.sim.proposal.gait import walk_of_robot
from gaitswarm.sim.proposal.legs import reach_below
from gaitswarm.sim.robot import Robot, RobotFiles, load_robot
from gaitswarm.sim.robot.identifiable import identifiable_variables
from gaitswarm.sim.robot.legs import ChainLeg
from gaitswarm.sim.robot.posture import feet_and_centre_of_mass, leg_points
from gaitswarm.sim.robot.urdf import unphysical
from gaitswarm.sim.scenario import Scenario
from gaitswarm.sim.simulate import simulate
from gaitswarm.views.robot_check import CheckedLegView, MeshView, RobotCheckView, StandingStillView

if TYPE_CHECKING:
    from gaitswarm.sim.simulate import Simulation

_SECONDS: Final = 1.0
_STIFF: Final = 20.0
"""Stiffness with which torque-controlled joints are held, per torque limit [1/rad]."""

_DAMPED: Final = 0.02
"""Their damping, per stiffness [s]."""

_OFF: Final = 0.02
"""Share of the weight by which standing forces may be off before that is a warning."""


def check_robot(
    files: RobotFiles,
    *,
    folder: str | os.PathLike[str] | None = ".",
    packages: Sequence[str | os.PathLike[str]] = (),
    field: str = "folder",
) -> RobotCheckView:
    """Load a robot, let it stand, and look for what is unphysical."""
    with simulation_errors(field):
        robot = load_robot(files)
        scenario = standing_scenario(robot)
        require_reachable(robot, scenario)
        controller, design = standing_drive(robot)
        values = np.array([list(design.values())])
        stood = simulate(scenario, controller, list(design), values, robot=robot, log=True)
    standing, warnings = _standing(robot, stood)
    angles = desired_angles(robot, scenario).angles[0]
    points = leg_points(robot, angles)
    mass = feet_and_centre_of_mass(robot, angles[None, :], 0.0)[1][0]
    carried = {joint.name: joint.child for joint in robot.urdf.joints}
    return RobotCheckView(
        name=robot.description.name,
        mass=robot.mass,
        body_mass=robot.urdf.body.mass,
        parameters=list(identifiable_variables(robot)),
        joints=robot.n_joints,
        legs=[
            CheckedLegView(
                name=data.name,
                joints=list(data.joints),
                foot=data.foot,
                length=sum(leg.lengths),
                mass=sum(robot.urdf.bodies[carried[joint]].mass for joint in data.joints),
                reach=reach_below(robot, number),
                points=points[number].tolist(),
            )
            for number, (leg, data) in enumerate(
                zip(robot.legs, robot.description.legs, strict=True)
            )
        ],
        held=dict(robot.description.held_joints),
        centre_of_mass=mass.tolist(),
        standing=standing,
        meshes=[] if folder is None else _meshes(files.urdf, Path(folder), map(Path, packages)),
        guesses=list(robot.description.guesses),
        warnings=[*warnings, *unphysical(robot.urdf, files.urdf)],
    )


def _meshes(urdf: str, folder: Path, packages: Iterable[Path]) -> list[MeshView]:
    """What the URDF names, each with the file that was found."""
    places = list(packages)
    found = {name: find_mesh(name, folder, places) for name in mesh_names(urdf)}
    return [MeshView(name=n, path=None if p is None else str(p)) for n, p in found.items()]


def standing_scenario(robot: Robot) -> Scenario:
    """A second in the robot's stance, all feet on the ground."""
    radius, height = 0.16, 0.15
    stances = [leg for leg in robot.legs if isinstance(leg, ChainLeg)]
    if stances:
        feet = np.array([leg.stand for leg in stances])
        radius = max(1e-6, float(np.abs(feet[:, 1]).mean()))
        hips = max(leg.hip[2] for leg in robot.legs)
        height = hips - float(feet[:, 2].mean()) + float(np.mean(robot.planned_soles()))
    standing = {
        "name": "standing",
        "cycle_time": _SECONDS,
        "cycles": 1.0,
        "radius": radius,
        "hip_height": height,
        "stride": 1e-9,
        "height": 0.0,
    }
    return walk_of_robot(standing, "robot.toml")


def standing_drive(robot: Robot) -> tuple[str, dict[str, float]]:
    """A controller that holds all joints."""
    if not robot.is_torque_controlled:
        return "p", {"P": 1.0}
    stiffness = min(_STIFF * float(np.median(robot.actuators().torque_limit)), LARGEST_GAIN)
    return "joint-pd", {"Kp": stiffness, "Kd": _DAMPED * stiffness, "feed_forward": 0.0}


def _standing(robot: Robot, stood: Simulation) -> tuple[StandingStillView, list[str]]:
    log = stood.logs[0]
    if log is None:
        raise RuntimeError("a reachable walk has a log")
    weight = robot.mass * GRAVITY
    last = len(log.time) // 5
    carried = float(np.nan_to_num(log.foot_force[-last:, :, 2]).sum(axis=1).mean())
    view = StandingStillView(
        seconds=_SECONDS,
        normal_forces=carried,
        weight=weight,
        height=float(np.nan_to_num(log.base_position[-1, 2])),
    )
    status = Status(int(stood.outcome.statuses[0]))
    warnings = []
    if status in (Status.FELL, Status.DIVERGED):
        warnings.append(
            f"it does not stand for {_SECONDS:g} s ({status.name.lower()}): look at the stance, and"
            " at the actuators' torque"
        )
    elif abs(carried - weight) > _OFF * weight:
        warnings.append(
            f"soles carry {carried:.1f} N of {weight:.1f} N: the robot is not at rest; look at"
            " contact.stiffness and contact.damping"
        )
    return view, warnings
