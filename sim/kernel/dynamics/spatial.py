"""3-vectors and 3x3 matrices of symbolic scalars.

Plain tuples rather than sparse CasADi matrices: CasADi drops products with the constants 0 and 1
scalar by scalar, so structural zeros cost nothing and the algorithm stays readable.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Scalar = Any
"""A casadi.SX scalar or a float; CasADi ships no types."""
Vector = tuple[Scalar, Scalar, Scalar]
Matrix = tuple[Vector, Vector, Vector]


def vector(values: Sequence[Scalar] | NDArray[np.float64]) -> Vector:
    """Three numbers; rounding noise of unit-sized constants becomes a structural zero.

    Args:
        values: (3,).
    """
    x, y, z = (_snap(value) for value in values)
    return x, y, z


def matrix(values: NDArray[np.float64]) -> Matrix:
    """A constant matrix, its noise removed as by `vector`.

    Args:
        values: (3, 3).
    """
    return vector(values[0]), vector(values[1]), vector(values[2])


def add(*terms: Vector) -> Vector:
    """Sum of the terms, from the left."""
    x, y, z = terms[0]
    for a, b, c in terms[1:]:
        x, y, z = x + a, y + b, z + c
    return x, y, z


def subtract(a: Vector, b: Vector) -> Vector:
    """a - b"""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def scale(s: Scalar, a: Vector) -> Vector:
    """s a"""
    return s * a[0], s * a[1], s * a[2]


def dot(a: Vector, b: Vector) -> Scalar:
    """a . b"""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    """a x b"""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


def transpose(m: Matrix) -> Matrix:
    """m^T"""
    return (
        (m[0][0], m[1][0], m[2][0]),
        (m[0][1], m[1][1], m[2][1]),
        (m[0][2], m[1][2], m[2][2]),
    )


def apply(m: Matrix, a: Vector) -> Vector:
    """m a"""
    return dot(m[0], a), dot(m[1], a), dot(m[2], a)


def multiply(a: Matrix, b: Matrix) -> Matrix:
    """a b"""
    columns = transpose(b)
    return _rows([tuple(dot(row, column) for column in columns) for row in a])


def plus(a: Matrix, b: Matrix) -> Matrix:
    """a + b"""
    return add(a[0], b[0]), add(a[1], b[1]), add(a[2], b[2])


def minus(a: Matrix, b: Matrix) -> Matrix:
    """a - b"""
    return subtract(a[0], b[0]), subtract(a[1], b[1]), subtract(a[2], b[2])


def outer(a: Vector, b: Vector) -> Matrix:
    """a b^T"""
    return scale(a[0], b), scale(a[1], b), scale(a[2], b)


def skew(a: Vector) -> Matrix:
    """[a]x, so that apply(skew(a), b) = cross(a, b)"""
    return (0.0, -a[2], a[1]), (a[2], 0.0, -a[0]), (-a[1], a[0], 0.0)


def mirrored(m: Matrix) -> Matrix:
    """m, symmetric, from its upper triangle; the lower one is never computed"""
    return (
        m[0],
        (m[0][1], m[1][1], m[1][2]),
        (m[0][2], m[1][2], m[2][2]),
    )


def inverse(m: Matrix) -> Matrix:
    """m^-1 of a symmetric m by its adjugate: one division."""
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
    """Rotation matrix of a quaternion."""
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
