"""Only an explicit upgrade migrates a database that holds something, and only if nobody uses it."""

from __future__ import annotations

import subprocess
from contextlib import closing
from datetime import UTC, datetime, timedelta

import pytest
from alembic import command
from alembic.config import Config
from sqlalchemy import Connection, text

from gaitswarm.services.optimizer.errors import Conflict, StoreUnavailable
from gaitswarm.services.optimizer.jobs.job import LONGEST_LEASE_SECONDS
from gaitswarm.services.optimizer.store.connections.engine import connect, parse_url
from gaitswarm.services.optimizer.store.rows.tables import metadata
from gaitswarm.services.optimizer.store.schema.in_use import exclusive
from gaitswarm.services.optimizer.store.schema.migrate import create, upgrade
from gaitswarm.services.optimizer.store.schema.revisions import MIGRATIONS, head, read_revision
from gaitswarm.services.optimizer.store.sql_store import open_store
from tests.examples.forked import ForkedCommand
from tests.examples.processes import output
from tests.store import worker_process
from tests.store.examples import spec
from tests.store.test_opening import edit
from tests.store.worker_process import OLDER

JOB = "bcdfghjkmnpq"


def alembic(connection: Connection) -> Config:
    """Of Alembic's commands, which run in a transaction of ours."""
    config = Config()
    config.set_main_option("script_location", str(MIGRATIONS))
    config.attributes["connection"] = connection
    return config


def schema(connection: Connection) -> list[str]:
    """Every table, column and index, in the words of the database itself."""
    if connection.dialect.name == "sqlite":
        return sorted(" ".join(row.sql.split()) for row in connection.execute(_SQLITE_SCHEMA))
    return [str(row) for query in _POSTGRESQL_SCHEMA for row in connection.execute(query)]


_SQLITE_SCHEMA = text("SELECT sql FROM sqlite_master WHERE name NOT LIKE 'sqlite_%'")
_POSTGRESQL_SCHEMA = [
    text(
        "SELECT table_name, column_name, data_type, is_nullable, column_default, is_identity"
        " FROM information_schema.columns WHERE table_schema = 'public'"
        " ORDER BY table_name, ordinal_position"
    ),
    text("SELECT indexdef FROM pg_indexes WHERE schemaname = 'public' ORDER BY indexname"),
    text(
        "SELECT conrelid::regclass, conname, pg_get_constraintdef(oid) FROM pg_constraint"
        " WHERE connamespace = 'public'::regnamespace ORDER BY conrelid::regclass::text, conname"
    ),
]


def store_older(url: str, *, state: str = "queued", lease_expires_at: str | None = None) -> None:
    """Make a database of an older revision, with a job in it."""
    database = connect(parse_url(url), for_migration=True)
    with database.transaction(write=True) as connection:
        command.upgrade(alembic(connection), OLDER)
        connection.execute(
            text(
                "INSERT INTO jobs (id, state, spec, created_at, updated_at, lease_owner,"
                " lease_expires_at, lease_token, iterations, evaluations, compute_seconds) VALUES"
                " (:id, :state, :spec, '2026-01-01 00:00:00', '2026-01-01 00:00:00', 'elsewhere:7',"
                " :expires, 0, 0, 0, 0.0)"
            ),
            {
                "id": JOB,
                "state": state,
                "spec": spec(iterations=7).resolved().model_dump_json(),
                "expires": lease_expires_at,
            },
        )
    database.close()


def revision(url: str) -> str | None:
    with (
        closing(connect(parse_url(url))) as database,
        database.transaction(write=False) as connection,
    ):
        return read_revision(connection)


def test_a_new_database_is_as_all_migrations_make_one(fresh_url: str) -> None:
    with closing(connect(parse_url(fresh_url), for_migration=True)) as database:
        with database.transaction(write=True) as connection:
            command.upgrade(alembic(connection), "head")
            migrated, revision = schema(connection), read_revision(connection)
            metadata.drop_all(connection)
            connection.execute(text("DROP TABLE alembic_version"))
            assert schema(connection) == []
        create(parse_url(fresh_url))
        with database.transaction(write=False) as connection:
            assert len(migrated) > len(metadata.tables)
            assert schema(connection) == migrated
            assert read_revision(connection) == revision == head()


