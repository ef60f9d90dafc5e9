"""Mamdani inference as in Matlab's Fuzzy Logic Toolbox (docs/optimizers.md).

min AND, max aggregation, min implication of the firing strength times the rule's weight, centroid
on 101 points; if no rule fires, the mean of the output range. Inputs and output are shares of their
range; the output's universe may extend beyond it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import lru_cache, reduce
from typing import Final, NamedTuple

import numpy as np

from gaitswarm.sim.arrays import Floats

N_POINTS: Final = 101
"""Samples of the output universe."""


class Shape(IntEnum):
    """Membership functions that share their half-height points (Matlab's mf2mf)."""

    TRIANGLE = 1
    GAUSS = 2
    PI = 3


class FuzzySet(NamedTuple):
    """A symmetric membership function."""

    peak: float  # position of membership one
    half_width: float  # the triangle's distance from peak to foot

    def membership(self, x: Floats, shape: Shape = Shape.TRIANGLE) -> Floats:
        """Degrees of membership of points (n,) of the universe, (n,) in [0, 1]."""
        distance = np.abs(x - self.peak) / self.half_width
        if shape is Shape.TRIANGLE:
            return np.maximum(0.0, 1.0 - distance)
        if shape is Shape.GAUSS:
            # exp(-d^2 / (2 sigma^2)) is one half at half the half-width, like the triangle.
            return np.exp(-4.0 * math.log(2.0) * distance**2)
        inner = 1.0 - 2.0 * distance**2
        outer = 2.0 * np.maximum(0.0, 1.0 - distance) ** 2
        return np.where(distance <= 0.5, inner, outer)


class Rule(NamedTuple):
    """IF every antecedent holds THEN consequent."""

    antecedents: Mapping[str, str]  # name of the set, by input; inputs left out do not matter
    consequent: str
    weight: float  # in [0, 1]


@dataclass(frozen=True, slots=True)
class Mamdani:
    """A fuzzy inference system with one output."""

    inputs: Mapping[str, Mapping[str, FuzzySet]]  # sets by input and name
    outputs: Mapping[str, FuzzySet]  # the output's sets by name, all of `output_shape`
    rules: Sequence[Rule]
    output_shape: Shape = Shape.TRIANGLE
    universe: float = 1.0  # limit of the output's universe on either side

    def degrees(self, grid: Mapping[str, Floats]) -> list[Floats]:
        """How far rules hold (n_rules, n_i), by input of the grid (n_i,); 1 if left out."""
        degrees = []
        for name, values in grid.items():
            grades: dict[str | None, Floats] = {None: np.ones(len(values))}
            for label, fuzzy_set in self.inputs[name].items():
                grades[label] = fuzzy_set.membership(values)
            degrees.append(np.stack([grades[r.antecedents.get(name)] for r in self.rules]))
        return degrees

    def consequents(self) -> list[int]:
        """Index of the output set, by rule."""
        names = list(self.outputs)
        return [names.index(rule.consequent) for rule in self.rules]

    def output_memberships(self) -> Floats:
        """(n_sets, 101) membership of the points of the output universe, read-only."""
        return _memberships(tuple(self.outputs.values()), self.output_shape, self.universe)

    def output_points(self) -> Floats:
        """(101,) samples of the output universe, symmetric to the bit, read-only."""
        return _points(self.universe)

    def infer(self, grid: Mapping[str, Floats]) -> Floats:
        """Crisp output over the product (n_1, n_2, ...) of values (n_i,) of the inputs."""
        degrees = self.degrees(grid)
        along = [
            degree.reshape([len(degree), *(-1 if i == axis else 1 for i in range(len(degrees)))])
            for axis, degree in enumerate(degrees)
        ]
        return self._crisp(along, tuple(degree.shape[1] for degree in degrees))

    def infer_at(self, points: Mapping[str, Floats]) -> Floats:
        """Crisp output at points, given by the inputs' coordinates (n,) in their order."""
        degrees = self.degrees(points)
        return self._crisp(degrees, degrees[0].shape[1:])

    def _crisp(self, degrees: Sequence[Floats], shape: tuple[int, ...]) -> Floats:
        """degrees: by input (rules, ...), of shapes that broadcast to (rules, *shape)."""
        levels = np.zeros((len(self.outputs), *shape))
        for k, (rule, target) in enumerate(zip(self.rules, self.consequents(), strict=True)):
            strength = reduce(np.minimum, [degree[k] for degree in degrees])
            np.maximum(levels[target], strength * rule.weight, out=levels[target])
        return centroid(levels, self.output_memberships(), self.output_points())


def _read_only(array: Floats) -> Floats:
    array.flags.writeable = False
    return array


@lru_cache(maxsize=64)
def _points(universe: float) -> Floats:
    half = N_POINTS // 2
    return _read_only(np.arange(-half, half + 1) / half * universe)


# A job needs few: its designs differ mostly in their weights.
@lru_cache(maxsize=64)
def _memberships(sets: tuple[FuzzySet, ...], shape: Shape, universe: float) -> Floats:
    points = _points(universe)
    return _read_only(np.stack([s.membership(points, shape) for s in sets]))


def centroid(levels: Floats, memberships: Floats, points: Floats) -> Floats:
    """Centre of area of the union of sets clipped at levels (n_sets, ...).

    Sums run over the points in order, so that the compiled version gives the same bits. Memberships
    are (n_sets, n_points).
    """
    flat = levels.reshape(len(levels), -1)
    moment = np.zeros(flat.shape[1])
    area = np.zeros(flat.shape[1])
    for k, point in enumerate(points):
        union = np.minimum(flat[0], memberships[0, k])
        for level, membership in zip(flat[1:], memberships[1:, k], strict=True):
            np.maximum(union, np.minimum(level, membership), out=union)
        moment += point * union
        area += union
    crisp = np.divide(moment, area, out=np.zeros_like(moment), where=area > 0.0)
    return crisp.reshape(levels.shape[1:])
