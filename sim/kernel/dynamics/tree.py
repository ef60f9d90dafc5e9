"""Trees of scalars: nested tuples and dataclasses whose leaves are numbers or symbols."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass, replace
from typing import TypeVar

from gaitswarm.sim.kernel.dynamics.spatial import Scalar

T = TypeVar("T")


def leaves(tree: object) -> Iterator[Scalar]:
    """All leaves, in one order for all trees of a shape."""
    if isinstance(tree, tuple):
        for branch in tree:
            yield from leaves(branch)
    elif is_dataclass(tree):
        for field in fields(tree):
            yield from leaves(getattr(tree, field.name))
    elif tree is not None:
        yield tree


def mapped(tree: T, function: Callable[[Scalar], Scalar]) -> T:
    """A tree of the same shape with other leaves."""
    if isinstance(tree, tuple):
        return tuple(mapped(branch, function) for branch in tree)  # type: ignore[return-value]
    if is_dataclass(tree):
        branches = {f.name: mapped(getattr(tree, f.name), function) for f in fields(tree)}
        return replace(tree, **branches)  # type: ignore[type-var]
    return tree if tree is None else function(tree)
