"""Every test that takes `store` or `database_url` runs against every database that there is."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from sqlalchemy import text

from gaitswarm.services.optimizer.store import Store, open_store
from gaitswarm.services.optimizer.store.engine import Database
from gaitswarm.services.optimizer.store.tables import metadata
from tests.store.examples import Clock
from tests.store.postgres_server import PostgresServer, postgres_server, server_binaries

_DATABASES = ["sqlite", pytest.param("postgresql", marks=pytest.mark.slow)]

_ON_POSTGRESQL = {"test_bits", "test_claims", "test_job_list"}
"""Modules that `make test` runs on PostgreSQL too; `make test-all` runs all of them."""


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Leave most tests on PostgreSQL to `make test-all`."""
    here = Path(__file__).parent
    for item in items:
        if item.path.parent != here or item.path.stem in _ON_POSTGRESQL:
            continue
        parameters = getattr(item, "callspec", None)
        if parameters is not None and "postgresql" in parameters.params.values():
            item.add_marker(pytest.mark.thorough("the same statements on PostgreSQL"))


@pytest.fixture(scope="session")
def migrated_sqlite(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An empty database of the newest schema, to be copied."""
    path = tmp_path_factory.mktemp("store") / "template.db"
    open_store(str(path)).close()
    return path


@pytest.fixture(scope="session")
def postgresql_server() -> Iterator[PostgresServer]:
    """A server that lasts."""
    with postgres_server(server_binaries()) as server:
        yield server


@pytest.fixture
def stoppable_server(
    postgresql_server: PostgresServer, emptied_postgresql: Callable[[], str]
) -> Iterator[PostgresServer]:
    """The server, empty, that the test stops and starts again."""
    emptied_postgresql()
    yield postgresql_server
    if not postgresql_server.runs:
        postgresql_server.start()


@pytest.fixture(scope="session")
def emptied_postgresql(postgresql_server: PostgresServer) -> Iterator[Callable[[], str]]:
    """Empties a database of the newest schema, which it gives the URL of.

    Over one connection, and by deleting: connecting and truncating take twenty times as long.
    """
    url = f"{postgresql_server.url}/postgres"
    open_store(url).close()
    database = Database(url)

    def emptied() -> str:
        with database.write() as connection:
            for table in reversed(metadata.sorted_tables):
                connection.execute(table.delete())
        return url

    yield emptied
    database.close()


@pytest.fixture(params=_DATABASES)
def database_url(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    """URL of an empty database of the newest schema."""
    if request.param == "sqlite":
        path = tmp_path / "jobs.db"
        shutil.copy(request.getfixturevalue("migrated_sqlite"), path)
        return f"sqlite:///{path}"
    emptied: Callable[[], str] = request.getfixturevalue("emptied_postgresql")
    return emptied()


@pytest.fixture(params=_DATABASES)
def fresh_url(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[str]:
    """URL of a database without any table."""
    if request.param == "sqlite":
        yield f"sqlite:///{tmp_path / 'fresh.db'}"
        return
    server: str = request.getfixturevalue("postgresql_server").url
    server_engine = Database(f"{server}/postgres").engine
    outside = server_engine.execution_options(isolation_level="AUTOCOMMIT")
    with outside.connect() as connection:
        connection.execute(text("CREATE DATABASE fresh"))
    yield f"{server}/fresh"
    with outside.connect() as connection:
        connection.execute(text("DROP DATABASE fresh WITH (FORCE)"))
    server_engine.dispose()


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def store(database_url: str, clock: Clock) -> Iterator[Store]:
    store = open_store(database_url, clock=clock)
    yield store
    store.close()
