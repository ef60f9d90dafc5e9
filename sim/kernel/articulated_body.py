"""Articulated-body algorithm of a floating-base robot, as symbols.

Walks a `pinocchio.Model` and writes Featherstone's algorithm (Rigid Body Dynamics Algorithms,
2008, table 9.4) for the tree it finds. Spatial quantities are pairs (linear, angular) in the
frame of their own link, as in Pinocchio, which stays the oracle that this is tested against.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sim.errors import RobotFileError
from sim.kernel.inertia import Force, Inertia, Motion
from sim.kernel.spatial import (
    Matrix,
    Scalar,
    Vector,
    add,
    apply,
    cross,
    dot,
    matrix,
    multiply,
    rotation_about,
    scale,
    subtract,
    transpose,
    vector,
)

BASE = 1
"""Index of the free-flyer joint in a Pinocchio model."""


@dataclass(frozen=True, slots=True)
class Link:
    """One link and the revolute joint before it.

    Attributes:
        joint: its name.
        parent: index of the parent link, 0 is the base.
        axis: constant unit axis in the link's frame.
        rotation: of the joint in the parent's frame, at rest.
        offset: of the joint in the parent's frame [m].
        inertia: in the link's frame.
    """

    joint: str
    parent: int
    axis: Vector
    rotation: Matrix
    offset: Vector
    inertia: Inertia


@dataclass(frozen=True, slots=True)
class LinkState:
    """Where a link is and how it moves: what external forces may depend on.

    Attributes:
        velocity: in the link's frame.
        up: the ground's normal in the link's frame.
        ahead: the world's x axis in the link's frame.
        height: of the link's origin over ground [m].
    """

    velocity: Motion
    up: Vector
    ahead: Vector
    height: Scalar


@dataclass(frozen=True, slots=True)
class Acceleration:
    """Accelerations of a tree.

    Attributes:
        base: in the base's frame.
        joints: (J,) [rad/s2].
    """

    base: Motion
    joints: tuple[Scalar, ...]


def links_of(model: Any, joint_order: Sequence[str]) -> tuple[Link, ...]:
    """The links of a Pinocchio model with a free-flyer base.

    Args:
        model: `pinocchio.Model`.
        joint_order: Names of all its joints but the free-flyer.

    Returns:
        The links in the order of the joints.

    Raises:
        RobotFileError: A joint is not revolute, or the order misses one or has a child before its
            parent.
    """
    if sorted(joint_order) != sorted(list(model.names)[BASE + 1 :]):
        raise RobotFileError(
            "robot.urdf: its movable joints are not the legs' joints of robot.toml:"
            f" {', '.join(sorted(set(joint_order) ^ set(list(model.names)[BASE + 1 :])))}"
        )
    index_of = {model.getJointId(name): k for k, name in enumerate(joint_order, start=1)}
    index_of[BASE] = 0
    links = []
    for name in joint_order:
        j = model.getJointId(name)
        if model.joints[j].nq != 1 or "Revolute" not in _kind(model.joints[j]):
            raise RobotFileError(f"robot.urdf: joint {name!r} is not revolute")
        if index_of[model.parents[j]] >= index_of[j]:
            raise RobotFileError(f"robot.urdf: joint {name!r} comes before its parent")
        subspace = np.asarray(model.joints[j].createData().S).reshape(-1)
        placement = model.jointPlacements[j]
        links.append(
            Link(
                joint=name,
                parent=index_of[model.parents[j]],
                axis=vector(subspace[3:]),
                rotation=matrix(placement.rotation),
                offset=vector(placement.translation),
                inertia=_body_inertia(model.inertias[j]),
            )
        )
    return tuple(links)


def kinematics(
    links: Sequence[Link],
    base: LinkState,
    sines: Sequence[Scalar],
    cosines: Sequence[Scalar],
    rates: Sequence[Scalar],
) -> tuple[list[LinkState], list[Matrix]]:
    """First pass: where every link is and how it moves.

    Args:
        links: Of the robot.
        base: State of the base.
        sines: Of the joint angles, (J,).
        cosines: Of the joint angles, (J,).
        rates: Joint velocities, (J,) [rad/s].

    Returns:
        State of every link (the base first), and each joint's rotation to its parent.
    """
    states, rotations = [base], []
    for link, sine, cosine, rate in zip(links, sines, cosines, rates, strict=True):
        parent = states[link.parent]
        rotation = multiply(link.rotation, rotation_about(link.axis, sine, cosine))
        inverse = transpose(rotation)
        v, w = parent.velocity.linear, parent.velocity.angular
        states.append(
            LinkState(
                velocity=Motion(
                    apply(inverse, add(v, cross(w, link.offset))),
                    add(apply(inverse, w), scale(rate, link.axis)),
                ),
                up=apply(inverse, parent.up),
                ahead=apply(inverse, parent.ahead),
                height=parent.height + dot(parent.up, link.offset),
            )
        )
        rotations.append(rotation)
    return states, rotations


def articulated_body(
    links: Sequence[Link],
    base_inertia: Inertia,
    states: Sequence[LinkState],
    rotations: Sequence[Matrix],
    rates: Sequence[Scalar],
    torques: Sequence[Scalar],
    armature: Sequence[float],
    external: Mapping[int, Force],
    gravity: Vector,
) -> Acceleration:
    """Second and third pass: accelerations under torques, external forces and gravity.

    Args:
        links: Of the robot.
        base_inertia: In the base's frame.
        states: Of `kinematics`.
        rotations: Of `kinematics`.
        rates: Joint velocities, (J,) [rad/s].
        torques: At the joints, (J,) [N m].
        armature: Reflected rotor inertia, (J,) [kg m2].
        external: Force on a link in its own frame, by the link's index as in `states`.
        gravity: In the base's frame [m/s2].

    Returns:
        Accelerations of base and joints.
    """
    inertias = [base_inertia, *(link.inertia for link in links)]
    forces = []
    for k, (inertia, state) in enumerate(zip(inertias, states, strict=True)):
        momentum = inertia.times(state.velocity)
        v, w = state.velocity.linear, state.velocity.angular
        bias = Force(
            cross(w, momentum.linear),
            add(cross(v, momentum.linear), cross(w, momentum.angular)),
        )
        if k in external:
            applied = external[k]
            bias = Force(
                subtract(bias.linear, applied.linear),
                subtract(bias.angular, applied.angular),
            )
        forces.append(bias)

    passed: list[tuple[Force, Scalar, Scalar]] = []
    coriolises: list[Motion] = []
    for k in range(len(links), 0, -1):
        link, rotation, rate = links[k - 1], rotations[k - 1], rates[k - 1]
        inertia, state = inertias[k], states[k]
        turning = scale(rate, link.axis)
        coriolis = Motion(
            cross(state.velocity.linear, turning),
            cross(state.velocity.angular, turning),
        )
        column = Force(apply(inertia.coupling, link.axis), apply(inertia.angular, link.axis))
        pivot = 1.0 / (dot(link.axis, column.angular) + armature[k - 1])
        force = forces[k].plus(inertia.times(coriolis))
        free = pivot * (torques[k - 1] - dot(link.axis, force.angular))
        passed.append((column, pivot, free))
        # What the joint passes on, put together in the parent's frame: a link without children
        # is still a rigid body there.
        above = column.in_parent(rotation, link.offset)
        scaled = Force(scale(pivot, above.linear), scale(pivot, above.angular))
        inertias[link.parent] = inertias[link.parent].plus(
            inertia.in_parent(rotation, link.offset).less_outer(scaled, above)
        )
        driven = Force(scale(free, above.linear), scale(free, above.angular))
        forces[link.parent] = (
            forces[link.parent].plus(force.in_parent(rotation, link.offset)).plus(driven)
        )
        coriolises.append(coriolis)
    passed.reverse()
    coriolises.reverse()

    # Accelerations are relative to free fall until gravity is put back at the end.
    accelerations = [_solve(inertias[0], forces[0])]
    joints = []
    for k, link in enumerate(links, start=1):
        (column, pivot, free), coriolis = passed[k - 1], coriolises[k - 1]
        parent, inverse = accelerations[link.parent], transpose(rotations[k - 1])
        linear = apply(inverse, add(parent.linear, cross(parent.angular, link.offset)))
        angular = apply(inverse, parent.angular)
        joint = free - pivot * (dot(column.linear, linear) + dot(column.angular, angular))
        accelerations.append(
            Motion(
                add(linear, coriolis.linear),
                add(angular, coriolis.angular, scale(joint, link.axis)),
            )
        )
        joints.append(joint)
    falling = accelerations[0]
    return Acceleration(Motion(add(falling.linear, gravity), falling.angular), tuple(joints))


def _kind(joint: Any) -> str:
    name = str(joint.shortname())
    return "Revolute" if name in ("JointModelRX", "JointModelRY", "JointModelRZ") else name


def _body_inertia(inertia: Any) -> Inertia:
    lever, mass = np.asarray(inertia.lever), float(inertia.mass)
    about_origin = np.asarray(inertia.inertia) + mass * (
        float(lever @ lever) * np.eye(3) - np.outer(lever, lever)
    )
    x, y, z = (float(value) for value in mass * lever)
    rows = [tuple(float(value) for value in row) for row in about_origin]
    return Inertia.of_body(mass, (x, y, z), (rows[0], rows[1], rows[2]))  # type: ignore[arg-type]


def _solve(inertia: Inertia, force: Force) -> Motion:
    """Motion a with inertia a = -force, by an unrolled LDL^T factorisation."""
    rows: list[list[Scalar]] = [[*inertia.linear[i], *inertia.coupling[i]] for i in range(3)] + [
        [*transpose(inertia.coupling)[i], *inertia.angular[i]] for i in range(3)
    ]
    n = len(rows)
    lower: list[list[Scalar]] = [[0.0] * n for _ in range(n)]
    pivots: list[Scalar] = []
    inverses: list[Scalar] = []
    for j in range(n):
        pivot = rows[j][j]
        for k in range(j):
            pivot = pivot - lower[j][k] * lower[j][k] * pivots[k]
        pivots.append(pivot)
        inverses.append(1.0 / pivot)
        for i in range(j + 1, n):
            entry = rows[j][i]
            for k in range(j):
                entry = entry - lower[i][k] * lower[j][k] * pivots[k]
            lower[i][j] = entry * inverses[j]
    x = [-value for value in (*force.linear, *force.angular)]
    for i in range(n):
        for k in range(i):
            x[i] = x[i] - lower[i][k] * x[k]
    x = [value * inverse for value, inverse in zip(x, inverses, strict=True)]
    for i in reversed(range(n)):
        for k in range(i + 1, n):
            x[i] = x[i] - lower[k][i] * x[k]
    return Motion((x[0], x[1], x[2]), (x[3], x[4], x[5]))
