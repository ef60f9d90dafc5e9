"""Columns by which jobs are searched and sorted by name."""

from __future__ import annotations

import json
from typing import Any

import sqlalchemy as sa
from alembic import op

revision = "0021"
down_revision = "0020"
branch_labels = None
depends_on = None

_COLUMNS = [
    *("id", "created_at", "best_fitness", "evaluations", "state", "iterations", "priority"),
    *("compute_seconds", "reference", "lineage", "archived", "parent_id", "deleted_at"),
    *("sort_name", "search_text"),
]


def upgrade() -> None:
    """Add the columns, fill them, and put them in SQLite's index of the job list."""
    by_code_point = sa.Text().with_variant(sa.Text(collation="C"), "postgresql")
    op.add_column("jobs", sa.Column("sort_name", by_code_point))
    op.add_column("jobs", sa.Column("search_text", sa.Text))
    connection = op.get_bind()
    documents = sa.text("SELECT id, CAST(spec AS text), CAST(labels AS text) FROM jobs")
    fill = sa.text("UPDATE jobs SET sort_name = :name, search_text = :words WHERE id = :id")
    for job_id, spec, labels in connection.execute(documents).all():
        written = _parsed(labels)
        name = str(written.get("name") or _parsed(spec).get("name") or "")
        words = (name, job_id, written.get("note") or "", *(written.get("tags") or ()))
        values = {"name": _folded(name) or None, "words": _folded("\n".join(words)), "id": job_id}
        connection.execute(fill, values)
    if connection.dialect.name == "sqlite":
        op.drop_index("ix_jobs_entries", "jobs")
        existing = sa.text("deleted_at IS NULL")
        op.create_index("ix_jobs_entries", "jobs", _COLUMNS, sqlite_where=existing)


def _parsed(text: str | None) -> dict[str, Any]:
    try:
        document = json.loads(text or "{}")
    except (ValueError, RecursionError):
        return {}
    return document if isinstance(document, dict) else {}


def _folded(text: str) -> str:
    text = text.casefold().replace("\0", "\ufffd")
    return text.encode("utf-8", "replace").decode()
