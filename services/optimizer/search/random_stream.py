"""Random numbers that are a function of where they are used, not of when or in what order."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

_DOUBLE_BITS: Final = 53


def uniform(
    seed: int, purpose: int, *, iteration: int, particle: int, count: int
) -> NDArray[np.float64]:
    """(count,) numbers in [0, 1): Philox 4x64 keyed by (seed, purpose).

    The counter starts at (iteration, particle), so that no stream overlaps another and none
    depends on how many numbers another one took. seed, purpose: 64 bits each.
    """
    philox = np.random.Philox(
        key=np.array([seed, purpose], dtype=np.uint64),
        counter=np.array([0, 0, particle, iteration], dtype=np.uint64),
    )
    # numpy keeps the raw stream of a bit generator fixed for good, but not that of a Generator.
    raw = np.asarray(philox.random_raw(count), dtype=np.uint64)
    return (raw >> np.uint64(64 - _DOUBLE_BITS)).astype(np.float64) * 2.0**-_DOUBLE_BITS


def swarm_uniform(
    seed: int, purpose: int, *, iteration: int, particles: int, count: int
) -> NDArray[np.float64]:
    """(particles, count): `uniform` of every particle, one row each."""
    rows = [
        uniform(seed, purpose, iteration=iteration, particle=particle, count=count)
        for particle in range(particles)
    ]
    return np.array(rows, dtype=np.float64).reshape(particles, count)
