"""Fuzzy inference as lookup tables (thesis 5.3): axes, indices, 8-bit values."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.controllers.fixed_point import FRACTION_BITS, to_fixed
from gaitswarm.sim.controllers.mamdani import Mamdani
from gaitswarm.sim.controllers.native_inference import compiled_table

OUTPUT_BITS: Final = 8
OUTPUT_SCALE: Final = 127
"""Table value of the largest output in the table."""


@dataclass(frozen=True, slots=True)
class Axis:
    """One input of a table.

    Attributes:
        bits: of the index.
        centred: about zero, as errors are; else from zero up, as currents.
    """

    bits: int
    centred: bool

    def grid(self) -> NDArray[np.float64]:
        """Shares of the input's range that the indices stand for, (2 ** bits,).

        Zero falls on the middle index of a centred axis, so the first index repeats the second.
        """
        n = 1 << self.bits
        if self.centred:
            return np.maximum(np.arange(-n // 2, n // 2) / (n // 2 - 1), -1.0)
        return np.arange(n) / (n - 1)

    def gain(self, full_range: float) -> int:
        """Fixed-point index per unit of an input."""
        n = 1 << self.bits
        return to_fixed((n // 2 - 1 if self.centred else n - 1) / full_range, FRACTION_BITS)


@dataclass(frozen=True, slots=True, eq=False)
class ExactInference:
    """Answers by the inference itself in 64-bit numbers, which no table stands between.

    For the reference kernel only.

    Attributes:
        system: the inference.
        error_range: coded counts of share 1.
        current_range: coded counts of share 1.
        output_range: PWM counts of share 1.
    """

    system: Mamdani
    error_range: float
    current_range: float
    output_range: float

    def respond(
        self, error: NDArray[np.int64], current: NDArray[np.int64], change: NDArray[np.int64]
    ) -> NDArray[np.int64]:
        """What the inference answers; the change does not matter."""
        del change
        crisp = self.system.infer_at(
            {
                "error": np.clip(error / self.error_range, -1.0, 1.0),
                "current": np.clip(current / self.current_range, 0.0, 1.0),
            }
        )
        return np.rint(crisp * self.output_range * (1 << FRACTION_BITS)).astype(np.int64)


def table_bytes(input_bits: tuple[int, ...], output_bits: int, outputs: int = 1) -> int:
    """Memory of a lookup table, eq. 5.1: N_O * R_O / 8 * 2^(sum of input bits).

    Returns:
        [B].
    """
    return outputs * output_bits * (1 << sum(input_bits)) // 8


@dataclass(frozen=True, slots=True, eq=False)
class Quantised:
    """An inference in 8 bits.

    Attributes:
        values: (2 ** bits of each axis) in 1/127ths of the largest output, read-only.
        largest: output anywhere in the table, as a share of the output's range.
    """

    values: NDArray[np.int8]
    largest: float

    @property
    def step(self) -> float:
        """Share of the output's range that one table value stands for."""
        return self.largest / OUTPUT_SCALE


@dataclass(slots=True)
class TableTime:
    """What making tables took, of those who ask for it.

    Attributes:
        seconds: wall time, added to [s].
        made: tables, added to.
    """

    seconds: float = 0.0
    made: int = 0


_table_time: Final[ContextVar[TableTime | None]] = ContextVar("table_time", default=None)


@contextmanager
def timing_tables() -> Iterator[TableTime]:
    """Time the tables that this thread makes inside the block."""
    spent = TableTime()
    before = _table_time.set(spent)
    try:
        yield spent
    finally:
        _table_time.reset(before)


def quantised(system: Mamdani, axes: Mapping[str, Axis]) -> Quantised:
    """An inference on the axes' grid.

    An output that reaches beyond its range is covered, and none loses resolution to a universe that
    the centroid never comes near the ends of.
    """
    begun = time.perf_counter()
    grid = {name: axis.grid() for name, axis in axes.items()}
    values, largest = compiled_table(system, grid) or reference_table(system, grid)
    values.flags.writeable = False
    spent = _table_time.get()
    if spent is not None:
        spent.seconds += time.perf_counter() - begun
        spent.made += 1
    return Quantised(values, largest)


def reference_table(
    system: Mamdani, grid: Mapping[str, NDArray[np.float64]]
) -> tuple[NDArray[np.int8], float]:
    """The oracle of the compiled table, and its replacement where there is no compiler.

    Args:
        grid: By input of the system, in its order, the values (n_i,), inside the range.

    Returns:
        Values in 1/127ths of the largest output, (n_1, n_2, ...), and that output, absolute.
    """
    crisp = system.infer(grid)
    largest = float(np.abs(crisp).max())
    return np.rint(crisp * (OUTPUT_SCALE / (largest or 1.0))).astype(np.int8), largest
