"""Backups while jobs run, and their restoration: the same rows on either database."""

from __future__ import annotations

import shutil
import threading
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import select

from gaitswarm.services.optimizer.errors import Conflict, InvalidRequest, NotFound, StoreUnavailable
from gaitswarm.services.optimizer.store import Store, open_store
from gaitswarm.services.optimizer.store.engine import Database
from gaitswarm.services.optimizer.store.maintenance import backup, check, restore
from gaitswarm.services.optimizer.store.tables import metadata
from tests.store.examples import ask, begun, completed, spec

Content = dict[str, list[tuple[Any, ...]]]


def content(url: str) -> Content:
    """All rows of all tables."""
    with (
        closing(Database(url)) as database,
        database.read() as connection,
    ):
        return {
            table.name: sorted(map(tuple, connection.execute(select(table))), key=repr)
            for table in metadata.sorted_tables
        }


@pytest.fixture
def database_url(migrated_sqlite: Path, tmp_path: Path) -> str:
    """Backups are of SQLite."""
    return f"sqlite:///{shutil.copy(migrated_sqlite, tmp_path / 'jobs.db')}"


@pytest.fixture
def filled(store: Store, database_url: str) -> Content:
    """What a database holds with jobs in several states."""
    claim = begun(store)
    store.commit(claim, completed(0), ask(1))
    done = begun(store, iterations=1)
    store.commit(done, completed(0), None)
    store.create_job(spec(), idempotency_key="a key")
    store.tokens.create_first()
    return content(database_url)


def test_a_backup_is_restored_row_by_row_on_either_database(
    filled: Content, database_url: str, fresh_url: str, tmp_path: Path
) -> None:
    file = tmp_path / "backup.db"
    backup(database_url, file)
    # One file is all there is.
    assert [path.name for path in tmp_path.glob("backup*")] == ["backup.db"]
    before = file.read_bytes()
    restore(fresh_url, file)
    assert content(fresh_url) == filled
    assert check(fresh_url) == []
    give_up_leases(fresh_url)
    with pytest.raises(Conflict, match="--force replaces all"):
        restore(fresh_url, file)
    restore(fresh_url, file, overwrite=True)
    assert content(fresh_url) == filled
    assert file.read_bytes() == before
    # Numbers go on where those of the backup end.
    with closing(open_store(fresh_url)) as store:
        store.create_job(spec())
    assert len(content(fresh_url)["audit"]) > len(filled["audit"])


def test_a_backup_is_of_one_moment_while_a_job_runs(
    store: Store, database_url: str, tmp_path: Path
) -> None:
    claim = begun(store, iterations=200)
    begin, stop = threading.Event(), threading.Event()

    def run() -> None:
        for index in range(199):
            store.commit(claim, completed(index), ask(index + 1))
            begin.set()
            if stop.is_set():
                return

    runner = threading.Thread(target=run)
    runner.start()
    begin.wait(10.0)
    file = tmp_path / "backup.db"
    try:
        backup(database_url, file)
    finally:
        stop.set()
        runner.join()
    assert check(str(file)) == []
    with closing(open_store(str(file))) as copy:
        assert 0 < copy.job(claim.job.id).progress.iterations <= 199


def test_nothing_is_replaced_unless_that_is_asked_for(
    filled: Content, store: Store, database_url: str, tmp_path: Path
) -> None:
    file = tmp_path / "backup.db"
    backup(database_url, file)
    with pytest.raises(Conflict, match=r"exists already.*--force"):
        backup(database_url, file)
    backup(database_url, file, overwrite=True)
    store.create_job(spec())
    store.close()
    give_up_leases(database_url)
    with pytest.raises(Conflict, match="--force replaces all"):
        restore(database_url, file)
    restore(database_url, file, overwrite=True)
    assert content(database_url) == filled


def test_a_server_has_backups_of_its_own(tmp_path: Path) -> None:
    with pytest.raises(InvalidRequest, match="pg_dump"):
        backup("postgresql://user@localhost/jobs", tmp_path / "backup.db")


def give_up_leases(url: str) -> None:
    """As time does, after all processes have ended."""
    with (
        closing(Database(url)) as database,
        database.write() as connection,
    ):
        connection.execute(metadata.tables["jobs"].update().values(lease_expires_at=None))


def test_a_database_in_use_is_not_restored_over(
    filled: Content, database_url: str, tmp_path: Path
) -> None:
    file = tmp_path / "backup.db"
    backup(database_url, file)
    with pytest.raises(Conflict, match="in use"):
        restore(database_url, file, overwrite=True)
    assert content(database_url) == filled


@pytest.mark.parametrize(
    ("written", "error", "words"),
    [
        (None, NotFound, "there is no backup"),
        (b"{}" * 1000, StoreUnavailable, "not a database"),
        (b"", InvalidRequest, "no backup of gaitswarm"),
    ],
    ids=["missing", "something else", "empty"],
)
def test_what_is_no_backup_is_named_and_makes_no_database(
    tmp_path: Path, written: bytes | None, error: type[Exception], words: str
) -> None:
    file, target = tmp_path / "backup.db", tmp_path / "jobs.db"
    if written is not None:
        file.write_bytes(written)
    with pytest.raises(error, match=words):
        restore(str(target), file)
    assert {path.name for path in tmp_path.iterdir()} <= {"backup.db"}
