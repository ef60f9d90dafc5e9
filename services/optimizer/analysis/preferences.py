"""Preferences under which a chosen design wins

For given biases the logarithm of fitness is linear in the exponents (eq. 4.1, 4.2), so the
exponents under which a design has the greatest lead solve a linear program.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gaitswarm.services.optimizer.analysis.front import TradeOffDesignView, design_fields
from gaitswarm.services.optimizer.analysis.utilities import (
    NAMED,
    PreferenceOwner,
    fitness_by,
    objective_vectors,
)
from gaitswarm.services.optimizer.jobs.iteration import EvaluationColumns
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.kinds.tuning_worlds import Aggregation
from gaitswarm.services.optimizer.jobs.preference import Preference
from gaitswarm.services.optimizer.search.random_stream import RandomNumbers
from gaitswarm.services.optimizer.views import Finite, View
from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.memory import require_room_for_scipy

Rows = NDArray[np.intp]

_DRAWN: Final = 512
"""Sampled exponents for a design that cannot win."""

_DRAW: Final = 0xE4B0

_AT_ONCE: Final = 4_000_000
"""Fitness values held in memory at a time."""

_RIVALS: Final = 32
"""Designs added to a linear program at a time."""

_ROUNDS: Final = 200
"""Limit on the number of linear programs; each has more rivals than the previous one."""

_DECIMALS: Final = 4
"""Of exponents, if rounding does not worsen the rank."""

_LP: Final = 1e-10
"""Tolerance of linear programs; the smallest that HiGHS supports."""

_TOLERANCE: Final = 1e-9
"""Tolerance of a lead relative to the linear program's, in the logarithm of fitness."""


class PreferenceFitView(View):
    """Rank of a design under a preference, among all designs of the job."""

    preference: Preference = Field(description="Its exponents sum to about 1.")
    biases_of: list[PreferenceOwner] = Field(description="Whose biases these are.")
    rank: int = Field(description="Of the design, from 1; equal designs share it.")
    fitness: float = Field(description="Of the design under it [1].", examples=[4.81])
    margin: Finite = Field(
        description="Share by which the rival's fitness is worse, negative if it is better [1], for"
        " exponents that sum to 1; null without a rival."
    )
    rival: TradeOffDesignView | None = Field(description="The best of all other designs under it.")


class PreferenceForView(View):
    """Preferences under which a design wins its job, without simulation."""

    chosen: TradeOffDesignView = Field(description="The design.")
    on_front: bool = Field(description="Whether no other design of the job dominates it.")
    wins: bool = Field(description="Whether no design is better under the best of the fits.")
    certain: bool = Field(
        description="Whether it wins, or it is proven that no exponents with these biases let it"
        " win; not proven for a job that judges in worlds or by the worst scenario."
    )
    fits: list[PreferenceFitView] = Field(
        description="One for each set of biases, the job's own and those of A, B and C, the best"
        " first: the exponents of the widest margin, or else of the best rank."
    )


def preference_for(columns: EvaluationColumns, row: int, spec: JobSpec) -> PreferenceForView:
    """Find preferences that suit a design, one for each set of biases.

    For the job's own biases and those of table 4.5, the exponents maximize the design's lead. If it
    cannot win, they give its best rank among the linear program's solution, where it is least
    behind, and some samples.

    Over worlds, and for the worst scenario, the linear program is an approximation: the aggregate
    of a product is not the product of the aggregates.
    """
    plain = objective_vectors(columns, aggregation=spec.aggregation)

    def design(index: int) -> TradeOffDesignView:
        return TradeOffDesignView(**design_fields(columns, plain, spec, index))

    preferences: dict[PreferenceOwner, Preference] = {"job": spec.resolved_preference(), **NAMED}
    owners: dict[tuple[float, ...], list[PreferenceOwner]] = {}
    for name, preference in preferences.items():
        owners.setdefault(preference.bias, []).append(name)
    fits = []
    for bias, names in owners.items():
        vectors = objective_vectors(columns, bias, aggregation=spec.aggregation)
        others = np.flatnonzero((vectors != vectors[row]).any(axis=1))
        exponent = _exponents(vectors, row, others)
        exact, rounded = (
            _fit(columns, row, others, Preference(bias=bias, exponent=tuple(e)), spec.aggregation)
            for e in (exponent.tolist(), np.round(exponent, _DECIMALS).tolist())
        )
        fits.append((names, rounded if rounded.rank <= exact.rank else exact))
    fits.sort(key=lambda fit: (fit[1].rank, -(fit[1].margin or 0.0)))
    better = (plain <= plain[row]).all(axis=1) & (plain < plain[row]).any(axis=1)
    wins = fits[0][1].rank == 1
    return PreferenceForView(
        chosen=design(row),
        on_front=not better.any(),
        wins=wins,
        certain=wins or (spec.worlds is None and spec.scenario_aggregate == "mean"),
        fits=[
            PreferenceFitView(
                preference=fit.preference,
                biases_of=names,
                rank=fit.rank,
                fitness=fit.fitness,
                margin=fit.margin,
                rival=None if fit.rival is None else design(fit.rival),
            )
            for names, fit in fits
        ],
    )


