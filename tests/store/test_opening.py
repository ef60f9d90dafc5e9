"""Opening a database: which URLs there are, and what is said when it cannot be used."""

from __future__ import annotations

import os
import sqlite3
import stat
import subprocess
import threading
from contextlib import ExitStack
from importlib.util import module_from_spec
from pathlib import Path

import pytest
from alembic.script import ScriptDirectory
from sqlalchemy import text

from gaitswarm.services.optimizer.errors import StoreUnavailable
from gaitswarm.services.optimizer.store import Store, open_store
from gaitswarm.services.optimizer.store import engine as engine_module
from gaitswarm.services.optimizer.store.engine import Database, parse_url
from gaitswarm.services.optimizer.store.schema import MIGRATIONS, head, lock_for_migration
from tests.examples.forked import ForkedCommand
from tests.examples.processes import loaded_by, output
from tests.optimizer.formula import SPEC
from tests.store import worker_process
from tests.store.examples import LEASE, spec


def edit(url: str, statement: str) -> None:
    database = Database(url)
    with database.write() as connection:
        connection.execute(text(statement))
    database.close()


@pytest.mark.parametrize(
    ("url", "meant"),
    [
        ("runs.db", "sqlite+pysqlite:///runs.db"),
        ("/data/runs.db", "sqlite+pysqlite:////data/runs.db"),
        ("sqlite:///runs.db", "sqlite+pysqlite:///runs.db"),
        ("sqlite:////data/runs.db", "sqlite+pysqlite:////data/runs.db"),
        ("postgresql://u:p@h:1/d", "postgresql+psycopg://u:p@h:1/d"),
        ("postgres://h/d", "postgresql+psycopg://h/d"),
        ("postgresql+psycopg://h/d", "postgresql+psycopg://h/d"),
    ],
)
def test_a_url_means(url: str, meant: str) -> None:
    assert parse_url(url).render_as_string(hide_password=False) == meant


def test_a_home_folder_is_expanded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HOME", "/home/someone")
    assert parse_url("~/runs.db").database == "/home/someone/runs.db"


@pytest.mark.parametrize(
    "url",
    [
        "",
        " ",
        "sqlite://",
        "sqlite:///:memory:",
        ":memory:",
        "mysql://h/d",
        "http://[",
        "a://b:x/d",
    ],
)
def test_a_url_that_cannot_be_used_is_answered_by_those_that_can(url: str) -> None:
    with pytest.raises(StoreUnavailable, match="sqlite:///FILE or postgresql://"):
        open_store(url)


def test_a_database_is_made_ready_when_it_is_opened(fresh_url: str) -> None:
    store = open_store(fresh_url)
    store.ping()
    job, _ = store.create_job(spec())
    store.close()
    again = open_store(fresh_url)
    assert again.job(job.id) == job
    again.close()


def test_the_newest_revision_is_the_head_of_all_migrations() -> None:
    scripts = ScriptDirectory(MIGRATIONS)
    assert scripts.get_heads() == [head()]


@pytest.mark.thorough("test_list_and_status_import_neither_analyses_nor_what_simulates")
@pytest.mark.slow
def test_a_database_is_made_and_opened_without_alembic(tmp_path: Path) -> None:
    path = str(tmp_path / "jobs.db")
    opened = f"open_store({path!r}).close()"
    statements = f"from gaitswarm.services.runtime import open_store; {opened}; {opened}"
    assert loaded_by(statements, ["alembic", "sqlalchemy"]) == {"sqlalchemy"}


def test_a_database_of_a_newer_gaitswarm_is_left_alone(fresh_url: str) -> None:
    open_store(fresh_url).close()
    edit(fresh_url, "UPDATE alembic_version SET version_num = '9999'")
    with pytest.raises(StoreUnavailable, match=r"9999.*another version of gaitswarm"):
        open_store(fresh_url)


