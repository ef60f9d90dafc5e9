"""What people write on jobs, and how many jobs there are of a kind."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from typing import Any, Final

from sqlalchemy import ColumnElement, Connection, select

from gaitswarm.services.optimizer.jobs.audit import AuditAction
from gaitswarm.services.optimizer.jobs.labels import (
    FacetCounts,
    Facets,
    Labels,
    LabelsChange,
    is_own_robot,
    preference_name,
    robot_name,
)
from gaitswarm.services.optimizer.store.rows.evaluation_rows import Row
from gaitswarm.services.optimizer.store.rows.job_rows import labels_of
from gaitswarm.services.optimizer.store.rows.tables import jobs
from gaitswarm.services.optimizer.store.statements.audit import note_change
from gaitswarm.services.optimizer.store.statements.documents import text_at
from gaitswarm.services.optimizer.store.statements.records import job_row, update_job

_FIELDS: Final = ("robot", "controller", "preference")
"""Of a spec, by which jobs are found."""


def folded(text: str) -> str:
    """Fold case, and replace characters that a database refuses."""
    text = text.casefold().replace("\0", "\N{REPLACEMENT CHARACTER}")
    return text.encode("utf-8", "replace").decode()


def search_columns(job_id: str, spec_name: str, labels: Labels) -> dict[str, Any]:
    """Return the columns by which a job is searched and sorted by name."""
    name = labels.name or spec_name
    words = "\n".join((name, job_id, labels.note, *labels.tags))
    return {"sort_name": folded(name) or None, "search_text": folded(words)}


def label_job(
    connection: Connection, job_id: str, change: LabelsChange, *, now: datetime, actor: str
) -> Row:
    """Change what is written on a job.

    Args:
        connection: An open transaction that may write.
        job_id: Of the job.
        change: What is to be different.
        now: The time at which it is.
        actor: Whom the audit log is to name.

    Returns:
        The job's row as it is then.
    """
    row = job_row(connection, job_id, lock=True)
    labels, spec = change.applied(labels_of(row)), row["spec"]
    name = spec.get("name") if isinstance(spec, dict) else None
    columns: dict[str, Any] = {"labels": labels.model_dump(mode="json")}
    columns |= search_columns(job_id, str(name or ""), labels)
    if change.archived is not None:
        columns["archived"] = change.archived
    note_change(connection, now, actor, AuditAction.LABEL, job_id)
    return update_job(connection, row, columns)


def spec_field(connection: Connection, name: str) -> ColumnElement[str]:
    """Select a text of a job's spec.

    Args:
        connection: Tells the dialect.
        name: Of a field of the spec.

    Returns:
        The text; "" where the spec has none of this name, or is no JSON.
    """
    return text_at(connection, jobs.c.spec, name)


def facet_columns(connection: Connection) -> list[ColumnElement[Any]]:
    """Select what jobs are found by.

    Args:
        connection: Tells the dialect.

    Returns:
        Columns that `to_facets` reads, in order.
    """
    return [jobs.c.state, jobs.c.labels, *(spec_field(connection, name) for name in _FIELDS)]


def to_facets(row: Any) -> Facets:
    """Read what a job is found by.

    Args:
        row: Values of `facet_columns`.

    Returns:
        Its facets.
    """
    state, labels, robot, controller, preference = row
    tags = labels.get("tags", ()) if isinstance(labels, dict) else ()
    return Facets(
        state,
        robot_name(robot),
        controller or None,
        preference_name(preference),
        tuple(tags),
        own_robot=is_own_robot(robot),
    )


def count_facets(connection: Connection, among: Sequence[ColumnElement[bool]]) -> FacetCounts:
    """Count jobs by what they are found by.

    Args:
        connection: An open transaction.
        among: Only jobs for which these hold.

    Returns:
        The counts.
    """
    counts = FacetCounts()
    for row in connection.execute(select(*facet_columns(connection)).where(*among)):
        counts.add(to_facets(row))
    return counts
