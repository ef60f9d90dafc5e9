"""Many rows of `evaluations` at once, as columns.

JSON texts of thousands of rows are joined to one array and parsed in one go, which is faster than
reading them one by one, as `rows.to_evaluation` does, and makes no object for each.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from functools import cache
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter
from sqlalchemy import Connection, Text, cast, select

from gaitswarm.services.optimizer.jobs.columns import EvaluationColumns
from gaitswarm.services.optimizer.jobs.iteration import CachedOutcome
from gaitswarm.services.optimizer.store.rows.tables import evaluations
from gaitswarm.sim.outcome import Status

# Faster than the standard library's parser by half, and as exact.
_JSON: Final = TypeAdapter(Any)

_PARSED: Final = 200
"""Texts that are parsed at once: meanwhile no other thread of Python goes on."""

_KEYS: Final = 1000
"""Keys of one query."""


def select_columns(
    connection: Connection, job_id: str, first: int, last: int
) -> EvaluationColumns | None:
    """Read the evaluations of a range of committed iterations.

    Args:
        connection: An open transaction.
        job_id: Of the job.
        first: Least index of an iteration.
        last: Index after the greatest.

    Returns:
        Their columns, rows in order of iteration and particle; None if there is no row.
    """
    table = evaluations.c
    query = (
        select(
            table.iteration,
            table.particle,
            table.fitness,
            # As text: both databases keep the JSON as it was written.
            cast(table.design, Text),
            cast(table.objectives, Text),
            cast(table.statuses, Text),
        )
        .where(table.job_id == job_id, table.iteration >= first, table.iteration < last)
        .order_by(table.iteration, table.particle)
    )
    rows = connection.execute(query).all()
    if not rows:
        return None
    iteration, particle, fitness, designs, objectives, statuses = zip(*rows, strict=True)
    return EvaluationColumns(
        iteration=np.array(iteration, dtype=np.int64),
        particle=np.array(particle, dtype=np.int64),
        designs=_numbers(designs),
        objectives=_numbers(objectives),
        statuses=_statuses(statuses),
        fitness=np.array([math.inf if f is None else f for f in fitness], dtype=np.float64),
    )


def select_known(connection: Connection, keys: Sequence[bytes]) -> dict[bytes, CachedOutcome]:
    """Find what designs came to in any job.

    Args:
        connection: An open transaction.
        keys: Of their walks.

    Returns:
        Outcomes of those that are known, by key; damaged ones are left out.
    """
    table, found = evaluations.c, dict[bytes, CachedOutcome]()
    for first in range(0, len(keys), _KEYS):
        query = select(
            table.walk_key, cast(table.objectives, Text), cast(table.statuses, Text)
        ).where(table.walk_key.in_(keys[first : first + _KEYS]))
        for key, objectives, statuses in connection.execute(query):
            with suppress(ValueError, TypeError, KeyError):
                numbers = np.array(_JSON.validate_json(objectives), dtype=np.float64)
                found[key] = CachedOutcome(
                    numbers, np.array(_status_values(statuses), dtype=np.uint8)
                )
    return found


def _numbers(texts: Sequence[str]) -> NDArray[np.float64]:
    """Nested arrays of numbers, one text a row; null is NaN."""
    return np.concatenate(
        [
            np.array(_JSON.validate_json(f"[{','.join(piece)}]"), dtype=np.float64)
            for piece in (texts[k : k + _PARSED] for k in range(0, len(texts), _PARSED))
        ]
    )


def _statuses(texts: Sequence[str]) -> NDArray[np.uint8]:
    """Arrays of labels, of which a job has few different ones."""
    values = cache(_status_values)
    return np.array([values(text) for text in texts], dtype=np.uint8)


def _status_values(text: str) -> list[int]:
    return [Status.from_label(label) for label in _JSON.validate_json(text)]
