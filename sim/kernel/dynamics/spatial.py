"""Spatial algebra of symbolic scalars: vectors, matrices, rotations, inertias, motions and forces.

Plain tuples instead of sparse CasADi matrices: CasADi drops products with the constants 0 and 1
scalar by scalar, so structural zeros cost nothing. Spatial quantities are pairs (linear, angular)
in the frame of their own link, as in Pinocchio.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Scalar = Any
"""A casadi.SX scalar or a float; CasADi has no type information."""
Vector = tuple[Scalar, Scalar, Scalar]
Matrix = tuple[Vector, Vector, Vector]


def vector(values: Sequence[Scalar] | NDArray[np.float64]) -> Vector:
    """Convert (3,) numbers; rounding noise of unit-sized constants becomes a structural zero."""
    x, y, z = (_snap(value) for value in values)
    return x, y, z


def matrix(values: NDArray[np.float64]) -> Matrix:
    """Convert a constant (3, 3) matrix, its noise removed as by `vector`."""
    return vector(values[0]), vector(values[1]), vector(values[2])


def add(*terms: Vector) -> Vector:
    """Sum of the terms, from the left."""
    x, y, z = terms[0]
    for a, b, c in terms[1:]:
        x, y, z = x + a, y + b, z + c
    return x, y, z


def subtract(a: Vector, b: Vector) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def scale(s: Scalar, a: Vector) -> Vector:
    return s * a[0], s * a[1], s * a[2]


def dot(a: Vector, b: Vector) -> Scalar:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def transpose(m: Matrix) -> Matrix:
    return ((m[0][0], m[1][0], m[2][0]), (m[0][1], m[1][1], m[2][1]), (m[0][2], m[1][2], m[2][2]))


def apply(m: Matrix, a: Vector) -> Vector:
    """m a"""
    return dot(m[0], a), dot(m[1], a), dot(m[2], a)


def multiply(a: Matrix, b: Matrix) -> Matrix:
    columns = transpose(b)
    return _rows([tuple(dot(row, column) for column in columns) for row in a])


def plus(a: Matrix, b: Matrix) -> Matrix:
    return add(a[0], b[0]), add(a[1], b[1]), add(a[2], b[2])


def minus(a: Matrix, b: Matrix) -> Matrix:
    return subtract(a[0], b[0]), subtract(a[1], b[1]), subtract(a[2], b[2])


def outer(a: Vector, b: Vector) -> Matrix:
    """a b^T"""
    return scale(a[0], b), scale(a[1], b), scale(a[2], b)


def skew(a: Vector) -> Matrix:
    """[a]x, so that apply(skew(a), b) = cross(a, b)"""
    return (0.0, -a[2], a[1]), (a[2], 0.0, -a[0]), (-a[1], a[0], 0.0)


def mirrored(m: Matrix) -> Matrix:
    """Symmetric matrix from the upper triangle of m; the lower one is never computed."""
    return (m[0], (m[0][1], m[1][1], m[1][2]), (m[0][2], m[1][2], m[2][2]))


def inverse(m: Matrix) -> Matrix:
    """m^-1 of a symmetric m by its adjugate, with one division."""
    columns = cross(m[1], m[2]), cross(m[2], m[0]), cross(m[0], m[1])
    share = 1.0 / dot(m[0], columns[0])
    return mirrored(_rows([scale(share, column) for column in columns]))


def rotation_about(axis: Vector, sine: Scalar, cosine: Scalar) -> Matrix:
    """Rodrigues' formula."""
    versine = 1.0 - cosine
    rows = []
    for i in range(3):
        row = []
        for j in range(3):
            along = axis[i] * axis[j]
            entry = cosine if i == j else 0.0
            if i == j and along == 1.0:
                entry = 1.0
            elif along != 0.0:
                entry = entry + along * versine
            turned = skew(axis)[i][j]
            row.append(entry + turned * sine if turned != 0.0 else entry)
        rows.append(tuple(row))
    return _rows(rows)


def rotation_of(quaternion: Sequence[Scalar]) -> Matrix:
    """Rotation matrix of a quaternion x y z w."""
    x, y, z, w = quaternion
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )


