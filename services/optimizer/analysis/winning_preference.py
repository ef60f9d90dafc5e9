"""The preference under which a design that somebody points at is the best of its job.

For given biases the logarithm of fitness is linear in the exponents (eq. 4.1, 4.2), so those under
which a design leads all others by the most are the solution of a linear program.
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
"""Exponents that are drawn for a design that cannot win."""

_DRAW: Final = 0xE4B0
"""Purpose of the random numbers."""

_AT_ONCE: Final = 4_000_000
"""Fitnesses that are held in memory at a time."""

_RIVALS: Final = 32
"""Designs that enter a linear program at once."""

_ROUNDS: Final = 200
"""Linear programs at most; each has more rivals than the one before."""

_DECIMALS: Final = 4
"""Of exponents, where rounding them costs no place."""

_LP: Final = 1e-10
"""Tolerance of linear programs; HiGHS has no smaller one."""

_TOLERANCE: Final = 1e-9
"""By how much a lead may miss that of the linear program, in the logarithm of fitness."""


@dataclass(frozen=True, slots=True)
class PreferenceFit:
    """How well a preference suits a design; all by ranking the job's designs under it.

    Attributes:
        preference: exponents sum to about 1.
        biases_of: whose biases these are: `job`, `A`, `B`, `C`.
        rank: of the design, from 1: how many are better, and itself.
        rival: row of the best of all designs that are not equal to it; None if there is none.
        fitness: of the design.
        margin: share by which the rival's fitness is worse; below 0 if it is better. With exponents
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
        """Whether no design is better."""
        return self.rank == 1


def preference_fits(
    columns: EvaluationColumns,
    row: int,
    own: Preference,
    *,
    worlds: TuningWorlds | None = None,
) -> tuple[PreferenceFit, ...]:
    """Find preferences that suit a design, one for each set of biases.

    With the job's own biases and with those of table 4.5, exponents are found by which the design
    leads by the most. Where it cannot win, they are those of its best rank among the linear
    program's, where it is least behind, and some that are drawn.

    In worlds the linear program is about an approximation: the aggregate of a product is not the
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
    """Biases with the names of those whose they are."""
    found: dict[tuple[float, ...], tuple[str, ...]] = {}
    for name, preference in {"job": own, **NAMED}.items():
        found[preference.bias] = (*found.get(preference.bias, ()), name)
    return found


def _exponents(vectors: Floats, row: int, others: Rows) -> Floats:
    """(M,) exponents under which a design wins by the most, or else has a good rank.

    vectors: (r, M) objectives with their biases, a row of +inf for a design that failed.
    """
    rivals = vectors[others[np.isfinite(vectors[others]).all(axis=1)]]
    if not len(rivals):
        return np.full(vectors.shape[1], 1.0 / vectors.shape[1])
    known = np.vstack([vectors[row], rivals])
    # An objective of 0, which has no logarithm, counts as the least that is more.
    least = np.where(known > 0.0, known, np.inf).min(axis=0)
    logarithms = np.log(np.maximum(known, np.where(np.isfinite(least), least, 1.0)))
    lead = logarithms[1:] - logarithms[0]
    exponent, margin = _widest_lead(lead)
    return exponent if margin > 0.0 else _best_rank(lead, exponent)


def _widest_lead(lead: Floats) -> tuple[Floats, float]:
    """Exponents that sum to 1 and the least lead under them, which is as great as can be.

    lead: (n, M) by how much the logarithm of each objective is greater than the design's.
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
    """As `_widest_lead`, of few designs."""
    require_room_for_scipy()
    from scipy.optimize import linprog  # noqa: PLC0415 - slow to import

    count, size = lead.shape
    # Variables: exponents, and the least lead, which is to be maximized.
    solved = linprog(
        np.append(np.zeros(size), -1.0),
        A_ub=np.column_stack([-lead, np.ones(count)]),
        b_ub=np.zeros(count),
        A_eq=np.append(np.ones(size), 0.0)[None],
        b_eq=[1.0],
        bounds=[(0.0, 1.0)] * size + [(None, None)],
        options={"primal_feasibility_tolerance": _LP, "dual_feasibility_tolerance": _LP},
    )
    found = np.asarray(solved.x, dtype=np.float64)
    return np.clip(found[:size], 0.0, 1.0) + 0.0, float(found[size])


def _best_rank(lead: Floats, exponent: Floats) -> Floats:
    """Of these exponents, each objective alone and some that are drawn, those of the best rank."""
    size = lead.shape[1]
    numbers = uniform(0, _DRAW, iteration=0, particle=0, count=_DRAWN * size)
    # Uniform among all that sum to 1.
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
    known = rival != row and bool(np.isfinite(fitness[rival]))
    with np.errstate(all="ignore"):
        ratio = float((fitness[rival] / fitness[row]) ** (1.0 / sum(preference.exponent)))
    return PreferenceFit(
        preference=preference,
        biases_of=names,
        rank=int(np.count_nonzero(fitness[others] < fitness[row])) + 1,
        rival=rival if known else None,
        fitness=float(fitness[row]),
        margin=ratio - 1.0 if known else None,
    )
