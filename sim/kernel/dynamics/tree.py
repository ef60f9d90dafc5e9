"""Trees of scalars: nested tuples and dataclasses whose leaves are numbers or symbols."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass, replace
from typing import Any, Generic, ParamSpec, TypeVar

import casadi as ca

from sim.kernel.dynamics.spatial import Scalar

T = TypeVar("T")
P = ParamSpec("P")


def leaves(tree: object) -> Iterator[Scalar]:
    """All leaves, in one order for all trees of a shape.

    Args:
        tree: The tree.

    Yields:
        Leaf by leaf.
    """
    if isinstance(tree, tuple):
        for branch in tree:
            yield from leaves(branch)
    elif is_dataclass(tree):
        for field in fields(tree):
            yield from leaves(getattr(tree, field.name))
    elif tree is not None:
        yield tree


def mapped(tree: T, function: Callable[[Scalar], Scalar]) -> T:
    """A tree of the same shape with other leaves.

    Args:
        tree: The tree.
        function: From a leaf to the new one; it is called in the order of `leaves`.

    Returns:
        The new tree.
    """
    if isinstance(tree, tuple):
        return tuple(mapped(branch, function) for branch in tree)  # type: ignore[return-value]
    if is_dataclass(tree):
        branches = {f.name: mapped(getattr(tree, f.name), function) for f in fields(tree)}
        return replace(tree, **branches)  # type: ignore[type-var]
    return tree if tree is None else function(tree)


class Traced(Generic[P, T]):
    """A function of trees that is run once and then repeated by CasADi.

    To put scalars together one by one in Python takes a hundred times as long as to repeat it for
    other ones. What comes out is the same to the bit, as zeros and ones are dropped anew.
    """

    def __init__(self, function: Callable[P, T], *examples: P.args, **named: P.kwargs) -> None:
        """Run the function.

        Args:
            function: Makes a tree of trees.
            examples: Arguments; leaves that are symbols may be anything else in a call.
            named: None; there for the type only.
        """
        assert not named  # noqa: S101
        self._given = [_is_symbolic(leaf) for leaf in leaves(examples)]
        symbols = mapped(examples, lambda leaf: ca.SX.sym("x") if _is_symbolic(leaf) else leaf)
        self._made = function(*symbols, **named)
        self._function = ca.Function(
            "traced",
            [ca.vertcat(*filter(_is_symbolic, leaves(symbols)))],
            [ca.vertcat(*filter(_is_symbolic, leaves(self._made)))],
        )

    def __call__(self, *arguments: P.args, **named: P.kwargs) -> T:
        """What the function makes of other arguments.

        Args:
            arguments: Of the shape of the examples; what was a number there is taken to be the
                same.
            named: None.

        Returns:
            The tree.
        """
        assert not named  # noqa: S101
        pairs = zip(leaves(arguments), self._given, strict=True)
        given: Any = ca.vertcat(*(leaf for leaf, taken in pairs if taken))
        found = iter(ca.vertsplit(self._function(given)))
        return mapped(self._made, lambda leaf: next(found) if _is_symbolic(leaf) else leaf)


def _is_symbolic(leaf: Scalar) -> bool:
    """Also of a number in CasADi's type: another limb may have a symbol there."""
    return isinstance(leaf, ca.SX)
