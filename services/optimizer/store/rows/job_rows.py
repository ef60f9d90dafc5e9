"""Rows of jobs to objects of the domain, and back, as far as this version can read them."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, replace
from typing import Any, Final

from pydantic import ValidationError

from gaitswarm.services.optimizer.errors import Unreadable
from gaitswarm.services.optimizer.jobs.chain import ChainDocuments
from gaitswarm.services.optimizer.jobs.documents import SPECS, AnySpec
from gaitswarm.services.optimizer.jobs.fork import Lineage
from gaitswarm.services.optimizer.jobs.job import Job, JobState, Progress, UnreadableSpec
from gaitswarm.services.optimizer.jobs.labels import Labels
from gaitswarm.services.optimizer.jobs.provenance import RECORDS, ProvenanceRecords
from gaitswarm.services.optimizer.jobs.reference import Reference
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.services.optimizer.store.rows.evaluation_rows import Row
from gaitswarm.services.optimizer.store.rows.tables import UnparsedText
from gaitswarm.sim.input import message_of

_KEPT: Final = (
    "what is stored stays as it is: run the gaitswarm that wrote it, or a newer one, and resume the"
    " job there; or submit a new one"
)


@dataclass(frozen=True, slots=True)
class JobDocuments:
    """What the documents of a job's row say.

    Attributes:
        spec: That it was submitted with, with its own budget; or what can be said of one that
            cannot be read.
        provenance: What its numbers depend on.
        lineage: Where it comes from, if it was forked.
    """

    spec: AnySpec | UnreadableSpec
    provenance: ProvenanceRecords
    lineage: Lineage | None

    @property
    def readable(self) -> bool:
        """Whether this version can read them."""
        return not isinstance(self.spec, UnreadableSpec)


def read_documents(row: Row) -> JobDocuments:
    """Read the documents of a job.

    Args:
        row: Of its columns, `spec`, `provenance` and `lineage`.

    Returns:
        What they say, whether they can be read or not.
    """
    try:
        return JobDocuments(submitted_spec(row), provenance_records(row), _lineage(row))
    except Unreadable as error:
        # Whoever cannot tell what the numbers depend on must not add others to them.
        return JobDocuments(_unreadable(row["spec"], str(error)), (), None)


def to_job(row: Row, documents: JobDocuments | None = None) -> Job:
    """A job from its row, whether its spec can be read or not.

    Args:
        row: All columns of `jobs`.
        documents: What its documents say, where they have been read; the row need not have them.

    Returns:
        The job, under its present budget.
    """
    documents = documents or read_documents(row)
    spec = documents.spec
    submitted_iterations = spec.iterations
    if row["budget"] is not None:
        if isinstance(spec, UnreadableSpec):
            spec = replace(spec, iterations=row["budget"])
        else:
            spec = spec.with_budget(row["budget"])
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
            evaluations_saved=row["evaluations_saved"] or 0,
            best_fitness=row["best_fitness"],
            best_iteration=row["best_iteration"],
            best_particle=row["best_particle"],
            compute_seconds=row["compute_seconds"],
            recent_seconds=row["recent_seconds"],
            head=row["head"],
        ),
        provenance=documents.provenance,
        accepts_changes=bool(row["accepts_changes"]),
        lineage=documents.lineage,
        owner=row["owner"],
        kept=bool(row["kept"]),
        submitted_iterations=submitted_iterations,
        waiting=row["waiting"],
        priority=row["priority"],
        labels=labels_of(row),
        archived=bool(row["archived"]),
        reference=reference_of(row["reference"]),
    )


def labels_of(row: Row) -> Labels:
    """What people have written on a job.

    Args:
        row: The job's row.

    Returns:
        Its labels; none where they cannot be read, as nothing depends on them.
    """
    try:
        return Labels() if row["labels"] is None else Labels.model_validate(row["labels"])
    except ValidationError:
        return Labels()


def reference_of(document: Any) -> Reference | None:
    """What a job's best is measured against.

    Args:
        document: As it is stored.

    Returns:
        The reference; None where none is stored, or it cannot be read, as nothing depends on it.
    """
    if not isinstance(document, dict):
        return None
    name, fitness = document.get("name"), document.get("fitness")
    return Reference(
        name if isinstance(name, str) else None,
        float(fitness) if isinstance(fitness, int | float) else None,
        "start" if document.get("kind") == "start" else "published",
    )


def submitted_spec(row: Row) -> AnySpec | UnreadableSpec:
    """The spec that a job was submitted with.

    Args:
        row: The job's row.

    Returns:
        The spec, with its own budget; or what can be said of one that cannot be read.
    """
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
    """What is wrong with a document, in a line.

    Args:
        error: What pydantic has against it.

    Returns:
        Path and message of the first three problems, and how many more there are.
    """
    found = error.errors(include_url=False, include_input=False)
    lines = [f"{'.'.join(map(str, entry['loc']))}: {message_of(entry)}" for entry in found[:3]]
    if len(found) > len(lines):
        lines.append(f"{len(found) - len(lines)} more")
    return "; ".join(lines)


def kept(problem: str) -> Unreadable:
    """The error for something of a job that cannot be read.

    Args:
        problem: What cannot be read, and why.

    Returns:
        The error, which also says what to do.
    """
    return Unreadable(f"{problem}; {_KEPT}")


def provenance_records(row: Row) -> ProvenanceRecords:
    """What a job's numbers depend on, since which iteration.

    Args:
        row: The job's row.

    Returns:
        The records, empty if none were made.

    Raises:
        Unreadable: They were written by another version, or damaged.
    """
    recorded = row["provenance"]
    try:
        return RECORDS.validate_python(() if recorded is None else recorded)
    except ValidationError as error:
        problems = first_problems(error)
        raise kept(f"its provenance cannot be read by this gaitswarm ({problems})") from error


def _lineage(row: Row) -> Lineage | None:
    """Where a job comes from. Raises Unreadable."""
    recorded = row["lineage"]
    try:
        return None if recorded is None else Lineage.model_validate(recorded)
    except ValidationError as error:
        problems = first_problems(error)
        raise kept(f"its lineage cannot be read by this gaitswarm ({problems})") from error


def lineage_document(lineage: Lineage | None) -> dict[str, Any] | None:
    """The JSON document of a job's lineage.

    Args:
        lineage: Where the job comes from; None for one that is not forked.

    Returns:
        The document, None for none.
    """
    return None if lineage is None else lineage.model_dump(mode="json")


def chain_documents(row: Row) -> ChainDocuments:
    """What a job's chain depends on beside its iterations.

    Args:
        row: The job's row.

    Returns:
        The documents as they are stored, whether they can be read or not.
    """
    return ChainDocuments(row["spec"], row["lineage"], row["provenance"])


def provenance_document(records: ProvenanceRecords) -> list[dict[str, Any]]:
    """The JSON document of a job's provenance.

    Args:
        records: Since which iteration its numbers depend on what.

    Returns:
        One object for every record.
    """
    return [record.model_dump(mode="json") for record in records]


def budget(row: Row) -> int:
    """Iterations that a job is to run.

    Args:
        row: The job's row.

    Returns:
        Those of its last extension, or of its spec.

    Raises:
        Unreadable: The spec says nothing that could be a budget.
    """
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
    """Without zero bytes, which PostgreSQL cannot hold, wherever a text has got them from.

    Args:
        text: Any text.

    Returns:
        The rest of it.
    """
    return text.replace("\0", "")


def spec_document(spec: Spec) -> dict[str, Any]:
    """The JSON document of a spec; it carries its schema version.

    Args:
        spec: Resolved.

    Returns:
        The document.
    """
    return spec.model_dump(mode="json")
