"""Eq. 4.1 and 4.2 for a hundred thousand designs at once.

The same numbers as `services.optimizer.jobs.preference` to twelve digits, in a twentieth of the
time; numpy's logarithm may differ from Python's in the last bit, so what is stored is never made
here.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from services.optimizer.jobs.columns import EvaluationColumns
from services.optimizer.jobs.preference import Preference
from services.optimizer.jobs.spec import Spec
from services.optimizer.jobs.tuning import JobSpec

Floats = NDArray[np.float64]

_BLOCK: Final = 4096
"""Rows at a time, so that what is computed stays in the processor's cache."""


def log_utilities(columns: EvaluationColumns, preference: Preference) -> Floats:
    """(r, K): logarithm of eq. 4.1, +inf where the walk failed or lacks a weighted objective."""
    result = np.empty(columns.statuses.shape)
    weighted = [
        (m, b, e)
        for m, (b, e) in enumerate(zip(preference.bias, preference.exponent, strict=True))
        if e > 0.0
    ]
    for first in range(0, len(columns), _BLOCK):
        rows = slice(first, first + _BLOCK)
        objectives = columns.objectives[rows]
        total = np.zeros(objectives.shape[:2])
        missing = columns.statuses[rows] != 0
        for m, bias, exponent in weighted:
            factor = bias + objectives[:, :, m]
            missing |= ~np.isfinite(factor)
            # A factor of zero or less cannot be improved upon, as in `preference`.
            with np.errstate(divide="ignore", invalid="ignore"):
                total += exponent * np.log(np.maximum(factor, 0.0))
        total[missing] = np.inf
        result[rows] = total
    return result


def fitness_of(log_utility: Floats) -> Floats:
    """(r, K) -> (r,): eq. 4.2, +inf where any case failed or a double ends."""
    failed = np.isposinf(log_utility).any(axis=1)
    with np.errstate(over="ignore", invalid="ignore"):
        fitness = np.exp(log_utility.mean(axis=1))
    return np.where(failed, np.inf, fitness)


def utilities(columns: EvaluationColumns, spec: Spec) -> Floats:
    """(r, K): worth of each design in each case by its job's own measure, +inf if it failed."""
    if isinstance(spec, JobSpec):
        logarithms = log_utilities(columns, spec.resolved_preference())
    else:
        logarithms = spec.judge(columns.objectives, columns.failed).log_utilities
    with np.errstate(over="ignore"):
        return np.asarray(np.exp(logarithms))
