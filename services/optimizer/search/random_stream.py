"""Random numbers that depend on where they are used, not on when or in which order."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.memory import require_room_for_scipy

_DOUBLE_BITS: Final = 53


def uniform(
    seed: int, purpose: int, *, iteration: int, particle: int, count: int
) -> NDArray[np.float64]:
    """Draw uniform random numbers of one particle: Philox 4x64 (Salmon et al. 2011).

    The key is (seed, purpose) and the counter starts at (iteration, particle), so that streams
    neither overlap nor depend on how many numbers another stream has used.
    """
    philox = np.random.Philox(
        key=np.array([seed, purpose], dtype=np.uint64),
        counter=np.array([0, 0, particle, iteration], dtype=np.uint64),
    )
    # numpy guarantees the raw stream of a bit generator, but not that of a Generator.
    raw = np.asarray(philox.random_raw(count), dtype=np.uint64)
    return (raw >> np.uint64(64 - _DOUBLE_BITS)).astype(np.float64) * 2.0**-_DOUBLE_BITS


def swarm_uniform(
    seed: int, purpose: int, *, iteration: int, particles: int, count: int
) -> NDArray[np.float64]:
    """Draw uniform random numbers of a whole swarm, (particles, count)."""
    rows = [
        uniform(seed, purpose, iteration=iteration, particle=particle, count=count)
        for particle in range(particles)
    ]
    return np.array(rows, dtype=np.float64).reshape(particles, count)


class RandomNumbers:
    """A stream of random numbers, drawn in order (Philox 4x64).

    The same seed and purpose give the same numbers with every version of numpy.
    """

    def __init__(self, seed: int, purpose: int, *, iteration: int = 0) -> None:
        """Start a stream."""
        self._philox = np.random.Philox(
            key=np.array([seed, purpose], dtype=np.uint64),
            counter=np.array([0, 0, 0, iteration], dtype=np.uint64),
        )

    def uniform(self, *shape: int) -> NDArray[np.float64]:
        """Draw numbers that are uniform in [0, 1).

        Args:
            shape: Shape of the array; none for a single number.

        Returns:
            An array of that shape.
        """
        raw = np.asarray(self._philox.random_raw(math.prod(shape)), dtype=np.uint64)
        numbers = (raw >> np.uint64(64 - _DOUBLE_BITS)).astype(np.float64) * 2.0**-_DOUBLE_BITS
        return numbers.reshape(shape)

    def normal(self, *shape: int) -> NDArray[np.float64]:
        """Draw numbers of the standard normal distribution.

        Args:
            shape: Shape of the array; none for a single number.

        Returns:
            An array of that shape; no value exceeds 8.3.
        """
        require_room_for_scipy()
        from scipy.special import ndtri  # noqa: PLC0415 - slow to import, and few searches need it

        middles = (np.floor(self.uniform(*shape) * 2.0**52) + 0.5) * 2.0**-52
        numbers: NDArray[np.float64] = ndtri(middles)
        return numbers

    def index(self, count: int) -> int:
        """Draw an index.

        Args:
            count: Number of indices, >= 1.

        Returns:
            0 to count - 1 with equal probability.
        """
        return int(self.uniform() * count)

    def permutation(self, count: int) -> NDArray[np.intp]:
        """Draw a permutation.

        Args:
            count: Number of indices.

        Returns:
            (count,) indices 0 to count - 1 in random order.
        """
        return np.argsort(self.uniform(count), kind="stable")

    def seed(self) -> int:
        """Draw a seed for a library's own generator.

        Returns:
            0 to 2**32 - 1.
        """
        return int(self.uniform() * 2.0**32)
