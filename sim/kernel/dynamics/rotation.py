"""Rotations of links about their joints, as symbols.

A turn about one of the frame's own axes mixes two components only; most joints have such axes.
"""

from __future__ import annotations

from dataclasses import dataclass

from gaitswarm.sim.kernel.dynamics.spatial import (
    Matrix,
    Scalar,
    Vector,
    apply,
    multiply,
    rotation_about,
    transpose,
)


@dataclass(frozen=True, slots=True)
class Rotation:
    """From a link's frame to the frame before it: a turn about a joint's axis, then its rest.

    Attributes:
        rest: rotation at angle zero.
        axis: constant unit axis, in the link's frame.
        sine: of the angle.
        cosine: of the angle.
    """

    rest: Matrix
    axis: Vector
    sine: Scalar
    cosine: Scalar

    def inwards(self, a: Vector) -> Vector:
        """A vector in the frame before the link."""
        return apply(self.rest, self._turned(a, self.sine))

    def outwards(self, a: Vector) -> Vector:
        """A vector in the link's frame."""
        return self._turned(apply(transpose(self.rest), a), -self.sine)

    def tensor_inwards(self, m: Matrix) -> Matrix:
        """A tensor in the frame before the link."""
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
        # As s^2 + c^2 = 1, half of the products will do.
        change = c * (m[j][j] - m[k][k]) - s * (m[j][k] + m[k][j])
        t[j][j], t[k][k] = m[k][k] + c * change, m[j][j] - c * change
        t[j][k], t[k][j] = m[j][k] + s * change, m[k][j] + s * change
        x, y, z = ((row[0], row[1], row[2]) for row in t)
        return x, y, z


def _from(i: int) -> tuple[int, int, int]:
    return i, (i + 1) % 3, (i + 2) % 3