class _Fit(NamedTuple):
    """Rank of a design under a preference; rival: the best row that is not equal to it."""

    preference: Preference
    rank: int
    fitness: float
    rival: int | None
    margin: float | None


def _fit(
    columns: EvaluationColumns,
    row: int,
    others: Rows,
    preference: Preference,
    aggregation: Aggregation | None,
) -> _Fit:
    """Rank a design by a preference; others: rows not equal to it."""
    fitness = fitness_by(columns, preference, aggregation=aggregation)
    rank = int(np.count_nonzero(fitness[others] < fitness[row])) + 1
    rival = int(others[fitness[others].argmin()]) if len(others) else row
    if rival == row or not np.isfinite(fitness[rival]):
        return _Fit(preference, rank, float(fitness[row]), None, None)
    with np.errstate(all="ignore"):
        ratio = float((fitness[rival] / fitness[row]) ** (1.0 / sum(preference.exponent)))
    return _Fit(preference, rank, float(fitness[row]), rival, ratio - 1.0)


def _exponents(vectors: Floats, row: int, others: Rows) -> Floats:
    """(M,) exponents of the greatest lead or a good rank; (r, M) objectives with their biases."""
    rivals = vectors[others[np.isfinite(vectors[others]).all(axis=1)]]
    if not len(rivals):
        return np.full(vectors.shape[1], 1.0 / vectors.shape[1])
    candidates = np.vstack([vectors[row], rivals])
    # An objective of 0, which has no logarithm, counts as the least positive one.
    least = np.where(candidates > 0.0, candidates, np.inf).min(axis=0)
    logarithms = np.log(np.maximum(candidates, np.where(np.isfinite(least), least, 1.0)))
    lead = logarithms[1:] - logarithms[0]
    exponent, margin = _widest_lead(lead)
    return exponent if margin > 0.0 else _best_rank(lead, exponent)


def _widest_lead(lead: Floats) -> tuple[Floats, float]:
    """Return exponents that sum to 1 and maximize the least lead over (n, M) relative logs."""
    rivals = lead.argmin(axis=0)
    exponent, promised = _program(lead[rivals])
    for _ in range(_ROUNDS):
        leads = lead @ exponent
        if leads.min() >= promised - _TOLERANCE:
            break
        least = np.argpartition(leads, min(_RIVALS, len(leads)) - 1)[:_RIVALS]
        rivals = np.union1d(rivals, least)
        exponent, promised = _program(lead[rivals])
    return exponent, float((lead @ exponent).min())


def _program(lead: Floats) -> tuple[Floats, float]:
    """As `_widest_lead`, for few designs."""
    require_room_for_scipy()
    from scipy.optimize import linprog  # noqa: PLC0415 - slow to import

    count, size = lead.shape
    # Variables: exponents, and the least lead, which is maximized.
    solved = linprog(
        np.append(np.zeros(size), -1.0),
        A_ub=np.column_stack([-lead, np.ones(count)]),
        b_ub=np.zeros(count),
        A_eq=np.append(np.ones(size), 0.0)[None],
        b_eq=[1.0],
        bounds=[(0.0, 1.0)] * size + [(None, None)],
        options={"primal_feasibility_tolerance": _LP, "dual_feasibility_tolerance": _LP},
    )
    solution = np.asarray(solved.x, dtype=np.float64)
    return np.clip(solution[:size], 0.0, 1.0) + 0.0, float(solution[size])


def _best_rank(lead: Floats, exponent: Floats) -> Floats:
    """The best-ranking of these exponents, each objective alone, and samples."""
    size = lead.shape[1]
    # Uniform on the simplex.
    drawn = -np.log1p(-RandomNumbers(0, _DRAW).uniform(_DRAWN, size))
    drawn /= drawn.sum(axis=1, keepdims=True)
    candidates = np.vstack([exponent, np.eye(size), drawn])
    step = max(1, _AT_ONCE // len(lead))
    better = np.concatenate(
        [
            np.count_nonzero(lead @ candidates[first : first + step].T < 0.0, axis=0)
            for first in range(0, len(candidates), step)
        ]
    )
    return np.asarray(candidates[better.argmin()])
