"""Chapter 3's fitness of one walk, maximized (thesis eq. 3.1, 3.8), to compare with its tables."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray


def single_scenario_fitness(objectives: NDArray[np.float64]) -> NDArray[np.float64]:
    """Eq. 3.1: F = 1e5 V^2 / (E F_GEAR F_ACC F_ANGACC (|Z| + 0.03)).

    objectives: (..., 6), columns as in `sim.outcome.OBJECTIVES`. Returns (...), NaN where an
    objective is NaN.
    """
    torque, acceleration, angular, energy, reciprocal_speed, height_loss = np.moveaxis(
        objectives, -1, 0
    )
    drive = energy * torque * acceleration * angular
    fitness: NDArray[np.float64] = 1e5 / (
        reciprocal_speed**2 * drive * (np.abs(height_loss) + 0.03)
    )
    return fitness


def general_fitness(
    values: Sequence[float], bias: Sequence[float], exponent: Sequence[float]
) -> float:
    """Eq. 3.8: F_g = prod_m (b_m + f_m)^e_m, of positive factors; exponents may be negative."""
    terms = zip(values, bias, exponent, strict=True)
    return math.exp(math.fsum(e * math.log(b + f) for f, b, e in terms))
