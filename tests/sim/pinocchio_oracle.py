"""Pinocchio's view of a robot, in the project's order of joints."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
import pinocchio as pin

from gaitswarm.sim.robot import load_robot
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.robot.urdf import parse_urdf
from tests.examples.walks import quadruped_files

ROBOTS = ("szabadka2", "quadruped", "turned quadruped")
"""One that ships, the example of one's own, and the same with every frame turned in its parent's:
in the first two, links are parallel to the body in the zero pose."""


@lru_cache
def robot_named(name: str) -> Robot:
    """One of ROBOTS."""
    if name == "szabadka2":
        return load_robot(name)
    files = quadruped_files()
    robot = load_robot(files)
    if name == "turned quadruped":
        # Its feet cannot be planned, so it cannot be loaded; its dynamics are as good as any.
        turned = files.urdf.replace("<origin xyz=", '<origin rpy="0.4 -0.7 0.9" xyz=')
        return replace(robot, urdf=parse_urdf(turned))
    return robot


class Oracle:
    """Pinocchio's model and data.

    joints: indices of our joints; q_index, v_index: where our q and v lie in Pinocchio's.
    """

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self.model = pin.buildModelFromXML(robot.urdf.text, pin.JointModelFreeFlyer())
        self.joints = [self.model.getJointId(name) for name in robot.joint_names]
        joints = [self.model.joints[index] for index in self.joints]
        self.q_index = [*range(7), *(joint.idx_q for joint in joints)]
        self.v_index = [*range(6), *(joint.idx_v for joint in joints)]
        armature = np.zeros(self.model.nv)
        armature[self.v_index[6:]] = robot.actuators().armature
        self.model.armature = armature
        self.data = self.model.createData()

    def carry(self, load: float) -> None:
        """Fix a point mass [kg] on the body, where the robot carries its loads."""
        at = pin.SE3(np.eye(3), np.array([0.0, 0.0, self.robot.description.load_height]))
        mass = pin.Inertia(load, np.zeros(3), np.zeros((3, 3)))
        self.model.appendBodyToJoint(1, mass, at)
        self.data = self.model.createData()

    def q(self, ours: np.ndarray) -> np.ndarray:
        theirs = np.empty(self.model.nq)
        theirs[self.q_index] = ours
        return theirs

    def v(self, ours: np.ndarray) -> np.ndarray:
        theirs = np.empty(self.model.nv)
        theirs[self.v_index] = ours
        return theirs

    def kinetic_energy(self, q: np.ndarray, v: np.ndarray) -> float:
        """Of links and rotors [J]."""
        # pin.computeKineticEnergy leaves out the rotors of every JointModelRevoluteUnaligned.
        inertia = np.triu(pin.crba(self.model, self.data, self.q(q)))
        inertia += np.triu(inertia, 1).T
        return float(0.5 * self.v(v) @ inertia @ self.v(v))

    def contact_forces(self, q: np.ndarray, v: np.ndarray) -> tuple[Any, np.ndarray]:
        """Spatial forces for pin.aba and world forces (L, 3), by eq. 2.13."""
        pin.forwardKinematics(self.model, self.data, self.q(q), self.v(v))
        pin.updateFramePlacements(self.model, self.data)
        external = [pin.Force.Zero() for _ in range(self.model.njoints)]
        world = []
        for leg, contact in zip(self.robot.description.legs, self.robot.contacts(), strict=True):
            frame = self.model.getFrameId(leg.foot)
            place = self.data.oMf[frame]
            speed = pin.getFrameVelocity(
                self.model, self.data, frame, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
            ).linear
            depth = contact.sole - place.translation[2]
            force = np.zeros(3)
            if depth > 0.0:
                normal = max(0.0, contact.stiffness * depth - contact.damping * speed[2])
                slip = max(float(np.hypot(*speed[:2])), contact.slip_velocity)
                force = np.array([*(-contact.friction * normal * speed[:2] / slip), normal])
            joint = self.model.frames[frame].parentJoint
            lever = self.model.frames[frame].placement.translation
            local = self.data.oMi[joint].rotation.T @ force
            external[joint] = pin.Force(local, np.cross(lever, local))
            world.append(force)
        return external, np.array(world)
