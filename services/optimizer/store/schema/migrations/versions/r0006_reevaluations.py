"""Best designs of searches in single precision, evaluated anew in double."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0006"
down_revision = "0005"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Create the table."""
    op.create_table(
        "reevaluations",
        sa.Column("job_id", sa.Text, nullable=False),
        sa.Column("iteration", sa.Integer, nullable=False),
        sa.Column("particle", sa.Integer, nullable=False),
        sa.Column("objectives", sa.JSON, nullable=False),
        sa.Column("statuses", sa.JSON, nullable=False),
        sa.Column("fitness", sa.Double),
        sa.PrimaryKeyConstraint("job_id", "iteration", "particle", name="pk_reevaluations"),
        sa.ForeignKeyConstraint(
            ["job_id", "iteration", "particle"],
            ["evaluations.job_id", "evaluations.iteration", "evaluations.particle"],
            name="fk_reevaluations_evaluations",
        ),
    )


def downgrade() -> None:
    """Drop it."""
    op.drop_table("reevaluations")