def test_a_store_whose_database_lost_its_schema_says_so(fresh_url: str) -> None:
    store = open_store(fresh_url)
    edit(fresh_url, "DELETE FROM alembic_version")
    with pytest.raises(StoreUnavailable, match=f"revision none, this gaitswarm needs {head()}"):
        store.ping()
    store.close()


def test_another_programs_file_is_left_as_it_is(tmp_path: Path) -> None:
    file = tmp_path / "theirs.db"
    edit(str(file), "CREATE TABLE notes (id TEXT)")
    before = file.read_bytes()
    with pytest.raises(StoreUnavailable, match=r"is of another program: .*notes; name another"):
        open_store(str(file))
    assert file.read_bytes() == before


def test_a_new_file_is_its_users_alone(tmp_path: Path) -> None:
    umask = os.umask(0o022)
    try:
        store = open_store(str(tmp_path / "jobs.db"))
        store.create_job(SPEC)
        assert {stat.S_IMODE(file.stat().st_mode) for file in tmp_path.iterdir()} == {0o600}
        store.close()
    finally:
        os.umask(umask)


def test_another_programs_tables_are_not_taken_over(fresh_url: str) -> None:
    edit(fresh_url, "CREATE TABLE jobs (id TEXT)")
    with pytest.raises(StoreUnavailable, match=r"jobs.*already exists|is of another program"):
        open_store(fresh_url)
    edit(fresh_url, "INSERT INTO jobs VALUES ('theirs')")


