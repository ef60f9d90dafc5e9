"""The path of a search, gone along again: what it was asked and told brings it where it was."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.jobs.spec import Spec, create_optimizer
from gaitswarm.services.optimizer.search.optimizer import Optimizer

Floats = NDArray[np.float64]


def retraced(
    spec: Spec,
    budgets: Sequence[int],
    asked: Sequence[Floats],
    told: Sequence[Floats],
    *,
    until: float = math.inf,
) -> Optimizer:
    """Take a search along a path, up to its last ask, which is not answered.

    Args:
        asked: (n, d) positions of every iteration, at least one.
        until: When `time.monotonic` is past this, it is given up [s].
    """
    searches = [create_optimizer(spec.model_copy(update={"iterations": n})) for n in budgets]
    search = searches.pop(0)
    for index, positions in enumerate(asked):
        if index:
            search.tell(told[index - 1])
        if time.monotonic() > until:
            raise TimeoutError(f"it came to iteration {index} of {len(asked)}")
        # Of some methods as long as all that they were told.
        state = search.dump() if searches else {}
        while not _asks_for(search, positions):
            if not searches:
                raise ValueError(f"its search would ask for other designs in iteration {index}")
            search = searches.pop(0)
            search.load(state)
    return search


def _asks_for(search: Optimizer, positions: Floats) -> bool:
    found = search.ask(len(positions))
    return found.shape == positions.shape and found.tobytes() == positions.tobytes()
