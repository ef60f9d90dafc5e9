"""Fitness and utilities: bias-weighted product and geometric mean (eq. 3.8, 4.1, 4.2)"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Annotated, Final, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, Tag, model_validator

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.input import NAME, OWN, Data, alternatives
from gaitswarm.sim.outcome import OBJECTIVE_NAMES, OBJECTIVES, Outcome, Status

_PIECE: Final = 4096
"""Values converted at a time, so that other Python threads can run in between."""


class Judgement(NamedTuple):
    """Fitness and utilities of n designs in K cases; all minimized."""

    fitness: Floats  # (n,), +inf if a case failed
    log_utilities: Floats  # (n, K) logarithms of the utilities, +inf if the case failed

    @property
    def utilities(self) -> Floats:
        """(n, K), +inf if the case failed or on overflow."""
        flat = self.log_utilities.reshape(-1)
        utilities = _by_pieces(len(flat), lambda piece: map(exponential, flat[piece].tolist()))
        return utilities.reshape(self.log_utilities.shape)


def _by_pieces(count: int, compute: Callable[[slice], Iterable[float]]) -> Floats:
    """Compute (count,) values piece by piece."""
    values = np.empty(count)
    for begin in range(0, count, _PIECE):
        piece = slice(begin, begin + _PIECE)
        values[piece] = list(compute(piece))
    return values


def exponential(logarithm: float) -> float:
    """Python's exponential function: numpy's differs in the last bit between processors."""
    try:
        return math.exp(logarithm)
    except OverflowError:
        return math.inf


def by_design(outcomes: Sequence[Outcome]) -> tuple[Floats, NDArray[np.bool_]]:
    """Convert outcomes by case to (n, K, m) objectives and (n, K) failures."""
    objectives = np.stack([outcome.objectives for outcome in outcomes], axis=1)
    failed = np.stack([outcome.statuses != Status.OK for outcome in outcomes], axis=1)
    return objectives, failed


WEIGHED: Final = OBJECTIVES[:5]
"""f1 to f5 of table 4.1, weighed by the preferences of chapter 4; f6 may be negative."""

WEIGHED_NAMES: Final = OBJECTIVE_NAMES[:5]

HEIGHT_LOSS: Final = OBJECTIVE_NAMES.index("height_loss")
"""Index of f6; preferences use its absolute value."""

# At an exponent of ten, five factors of a million still fit a double; beyond, a utility is
# infinite, as for a failed simulation.
Bias = Annotated[float, Field(ge=0.0, le=1e6)]
Exponent = Annotated[float, Field(ge=0.0, le=10.0)]


class Preference(Data):
    """Biases b and exponents e of the objectives, in the order f1..f6 of table 4.1.

    A scenario's utility, minimized, is prod_m (b_m + f_m) ** e_m: with five entries the
    bias-weighted product of chapter 4 (eq. 4.1), with six that of chapter 3 (eq. 3.8). The signed
    height loss f6 enters by its absolute value, as in eq. 3.1: rising is no better than sinking.
    """

    bias: tuple[Bias, ...] = Field(
        min_length=5,
        max_length=6,
        description="b_m >= 0, in the unit of f_m: "
        + ", ".join(OBJECTIVE_NAMES)
        + "; five, or six to include the last.",
        examples=[(0.9, 0.8, 0.24, 0.5, 0.8)],
    )
    exponent: tuple[Exponent, ...] = Field(
        min_length=5,
        max_length=6,
        description="e_m >= 0: weight of each objective, as many as biases; not all of them zero.",
        examples=[(0.1, 0.7, 0.3, 0.3, 0.1)],
    )

    @model_validator(mode="after")
    def _ranks_designs(self) -> Preference:
        if not any(self.exponent):
            raise ValueError("all exponents are zero, so every design would have the same fitness")
        if len(self.bias) != len(self.exponent):
            raise ValueError(
                f"{len(self.bias)} biases and {len(self.exponent)} exponents; give one of each"
                " per objective"
            )
        return self


PreferenceName = Literal["A", "B", "C", "chapter-3"]

PreferenceChoice = Annotated[
    Annotated[PreferenceName, Tag(NAME)] | Annotated[Preference, Tag(OWN)],
    alternatives("must be 'A', 'B', 'C' or 'chapter-3', or an object with bias and exponent"),
]

PREFERENCES: Final[dict[PreferenceName, Preference]] = {
    "A": Preference(bias=(0.9, 0.8, 0.24, 0.5, 0.8), exponent=(0.1, 0.7, 0.3, 0.3, 0.1)),
    "B": Preference(bias=(0.4, 0.7, 0.3, 0.4, 1.0), exponent=(0.2, 0.6, 0.8, 0.1, 0.2)),
    "C": Preference(bias=(0.0, 0.0, 0.0, 0.0, 0.0), exponent=(1.0, 1.0, 1.0, 1.0, 1.0)),
    "chapter-3": Preference(
        bias=(0.0, 0.0, 0.0, 0.0, 0.0, 0.03), exponent=(1.0, 1.0, 1.0, 1.0, 2.0, 1.0)
    ),
}
"""A, B, C of table 4.5, and chapter 3's, whose utility is 1e5 / F with F of eq. 3.1."""

