"""How far designs of a calibration are from its targets."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.jobs.preference import (
    PREFERENCES,
    PreferenceName,
    figure_of_merit,
    judge,
)
from gaitswarm.sim.calibration.targets import QUANTITIES, Target
from gaitswarm.sim.calibration.walk import RESULTS

Floats = NDArray[np.float64]

_COLUMNS: Final = {result.name: column for column, result in enumerate(RESULTS)}


def reached(
    target: Target,
    objectives: Floats,
    failed: NDArray[np.bool_],
    of_walk: Mapping[str, Sequence[int]],
) -> Floats:
    """What designs come to where a target is set."""

    def of(walk: str) -> Floats:
        cases = list(of_walk[walk])
        values = _of_all(target.quantity, objectives[:, cases], failed[:, cases])
        values[failed[:, cases].any(axis=1)] = np.nan
        return values

    values = of(target.walk)
    if target.relative_to is None:
        return values
    with np.errstate(divide="ignore", invalid="ignore"):
        return values / of(target.relative_to)


def _of_all(quantity: str, rows: Floats, bad: NDArray[np.bool_]) -> Floats:
    """(n, k, m) results in a walk's k scenarios -> (n,) values, any where it failed."""
    if quantity == "F":
        preference = PREFERENCES["chapter-3"]
        fitness = judge(rows, bad, preference).fitness.tolist()
        found = [figure_of_merit(value, preference) for value in fitness]
        return np.array([math.nan if value is None else value for value in found])
    if quantity.startswith("fitness:"):
        name: PreferenceName = quantity.removeprefix("fitness:")  # type: ignore[assignment]
        return judge(rows, bad, PREFERENCES[name]).fitness
    return rows[:, 0, _COLUMNS[quantity]].copy()


def difference(target: Target, value: float) -> float:
    """How far off a value is, in tolerances."""
    if not math.isfinite(value):
        return math.inf
    if not QUANTITIES[target.quantity].positive:
        return (value - target.value) / target.tolerance
    if value <= 0.0:
        return math.inf
    return math.log(value / target.value) / math.log1p(target.tolerance)


def root_mean_square(differences: Floats) -> Floats:
    """Root mean square of each row."""
    rows = [[difference * difference for difference in row] for row in differences.tolist()]
    return np.array([math.sqrt(math.fsum(row) / len(row)) if row else 0.0 for row in rows])
