"""Random numbers that are a function of where they are used, not of when or in what order."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

_DOUBLE_BITS: Final = 53


def uniform(
    seed: int, purpose: int, *, iteration: int, particle: int, count: int
) -> NDArray[np.float64]:
    """Uniform random numbers of one particle: Philox 4x64 (Salmon et al. 2011).

    The key is (seed, purpose), and the counter starts at (iteration, particle): no stream overlaps
    another, and none depends on how many numbers another one took.

    Args:
        seed: of the job, 64 bits.
        purpose: what the numbers are for, 64 bits.
        iteration: from 0, 64 bits.
        particle: from 0, 64 bits.
        count: of numbers.

    Returns:
        (count,) in [0, 1), multiples of 2**-53.
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
    """Uniform random numbers of a whole swarm.

    Args:
        seed: of the job, 64 bits.
        purpose: what the numbers are for, 64 bits.
        iteration: from 0, 64 bits.
        particles: size of the swarm.
        count: of numbers for each particle.

    Returns:
        (particles, count) in [0, 1); a row is what `uniform` gives for that particle.
    """
    rows = [
        uniform(seed, purpose, iteration=iteration, particle=particle, count=count)
        for particle in range(particles)
    ]
    return np.array(rows, dtype=np.float64).reshape(particles, count)
