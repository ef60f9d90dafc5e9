"""Winners of a job's history under many preferences, to choose the most robust of them

The thesis proposes this as future research (4.5): a preference whose optimum is robust.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.analysis.ranking import fitness_by
from gaitswarm.services.optimizer.analysis.robustness_index import NORMALISED_OBJECTIVES
from gaitswarm.services.optimizer.jobs.columns import EvaluationColumns
from gaitswarm.services.optimizer.jobs.kinds.tuning_worlds import TuningWorlds
from gaitswarm.services.optimizer.jobs.preference import PREFERENCES, Preference
from gaitswarm.services.optimizer.search.random_stream import swarm_uniform

Floats = NDArray[np.float64]

NAMED: Final[Mapping[str, Preference]] = {name: PREFERENCES[name] for name in ("A", "B", "C")}
"""Preferences of table 4.5."""

_DRAW: Final = 0xB1A5


@dataclass(frozen=True, slots=True, eq=False)
class Winner:
    """A design that is the best of its job under some preferences.

    Attributes:
        preference: one under which it wins: of table 4.5 if possible, else that with the greatest
            lead.
        named: names of the preferences of table 4.5 under which it wins.
        share: of the drawn preferences under which it wins [1].
    """

    row: int
    preference: Preference
    named: tuple[str, ...]
    share: float


def drawn_preferences(columns: EvaluationColumns, *, count: int, seed: int) -> list[Preference]:
    """Draw preferences of five objectives.

    Exponents are uniform in 0 to 1, as in table 4.5; only their ratios affect a ranking. Biases are
    uniform between 0 and the median of their objective in the job: a bias as large as its objective
    halves the effect of a relative change.
    """
    size = len(NORMALISED_OBJECTIVES)
    values = columns.objectives[columns.statuses == 0][:, :size]
    scale = np.median(values[np.isfinite(values).all(axis=1)], axis=0)
    numbers = swarm_uniform(seed, _DRAW, iteration=0, particles=count, count=2 * size)
    return [
        Preference(
            bias=tuple((row[:size] * np.abs(scale)).tolist()),
            exponent=tuple((1.0 - row[size:]).tolist()),
        )
        for row in numbers
    ]


def winners(
    columns: EvaluationColumns,
    drawn: Sequence[Preference],
    *,
    worlds: TuningWorlds | None = None,
) -> tuple[Winner, ...]:
    """Return the winners under any of the preferences."""
    preferences = [*NAMED.values(), *drawn]
    names = [*NAMED, *("" for _ in drawn)]
    best = np.array([fitness_by(columns, p, worlds=worlds).argmin() for p in preferences])
    rows = np.unique(best)
    # Lead of each winner over the others, under every preference.
    winning = columns.rows(rows)
    rivals = np.sort([np.log(fitness_by(winning, p, worlds=worlds)) for p in preferences], axis=1)
    lead = rivals[:, 1] - rivals[:, 0] if len(rows) > 1 else np.zeros(len(preferences))
    result = []
    for row in rows.tolist():
        won = np.flatnonzero(best == row)
        named = tuple(names[index] for index in won if names[index])
        chosen = won[0] if named else won[lead[won].argmax()]
        share = np.count_nonzero(won >= len(NAMED)) / max(1, len(drawn))
        result.append(Winner(row, preferences[chosen], named, share))
    return tuple(sorted(result, key=lambda winner: (not winner.named, -winner.share, winner.row)))
