"""Rows of jobs: reading, locking and changing them"""

from __future__ import annotations

import json
import re
import secrets
from collections.abc import Mapping
from dataclasses import fields
from datetime import datetime
from functools import lru_cache
from typing import Any, Final

from pydantic import TypeAdapter, ValidationError
from sqlalchemy import Connection, Select, Text, bindparam, cast, insert, select, update

from gaitswarm.services.optimizer.errors import NotFound, Unreadable
from gaitswarm.services.optimizer.jobs.chain import ChainDocuments
from gaitswarm.services.optimizer.jobs.documents import SPECS, AnySpec
from gaitswarm.services.optimizer.jobs.fork import Lineage
from gaitswarm.services.optimizer.jobs.job import Job, JobState, Progress, Reference, UnreadableSpec
from gaitswarm.services.optimizer.jobs.labels import Labels
from gaitswarm.services.optimizer.jobs.provenance import RECORDS, ProvenanceRecords
from gaitswarm.services.optimizer.store.tables import EXISTING, Row, jobs, notifications
from gaitswarm.sim.input import message_of

ID_ALPHABET: Final = "23456789bcdfghjkmnpqrstvwxz"
"""No vowels and no look-alikes, as ids are read aloud."""

_FORM: Final = re.compile(rf"[{ID_ALPHABET}]{{12}}")

_REMEDY: Final = (
    "what is stored stays as it is: run the gaitswarm that wrote it, or a newer one, and resume the"
    " job there; or submit a new one"
)

_LARGE_SPEC: Final = 65_536
"""Length of a spec, in characters, from which it is parsed every time."""

_DOCUMENTS: Final = ("spec", "provenance", "lineage", "labels")

_SAME_NAME: Final = tuple(
    field.name
    for field in fields(Job)
    if field.name in jobs.c and field.name not in (*_DOCUMENTS, "state")
)
"""Columns that are fields of `Job`."""

_PROGRESS: Final = Progress._fields
"""Columns that are fields of `Progress`."""

_REFERENCE: Final = Reference._fields
"""Columns `reference_...` that are fields of `Reference`."""

COLUMNS: Final = tuple(
    cast(column, Text).label(column.name) if column.name in _DOCUMENTS else column
    for column in jobs.c
)
"""Columns of a row of a job; documents are text, so that a damaged one hides no other row."""

# Statements of all columns, each built once: that takes longer than to execute them.
_ROW: Final = select(*COLUMNS).where(jobs.c.id == bindparam("of"), EXISTING)
_LOCKED_ROW: Final = _ROW.with_for_update()
_ID: Final = select(jobs.c.id).where(jobs.c.id == bindparam("of"), EXISTING)
_UPDATE: Final = update(jobs).where(jobs.c.id == bindparam("of")).returning(*COLUMNS)
INSERT: Final = insert(jobs).returning(*COLUMNS)

_LINEAGE: Final[TypeAdapter[Lineage | None]] = TypeAdapter(Lineage | None)


def new_job_id() -> str:
    """Return twelve characters, 57 random bits."""
    return "".join(secrets.choice(ID_ALPHABET) for _ in range(12))


def is_job_id(text: str) -> bool:
    """Return whether a text can be an id; databases refuse some other texts."""
    return _FORM.fullmatch(text) is not None


def job_row(connection: Connection, job_id: str, *, lock: bool = False) -> Row:
    """Return the row of a job, locked until the transaction's end. Raises NotFound."""
    return _row(connection, job_id, _LOCKED_ROW if lock else _ROW)


def require_job(connection: Connection, job_id: str) -> None:
    """Raise NotFound for an unknown job."""
    _row(connection, job_id, _ID)


def _row(connection: Connection, job_id: str, query: Select[Any]) -> Row:
    if is_job_id(job_id):
        row = connection.execute(query, {"of": job_id}).mappings().first()
        if row is not None:
            return row
    raise NotFound(f"there is no job {job_id!r}")


def update_job(connection: Connection, row: Row, columns: Mapping[str, Any]) -> Row:
    """Change a locked job and return its row; a job that ends leaves a notification."""
    after = connection.execute(_UPDATE, {"of": row["id"], **columns}).mappings().one()
    if after["notify_url"] is not None and "state" in columns and after["finished_at"] is not None:
        _add_notification(connection, after)
    return after


def _add_notification(connection: Connection, job: Row) -> None:
    ended_at = job["finished_at"]
    document = {
        "type": f"job.{job['state']}",
        "timestamp": ended_at.isoformat(),
        "data": {
            "id": job["id"],
            "name": to_job(job).stored_spec.name,
            **{name: job[name] for name in ("state", "iterations", "evaluations", "best_fitness")},
            "error": job["error"],
        },
    }
    connection.execute(
        insert(notifications).values(
            id=f"msg_{secrets.token_hex(12)}",
            job_id=job["id"],
            url=job["notify_url"],
            document=document,
            created_at=ended_at,
            attempts=0,
            next_attempt_at=ended_at,
        )
    )