_NUMERATOR: Final = 1e5


def figure_of_merit(fitness: float, preference: Preference) -> float | None:
    """F of eq. 3.1, which chapter 3 maximizes: 1e5 V^2 / (E F_GEAR F_ACC F_ANGACC (|Z| + 0.03))."""
    if preference != PREFERENCES["chapter-3"] or not 0.0 < fitness < math.inf:
        return None
    value = _NUMERATOR / fitness
    return value if math.isfinite(value) else None


def judge(objectives: Floats, failed: NDArray[np.bool_], preference: Preference) -> Judgement:
    """Judge designs by the bias-weighted product and the geometric mean (eq. 4.1, 4.2)."""
    logarithms = log_utilities(objectives, failed, preference)
    return Judgement(geometric_mean(logarithms), logarithms)


def log_utilities(objectives: Floats, failed: NDArray[np.bool_], preference: Preference) -> Floats:
    """Logarithm of the bias-weighted product (eq. 3.8, 4.1)."""
    flat, lost = objectives.reshape(-1, objectives.shape[-1]), failed.reshape(-1)

    def compute(piece: slice) -> Iterator[float]:
        for row, bad in zip(flat[piece].tolist(), lost[piece].tolist(), strict=True):
            yield math.inf if bad else _log_product(row, preference)

    return _by_pieces(len(flat), compute).reshape(failed.shape)


def geometric_mean(log_utility: Floats) -> Floats:
    """Geometric mean over scenarios (eq. 4.2)."""

    def compute(piece: slice) -> Iterator[float]:
        for row in log_utility[piece].tolist():
            yield math.inf if math.inf in row else exponential(math.fsum(row) / len(row))

    return _by_pieces(len(log_utility), compute)


def objective_vectors(
    objectives: Floats,
    failed: NDArray[np.bool_],
    bias: Sequence[float] = (0.0,) * 5,
    aggregate: Callable[[Floats], Floats] = lambda logarithms: logarithms,
) -> Floats:
    """Return each design's objectives over all scenarios, (n, M), for Pareto fronts.

    Objective m is the fitness under a preference that weighs it alone. Under any preference with
    these biases, fitness is the product of the objectives, each raised to its exponent (eq. 4.1,
    4.2); so for all exponents the best design is non-dominated.

    aggregate: converts (n, K) logarithms of utilities to those of scenarios. Worlds aggregate each
    objective separately: the worst world of one may be the best of another.
    """
    columns = []
    for exponent in np.eye(len(bias)).tolist():
        alone = Preference(bias=tuple(bias), exponent=tuple(exponent))
        columns.append(geometric_mean(aggregate(log_utilities(objectives, failed, alone))))
    vectors = np.stack(columns, axis=1)
    vectors[~np.isfinite(vectors).all(axis=1)] = math.inf
    return vectors


def _log_product(row: list[float], preference: Preference) -> float:
    terms = []
    for m, (b, e) in enumerate(zip(preference.bias, preference.exponent, strict=True)):
        if e == 0.0:
            continue
        factor = b + (abs(row[m]) if m == HEIGHT_LOSS else row[m])
        if not math.isfinite(factor):
            return math.inf
        # A factor of zero or less cannot be improved.
        terms.append(e * math.log(factor) if factor > 0.0 else -math.inf)
    return math.fsum(terms)
