"""Random search: what every other method has to beat."""

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
    """Search by designs that are uniform in the box, integers and choices as likely as each other.

    Args:
        settings: Of the method.
        space: The box that is searched.
        budget: Evaluations of the planned run.
        random: Its random numbers.

    Yields:
        (particles, d) positions.
    """
    while True:
        unit = random.uniform(settings.particles, space.dimension)
        yield space.evenly(unit)
