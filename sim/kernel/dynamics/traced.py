"""Functions of trees that Python runs once, and CasADi from then on."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Generic, TypeVar, TypeVarTuple

import casadi as ca

from gaitswarm.sim.kernel.dynamics.spatial import Scalar
from gaitswarm.sim.kernel.dynamics.tree import leaves, mapped

Trees = TypeVarTuple("Trees")
T = TypeVar("T")


class Traced(Generic[*Trees, T]):
    """A function of trees that is run once and then repeated by CasADi.

    To put scalars together one by one in Python takes much longer than to repeat it for other
    ones. Zeros and ones are dropped anew. A quotient of which the divisor is a symbol at first, and
    a number later, stays one, where Python's CasADi multiplies with the number's inverse.
    """

    def __init__(self, function: Callable[[*Trees], T], *examples: *Trees) -> None:
        """Run the function."""
        self._given = [_is_symbolic(leaf) for leaf in leaves(examples)]
        symbols = mapped(examples, lambda leaf: ca.SX.sym("x") if _is_symbolic(leaf) else leaf)
        self._made = function(*symbols)
        self._function = ca.Function(
            "traced",
            [ca.vertcat(*filter(_is_symbolic, leaves(symbols)))],
            [ca.vertcat(*filter(_is_symbolic, leaves(self._made)))],
        )

    def __call__(self, *arguments: *Trees) -> T:
        """What the function makes of other arguments."""
        pairs = zip(leaves(arguments), self._given, strict=True)
        given: Any = ca.vertcat(*(leaf for leaf, taken in pairs if taken))
        found = iter(ca.vertsplit(self._function(given)))
        return mapped(self._made, lambda leaf: next(found) if _is_symbolic(leaf) else leaf)


def outline(tree: object) -> str:
    """All of a tree but its symbols: trees with one outline are traced alike."""
    return repr(mapped(tree, lambda leaf: "symbol" if _is_symbolic(leaf) else float(leaf)))


def _is_symbolic(leaf: Scalar) -> bool:
    """Also of a number in CasADi's type: another limb may have a symbol there."""
    return isinstance(leaf, ca.SX)
