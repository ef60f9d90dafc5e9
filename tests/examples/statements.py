"""SQL statements that the databases of all tests of a process share."""

from __future__ import annotations

import sqlalchemy as sa

from gaitswarm.services.optimizer.store.engine import Database


def share_statements() -> None:
    """Let engines of one kind share their dialect and the statements that it compiled.

    Each test has a database of its own, whose engine would compile all statements again.
    """
    first: dict[str, sa.Engine] = {}
    prepare = Database.__init__

    def prepare_sharing(self: Database, url: str | sa.URL, *, for_migration: bool = False) -> None:
        prepare(self, url, for_migration=for_migration)
        shared = first.get(self.engine.name)
        if shared is not None:
            self.engine.dialect = shared.dialect
            vars(self.engine)["_compiled_cache"] = vars(shared)["_compiled_cache"]
            return

        # A dialect is complete once it has been connected.
        @sa.event.listens_for(self.engine, "engine_connect")
        def _share(connection: sa.Connection) -> None:
            first.setdefault(connection.engine.name, connection.engine)

    Database.__init__ = prepare_sharing  # type: ignore[method-assign]
