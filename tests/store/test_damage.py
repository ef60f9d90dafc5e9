"""A database that is damaged while it is in use is not said to be safe."""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Iterator
from pathlib import Path

import pytest

from gaitswarm.services.optimizer.errors import StoreUnavailable
from gaitswarm.services.optimizer.store import Store, engine, open_store
from tests.store.examples import begun, completed, spec


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """An SQLite database with a job, opened by no process."""
    path = tmp_path / "jobs.db"
    store = open_store(str(path))
    store.create_job(spec())
    store.close()
    return path


@pytest.fixture
def opened(file: Path) -> Iterator[Store]:
    """The same, in use: a job has been committed to since."""
    store = open_store(str(file))
    store.commit(begun(store, iterations=1), completed(0), None)
    yield store
    store.close()


def test_a_sound_database_is_verified(store: Store) -> None:
    store.commit(begun(store, iterations=1), completed(0), None)
    store.verify()


def test_a_file_overwritten_with_garbage_is_noticed_though_it_can_still_be_read(
    opened: Store, file: Path
) -> None:
    with file.open("r+b") as raw:
        raw.write(os.urandom(file.stat().st_size))
    opened.jobs()
    with pytest.raises(StoreUnavailable, match="damaged while it was in use"):
        opened.verify()


def test_rows_that_cannot_be_fetched_are_a_fault_of_the_database(file: Path) -> None:
    database = engine.Database(str(file))
    with pytest.raises(StoreUnavailable, match=r"jobs\.db: disk I/O error"), database.read():
        raise sqlite3.OperationalError("disk I/O error")


def test_a_file_that_is_gone_is_noticed_and_not_recreated(opened: Store, file: Path) -> None:
    file.unlink()
    with pytest.raises(StoreUnavailable):
        opened.verify()
    assert not file.exists()


def test_a_check_that_takes_too_long_ends_without_a_verdict(
    opened: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    for _ in range(40):
        opened.create_job(spec())
    monkeypatch.setattr(engine, "CHECK_SECONDS", -1.0)
    opened.verify()
