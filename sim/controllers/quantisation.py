"""Fuzzy inference as lookup tables (thesis 5.3): axes, indices, 8-bit values."""

from __future__ import annotations

import ctypes
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from functools import lru_cache, reduce
from importlib import resources
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.arrays import Floats, Ints
from gaitswarm.sim.compiler.compilation import load_library, vector_header
from gaitswarm.sim.controllers.fixed_point import FRACTION_BITS, to_fixed
from gaitswarm.sim.controllers.mamdani import Mamdani

OUTPUT_BITS: Final = 8
OUTPUT_SCALE: Final = 127
"""Table value of the largest output in the table."""


class Axis(NamedTuple):
    """One input of a table."""

    bits: int  # of the index
    centred: bool  # symmetric about zero, like errors; otherwise from zero up, like currents

    def grid(self) -> Floats:
        """Shares of the input's range at the indices, (2 ** bits,).

        Zero falls on the middle index of a centred axis, so the first index repeats the second.
        """
        n = 1 << self.bits
        if self.centred:
            return np.maximum(np.arange(-n // 2, n // 2) / (n // 2 - 1), -1.0)
        return np.arange(n) / (n - 1)

    def gain(self, full_range: float) -> int:
        """Fixed-point index per unit of an input.

        Args:
            full_range: Value of the input at the last index.
        """
        n = 1 << self.bits
        return to_fixed((n // 2 - 1 if self.centred else n - 1) / full_range, FRACTION_BITS)


@dataclass(frozen=True, slots=True, eq=False)
class ExactInference:
    """Response by the inference in 64-bit numbers, without a table; reference kernel only."""

    system: Mamdani
    error_range: float  # coded counts of share 1
    current_range: float  # coded counts of share 1
    output_range: float  # PWM counts of share 1

    def respond(self, error: Ints, current: Ints, change: Ints) -> Ints:
        del change
        crisp = self.system.infer_at(
            {
                "error": np.clip(error / self.error_range, -1.0, 1.0),
                "current": np.clip(current / self.current_range, 0.0, 1.0),
            }
        )
        return np.rint(crisp * self.output_range * (1 << FRACTION_BITS)).astype(np.int64)


def table_bytes(input_bits: tuple[int, ...], output_bits: int, outputs: int = 1) -> int:
    """Memory of a lookup table [B], eq. 5.1: N_O * R_O / 8 * 2^(sum of input bits)."""
    return outputs * output_bits * (1 << sum(input_bits)) // 8


class Quantised(NamedTuple):
    """An inference in 8 bits."""

    # (2 ** bits of each axis) in 1/127ths of the largest output, read-only
    values: NDArray[np.int8]
    largest: float  # output in the table, as a share of the output's range

    @property
    def step(self) -> float:
        """Share of the output's range that one unit of a table value represents."""
        return self.largest / OUTPUT_SCALE


@dataclass(slots=True)
class TableTime:
    """Accumulated cost of building tables."""

    seconds: float = 0.0  # wall time [s]
    made: int = 0  # number of tables


_table_time: Final[ContextVar[TableTime | None]] = ContextVar("table_time", default=None)


@contextmanager
def timing_tables() -> Iterator[TableTime]:
    """Measure the tables that this thread builds inside the block."""
    spent = TableTime()
    before = _table_time.set(spent)
    try:
        yield spent
    finally:
        _table_time.reset(before)


def quantised(system: Mamdani, axes: Mapping[str, Axis]) -> Quantised:
    """Tabulate an inference on the axes' grid."""
    begun = time.perf_counter()
    grid = {name: axis.grid() for name, axis in axes.items()}
    values, largest = compiled_table(system, grid) or reference_table(system, grid)
    values.flags.writeable = False
    spent = _table_time.get()
    if spent is not None:
        spent.seconds += time.perf_counter() - begun
        spent.made += 1
    return Quantised(values, largest)


def reference_table(system: Mamdani, grid: Mapping[str, Floats]) -> tuple[NDArray[np.int8], float]:
    """Oracle of the compiled table, and its replacement without a compiler.

    The grid has the values (n_i,) of the inputs, in order. Returns values in 1/127ths of the
    largest output, (n_1, n_2, ...), and that output, absolute.
    """
    crisp = system.infer(grid)
    largest = float(np.abs(crisp).max())
    return np.rint(crisp * (OUTPUT_SCALE / (largest or 1.0))).astype(np.int8), largest


def compiled_table(
    system: Mamdani, grid: Mapping[str, Floats], *, library: ctypes.CDLL | None = None
) -> tuple[NDArray[np.int8], float] | None:
    """`reference_table` in a fraction of a millisecond, with the same bits."""
    *firsts, inner = system.degrees(grid)
    memberships, points = system.output_memberships(), system.output_points()
    library = library or _library()
    if (
        library is None
        or inner.shape[1] % library.gaitswarm_block()
        or len(system.rules) > library.gaitswarm_max_rules()
        or len(memberships) > library.gaitswarm_max_sets()
        or len(points) > library.gaitswarm_max_points()
    ):
        return None
    outer = reduce(_both_hold, firsts)
    values = np.empty([len(axis) for axis in grid.values()], dtype=np.int8)
    sizes = (
        len(values),
        outer.shape[1],
        inner.shape[1],
        len(system.rules),
        len(memberships),
        len(points),
    )
    arrays = (
        np.ascontiguousarray(outer),
        inner,
        np.array([rule.weight for rule in system.rules], dtype=np.float64),
        np.array(system.consequents(), dtype=np.int64),
        memberships,
        points,
        np.empty(library.gaitswarm_scratch(*map(ctypes.c_int64, sizes[1:4]))),
        values,
    )
    library.gaitswarm_table.restype = ctypes.c_double
    largest = library.gaitswarm_table(
        *map(ctypes.c_int64, sizes), *(ctypes.c_void_p(array.ctypes.data) for array in arrays)
    )
    return values, float(largest)


def _both_hold(a: Floats, b: Floats) -> Floats:
    """Degrees (rules, n) and (rules, m) over the product of their values: (rules, n m)."""
    return np.minimum(a[:, :, np.newaxis], b[:, np.newaxis, :]).reshape(len(a), -1)


def inference_source() -> str:
    here = resources.files("gaitswarm.sim.controllers")
    parts = [(here / name).read_text(encoding="utf-8") for name in ("estimate.c", "inference.c")]
    return "\n".join([vector_header(), *parts])


@lru_cache(maxsize=1)
def _library() -> ctypes.CDLL | None:
    source = inference_source()
    return load_library("inference", source.encode(), lambda: source)
