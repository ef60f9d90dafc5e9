"""A problem whose minimum is known, and small tournaments."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.jobs.documents import SPECS
from gaitswarm.services.optimizer.jobs.kinds.tournament import TournamentSpec
from gaitswarm.services.optimizer.search.space import Axis, Space
from gaitswarm.services.optimizer.tournament.race import Evaluate, Search

Floats = NDArray[np.float64]

MIXED: Final = Space(
    [Axis(-2.0, 3.0), Axis(0.0, 6.0, "integer"), Axis(0.0, 2.0, "categorical"), Axis(100.0, 900.0)]
)


class Bowl:
    """A sum of squares with its minimum of 0 at 0.25 of every axis; some designs cannot be judged.

    What a search is told is off by `bias`.
    """

    def __init__(self, space: Space = MIXED, *, bias: float = 0.0) -> None:
        self.space = space
        self.asked: list[Floats] = []
        self._bias = bias

    def fitness(self, designs: Floats, *, seed: int, first: int) -> Floats:
        assert first == sum(map(len, self.asked))
        self.asked.append(designs)
        return self.final(designs, np.zeros(len(designs))) + self._bias

    def final(self, designs: Floats, fitness: Floats) -> Floats:
        unit = self.space.to_unit(designs)
        quarter = (self.space.low + 0.25 * self.space.span).reshape(1, -1)
        aim = self.space.to_unit(self.space.designs(quarter))
        return np.where(unit[:, 0] > 0.97, np.inf, np.square(unit - aim).sum(axis=1))


def script(*batches: list[list[float]]) -> Search:
    """A search that asks for these positions, whatever it is told."""

    def search(space: Space, budget: int, seed: int, evaluate: Evaluate) -> None:
        for batch in batches:
            evaluate(np.array(batch))

    return search


def tournament(**changes: Any) -> TournamentSpec:
    """Two runs of random search on two functions."""
    spec = SPECS.validate_python(
        {
            "kind": "tournament",
            "name": "small",
            "method": "random",
            "problems": [{"function": "D4C1R0I1"}, {"function": "D7C0R1I1"}],
            "evaluations": 40,
            "iterations": 2,
            **changes,
        }
    )
    assert isinstance(spec, TournamentSpec)
    return spec
