"""A database file that is removed or replaced while a store has it open."""

from __future__ import annotations

import shutil
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path

import pytest
from sqlalchemy import update

from gaitswarm.services.optimizer.errors import StoreReplaced
from gaitswarm.services.optimizer.jobs.job import Command
from gaitswarm.services.optimizer.store import Store, open_store
from gaitswarm.services.optimizer.store.engine import Database
from gaitswarm.services.optimizer.store.maintenance import backup
from gaitswarm.services.optimizer.store.tables import jobs, metadata
from tests.store.examples import begun, completed, spec

REPLACED = "removed or replaced while it was open; restart"


@pytest.fixture
def opened(database: Path) -> Iterator[Store]:
    with closing(open_store(str(database))) as store:
        store.create_job(spec())
        yield store


def log_of(file: Path) -> Path:
    return file.with_name(f"{file.name}-wal")


def remove(file: Path) -> None:
    file.unlink()


def remove_all(file: Path) -> None:
    for end in ("", "-wal", "-shm"):
        file.with_name(file.name + end).unlink()


def remove_log(file: Path) -> None:
    log_of(file).unlink()


def replace_by_copy(file: Path) -> None:
    copy = file.with_name("copy.db")
    shutil.copy(file, copy)
    copy.replace(file)


def replace_log(file: Path) -> None:
    replace_by_copy(log_of(file))


@pytest.mark.parametrize(
    "change",
    [remove, remove_all, remove_log, replace_by_copy, replace_log],
    ids=lambda f: f.__name__,
)
def test_writes_are_refused_once_the_file_is_another(
    opened: Store, database: Path, change: Callable[[Path], None]
) -> None:
    claim = begun(opened)
    opened.ping()
    change(database)
    before = opened.jobs().items
    for refused in (
        lambda: opened.create_job(spec()),
        lambda: opened.commit(claim, completed(0), None),
        lambda: opened.command(claim.job.id, Command.PAUSE),
        opened.ping,
        opened.verify,
    ):
        with pytest.raises(StoreReplaced, match=REPLACED):
            refused()
    assert opened.jobs().items == before, "a refused write changes nothing"


def test_no_empty_file_is_made_in_place_of_one_that_was_removed(database: Path) -> None:
    with closing(Database(str(database))) as engine:
        with engine.read():
            remove(database)
            with pytest.raises(StoreReplaced, match=REPLACED), engine.read():
                pass
        assert not database.exists()


def test_a_store_that_is_opened_again_uses_the_file_that_is_there(
    opened: Store, database: Path
) -> None:
    remove_all(database)
    with closing(open_store(str(database))) as again:
        assert again.jobs().items == ()
        again.create_job(spec())
        again.ping()


def test_a_file_that_is_moved_back_is_written_again(opened: Store, database: Path) -> None:
    away = database.rename(database.with_suffix(".away"))
    with pytest.raises(StoreReplaced):
        opened.create_job(spec())
    away.rename(database)
    opened.create_job(spec())
    opened.ping()


def vacuum(file: Path) -> None:
    with closing(sqlite3.connect(file)) as connection:
        connection.execute("VACUUM")


def checkpoint(file: Path) -> None:
    with closing(sqlite3.connect(file)) as connection:
        connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")


def write_elsewhere(file: Path) -> None:
    with closing(open_store(str(file))) as other:
        other.create_job(spec())


def back_up(file: Path) -> None:
    backup(str(file), file.with_name("backup.db"))


@pytest.mark.parametrize("use", [vacuum, checkpoint, write_elsewhere, back_up])
def test_what_others_do_with_a_database_is_no_replacement(
    opened: Store, database: Path, use: Callable[[Path], None]
) -> None:
    use(database)
    opened.create_job(spec())
    opened.ping()
    opened.verify()


def write(database: Database) -> None:
    with database.write() as connection:
        connection.execute(update(jobs).values(priority=0))


def test_a_log_that_is_made_again_between_connections_is_no_replacement(database: Path) -> None:
    log = log_of(database)
    with closing(Database(str(database))) as engine:
        write(engine)
        before = log.stat().st_ino
        # A file that has its inode, so that no other one gets it.
        log.with_name("another").hardlink_to(log)
        # As when a user interrupts a statement: its connection, the only one, is closed.
        engine.close()
        assert not log.exists()
        write(engine)
        write(engine)
        assert log.stat().st_ino != before


def test_a_log_that_is_made_by_the_first_transaction_is_no_replacement(tmp_path: Path) -> None:
    with (
        closing(Database(str(tmp_path / "new.db"))) as engine,
        engine.write() as connection,
    ):
        engine.check_in_place()
        metadata.create_all(connection)


def test_a_link_to_a_database_is_followed(database: Path, tmp_path: Path) -> None:
    folder = tmp_path / "links"
    folder.mkdir()
    link = folder / "linked.db"
    link.symlink_to(database)
    with closing(open_store(str(link))) as store:
        store.create_job(spec())
        store.ping()
        remove_log(database)
        with pytest.raises(StoreReplaced):
            store.create_job(spec())
