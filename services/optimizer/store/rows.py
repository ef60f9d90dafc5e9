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

from services.optimizer.jobs.iteration import Ask, CompletedIteration, Evaluation, Iteration
from services.optimizer.store.tables import iterations
from sim.outcome import Status

Row = Mapping[Any, Any]
"""Columns of one row by name, as selected or as they are about to be."""


LISTED: Final = tuple(
    column for column in iterations.c if column.name not in ("positions", "optimizer_state")
)
"""Columns of an iteration as it is listed: an ask is a hundred times as long as all others."""


def to_iteration(row: Row) -> Iteration:
    """A committed iteration from its row.

    Args:
        row: The columns `LISTED` of `iterations`.

    Returns:
        The iteration, without its particles.
    """
    return Iteration(
        index=row["iteration"],
        best=row["best"],
        mean=row["mean"],
        median=row["median"],
        worst=row["worst"],
        best_so_far=row["best_so_far"],
        failed=row["failed"],
        evaluate_seconds=row["evaluate_seconds"],
        committed_at=row["committed_at"],
    )


def iteration_summary(fitness: NDArray[np.float64], best_before: float | None) -> dict[str, Any]:
    """Columns of a committed iteration: statistics over the finite values of its fitness.

    Args:
        fitness: (n,) of the swarm, +inf where a design failed.
        best_before: The least fitness of all earlier iterations; None if there is none.

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
    if len(finite):
        # Huge values may overflow in the sum; such a mean is as good as none.
        with np.errstate(over="ignore"):
            mean, median = _number(np.mean(finite)), _number(np.median(finite))
        best = float(np.min(finite))
        so_far = best if best_before is None else min(best, best_before)
        summary |= {
            "best": best,
            "mean": mean,
            "median": median,
            "worst": float(np.max(finite)),
            "best_so_far": so_far,
        }
    return summary


def best_particle(fitness: NDArray[np.float64]) -> int | None:
    """Find the best of a swarm.

    Args:
        fitness: (n,), +inf where a design failed.

    Returns:
        Index of the least finite fitness, the earliest of equals; None if there is none.
    """
    finite = np.isfinite(fitness)
    return int(np.argmin(np.where(finite, fitness, np.inf))) if finite.any() else None


def to_evaluation(row: Row) -> Evaluation:
    """One particle of a committed iteration from its row.

    Args:
        row: All columns of `evaluations`.

    Returns:
        The evaluation; floats have every bit that was stored.
    """
    objectives = np.array(row["objectives"], dtype=np.float64)
    return Evaluation(
        iteration=row["iteration"],
        particle=row["particle"],
        design=np.array(row["design"], dtype=np.float64),
        objectives=objectives,
        statuses=np.array([Status.from_label(s) for s in row["statuses"]], dtype=np.uint8),
        fitness=math.inf if row["fitness"] is None else row["fitness"],
    )


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
            "objectives": [_numbers(case) for case in by_case],
            "statuses": [Status(status).label for status in labels],
            "fitness": _number(fitness),
        }
        for particle, (design, by_case, labels, fitness) in enumerate(
            zip(
                done.designs.tolist(),
                objectives.tolist(),
                statuses.tolist(),
                done.fitness.tolist(),
                strict=True,
            )
        )
    ]


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
    }


def _number(value: float | np.floating[Any]) -> float | None:
    """A float, or None for what JSON and SQL cannot hold."""
    return float(value) if math.isfinite(value) else None


def _numbers(values: Sequence[float]) -> list[float | None]:
    return [_number(value) for value in values]
