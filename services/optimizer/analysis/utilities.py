"""Vectorized bias-weighted product and geometric mean (eq. 3.8, 4.1, 4.2)

The values agree with `services.optimizer.jobs.preference` to twelve digits. numpy's logarithm may
differ from Python's in the last bit, so stored values are not computed here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.errors import Conflict, InvalidRequest
from gaitswarm.services.optimizer.jobs.constraints import violations
from gaitswarm.services.optimizer.jobs.documents import AnySpec
from gaitswarm.services.optimizer.jobs.iteration import EvaluationColumns
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.kinds.tuning_worlds import PLAIN, Aggregation
from gaitswarm.services.optimizer.jobs.preference import HEIGHT_LOSS, PREFERENCES, Preference
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.sim.arrays import Floats

PreferenceOwner = Literal["job", "A", "B", "C"]

NAMED: Final[Mapping[PreferenceOwner, Preference]] = {
    "A": PREFERENCES["A"],
    "B": PREFERENCES["B"],
    "C": PREFERENCES["C"],
}
"""Preferences of table 4.5."""


_BLOCK: Final = 4096
"""Rows at a time, for the processor's cache."""


def tuning_spec(job_id: str, spec: AnySpec, has: str) -> JobSpec:
    """Return the spec of a job that tunes a drive; `has` says what only such a job has."""
    if not isinstance(spec, JobSpec):
        raise InvalidRequest(
            f"job {job_id} is of kind {spec.kind}; only a job that tunes a drive has {has}",
            field="job_id",
        )
    return spec


def require_success(job_id: str, values: Floats) -> None:
    """Check that any of a job's designs has finite values (r, n)."""
    if not np.isfinite(values).all(axis=1).any():
        raise Conflict(
            f"job {job_id} has no design yet that succeeds in all scenarios and keeps the"
            " constraints, if any"
        )


def infeasible_rows(columns: EvaluationColumns, spec: JobSpec) -> NDArray[np.bool_]:
    """Return which designs (r,) violate the constraints of a spec; failed ones do, too."""
    limits, result = spec.limits(), np.zeros(len(columns), dtype=np.bool_)
    for first in range(0, len(columns) if limits else 0, _BLOCK):
        rows = slice(first, first + _BLOCK)
        result[rows] = violations(limits, columns.objectives[rows]) > 0.0
    return result


def log_utilities(columns: EvaluationColumns, preference: Preference) -> Floats:
    """Return (r, K) logarithms of the bias-weighted product (eq. 3.8, 4.1)."""
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
            # A factor of zero or less cannot be improved, as in `preference`.
            with np.errstate(divide="ignore", invalid="ignore"):
                total += exponent * np.log(np.maximum(factor, 0.0))
        total[missing] = np.inf
        result[rows] = total
    return result


def fitness_by(
    columns: EvaluationColumns, preference: Preference, *, aggregation: Aggregation = PLAIN
) -> Floats:
    """Return the (r,) fitness by a preference (eq. 4.2), +inf after failure or overflow."""
    logarithms = aggregation.aggregated(log_utilities(columns, preference))
    failed = np.isposinf(logarithms).any(axis=1)
    with np.errstate(over="ignore", invalid="ignore"):
        return np.where(failed, np.inf, np.exp(logarithms.mean(axis=1)))


def objective_vectors(
    columns: EvaluationColumns,
    bias: Sequence[float] = (0.0,) * 5,
    *,
    aggregation: Aggregation = PLAIN,
) -> Floats:
    """Return each design's (r, M) objectives over all scenarios, minimized."""
    result = np.empty((len(columns), len(bias)))
    for m, exponent in enumerate(np.eye(len(bias)).tolist()):
        alone = Preference(bias=tuple(bias), exponent=tuple(exponent))
        result[:, m] = fitness_by(columns, alone, aggregation=aggregation)
    result[~np.isfinite(result).all(axis=1)] = np.inf
    return result


def utilities(columns: EvaluationColumns, spec: Spec) -> Floats:
    """Return the (r, K) utilities by the job's own measure, +inf after a failure."""
    if isinstance(spec, JobSpec):
        logarithms = log_utilities(columns, spec.resolved_preference())
    else:
        logarithms = spec.judge(columns.objectives, columns.failed).log_utilities
    with np.errstate(over="ignore"):
        return np.asarray(np.exp(logarithms))
