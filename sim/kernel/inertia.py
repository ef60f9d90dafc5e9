"""Spatial inertias, motions and forces as symbols.

Spatial quantities are pairs (linear, angular) in the frame of their own link, as in Pinocchio.
"""

from __future__ import annotations

from dataclasses import dataclass

from sim.kernel.spatial import (
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
    """Rigid or articulated inertia in a link's frame: force = linear a + coupling alpha,
    moment = coupling^T a + angular alpha.

    Attributes:
        linear: [kg].
        coupling: [kg m].
        angular: [kg m2].
        rigid: mass [kg] and first moment [kg m] of a rigid body, which is cheaper to move: its
            linear part is isotropic, its coupling a mere vector. None for an articulated inertia.
    """

    linear: Matrix
    coupling: Matrix
    angular: Matrix
    rigid: tuple[Scalar, Vector] | None = None

    @classmethod
    def of_body(cls, mass: Scalar, moment: Vector, angular: Matrix) -> Inertia:
        """Inertia of a rigid body.

        Args:
            mass: [kg].
            moment: First moment m c [kg m].
            angular: Rotational inertia about the link's origin [kg m2].

        Returns:
            The same as a spatial inertia.
        """
        diagonal = ((mass, 0.0, 0.0), (0.0, mass, 0.0), (0.0, 0.0, mass))
        return cls(diagonal, transpose(skew(moment)), angular, rigid=(mass, moment))

    def times(self, motion: Motion) -> Force:
        """Inertia times motion.

        Args:
            motion: Of the link, in its frame.

        Returns:
            Momentum of a velocity, force of an acceleration.
        """
        return Force(
            add(apply(self.linear, motion.linear), apply(self.coupling, motion.angular)),
            add(
                apply(transpose(self.coupling), motion.linear),
                apply(self.angular, motion.angular),
            ),
        )

    def plus(self, other: Inertia) -> Inertia:
        """Sum, no longer known to be rigid.

        Args:
            other: In the same frame.

        Returns:
            The sum.
        """
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

        Returns:
            The same as a spatial inertia: force = resistance (a + alpha x at).
        """
        lever = skew(at)
        coupling = minus(((0.0,) * 3,) * 3, multiply(resistance, lever))
        return cls(resistance, coupling, mirrored(multiply(lever, coupling)))

    def less_outer(self, scaled: Force, column: Force) -> Inertia:
        """Difference to the product scaled column^T, which is symmetric.

        Args:
            scaled: The column times a number.
            column: In this inertia's frame.

        Returns:
            The difference.
        """
        return Inertia(
            mirrored(minus(self.linear, outer(scaled.linear, column.linear))),
            minus(self.coupling, outer(scaled.linear, column.angular)),
            mirrored(minus(self.angular, outer(scaled.angular, column.angular))),
        )

    def in_parent(self, rotation: Matrix, offset: Vector) -> Inertia:
        """The same seen from the parent's frame.

        Args:
            rotation: From this frame to the parent's.
            offset: Of this frame's origin in the parent's [m].

        Returns:
            The inertia there.
        """
        inverse = transpose(rotation)
        angular = mirrored(multiply(multiply(rotation, self.angular), inverse))
        if self.rigid is None:
            linear = mirrored(multiply(multiply(rotation, self.linear), inverse))
            coupling = multiply(multiply(rotation, self.coupling), inverse)
            rigid = None
        else:
            mass, moment = self.rigid
            linear, turned = self.linear, apply(rotation, moment)
            coupling = transpose(skew(turned))
            rigid = (mass, add(turned, scale(mass, offset)))
        lever = skew(offset)
        shifted = minus(coupling, multiply(linear, lever))
        moved = minus(angular, multiply(transpose(coupling), lever))
        return Inertia(linear, shifted, mirrored(plus(moved, multiply(lever, shifted))), rigid)


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
        """Sum.

        Args:
            other: In the same frame.

        Returns:
            The sum.
        """
        return Force(add(self.linear, other.linear), add(self.angular, other.angular))

    def less(self, other: Force) -> Force:
        """Difference.

        Args:
            other: In the same frame.

        Returns:
            The difference.
        """
        return Force(subtract(self.linear, other.linear), subtract(self.angular, other.angular))

    def in_parent(self, rotation: Matrix, offset: Vector) -> Force:
        """The same seen from the parent's frame.

        Args:
            rotation: From this frame to the parent's.
            offset: Of this frame's origin in the parent's [m].

        Returns:
            The force there.
        """
        linear = apply(rotation, self.linear)
        return Force(linear, add(apply(rotation, self.angular), cross(offset, linear)))
