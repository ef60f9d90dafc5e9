"""Response surface of a fuzzy controller over error and current, by inference and by table."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.controllers.base import Inference, Universe
from gaitswarm.sim.controllers.mamdani import FuzzySet
from gaitswarm.sim.controllers.quantisation import OUTPUT_BITS, Axis, table_bytes

SURFACE_AXES: Final = ("error", "current")
"""Inputs of a surface; others are held constant."""


@dataclass(frozen=True, slots=True, eq=False)
class Memberships:
    """Range and sets of an input or output."""

    universe: Universe
    # of the universe, in its unit; an output's may lie beyond its range
    limits: tuple[float, float]
    values: Floats  # (n,), in its unit
    degrees: Mapping[str, Floats]  # by set, (n,) [1]


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """One output over (error, current), in its unit."""

    source: Inference
    inputs: Mapping[str, Memberships]
    output: Memberships
    held: Mapping[str, float]  # constant value of each other input, in its unit
    inference: Floats  # (n_error, n_current), at the inputs' `values`
    table: Floats  # (n_error, n_current), at the inputs' `values`

    @property
    def bytes(self) -> int:
        """Memory of the whole table, eq. 5.1 [B]."""
        return table_bytes(tuple(axis.bits for axis in self.source.axes.values()), OUTPUT_BITS)

    @property
    def largest_difference(self) -> float:
        """Between table and inference."""
        return float(np.abs(self.table - self.inference).max())

    @property
    def rms_difference(self) -> float:
        """Between table and inference."""
        return float(np.sqrt(np.mean((self.table - self.inference) ** 2)))


def surface(
    source: Inference, *, error_points: int, current_points: int, velocity: float = 0.0
) -> Surface:
    """Compute an output on an even grid of whole counts, at a velocity error [counts/s]."""
    points = {"error": error_points, "current": current_points, "velocity": error_points}
    inputs = {
        name: _input(universe, source.axes[name], points[name], source.system.inputs[name])
        for name, universe in source.inputs.items()
    }
    held = {
        name: np.rint([velocity * universe.counts]) / universe.counts
        for name, universe in source.inputs.items()
        if name not in SURFACE_AXES
    }
    values = {name: held.get(name, inputs[name].values) for name in inputs}
    return Surface(
        source=source,
        inputs=inputs,
        output=_output(source),
        held={name: float(value) for name, (value,) in held.items()},
        inference=_inferred(source, values),
        table=_looked_up(source, values),
    )


def _input(
    universe: Universe, axis: Axis, points: int, sets: Mapping[str, FuzzySet]
) -> Memberships:
    """Even over the range; measured values are whole counts."""
    limits = (-universe.full_range if axis.centred else 0.0, universe.full_range)
    low, high = (limit * universe.counts for limit in limits)
    counts = np.rint(np.linspace(low, high, points))
    values = counts / universe.counts
    shares = _shares(universe, values)
    degrees = {name: fuzzy_set.membership(shares) for name, fuzzy_set in sets.items()}
    return Memberships(universe, limits, values, degrees)


def _output(source: Inference) -> Memberships:
    values = source.system.output_points() * source.output.full_range
    memberships = source.system.output_memberships()
    degrees = dict(zip(source.system.outputs, memberships, strict=True))
    limits = (float(values[0]), float(values[-1]))
    return Memberships(source.output, limits, values=values, degrees=degrees)


def _inferred(source: Inference, values: Mapping[str, Floats]) -> Floats:
    """(n_error, n_current) by the inference."""
    grid = {name: _shares(source.inputs[name], values[name]) for name in values}
    crisp = source.system.infer(grid) * source.output.full_range
    return crisp.reshape(len(values["error"]), len(values["current"]))


def _looked_up(source: Inference, values: Mapping[str, Floats]) -> Floats:
    """(n_error, n_current) as the microcontroller computes it, in integers."""
    counts = {
        name: np.rint(values[name] * source.inputs[name].counts).astype(np.int64) for name in values
    }
    error, current = np.meshgrid(counts["error"], counts["current"], indexing="ij")
    change = np.broadcast_to(counts.get("velocity", np.int64(0)), error.shape)
    return source.table.respond(error, current, change) / source.output.counts


def _shares(universe: Universe, values: Floats) -> Floats:
    return np.clip(values / universe.full_range, -1.0, 1.0)
