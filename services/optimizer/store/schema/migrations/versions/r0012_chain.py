"""Digests of iterations, each chained to the one before, and of asks."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0012"
down_revision = "0011"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the columns; NULL for what is stored already."""
    with op.batch_alter_table("jobs") as jobs:
        jobs.add_column(sa.Column("head", sa.Text))
    with op.batch_alter_table("iterations") as iterations:
        iterations.add_column(sa.Column("ask_digest", sa.Text))
        iterations.add_column(sa.Column("digest", sa.Text))


def downgrade() -> None:
    """Drop them."""
    with op.batch_alter_table("iterations") as iterations:
        iterations.drop_column("digest")
        iterations.drop_column("ask_digest")
    with op.batch_alter_table("jobs") as jobs:
        jobs.drop_column("head")
