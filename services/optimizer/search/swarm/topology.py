"""Who informs whom in a swarm."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Links = tuple[NDArray[np.intp], NDArray[np.intp]]
"""(m,) particles that inform, (m,) those that they inform. Each one informs itself."""


def ring(particles: int) -> Links:
    """Links of a swarm in which each particle informs both its neighbours.

    The "lbest" swarm of Bratton and Kennedy (2007). The last particle is a neighbour of the first.
    """
    every = np.arange(particles)
    informed = [every, (every + 1) % particles, (every - 1) % particles]
    return np.tile(every, 3), np.concatenate(informed)


def random_informants(draws: NDArray[np.float64]) -> Links:
    """Links of a swarm in which each particle informs some that are drawn.

    The same one may be drawn twice, so how many inform a particle varies: the topology of the
    standard swarm of 2011 (Clerc 2012).
    """
    particles, k = draws.shape
    every = np.arange(particles)
    informed = np.floor(draws * particles).astype(np.intp)
    return np.concatenate([every, np.repeat(every, k)]), np.concatenate([every, informed.ravel()])


def leaders(links: Links, fitness: NDArray[np.float64]) -> NDArray[np.intp]:
    """The best of those that inform each particle."""
    informs, informed = links
    worst_first = np.argsort(-fitness[informs], kind="stable")
    best = np.empty(len(fitness), dtype=np.intp)
    # Where an index is assigned to several times, the last value stays.
    best[informed[worst_first]] = informs[worst_first]
    return best
