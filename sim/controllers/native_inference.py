"""Tables of an inference, compiled where there is a compiler: a fraction of a millisecond each."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping
from functools import lru_cache, reduce
from importlib import resources

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.compiler.compilation import load_library, vector_header
from gaitswarm.sim.controllers.mamdani import Mamdani


def compiled_table(
    system: Mamdani,
    grid: Mapping[str, NDArray[np.float64]],
    *,
    library: ctypes.CDLL | None = None,
) -> tuple[NDArray[np.int8], float] | None:
    """An inference in 8 bits, with the bits of `quantisation.reference_table`.

    Args:
        grid: By input, in the order of the system's, the values (n_i,), inside the range.

    Returns:
        Values in 1/127ths of the largest output over the product of the inputs' values,
        (n_1, n_2, ...), and that output, absolute, as a share of the output's range. None for a
        system that is too large, or a grid that is not of whole blocks, and on a machine without a
        C compiler.
    """
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
    values = np.empty([len(own) for own in grid.values()], dtype=np.int8)
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


def _both_hold(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Degrees (rules, n) and (rules, m) over the product of their values: (rules, n m)."""
    return np.minimum(a[:, :, np.newaxis], b[:, np.newaxis, :]).reshape(len(a), -1)


def inference_source() -> str:
    """The compiled inference's source."""
    here = resources.files("gaitswarm.sim.controllers")
    parts = [(here / name).read_text(encoding="utf-8") for name in ("estimate.c", "inference.c")]
    return "\n".join([vector_header(), *parts])


@lru_cache(maxsize=1)
def _library() -> ctypes.CDLL | None:
    source = inference_source()
    return load_library("inference", source.encode(), lambda: source)