def test_a_database_can_be_opened_by_several_threads_at_once(fresh_url: str) -> None:
    failures: list[BaseException] = []

    def open_it() -> None:
        try:
            open_store(fresh_url).close()
        except BaseException as error:  # noqa: BLE001
            failures.append(error)

    threads = [threading.Thread(target=open_it) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert failures == []


def test_different_databases_can_be_opened_by_several_threads_at_once(tmp_path: Path) -> None:
    failures: list[BaseException] = []

    def open_one(index: int) -> None:
        try:
            open_store(str(tmp_path / f"{index}.db")).close()
        except BaseException as error:  # noqa: BLE001
            failures.append(error)

    threads = [threading.Thread(target=open_one, args=(index,)) for index in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert failures == []


def test_a_migration_under_way_elsewhere_is_waited_for(fresh_url: str) -> None:
    database = Database(fresh_url, for_migration=True)
    opened: list[Store] = []
    thread = threading.Thread(target=lambda: opened.append(open_store(fresh_url)))
    with database.write() as connection:
        lock_for_migration(connection)
        thread.start()
        thread.join(timeout=0.3)
        assert thread.is_alive()
    thread.join(timeout=30.0)
    opened[0].close()


@pytest.mark.slow
def test_a_database_can_be_opened_by_several_processes_at_once(fresh_url: str) -> None:
    program = worker_process.open_when_told
    with ExitStack() as stack:
        processes = [
            stack.enter_context(
                ForkedCommand(fresh_url, program=program, stdin=subprocess.PIPE, stderr=None)
            )
            for _ in range(3)
        ]
        for process in processes:
            assert output(process.stdout).readline() == "ready\n"
        for process in processes:
            output(process.stdin).write("go\n")
            output(process.stdin).flush()
        assert [process.wait(timeout=60) for process in processes] == [0, 0, 0]


def test_a_closed_store_can_be_closed_again(store: Store) -> None:
    store.close()
    store.close()


def test_a_file_in_no_folder_is_named(tmp_path: Path) -> None:
    path = tmp_path / "nowhere" / "runs.db"
    with pytest.raises(StoreUnavailable, match=r"nowhere/runs\.db.*directory exists"):
        open_store(str(path))
    assert not path.parent.exists()


def test_a_folder_is_no_database(tmp_path: Path) -> None:
    with pytest.raises(StoreUnavailable, match=str(tmp_path)):
        open_store(str(tmp_path))


def test_a_file_that_is_no_database_is_named_and_kept(tmp_path: Path) -> None:
    path = tmp_path / "spec.json"
    path.write_text('{"iterations": 25}' * 100)
    with pytest.raises(StoreUnavailable, match=r"spec\.json.*not a database"):
        open_store(str(path))
    assert path.read_text() == '{"iterations": 25}' * 100


@pytest.mark.parametrize(
    "url",
    [
        "postgresql://u:secret@127.0.0.1:1/d",
        "postgresql://127.0.0.1:1/d?user=u&password=secret",
        "postgresql://127.0.0.1:1/d?user=u&sslpassword=secret&passfile=/run/secret",
    ],
)
def test_a_server_that_does_not_answer_is_named_without_its_password(url: str) -> None:
    with pytest.raises(StoreUnavailable) as refused:
        open_store(url)
    assert "127.0.0.1:1/d" in str(refused.value) and "secret" not in str(refused.value)


def test_what_a_driver_says_is_shown_without_passwords() -> None:
    database = Database("postgresql://u:one@127.0.0.1:1/d?user=v&sslpassword=two")
    assert database.without_secrets("no v, one, two") == "no v, ***, ***"
    database.close()


def test_a_committed_iteration_survives_a_power_cut(tmp_path: Path) -> None:
    """As the module is, not as tests have set it."""
    source = engine_module.__spec__
    assert source is not None and source.loader is not None
    unchanged = module_from_spec(source)
    source.loader.exec_module(unchanged)
    names = ("journal_mode", "synchronous", "foreign_keys", "busy_timeout")
    with unchanged.Database(str(tmp_path / "runs.db")).read() as connection:
        said = [connection.exec_driver_sql(f"PRAGMA {name}").scalar_one() for name in names]
    full = 2
    assert said == ["wal", full, 1, engine_module.BUSY_SECONDS * 1000]


def test_a_database_that_stays_locked_is_unavailable_to_writers_but_not_to_readers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(engine_module, "BUSY_SECONDS", 0.05)
    path = tmp_path / "runs.db"
    store = open_store(str(path))
    job, _ = store.create_job(spec())
    other = sqlite3.connect(path, isolation_level=None)
    other.execute("BEGIN IMMEDIATE")
    with pytest.raises(StoreUnavailable, match=r"runs\.db.*locked"):
        store.claim("runner", lease_seconds=LEASE)
    assert store.job(job.id) == job
    other.execute("ROLLBACK")
    assert store.claim("runner", lease_seconds=LEASE) is not None
    other.close()
    store.close()


def test_an_exception_rolls_back_and_keeps_its_type(database_url: str) -> None:
    database: Database = Database(database_url)

    def delete_and_fail() -> None:
        with database.write() as connection:
            connection.execute(text("DELETE FROM alembic_version"))
            raise KeyError

    with pytest.raises(KeyError):
        delete_and_fail()
    with database.read() as connection:
        found = connection.execute(text("SELECT version_num FROM alembic_version")).scalar_one()
    assert found == head()
    database.close()


def test_what_a_reading_transaction_sees_of_others_depends_on_the_database(
    database_url: str, store: Store
) -> None:
    database = Database(database_url)
    count = text("SELECT count(*) FROM jobs")
    with database.read() as connection:
        assert connection.execute(count).scalar_one() == 0
        store.create_job(spec())
        seen = connection.execute(count).scalar_one()
    assert seen == (0 if database.engine.dialect.name == "sqlite" else 1)
    database.close()


@pytest.mark.slow
@pytest.mark.parametrize("database_url", ["postgresql"], indirect=True)
def test_a_server_that_takes_no_writes_is_unavailable(database_url: str) -> None:
    # As a standby that the address leads to while another server becomes the primary.
    opened = open_store(f"{database_url}?options=-c%20default_transaction_read_only%3Don")
    with pytest.raises(StoreUnavailable, match="read-only transaction"):
        opened.create_job(spec())
    opened.close()
