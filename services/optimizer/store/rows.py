"""Rows of the tables to objects of the domain, and back. Floats keep every bit.

JSON has neither NaN nor infinity: an objective that does not exist is null, and a fitness of
+inf is NULL.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter, ValidationError

from services.optimizer.errors import Unreadable
from services.optimizer.jobs.documents import SPECS, AnySpec
from services.optimizer.jobs.job import (
    Ask,
    CompletedIteration,
    Evaluation,
    Iteration,
    Job,
    JobState,
    Progress,
    UnreadableSpec,
)
from services.optimizer.jobs.provenance import ProvenanceRecord, ProvenanceRecords
from services.optimizer.jobs.spec import Spec
from services.optimizer.store.tables import UnparsedText, iterations
from sim.outcome import Status

Row = Mapping[Any, Any]
"""Columns of one row by name, as selected or as they are about to be."""

_RECORDS: Final = TypeAdapter(tuple[ProvenanceRecord, ...])


_KEPT: Final = (
    "what is stored stays as it is: run the gaitswarm that wrote it, or a newer one, and resume the"
    " job there; or submit a new one"
)


def to_job(row: Row) -> Job:
    """A row of `jobs`, whether its spec can be read or not."""
    spec = submitted_spec(row)
    try:
        provenance = provenance_records(row)
    except Unreadable as error:
        # Whoever cannot tell what the numbers depend on must not add others to them.
        provenance, spec = (), _unreadable(row["spec"], str(error))
    if row["budget"] is not None:
        if isinstance(spec, UnreadableSpec):
            spec = replace(spec, iterations=row["budget"])
        else:
            spec = spec.model_copy(update={"iterations": row["budget"]})
    return Job(
        id=row["id"],
        stored_spec=spec,
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
        provenance=provenance,
        accepts_changes=bool(row["accepts_changes"]),
    )


def submitted_spec(row: Row) -> AnySpec | UnreadableSpec:
    """Spec of a row of `jobs`, with the budget that it was submitted with."""
    document = row["spec"]
    if isinstance(document, UnparsedText):
        return UnreadableSpec(f"its spec is not JSON; {_KEPT}")
    try:
        return SPECS.validate_python(document)
    except ValidationError as error:
        problems = first_problems(error)
    except Exception as error:  # noqa: BLE001 - whatever is wrong with one job, lists show the rest
        problems = f"{type(error).__name__}: {error}"
    return _unreadable(document, f"its spec cannot be read by this gaitswarm ({problems}); {_KEPT}")


def _unreadable(document: Any, reason: str) -> UnreadableSpec:
    """With as much of the document as everybody can understand."""
    known = document if isinstance(document, dict) else {}
    name, swarm = known.get("name"), known.get("optimizer")
    return UnreadableSpec(
        reason,
        name=name if isinstance(name, str) else "",
        iterations=_count(known.get("iterations")),
        particles=_count(swarm.get("particles")) if isinstance(swarm, dict) else 0,
    )


def first_problems(error: ValidationError) -> str:
    """What is wrong with a document, in a line; of many problems the first three."""
    found = error.errors(include_url=False, include_context=False, include_input=False)
    lines = [f"{'.'.join(map(str, entry['loc']))}: {entry['msg']}" for entry in found[:3]]
    if len(found) > len(lines):
        lines.append(f"{len(found) - len(lines)} more")
    return "; ".join(lines)


def kept(problem: str) -> Unreadable:
    """The error for something of a job that cannot be read; says what to do."""
    return Unreadable(f"{problem}; {_KEPT}")


def provenance_records(row: Row) -> ProvenanceRecords:
    """Provenance of the job of a row of `jobs`, empty if none was recorded. Raises Unreadable."""
    try:
        return _RECORDS.validate_python(row["provenance"] or ())
    except ValidationError as error:
        problems = first_problems(error)
        raise kept(f"its provenance cannot be read by this gaitswarm ({problems})") from error


def provenance_document(records: ProvenanceRecords) -> list[dict[str, Any]]:
    """The JSON document of a job's provenance."""
    return [record.model_dump(mode="json") for record in records]


def budget(row: Row) -> int:
    """Iterations that the job of a row of `jobs` is to run. Raises Unreadable."""
    try:
        return int(row["spec"]["iterations"] if row["budget"] is None else row["budget"])
    except (TypeError, LookupError, ValueError):
        raise kept("its budget cannot be read") from None


def _count(value: object) -> int:
    """A number that is one, 0 for anything else."""
    return value if isinstance(value, int) and value > 0 else 0


def request_digest(request: Any) -> str:
    """What a request is recognized by: SHA-256 of its JSON document, whatever its layout.

    Args:
        request: The document as it was parsed: objects, arrays, strings, numbers.

    Returns:
        64 hexadecimal digits.
    """
    canonical = json.dumps(request, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(canonical.encode()).hexdigest()


def storable(text: str) -> str:
    """Without zero bytes, which PostgreSQL cannot hold, wherever a text has got them from."""
    return text.replace("\0", "")


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
