"""Random search: the baseline for every other method."""

from __future__ import annotations

from typing import Literal

from gaitswarm.services.optimizer.search.optimizer import SearchSettings
from gaitswarm.services.optimizer.search.random_stream import RandomNumbers
from gaitswarm.services.optimizer.search.replayed import Proposals
from gaitswarm.services.optimizer.search.space import Space


class RandomSearchSettings(SearchSettings):
    """Settings of random search."""

    name: Literal["random"] = "random"


def random_search(
    settings: RandomSearchSettings,
    space: Space,
    budget: int,  # noqa: ARG001 - the same for every budget
    random: RandomNumbers,
) -> Proposals:
    """Sample designs uniformly in the box, all integers and choices with equal probability."""
    while True:
        unit = random.uniform(settings.particles, space.dimension)
        yield space.evenly(unit)