def _rows(rows: Sequence[Sequence[Scalar]]) -> Matrix:
    a, b, c = rows
    return (a[0], a[1], a[2]), (b[0], b[1], b[2]), (c[0], c[1], c[2])


def _snap(value: Scalar) -> Scalar:
    if not isinstance(value, float | int | np.floating):
        return value
    number = float(value)
    nearest = float(round(number))
    return nearest if abs(number - nearest) < 1e-14 else number


T = TypeVar("T")


def leaves(tree: object) -> Iterator[Scalar]:
    """Yield all leaves of nested tuples and dataclasses, in one order for all trees of a shape."""
    if isinstance(tree, tuple):
        for branch in tree:
            yield from leaves(branch)
    elif is_dataclass(tree):
        for field in fields(tree):
            yield from leaves(getattr(tree, field.name))
    elif tree is not None:
        yield tree


def mapped(tree: T, function: Callable[[Scalar], Scalar]) -> T:
    if isinstance(tree, tuple):
        return tuple(mapped(branch, function) for branch in tree)  # type: ignore[return-value]
    if is_dataclass(tree):
        branches = {f.name: mapped(getattr(tree, f.name), function) for f in fields(tree)}
        return replace(tree, **branches)  # type: ignore[type-var]
    return tree if tree is None else function(tree)


@dataclass(frozen=True, slots=True)
class Rotation:
    """Rotation from a link's frame to the preceding frame: about the joint's axis, then `rest`."""

    rest: Matrix  # rotation at angle zero
    axis: Vector  # constant unit axis in the link's frame
    sine: Scalar
    cosine: Scalar

    def inwards(self, a: Vector) -> Vector:
        """Express a vector in the preceding frame."""
        return apply(self.rest, self._turned(a, self.sine))

    def outwards(self, a: Vector) -> Vector:
        """Express a vector in the link's frame."""
        return self._turned(apply(transpose(self.rest), a), -self.sine)

    def tensor_inwards(self, m: Matrix) -> Matrix:
        """Express a tensor in the preceding frame."""
        return multiply(multiply(self.rest, self._turned_tensor(m)), transpose(self.rest))

    def _turned(self, a: Vector, sine: Scalar) -> Vector:
        if 1.0 not in self.axis:
            return apply(rotation_about(self.axis, sine, self.cosine), a)
        i, j, k = _from(self.axis.index(1.0))
        turned = [a[i]] * 3
        turned[j] = self.cosine * a[j] - sine * a[k]
        turned[k] = self.cosine * a[k] + sine * a[j]
        return turned[0], turned[1], turned[2]

    def _turned_tensor(self, m: Matrix) -> Matrix:
        s, c = self.sine, self.cosine
        if 1.0 not in self.axis:
            turn = rotation_about(self.axis, s, c)
            return multiply(multiply(turn, m), transpose(turn))
        i, j, k = _from(self.axis.index(1.0))
        t = [list(row) for row in m]
        t[i][j], t[i][k] = c * m[i][j] - s * m[i][k], c * m[i][k] + s * m[i][j]
        t[j][i], t[k][i] = c * m[j][i] - s * m[k][i], c * m[k][i] + s * m[j][i]
        # Half of the products suffice as s^2 + c^2 = 1.
        change = c * (m[j][j] - m[k][k]) - s * (m[j][k] + m[k][j])
        t[j][j], t[k][k] = m[k][k] + c * change, m[j][j] - c * change
        t[j][k], t[k][j] = m[j][k] + s * change, m[k][j] + s * change
        x, y, z = ((row[0], row[1], row[2]) for row in t)
        return x, y, z


def _from(i: int) -> tuple[int, int, int]:
    return i, (i + 1) % 3, (i + 2) % 3