def test_a_database_whose_migrations_were_all_taken_back_is_made_ready(fresh_url: str) -> None:
    with (
        closing(connect(parse_url(fresh_url), for_migration=True)) as database,
        database.transaction(write=True) as connection,
    ):
        command.upgrade(alembic(connection), "head")
        command.downgrade(alembic(connection), "base")
        assert read_revision(connection) is None
    open_store(fresh_url).close()


def test_an_older_database_is_refused_and_left_as_it_is(fresh_url: str) -> None:
    store_older(fresh_url)
    with pytest.raises(StoreUnavailable, match=f"{OLDER}.* needs {head()}.*gaitswarm db upgrade"):
        open_store(fresh_url)
    assert revision(fresh_url) == OLDER


def test_an_upgrade_brings_an_older_database_to_the_newest_schema_with_its_jobs(
    fresh_url: str,
) -> None:
    store_older(fresh_url)
    assert upgrade(fresh_url) == OLDER
    assert upgrade(fresh_url) == head()
    with closing(open_store(fresh_url)) as store:
        assert store.job(JOB).spec.iterations == 7


def test_an_upgrade_makes_the_tables_of_an_empty_database(fresh_url: str) -> None:
    assert upgrade(fresh_url) is None
    assert revision(fresh_url) == head()


def test_no_upgrade_touches_what_a_newer_gaitswarm_has_made(fresh_url: str) -> None:
    open_store(fresh_url).close()
    edit(fresh_url, "UPDATE alembic_version SET version_num = '9999'")
    with pytest.raises(StoreUnavailable, match=f"9999.*up to {head()}.*upgrade gaitswarm"):
        upgrade(fresh_url)


@pytest.mark.slow
def test_a_database_that_an_idle_process_has_open_is_not_upgraded(fresh_url: str) -> None:
    store_older(fresh_url)
    process = ForkedCommand(
        fresh_url, program=worker_process.stay_open, stdin=subprocess.PIPE, stderr=None
    )
    with process:
        assert output(process.stdout).readline() == "ready\n"
        with pytest.raises(Conflict, match=r"in use by .*end all that use it first") as refused:
            upgrade(fresh_url)
        if fresh_url.startswith("postgresql"):
            assert f":{process.pid}" in str(refused.value)
        output(process.stdin).write("end\n")
        output(process.stdin).flush()
        process.wait(timeout=30.0)
    assert upgrade(fresh_url) == OLDER


@pytest.mark.parametrize("year", ["2026", "2126"])
def test_a_database_with_a_job_under_way_is_not_upgraded(fresh_url: str, year: str) -> None:
    expires = datetime.now(UTC) + timedelta(seconds=LONGEST_LEASE_SECONDS / 2)
    store_older(fresh_url, state="running", lease_expires_at=f"{expires:%Y-%m-%d %H:%M:%S}")
    with pytest.raises(Conflict, match=f"job {JOB} is run by elsewhere:7"):
        upgrade(fresh_url)
    given_up = "UPDATE jobs SET lease_expires_at = 'YEAR-01-01 00:00:00'"
    edit(fresh_url, given_up.replace("YEAR", year))
    assert upgrade(fresh_url) == OLDER


def test_a_process_that_outlived_an_upgrade_is_refused_when_it_connects_again(
    fresh_url: str,
) -> None:
    with closing(open_store(fresh_url)) as store:
        # As a network does that parts it from the server.
        store.close()
        edit(fresh_url, "UPDATE alembic_version SET version_num = '9999'")
        for _ in range(2):
            with pytest.raises(StoreUnavailable, match=f"9999.*up to {head()}"):
                store.create_job(spec())


def test_nobody_comes_in_during_an_upgrade(fresh_url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gaitswarm.services.optimizer.store.connections.engine.BUSY_SECONDS", 0.2)
    open_store(fresh_url).close()
    with (
        closing(connect(parse_url(fresh_url), for_migration=True)) as database,
        exclusive(database),
        pytest.raises(StoreUnavailable, match=r"being upgraded|locked"),
    ):
        open_store(fresh_url).jobs()
    with closing(open_store(fresh_url)) as store:
        assert store.jobs().items == ()


def test_an_upgrade_that_fails_on_its_way_changes_nothing(fresh_url: str) -> None:
    store_older(fresh_url)
    edit(fresh_url, "CREATE TABLE tokens (theirs TEXT)")
    with pytest.raises(StoreUnavailable, match=r"tokens.*already exists"):
        upgrade(fresh_url)
    assert revision(fresh_url) == OLDER
    edit(fresh_url, "DROP TABLE tokens")
    assert upgrade(fresh_url) == OLDER
