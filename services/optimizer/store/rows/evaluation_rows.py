"""Rows of iterations and evaluations to objects of the domain, and back. Floats keep every bit.

JSON has neither NaN nor infinity: an objective that does not exist is null, and a fitness of
+inf is NULL.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import func, select

from gaitswarm.services.optimizer.jobs.chain import ask_digest
from gaitswarm.services.optimizer.jobs.iteration import (
    Ask,
    CompletedIteration,
    Evaluation,
    Iteration,
    Reevaluation,
)
from gaitswarm.services.optimizer.store.rows.tables import evaluations, iterations
from gaitswarm.sim.outcome import Status

Row = Mapping[Any, Any]
"""Columns of one row by name, as selected or as they are about to be."""


_DESIGNS: Final = (
    select(func.max(evaluations.c.particle) + 1)
    .where(
        evaluations.c.job_id == iterations.c.job_id,
        evaluations.c.iteration == iterations.c.iteration,
    )
    .correlate(iterations)
    .scalar_subquery()
    .label("designs")
)
"""How many designs an iteration has; particles are counted from 0, and the index has the last."""

_UNLISTED: Final = ("job_id", "positions", "optimizer_state", "asked_at", "ask_digest")

LISTED: Final = (
    *(c for c in iterations.c if c.name not in _UNLISTED),
    _DESIGNS,
)
"""Columns of an iteration as it is listed: an ask is a hundred times as long as all others."""


def to_iteration(row: Row) -> Iteration:
    """A committed iteration from its row.

    Args:
        row: The columns `LISTED`.

    Returns:
        The iteration, without its particles.
    """
    return Iteration(
        index=row["iteration"],
        designs=row["designs"],
        best=row["best"],
        mean=row["mean"],
        median=row["median"],
        worst=row["worst"],
        best_so_far=row["best_so_far"],
        failed=row["failed"],
        evaluate_seconds=row["evaluate_seconds"],
        committed_at=row["committed_at"],
        digest=row["digest"],
    )


def fitness_summary(
    fitness: NDArray[np.float64], best: float | None, best_before: float | None
) -> dict[str, Any]:
    """Columns of a committed iteration: statistics over the finite values of its fitness.

    Args:
        fitness: (n,) of its designs, +inf for one that failed.
        best: Least of it, in double precision; None if there is none.
        best_before: The same of all earlier iterations.

    Returns:
        Values by name of their columns, None where there is none.
    """
    finite = fitness[np.isfinite(fitness)]
    summary: dict[str, Any] = {
        "failed": len(fitness) - len(finite),
        "best": None,
        "mean": None,
        "median": None,
        "worst": None,
        "best_so_far": best_before,
    }
    if best is not None:
        summary["best_so_far"] = best if best_before is None else min(best, best_before)
    if len(finite):
        # Huge values may overflow in the sum; such a mean is as good as none.
        with np.errstate(over="ignore"):
            mean, median = _number(np.mean(finite)), _number(np.median(finite))
        summary |= {
            "best": float(np.min(finite)),
            "mean": mean,
            "median": median,
            "worst": float(np.max(finite)),
        }
    return summary


def to_evaluation(row: Row, reevaluation: Reevaluation | None = None) -> Evaluation:
    """One particle of a committed iteration from its row.

    Args:
        row: All columns of `evaluations`.
        reevaluation: Of the same particle in double precision, if there is one.

    Returns:
        The evaluation; floats have every bit that was stored.
    """
    return Evaluation(
        iteration=row["iteration"],
        particle=row["particle"],
        design=np.array(row["design"], dtype=np.float64),
        **_results(row),
        reevaluation=reevaluation,
    )


def to_reevaluation(row: Row) -> Reevaluation:
    """What a particle came to in double precision, from its row.

    Args:
        row: All columns of `reevaluations`.

    Returns:
        The reevaluation; floats have every bit that was stored.
    """
    return Reevaluation(particle=row["particle"], **_results(row))


def _results(row: Row) -> dict[str, Any]:
    return {
        "objectives": np.array(row["objectives"], dtype=np.float64),
        "statuses": np.array([Status.from_label(s) for s in row["statuses"]], dtype=np.uint8),
        "fitness": math.inf if row["fitness"] is None else row["fitness"],
    }


def evaluation_rows(job_id: str, done: CompletedIteration) -> list[dict[str, Any]]:
    """Rows of `evaluations`, one for each particle.

    Args:
        job_id: Of the job.
        done: The iteration.

    Returns:
        Values by name of their columns, in the order of the particles.
    """
    # (K, n, m) and (K, n), by case, are turned to one (K, m) and (K,) per particle.
    objectives = np.stack([outcome.objectives for outcome in done.outcomes], axis=1)
    statuses = np.stack([outcome.statuses for outcome in done.outcomes], axis=1)
    return [
        {
            "job_id": job_id,
            "iteration": done.iteration,
            "particle": particle,
            "design": design,
            "walk_key": key,
            **_result_columns(by_case, labels, fitness),
        }
        for particle, (design, by_case, labels, fitness, key) in enumerate(
            zip(
                done.designs.tolist(),
                objectives.tolist(),
                statuses.tolist(),
                done.fitness.tolist(),
                done.keys or [None] * len(done.fitness),
                strict=True,
            )
        )
    ]


def reevaluation_row(job_id: str, iteration: int, anew: Reevaluation) -> dict[str, Any]:
    """Row of `reevaluations`.

    Args:
        job_id: Of the job.
        iteration: Whose particle was evaluated anew.
        anew: What it came to.

    Returns:
        Values by name of their columns.
    """
    return {
        "job_id": job_id,
        "iteration": iteration,
        "particle": anew.particle,
        **_result_columns(anew.objectives.tolist(), anew.statuses.tolist(), anew.fitness),
    }


def _result_columns(
    objectives: Sequence[Sequence[float]], statuses: Sequence[int], fitness: float
) -> dict[str, Any]:
    return {
        "objectives": [_numbers(case) for case in objectives],
        "statuses": [Status(status).label for status in statuses],
        "fitness": _number(fitness),
    }


def to_ask(row: Row) -> Ask:
    """An ask from its row.

    Args:
        row: All columns of `iterations`.

    Returns:
        The ask as it was before it was sent out.
    """
    return Ask(
        iteration=row["iteration"],
        positions=np.array(row["positions"], dtype=np.float64),
        state=row["optimizer_state"],
    )


def ask_columns(ask: Ask) -> dict[str, Any]:
    """Columns of an iteration that is about to be evaluated.

    Args:
        ask: What is to be evaluated.

    Returns:
        Values by name of their columns.
    """
    return {
        "iteration": ask.iteration,
        "positions": ask.positions.tolist(),
        "optimizer_state": ask.state,
        "ask_digest": ask_digest(ask.positions, ask.state),
    }


def _number(value: float | np.floating[Any]) -> float | None:
    """A float, or None for what JSON and SQL cannot hold."""
    return float(value) if math.isfinite(value) else None


def _numbers(values: Sequence[float]) -> list[float | None]:
    return [_number(value) for value in values]