def entering(state: JobState, now: datetime) -> dict[str, Any]:
    """Return the columns that change with the state; the fencing token stays."""
    columns = {
        "state": state,
        "updated_at": now,
        "finished_at": now if state.terminal else None,
        "waiting": None,
    }
    if state not in (JobState.RUNNING, JobState.PAUSING):
        columns |= {"lease_owner": None, "lease_renewed_at": None, "lease_expires_at": None}
    return columns


def to_job(row: Row) -> Job:
    """Build a job from its row. Equal documents are parsed once."""
    spec: AnySpec | UnreadableSpec
    read = _read_documents if len(row["spec"]) < _LARGE_SPEC else _read_documents.__wrapped__
    try:
        spec, provenance, lineage = read(row["spec"], row["provenance"], row["lineage"])
    except Unreadable as error:
        # Results must not be added to those of unknown provenance.
        spec, provenance, lineage = _described(parsed(row["spec"]), str(error)), (), None
    submitted_iterations = spec.iterations
    if row["budget"] is not None:
        if isinstance(spec, UnreadableSpec):
            spec = spec._replace(iterations=row["budget"])
        else:
            spec = spec.with_budget(row["budget"])
    try:
        labels = Labels() if row["labels"] is None else Labels.model_validate_json(row["labels"])
    except ValidationError:
        # Nothing depends on them.
        labels = Labels()
    return Job(
        **{name: row[name] for name in _SAME_NAME},
        stored_spec=spec,
        state=JobState(row["state"]),
        progress=Progress(**{name: row[name] for name in _PROGRESS}),
        provenance=provenance,
        lineage=lineage,
        submitted_iterations=submitted_iterations,
        labels=labels,
        reference=None
        if row["reference_kind"] is None
        else Reference(**{name: row[f"reference_{name}"] for name in _REFERENCE}),
    )


@lru_cache(maxsize=1024)
def _read_documents(
    spec: str, provenance: str | None, lineage: str | None
) -> tuple[AnySpec, ProvenanceRecords, Lineage | None]:
    """Raise Unreadable for documents of another version, or damaged ones."""
    what = "spec"
    try:
        read_spec = SPECS.validate_python(json.loads(spec))
        what = "provenance"
        records = RECORDS.validate_python(() if provenance is None else parsed(provenance))
        what = "lineage"
        return read_spec, records, _LINEAGE.validate_python(parsed(lineage))
    except (json.JSONDecodeError, RecursionError):
        raise unreadable(f"its {what} is not JSON") from None
    except ValidationError as error:
        problem = first_problems(error)
    except Exception as error:  # noqa: BLE001 - one damaged job must not hide the others
        problem = f"{type(error).__name__}: {error}"
    raise unreadable(f"its {what} cannot be read by this gaitswarm ({problem})")


def parsed(text: str | None) -> Any:
    """Return a stored document; itself if it is not JSON."""
    try:
        return None if text is None else json.loads(text)
    except (ValueError, RecursionError):
        return text


def _described(document: Any, reason: str) -> UnreadableSpec:
    """Return what can be understood of an unreadable spec."""
    spec = document if isinstance(document, dict) else {}
    name, settings = spec.get("name"), spec.get("optimizer")
    return UnreadableSpec(
        reason,
        name=name if isinstance(name, str) else "",
        iterations=_count(spec.get("iterations")),
        particles=_count(settings.get("particles")) if isinstance(settings, dict) else 0,
    )


def _count(value: object) -> int:
    return value if isinstance(value, int) and value > 0 else 0


def unreadable(problem: str) -> Unreadable:
    """Return the error for a stored document that this version cannot read."""
    return Unreadable(f"{problem}; {_REMEDY}")


def first_problems(error: ValidationError) -> str:
    """Return the first three problems of a document in a line."""
    problems = error.errors(include_url=False, include_input=False)
    lines = [f"{'.'.join(map(str, p['loc']))}: {message_of(p)}" for p in problems[:3]]
    if len(problems) > len(lines):
        lines.append(f"{len(problems) - len(lines)} more")
    return "; ".join(lines)


def chain_documents(row: Row) -> ChainDocuments:
    """Return the documents of a job's chain as stored, readable or not."""
    return ChainDocuments(*(parsed(row[name]) for name in ("spec", "lineage", "provenance")))


def provenance_document(records: ProvenanceRecords) -> list[dict[str, Any]]:
    return [record.model_dump(mode="json") for record in records]
