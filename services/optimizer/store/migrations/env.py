"""Runs migrations on the connection that `services.optimizer.store.schema` hands over.

Alembic executes this file. The transaction is the caller's.
"""

from __future__ import annotations

from alembic import context
from sqlalchemy import Connection

from gaitswarm.services.optimizer.store.tables import metadata


def _run(connection: Connection) -> None:
    context.configure(
        connection=connection,
        target_metadata=metadata,
        # SQLite alters a table by copying it; it can do so inside a transaction.
        render_as_batch=True,
        transactional_ddl=True,
    )
    with context.begin_transaction():
        context.run_migrations()


_run(context.config.attributes["connection"])
