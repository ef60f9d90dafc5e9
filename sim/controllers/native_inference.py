"""The inference compiled, where there is a compiler: a table costs milliseconds, not tens."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping
from functools import lru_cache, reduce
from importlib import resources

import numpy as np
from numpy.typing import NDArray

from sim.compiler.compilation import load_library, vector_header
from sim.controllers.mamdani import Mamdani


def infer(
    system: Mamdani,
    grid: Mapping[str, NDArray[np.float64]],
    *,
    library: ctypes.CDLL | None = None,
) -> NDArray[np.float64]:
    """Infer a table, with the bits of `Mamdani.infer`, which serves where nothing is compiled.

    Args:
        system: An inference system of two inputs or more.
        grid: By input, in the order of the system's, the values (n_i,), inside the range.
        library: `inference_source` compiled; the usual one if left out.

    Returns:
        Crisp output, inside its universe, over the product of the inputs' values, (n_1, n_2, ...).

    Raises:
        KernelBuildError: The library cannot be compiled, stored or loaded.
    """
    *firsts, inner = system.degrees(grid)
    library = library or _library()
    if (
        library is None
        or inner.shape[1] % library.gaitswarm_block()
        or len(system.outputs) > library.gaitswarm_max_sets()
    ):
        return system.infer(grid)
    outer = reduce(_both_hold, firsts)
    arrays = (
        np.ascontiguousarray(outer),
        np.ascontiguousarray(inner),
        np.array([rule.weight for rule in system.rules], dtype=np.float64),
        np.array(system.consequents(), dtype=np.int64),
        np.ascontiguousarray(system.output_memberships()),
        system.output_points(),
        np.empty((outer.shape[1], inner.shape[1])),
    )
    sizes = (
        outer.shape[1],
        inner.shape[1],
        len(system.rules),
        len(system.outputs),
        len(system.output_points()),
    )
    library.gaitswarm_infer(
        *(ctypes.c_int64(size) for size in sizes),
        *(ctypes.c_void_p(array.ctypes.data) for array in arrays),
    )
    return arrays[-1].reshape([len(values) for values in grid.values()])


def _both_hold(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Degrees (rules, n) and (rules, m) over the product of their values: (rules, n m)."""
    return np.minimum(a[:, :, np.newaxis], b[:, np.newaxis, :]).reshape(len(a), -1)


def inference_source() -> str:
    """The compiled inference's source.

    Returns:
        C text that lacks the definition of DOUBLES only.
    """
    code = (resources.files("sim.controllers") / "inference.c").read_text(encoding="utf-8")
    return vector_header() + code


@lru_cache(maxsize=1)
def _library() -> ctypes.CDLL | None:
    source = inference_source()
    return load_library("inference", source.encode(), lambda: source)
