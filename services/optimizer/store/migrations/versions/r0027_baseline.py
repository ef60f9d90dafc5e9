"""The first schema, created by `schema.create`"""

from __future__ import annotations

revision = "0027"
down_revision = None
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Do nothing: new databases are created in the newest schema."""
