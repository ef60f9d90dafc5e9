"""Preferences under which a chosen design is the best of its job

For given biases the logarithm of fitness is linear in the exponents (eq. 4.1, 4.2), so the
exponents under which a design has the greatest lead solve a linear program.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.analysis.preference_winners import NAMED
from gaitswarm.services.optimizer.analysis.ranking import fitness_by
from gaitswarm.services.optimizer.analysis.utilities import objective_vectors
from gaitswarm.services.optimizer.jobs.columns import EvaluationColumns
from gaitswarm.services.optimizer.jobs.kinds.tuning_worlds import TuningWorlds
from gaitswarm.services.optimizer.jobs.preference import Preference
from gaitswarm.services.optimizer.search.random_stream import uniform
from gaitswarm.sim.memory import require_room_for_scipy

Floats = NDArray[np.float64]
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


@dataclass(frozen=True, slots=True)
class PreferenceFit:
    """Suitability of a preference for a design, by ranking the job's designs.

    Attributes:
        preference: exponents sum to about 1.
        biases_of: origin of the biases: `job`, `A`, `B`, `C`.
        rival: row of the best design that is not equal to it; None if there is none.
        margin: share by which the rival's fitness is worse; negative if it is better. For exponents
            that sum to 1.
    """

    preference: Preference
    biases_of: tuple[str, ...]
    rank: int
    rival: int | None
    fitness: float
    margin: float | None

    @property
    def wins(self) -> bool:
        return self.rank == 1


def preference_fits(
    columns: EvaluationColumns,
    row: int,
    own: Preference,
    *,
    worlds: TuningWorlds | None = None,
) -> tuple[PreferenceFit, ...]:
    """Find preferences that suit a design, one for each set of biases.

    For the job's own biases and those of table 4.5, the exponents maximize the design's lead. If it
    cannot win, they give its best rank among the linear program's solution, where it is least
    behind, and some samples.

    With worlds the linear program is an approximation: the aggregate of a product is not the
    product of the aggregates.
    """
    fits = []
    for bias, names in _biases(own).items():
        vectors = objective_vectors(columns, bias, worlds=worlds)
        others = np.flatnonzero((vectors != vectors[row]).any(axis=1))
        exponent = _exponents(vectors, row, others)
        exact, rounded = (
            _fit(
                row,
                others,
                fitness_by(columns, preference, worlds=worlds),
                preference,
                names,
            )
            for preference in (
                Preference(bias=bias, exponent=tuple(exponent.tolist())),
                Preference(bias=bias, exponent=tuple(np.round(exponent, _DECIMALS).tolist())),
            )
        )
        fits.append(rounded if rounded.rank <= exact.rank else exact)
    return tuple(sorted(fits, key=lambda fit: (fit.rank, -(fit.margin or 0.0))))


def _biases(own: Preference) -> Mapping[tuple[float, ...], tuple[str, ...]]:
    names_by_bias: dict[tuple[float, ...], tuple[str, ...]] = {}
    for name, preference in {"job": own, **NAMED}.items():
        names_by_bias[preference.bias] = (*names_by_bias.get(preference.bias, ()), name)
    return names_by_bias


def _exponents(vectors: Floats, row: int, others: Rows) -> Floats:
    """(M,) exponents under which a design has the greatest lead, or else a good rank.

    vectors: (r, M) objectives with their biases, +inf for a failed design.
    """
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
    """Return exponents that sum to 1 and maximize the least lead, and that lead.

    lead: (n, M) logarithms of the objectives relative to the design's.
    """
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
    numbers = uniform(0, _DRAW, iteration=0, particle=0, count=_DRAWN * size)
    # Uniform on the simplex.
    drawn = -np.log1p(-numbers.reshape(_DRAWN, size))
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


def _fit(
    row: int, others: Rows, fitness: Floats, preference: Preference, names: tuple[str, ...]
) -> PreferenceFit:
    """Rank a design by the fitness (r,) of all under a preference; others: rows not equal to it."""
    rival = int(others[fitness[others].argmin()]) if len(others) else row
    candidates = rival != row and bool(np.isfinite(fitness[rival]))
    with np.errstate(all="ignore"):
        ratio = float((fitness[rival] / fitness[row]) ** (1.0 / sum(preference.exponent)))
    return PreferenceFit(
        preference=preference,
        biases_of=names,
        rank=int(np.count_nonzero(fitness[others] < fitness[row])) + 1,
        rival=rival if candidates else None,
        fitness=float(fitness[row]),
        margin=ratio - 1.0 if candidates else None,
    )
