"""Runs of search methods on functions of a formula, for their tests."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from gaitswarm.plugins import Axis, Space, create_search
from gaitswarm_research.methods.local_search import Point, Walk

Floats = NDArray[np.float64]

Formula = Callable[[Floats], Floats]
"""(n, d) designs or unit positions -> (n,) fitness."""

MIXED = Space(
    [
        Axis(-1.0, 2.0),
        Axis(0.0, 10.0, "integer"),
        Axis(0.0, 3.0, "categorical"),
        Axis(-5.0, 5.0),
        Axis(0.0, 1000.0, "integer"),
    ]
)
"""Two continuous variables, an integer of few values and one of many, a choice."""


def mixed_bowl(designs: Floats) -> Floats:
    """Least, 0, at x = (0.5, 7, choice 2, -1.2, 640); each other choice costs 0.3."""
    x = designs
    bowl = (x[:, 0] - 0.5) ** 2 + 0.05 * (x[:, 1] - 7.0) ** 2 + 0.1 * (x[:, 3] + 1.2) ** 2
    return bowl + 0.3 * (x[:, 2] != 2.0) + np.abs(x[:, 4] - 640.0) / 1000.0


def designs_asked(
    name: str,
    space: Space,
    formula: Formula,
    budget: int,
    seed: int = 1,
    **settings: object,
) -> list[Floats]:
    """The designs of each ask of a run, in order."""
    search = create_search({"name": name, **settings}, space, budget, seed)
    asked = []
    while search.evaluations < budget:
        designs = space.designs(search.ask(budget - search.evaluations))
        asked.append(designs)
        search.tell(formula(designs))
    return asked


def calls_to(target: float, asked: list[Floats], formula: Formula) -> int:
    """Evaluations until a target is reached, or one more than there were."""
    values = formula(np.vstack(asked))
    reached = np.flatnonzero(values <= target)
    return int(reached[0]) + 1 if len(reached) else len(values) + 1


def walked(walk: Walk, formula: Formula) -> tuple[Point, list[Floats]]:
    """Where a local search ends, and what it proposed."""
    proposals = [next(walk)]
    while True:
        try:
            proposals.append(walk.send(formula(proposals[-1])))
        except StopIteration as stop:
            return stop.value, proposals
