"""Kinds of limbs: what the compiled code of a limb depends on, as opposed to its data."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.kernel.dynamics.spatial import Scalar, leaves, mapped
from gaitswarm.sim.robot.limbs import Limb, LimbJoint, electrical_constants, limbs_of
from gaitswarm.sim.robot.robot import Robot


@lru_cache(maxsize=64)
def robot_constants(robot: Robot) -> NDArray[np.float64]:
    """Constants that a kernel reads besides the run-time parameters."""
    limbs = limbs_of(robot)
    joints = [joint for limb in limbs for joint in limb.joints]
    kinds = limb_kinds(limbs)
    numbers = electrical_constants(joints)
    for limb, kind in zip(limbs, kinds, strict=True):
        numbers += kind.numbers_of(limb)
    if robot.servos is not None:
        numbers += robot.servos.ravel().tolist()
    constants = np.array(numbers)
    constants.flags.writeable = False
    return constants


_DATA: Final = tuple(f.name for f in fields(LimbJoint) if f.name not in ("axis", "sign"))


@dataclass(frozen=True, slots=True)
class LimbKind:
    """Limbs that share a function: same axes, and the same constants are 0 or 1."""

    axes: tuple[tuple[float, ...], ...]
    trivial: tuple[float | None, ...]  # by constant, 0 or 1 where all limbs have it, else None

    def numbers_of(self, limb: Limb) -> list[float]:
        """Constants in which limbs of this kind differ."""
        return [x for x, fixed in zip(_constants(limb), self.trivial, strict=True) if fixed is None]

    def symbolic(self, limb: Limb, symbols: Sequence[Scalar]) -> Limb:
        left = iter(symbols)
        values = iter([next(left) if fixed is None else fixed for fixed in self.trivial])
        return _with_constants(limb, values)


def limb_kinds(limbs: Sequence[Limb]) -> list[LimbKind]:
    """The kind of every limb: one kind per set of axes."""
    alike: dict[tuple[tuple[float, ...], ...], list[list[float]]] = {}
    for limb in limbs:
        alike.setdefault(_axes(limb), []).append(_constants(limb))
    kinds = {}
    for axes, members in alike.items():
        trivial: list[float | None] = []
        for k, values in enumerate(zip(*members, strict=True)):
            same = values[0] if len(set(values)) == 1 else None
            trivial.append(same if same in (0.0, 1.0) and k >= len(axes) else None)
        kinds[axes] = LimbKind(axes, tuple(trivial))
    return [kinds[_axes(limb)] for limb in limbs]


def _axes(limb: Limb) -> tuple[tuple[float, ...], ...]:
    return tuple(joint.axis for joint in limb.joints)


def _constants(limb: Limb) -> list[float]:
    """All leaves but the axes, the joints' signs first."""
    rest = [
        leaf for joint in limb.joints for name in _DATA for leaf in leaves(getattr(joint, name))
    ]
    return [*(joint.sign for joint in limb.joints), *rest, *leaves((limb.foot, limb.mobility))]


def _with_constants(limb: Limb, values: Iterator[Scalar]) -> Limb:
    """Replace the constants, in the order of `_constants`."""
    signs = [next(values) for _ in limb.joints]
    joints = []
    for joint, sign in zip(limb.joints, signs, strict=True):
        data = {name: mapped(getattr(joint, name), lambda _: next(values)) for name in _DATA}
        joints.append(replace(joint, sign=sign, **data))
    foot, mobility = mapped((limb.foot, limb.mobility), lambda _: next(values))
    return Limb(tuple(joints), foot, mobility)
