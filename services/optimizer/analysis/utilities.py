"""Bias-weighted product and geometric mean (eq. 3.8, 4.1, 4.2) of many designs at once.

The same numbers as `services.optimizer.jobs.preference` to twelve digits. numpy's logarithm may
differ from Python's in the last bit, so that nothing that is stored is computed here.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.jobs.columns import EvaluationColumns
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.kinds.tuning_worlds import TuningWorlds
from gaitswarm.services.optimizer.jobs.preference import HEIGHT_LOSS, Preference
from gaitswarm.services.optimizer.jobs.spec import Spec

Floats = NDArray[np.float64]

_BLOCK: Final = 4096
"""Rows at a time, so that what is computed stays in the processor's cache."""


def log_utilities(columns: EvaluationColumns, preference: Preference) -> Floats:
    """Logarithm of the bias-weighted product (eq. 3.8, 4.1).

    Returns:
        (r, K), +inf where the walk failed or lacks an objective with a weight.
    """
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
            column = objectives[:, :, m]
            factor = bias + (np.abs(column) if m == HEIGHT_LOSS else column)
            missing |= ~np.isfinite(factor)
            # A factor of zero or less cannot be improved upon, as in `preference`.
            with np.errstate(divide="ignore", invalid="ignore"):
                total += exponent * np.log(np.maximum(factor, 0.0))
        total[missing] = np.inf
        result[rows] = total
    return result


def fitness_of(log_utility: Floats) -> Floats:
    """Geometric mean over scenarios (eq. 4.2).

    Args:
        log_utility: (r, K) logarithms of utilities, +inf where a walk failed.

    Returns:
        (r,) fitness, +inf where any walk failed or a double ends.
    """
    failed = np.isposinf(log_utility).any(axis=1)
    with np.errstate(over="ignore", invalid="ignore"):
        fitness = np.exp(log_utility.mean(axis=1))
    return np.where(failed, np.inf, fitness)


def objective_vectors(
    columns: EvaluationColumns,
    bias: Sequence[float] = (0.0,) * 5,
    *,
    worlds: TuningWorlds | None = None,
) -> Floats:
    """What each design comes to in each objective, over all scenarios.

    Number m of a design is its fitness under a preference that weighs objective m alone. Without
    worlds, fitness under any preference with these biases is the product of these numbers, each to
    the power of its exponent.

    Returns:
        (r, M), each in its objective's unit, minimized; a row is +inf throughout where a walk of
        the design failed or lacks an objective.
    """
    result = np.empty((len(columns), len(bias)))
    for m, exponent in enumerate(np.eye(len(bias)).tolist()):
        alone = Preference(bias=tuple(bias), exponent=tuple(exponent))
        logarithms = log_utilities(columns, alone)
        result[:, m] = fitness_of(logarithms if worlds is None else worlds.aggregated(logarithms))
    result[~np.isfinite(result).all(axis=1)] = np.inf
    return result


def utilities(columns: EvaluationColumns, spec: Spec) -> Floats:
    """What each design is worth in each case by its job's own measure.

    Returns:
        (r, K) utilities, minimized, +inf where a case failed.
    """
    if isinstance(spec, JobSpec):
        logarithms = log_utilities(columns, spec.resolved_preference())
    else:
        logarithms = spec.judge(columns.objectives, columns.failed).log_utilities
    with np.errstate(over="ignore"):
        return np.asarray(np.exp(logarithms))
