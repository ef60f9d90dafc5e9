"""Spatial inertias, motions and forces as symbols.

Spatial quantities are pairs (linear, angular) in the frame of their own link, as in Pinocchio.
"""

from __future__ import annotations

from dataclasses import dataclass

from gaitswarm.sim.kernel.dynamics.rotation import Rotation
from gaitswarm.sim.kernel.dynamics.spatial import (
    Matrix,
    Scalar,
    Vector,
    add,
    apply,
    cross,
    minus,
    mirrored,
    multiply,
    outer,
    plus,
    scale,
    skew,
    subtract,
    transpose,
)


@dataclass(frozen=True, slots=True)
class Inertia:
    """Articulated inertia in a link's frame: force = linear a + coupling alpha,
    moment = coupling^T a + angular alpha.

    Attributes:
        linear: [kg].
        coupling: [kg m].
        angular: [kg m2].
    """

    linear: Matrix
    coupling: Matrix
    angular: Matrix

    def plus(self, other: Inertia) -> Inertia:
        """Sum."""
        return Inertia(
            mirrored(plus(self.linear, other.linear)),
            plus(self.coupling, other.coupling),
            mirrored(plus(self.angular, other.angular)),
        )

    @classmethod
    def at_point(cls, at: Vector, resistance: Matrix) -> Inertia:
        """What resists the acceleration of one point of a link.

        Args:
            at: The point [m].
            resistance: Force per acceleration of the point, symmetric [kg].
        """
        lever = skew(at)
        coupling = minus(((0.0,) * 3,) * 3, multiply(resistance, lever))
        return cls(resistance, coupling, mirrored(multiply(lever, coupling)))

    def less_outer(self, scaled: Force, column: Force) -> Inertia:
        """Difference to the product scaled column^T, which is symmetric."""
        return Inertia(
            mirrored(minus(self.linear, outer(scaled.linear, column.linear))),
            minus(self.coupling, outer(scaled.linear, column.angular)),
            mirrored(minus(self.angular, outer(scaled.angular, column.angular))),
        )

    def in_parent(self, rotation: Rotation, offset: Vector) -> Inertia:
        """The same seen from the parent's frame.

        Args:
            offset: Of this frame's origin in the parent's [m].
        """
        angular = mirrored(rotation.tensor_inwards(self.angular))
        linear = mirrored(rotation.tensor_inwards(self.linear))
        coupling = rotation.tensor_inwards(self.coupling)
        lever = skew(offset)
        shifted = minus(coupling, multiply(linear, lever))
        moved = minus(angular, multiply(transpose(coupling), lever))
        return Inertia(linear, shifted, mirrored(plus(moved, multiply(lever, shifted))))


@dataclass(frozen=True, slots=True)
class RigidBody:
    """A body's mass and where it is, in the body's own frame.

    Attributes:
        mass: [kg].
        moment: first moment m c [kg m].
        angular: rotational inertia about the frame's origin [kg m2].
    """

    mass: Scalar
    moment: Vector
    angular: Matrix

    def inertia(self) -> Inertia:
        """The same as a spatial inertia."""
        mass = self.mass
        diagonal = ((mass, 0.0, 0.0), (0.0, mass, 0.0), (0.0, 0.0, mass))
        return Inertia(diagonal, transpose(skew(self.moment)), self.angular)

    def force(self, angular_velocity: Vector, acceleration: Motion, tensor: Matrix) -> Force:
        """Force that makes the body move so (Newton's and Euler's equations).

        Args:
            angular_velocity: omega [rad/s].
            tensor: [alpha]x + [omega]x^2, by `angular_acceleration_tensor`.
        """
        linear = add(scale(self.mass, acceleration.linear), apply(tensor, self.moment))
        w, alpha, inertia = angular_velocity, acceleration.angular, self.angular
        turning = []
        # I alpha + omega x I omega, component by component: its products are the tensor's.
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
    """What gives the acceleration of a body's points against one of them, by their offsets.

    Args:
        velocity: omega of the body [rad/s].
        acceleration: alpha [rad/s2].

    Returns:
        [alpha]x + [omega]x^2 (Angeles, Fundamentals of Robotic Mechanical Systems).
    """
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
    """Spatial velocity or acceleration.

    Attributes:
        linear: [m/s] or [m/s2].
        angular: [rad/s] or [rad/s2].
    """

    linear: Vector
    angular: Vector


@dataclass(frozen=True, slots=True)
class Force:
    """Spatial force or momentum.

    Attributes:
        linear: [N] or [N s].
        angular: about the frame's origin [N m] or [N m s].
    """

    linear: Vector
    angular: Vector

    def plus(self, other: Force) -> Force:
        """Sum."""
        return Force(add(self.linear, other.linear), add(self.angular, other.angular))

    def less(self, other: Force) -> Force:
        """Difference."""
        return Force(subtract(self.linear, other.linear), subtract(self.angular, other.angular))

    def in_parent(self, rotation: Rotation, offset: Vector) -> Force:
        """The same seen from the parent's frame.

        Args:
            offset: Of this frame's origin in the parent's [m].
        """
        linear = rotation.inwards(self.linear)
        return Force(linear, add(rotation.inwards(self.angular), cross(offset, linear)))
