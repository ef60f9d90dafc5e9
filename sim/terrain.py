"""Ground that is not flat: its description, and the height grid that all kernels read.

Every kind becomes one grid of heights, evaluated by bilinear interpolation in the same IEEE
operations everywhere (`HeightGrid.under`, and terrain.c in the compiled kernel).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Annotated, Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.input import Data

_EDGE: Final = 0.005
"""Largest width of the ramp that represents a vertical edge [m]."""

_EXTENT: Final = 20.0
"""Length of steps and stairs [m]."""

_LATTICE: Final = 64
"""Random heights along each side of a rough tile, one correlation length apart."""

_CELLS: Final = 8
"""Cells of the grid per correlation length."""

_LARGEST_GRID: Final = 40_000
"""Limit of the heights in a document."""


class Plane(Data):
    """Flat ground, level or on the scenario's slope."""

    kind: Literal["plane"] = "plane"


class _Edges(Data):
    height: float = Field(gt=0.0, le=0.5, description="Height of a step [m].", examples=[0.02])
    depth: float = Field(default=0.25, ge=0.02, le=5.0)
    """Length of a step along the walk [m]."""
    start: float = Field(default=0.3, ge=0.0, le=10.0)
    """Distance of the first edge ahead of the body's centre at the start [m]."""


class Steps(_Edges):
    """Ground that rises by a step and falls again, over and over, for 20 m."""

    kind: Literal["steps"]


class Stairs(_Edges):
    """Stairs up, 20 m long."""

    kind: Literal["stairs"]


class Rough(Data):
    """Smooth random bumps that repeat after 64 correlation lengths."""

    kind: Literal["rough"]
    amplitude: float = Field(ge=0.0, le=0.5, examples=[0.01])
    """Largest height and depth against the mean plane [m]."""
    correlation_length: float = Field(default=0.1, ge=0.02, le=10.0)
    """Distance between independent heights [m]."""
    seed: int = Field(default=1, ge=0, lt=2**53, description="Seed of the heights.")


class Grid(Data):
    """Measured heights; beyond the grid, the heights of its edge go on."""

    kind: Literal["grid"]
    cell: float = Field(gt=0.0, le=10.0, description="Distance between neighbouring heights [m].")
    heights: tuple[tuple[Annotated[float, Field(ge=-10.0, le=10.0)], ...], ...] = Field(
        min_length=2,
        max_length=_LARGEST_GRID // 2,
        description="Rows along the walk, each from right to left [m]; the robot starts over the"
        " middle of the grid.",
        examples=[[[0.0, 0.0], [0.01, 0.02]]],
    )

    @model_validator(mode="after")
    def _rows_are_even(self) -> Grid:
        widths = {len(row) for row in self.heights}
        if len(widths) > 1 or min(widths) < 2:
            raise ValueError("heights: rows need the same number of heights, at least 2")
        if len(self.heights) * widths.pop() > _LARGEST_GRID:
            raise ValueError(f"heights: more than {_LARGEST_GRID}; choose larger cells")
        return self


Terrain = Annotated[Plane | Steps | Stairs | Rough | Grid, Field(discriminator="kind")]
"""Shape of the ground, heights along its normal where the scenario has a slope."""

PLANE: Final = Plane()


