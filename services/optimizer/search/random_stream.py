"""Random numbers that depend on where they are used, not on when or in which order."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.memory import require_room_for_scipy

_DOUBLE_BITS: Final = 53


class RandomNumbers:
    """A stream of random numbers, drawn in order: Philox 4x64 (Salmon et al. 2011).

    The key is (seed, purpose) and the counter starts at (iteration, particle), so that streams
    neither overlap nor depend on how many numbers another stream has used. The same seed and
    purpose give the same numbers with every version of numpy.

    In the methods, `shape` is that of the result, none for a single number.
    """

    def __init__(self, seed: int, purpose: int, *, iteration: int = 0, particle: int = 0) -> None:
        self._philox = np.random.Philox(
            key=np.array([seed, purpose], dtype=np.uint64),
            counter=np.array([0, 0, particle, iteration], dtype=np.uint64),
        )

    def uniform(self, *shape: int) -> Floats:
        """Draw numbers that are uniform in [0, 1)."""
        # numpy guarantees the raw stream of a bit generator, but not that of a Generator.
        raw = np.asarray(self._philox.random_raw(math.prod(shape)), dtype=np.uint64)
        numbers = (raw >> np.uint64(64 - _DOUBLE_BITS)).astype(np.float64) * 2.0**-_DOUBLE_BITS
        return numbers.reshape(shape)

    def normal(self, *shape: int) -> Floats:
        """Draw numbers of the standard normal distribution; no value exceeds 8.3."""
        numbers: Floats = normal_quantiles(
            (np.floor(self.uniform(*shape) * 2.0**52) + 0.5) * 2.0**-52
        )
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
        """Draw a permutation of the indices 0 to count - 1.

        Args:
            count: Number of indices.
        """
        return np.argsort(self.uniform(count), kind="stable")

    def seed(self) -> int:
        """Draw a seed for a library's own generator, 0 to 2**32 - 1."""
        return int(self.uniform() * 2.0**32)


def normal_quantiles(probabilities: Floats | float) -> Any:
    """Return quantiles of the standard normal distribution."""
    require_room_for_scipy()
    from scipy.special import ndtri  # noqa: PLC0415 - slow to import, and few searches need it

    return ndtri(probabilities)


def swarm_uniform(seed: int, purpose: int, *, iteration: int, particles: int, count: int) -> Floats:
    """Draw uniform random numbers of a whole swarm, (particles, count)."""
    return np.array(
        [
            RandomNumbers(seed, purpose, iteration=iteration, particle=particle).uniform(count)
            for particle in range(particles)
        ]
    ).reshape(particles, count)
