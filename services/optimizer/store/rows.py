"""Rows of the tables to objects of the domain, and back. Floats keep every bit.

JSON has neither NaN nor infinity: an objective that does not exist is null, and a fitness of
+inf is NULL.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter, ValidationError

from services.optimizer.errors import StoreUnavailable
from services.optimizer.jobs.documents import SPECS, AnySpec
from services.optimizer.jobs.job import (
    Ask,
    CompletedIteration,
    Evaluation,
    Iteration,
    Job,
    JobState,
    Progress,
)
from services.optimizer.jobs.provenance import ProvenanceRecord, ProvenanceRecords
from services.optimizer.jobs.spec import Spec
from services.optimizer.store.tables import iterations
from sim.outcome import Status

Row = Mapping[Any, Any]
"""Columns of one row by name, as selected or as they are about to be."""

_RECORDS: Final = TypeAdapter(tuple[ProvenanceRecord, ...])


def to_job(row: Row) -> Job:
    """A row of `jobs`. Raises as `submitted_spec` and `provenance_records`."""
    spec = submitted_spec(row)
    if row["budget"] is not None:
        spec = spec.model_copy(update={"iterations": row["budget"]})
    return Job(
        id=row["id"],
        spec=spec,
        state=JobState(row["state"]),
        created_at=row["created_at"],
        updated_at=row["updated_at"],
        started_at=row["started_at"],
        finished_at=row["finished_at"],
        error=row["error"],
        progress=Progress(
            iterations=row["iterations"],
            evaluations=row["evaluations"],
            best_fitness=row["best_fitness"],
            best_iteration=row["best_iteration"],
            best_particle=row["best_particle"],
            compute_seconds=row["compute_seconds"],
        ),
        provenance=provenance_records(row),
        accepts_changes=bool(row["accepts_changes"]),
    )


def submitted_spec(row: Row) -> AnySpec:
    """Spec of a row of `jobs`, with the budget that it was submitted with.

    Raises StoreUnavailable for a spec that this version cannot read.
    """
    try:
        return SPECS.validate_python(row["spec"])
    except ValidationError as error:
        raise StoreUnavailable(
            f"job {row['id']} was stored with a spec that this version cannot read: {error}"
        ) from error


def provenance_records(row: Row) -> ProvenanceRecords:
    """Provenance of the job of a row of `jobs`, empty if none was recorded.

    Raises StoreUnavailable for records that this version cannot read.
    """
    try:
        return _RECORDS.validate_python(row["provenance"] or ())
    except ValidationError as error:
        raise StoreUnavailable(
            f"job {row['id']} was stored with a provenance that this version cannot read: {error}"
        ) from error


def provenance_document(records: ProvenanceRecords) -> list[dict[str, Any]]:
    """The JSON document of a job's provenance."""
    return [record.model_dump(mode="json") for record in records]


def budget(row: Row) -> int:
    """Iterations that the job of a row of `jobs` is to run."""
    return int(row["spec"]["iterations"] if row["budget"] is None else row["budget"])


def request_digest(request: Any) -> str:
    """What a request is recognized by: SHA-256 of its JSON document, whatever its layout.

    Args:
        request: The document as it was parsed: objects, arrays, strings, numbers.

    Returns:
        64 hexadecimal digits.
    """
    canonical = json.dumps(request, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(canonical.encode()).hexdigest()


def spec_document(spec: Spec) -> dict[str, Any]:
    """The JSON document of a spec; it carries its schema version."""
    return spec.model_dump(mode="json")


LISTED: Final = tuple(
    column for column in iterations.c if column.name not in ("positions", "optimizer_state")
)
"""Columns of an iteration as it is listed: an ask is a hundred times as long as all others."""


def to_iteration(row: Row) -> Iteration:
    """A committed row of `iterations`."""
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
    """Columns of a committed iteration: statistics over the finite values of fitness (n,)."""
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
    """Index of the least finite fitness, the earliest of equals; None if there is none."""
    finite = np.isfinite(fitness)
    return int(np.argmin(np.where(finite, fitness, np.inf))) if finite.any() else None


def to_evaluation(row: Row) -> Evaluation:
    """A row of `evaluations`."""
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
    """One row of `evaluations` per particle."""
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
    """A row of `iterations` as it was asked."""
    return Ask(
        iteration=row["iteration"],
        positions=np.array(row["positions"], dtype=np.float64),
        state=row["optimizer_state"],
    )


def ask_columns(ask: Ask) -> dict[str, Any]:
    """Columns of an iteration that is about to be evaluated."""
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