@dataclass(frozen=True, slots=True, eq=False)
class HeightGrid:
    """Heights at the corners of square cells.

    Attributes:
        heights: (n + 1, m + 1), n cells along x and m along y [scale m].
        origin: x and y of the first corner [m].
        cell: edge of a cell [m].
        highest: largest of the heights [scale m].
        repeats: whether the heights repeat along x and along y; else those of the edge go on.
        scale: factor of the heights.
    """

    heights: Floats
    origin: tuple[float, float]
    cell: float
    highest: float
    repeats: tuple[bool, bool] = (False, False)
    scale: float = 1.0

    def under(self, x: Floats, y: Floats) -> tuple[Floats, Floats, Floats]:
        """Return height [m] and slopes along x and y [1] at points; as terrain.c, bit for bit."""
        u, i, inside_x = self._place(0, x)
        v, j, inside_y = self._place(1, y)
        corner, left = self.heights[i, j], self.heights[i, j + 1]
        ahead, across = self.heights[i + 1, j], self.heights[i + 1, j + 1]
        near, far = corner + v * (left - corner), ahead + v * (across - ahead)
        rise, sideways = far - near, left - corner
        sideways = sideways + u * ((across - ahead) - sideways)
        steepness = self.scale * self.per_metre
        return (
            self.scale * (near + u * rise),
            np.where(inside_x, steepness * rise, 0.0),
            np.where(inside_y, steepness * sideways, 0.0),
        )

    def height(self, x: Floats, y: Floats) -> Floats:
        """Return the height at points [m]."""
        return self.under(x, y)[0]

    @property
    def cells(self) -> tuple[int, int]:
        """Number of cells along x and y."""
        n, m = self.heights.shape
        return n - 1, m - 1

    @property
    def per_metre(self) -> float:
        """Cells per metre."""
        return 1.0 / self.cell

    @property
    def top(self) -> float:
        """Largest height, or more by a rounding [m]."""
        return self.scale * self.highest + 1e-9

    @property
    def repeated(self) -> tuple[float, float]:
        """Repetitions per cell along x and y, 0 for none."""
        (x, y), (n, m) = self.repeats, self.cells
        return x / n, y / m

    def _place(self, axis: int, at: Floats) -> tuple[Floats, NDArray[np.intp], NDArray[np.bool_]]:
        """Return the share of a cell, its index, and whether the point lies on the grid."""
        cells = float(self.cells[axis])
        u = (at - self.origin[axis]) * self.per_metre
        u = u - np.floor(u * self.repeated[axis]) * cells
        on = np.fmin(np.fmax(u, 0.0), cells)
        index = np.fmin(np.floor(on), cells - 1.0)
        return on - index, index.astype(np.intp), u == on

    def placed(self, seed: int) -> HeightGrid:
        """Return the grid under a robot that starts at another place; a seed of 0 is its own."""
        mixed = seed * 0x9E3779B97F4A7C15 % 2**64
        shares = mixed >> 32, mixed & 0xFFFFFFFF
        x, y = (
            at - share / 2**32 * cells * self.cell * repeats
            for at, share, cells, repeats in zip(
                self.origin, shares, self.cells, self.repeats, strict=True
            )
        )
        return replace(self, origin=(x, y))


@lru_cache(maxsize=32)
def height_grid(terrain: Terrain) -> HeightGrid | None:
    """Return the heights of a terrain; None for a plane."""
    if isinstance(terrain, Rough):
        return rough_grid(terrain)
    if isinstance(terrain, Grid):
        heights = np.array(terrain.heights)
        n, m = heights.shape
        middle = -0.5 * terrain.cell * (n - 1), -0.5 * terrain.cell * (m - 1)
        return HeightGrid(_fixed(heights), middle, terrain.cell, float(heights.max()))
    if isinstance(terrain, _Edges):
        return _edges(terrain, up=isinstance(terrain, Stairs))
    return None


def rough_grid(terrain: Rough) -> HeightGrid:
    """Return the heights of rough ground."""
    cell = terrain.correlation_length / _CELLS
    heights = _tile(terrain.seed)
    return HeightGrid(heights, (0.0, 0.0), cell, 1.0, (True, True), terrain.amplitude)


def _edges(terrain: _Edges, *, up: bool) -> HeightGrid:
    """Steps that start with an edge, one cell wide."""
    cells = math.ceil(terrain.depth / _EDGE)
    corners = np.arange(math.ceil(_EXTENT / terrain.depth) * cells + 1)
    levels = (corners + (cells - 1)) // cells
    column = terrain.height * (levels if up else levels % 2)
    heights = _fixed(np.stack([column, column], axis=1))
    return HeightGrid(heights, (terrain.start, 0.0), terrain.depth / cells, float(column.max()))


@lru_cache(maxsize=8)
def _tile(seed: int) -> Floats:
    """Random heights between -1 and 1, as a uniform cubic B-spline of a periodic lattice."""
    random = np.random.Generator(np.random.Philox(seed)).random((_LATTICE, _LATTICE))
    heights = _refined(_refined(2.0 * random - 1.0).T).T
    heights = heights / np.abs(heights).max()
    return _fixed(np.pad(heights, ((0, 1), (0, 1)), mode="wrap"))


def _refined(lattice: Floats) -> Floats:
    """Interpolate between the rows of a periodic lattice.

    Only elementwise operations, whose bits do not depend on the machine.
    """
    rows = []
    for k in range(_CELLS):
        t = k / _CELLS
        weights = (
            (1.0 - t) * (1.0 - t) * (1.0 - t) / 6.0,
            (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0,
            (1.0 + 3.0 * t + 3.0 * t * t - 3.0 * t * t * t) / 6.0,
            t * t * t / 6.0,
        )
        row = weights[0] * lattice
        for shift in (1, 2, 3):
            row = row + weights[shift] * np.roll(lattice, -shift, axis=0)
        rows.append(row)
    return np.stack(rows, axis=1).reshape(-1, lattice.shape[1])


def _fixed(heights: Floats) -> Floats:
    heights = np.ascontiguousarray(heights)
    heights.flags.writeable = False
    return heights