@dataclass(frozen=True, slots=True)
class Inertia:
    """Articulated inertia in a link's frame: force = A a + C alpha, moment = C^T a + B alpha."""

    linear: Matrix  # [kg]
    coupling: Matrix  # [kg m]
    angular: Matrix  # [kg m2]

    def plus(self, other: Inertia) -> Inertia:
        return Inertia(
            mirrored(plus(self.linear, other.linear)),
            plus(self.coupling, other.coupling),
            mirrored(plus(self.angular, other.angular)),
        )

    @classmethod
    def at_point(cls, at: Vector, resistance: Matrix) -> Inertia:
        """Resistance [kg], symmetric, to the acceleration of one point of a link."""
        lever = skew(at)
        coupling = minus(((0.0,) * 3,) * 3, multiply(resistance, lever))
        return cls(resistance, coupling, mirrored(multiply(lever, coupling)))

    def less_outer(self, scaled: Force, column: Force) -> Inertia:
        """Subtract the product scaled column^T, which is symmetric."""
        return Inertia(
            mirrored(minus(self.linear, outer(scaled.linear, column.linear))),
            minus(self.coupling, outer(scaled.linear, column.angular)),
            mirrored(minus(self.angular, outer(scaled.angular, column.angular))),
        )

    def in_parent(self, rotation: Rotation, offset: Vector) -> Inertia:
        """Express in the parent's frame; offset is this frame's origin there [m]."""
        angular = mirrored(rotation.tensor_inwards(self.angular))
        linear = mirrored(rotation.tensor_inwards(self.linear))
        coupling = rotation.tensor_inwards(self.coupling)
        lever = skew(offset)
        shifted = minus(coupling, multiply(linear, lever))
        moved = minus(angular, multiply(transpose(coupling), lever))
        return Inertia(linear, shifted, mirrored(plus(moved, multiply(lever, shifted))))


@dataclass(frozen=True, slots=True)
class RigidBody:
    """Inertial parameters of a body in its own frame."""

    mass: Scalar  # [kg]
    moment: Vector  # first moment m c [kg m]
    angular: Matrix  # rotational inertia about the frame's origin [kg m2]

    def inertia(self) -> Inertia:
        mass = self.mass
        diagonal = ((mass, 0.0, 0.0), (0.0, mass, 0.0), (0.0, 0.0, mass))
        return Inertia(diagonal, transpose(skew(self.moment)), self.angular)

    def force(self, angular_velocity: Vector, acceleration: Motion, tensor: Matrix) -> Force:
        """Force that gives the body this motion (Newton-Euler equations)."""
        linear = add(scale(self.mass, acceleration.linear), apply(tensor, self.moment))
        w, alpha, inertia = angular_velocity, acceleration.angular, self.angular
        turning = []
        # I alpha + omega x I omega by components: its products are the tensor's.
        for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
            turning.append(
                inertia[i][i] * alpha[i]
                + (inertia[k][k] - inertia[j][j]) * (w[j] * w[k])
                + inertia[j][k] * (tensor[j][j] - tensor[k][k])
                + inertia[i][k] * tensor[j][i]
                - inertia[i][j] * tensor[k][i]
            )
        x, y, z = turning
        return Force(linear, add((x, y, z), cross(self.moment, acceleration.linear)))


def angular_acceleration_tensor(velocity: Vector, acceleration: Vector) -> Matrix:
    """[alpha]x + [omega]x^2 (Angeles, Fundamentals of Robotic Mechanical Systems)."""
    x, y, z = velocity
    a, b, c = acceleration
    xx, yy, zz, xy, xz, yz = x * x, y * y, z * z, x * y, x * z, y * z
    return (
        (-(yy + zz), xy - c, xz + b),
        (xy + c, -(xx + zz), yz - a),
        (xz - b, yz + a, -(xx + yy)),
    )


@dataclass(frozen=True, slots=True)
class Motion:
    """Spatial velocity or acceleration."""

    linear: Vector  # [m/s] or [m/s2]
    angular: Vector  # [rad/s] or [rad/s2]


@dataclass(frozen=True, slots=True)
class Force:
    """Spatial force or momentum."""

    linear: Vector  # [N] or [N s]
    angular: Vector  # about the frame's origin [N m] or [N m s]

    def plus(self, other: Force) -> Force:
        return Force(add(self.linear, other.linear), add(self.angular, other.angular))

    def less(self, other: Force) -> Force:
        return Force(subtract(self.linear, other.linear), subtract(self.angular, other.angular))

    def in_parent(self, rotation: Rotation, offset: Vector) -> Force:
        """Express in the parent's frame; offset is this frame's origin there [m]."""
        linear = rotation.inwards(self.linear)
        return Force(linear, add(rotation.inwards(self.angular), cross(offset, linear)))
