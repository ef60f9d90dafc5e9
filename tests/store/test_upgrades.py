"""Only an explicit upgrade migrates a database that holds data, and only if it is not in use."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable
from contextlib import closing
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from gaitswarm.services.optimizer.errors import Conflict, StoreUnavailable
from gaitswarm.services.optimizer.jobs.job import LONGEST_LEASE_SECONDS
from gaitswarm.services.optimizer.store import open_store
from gaitswarm.services.optimizer.store import schema as schema_module
from gaitswarm.services.optimizer.store.engine import Database
from gaitswarm.services.optimizer.store.schema import (
    MIGRATIONS,
    exclusive,
    head,
    read_revision,
    upgrade,
)
from tests.examples.forked import ForkedCommand
from tests.examples.processes import output
from tests.store import worker_process
from tests.store.examples import spec
from tests.store.test_opening import edit


def store_job(url: str) -> str:
    """Make a database of the newest revision, with a job in it."""
    with closing(open_store(url)) as store:
        job, _ = store.create_job(spec(iterations=7))
    return job.id


@pytest.fixture
def release_next(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[], None]:
    """Let a revision follow the newest one, as in a later version of gaitswarm."""

    def release() -> None:
        folder = tmp_path / "migrations"
        shutil.copytree(MIGRATIONS, folder)
        (folder / "versions" / f"r{NEXT}_next.py").write_text(_NEXT_MIGRATION)
        monkeypatch.setattr(schema_module, "MIGRATIONS", folder)

    return release


NEWEST = head()
NEXT = f"{int(NEWEST) + 1:04}"
_NEXT_MIGRATION = f"""
import sqlalchemy as sa
from alembic import op

revision, down_revision = "{NEXT}", "{NEWEST}"


def upgrade():
    op.create_table("next", sa.Column("id", sa.Text))
"""


def revision(url: str) -> str | None:
    with (
        closing(Database(url)) as database,
        database.read() as connection,
    ):
        return read_revision(connection)


@pytest.mark.parametrize("opened", [open_store, upgrade])
def test_a_database_of_a_version_before_the_first_release_is_refused(
    fresh_url: str, opened: Callable[[str], object]
) -> None:
    store_job(fresh_url)
    edit(fresh_url, "UPDATE alembic_version SET version_num = '0023'")
    with pytest.raises(StoreUnavailable, match=r"0023, .*does not know.*name another database"):
        opened(fresh_url)
    assert revision(fresh_url) == "0023"


def test_an_older_database_is_refused_and_left_as_it_is(
    fresh_url: str, release_next: Callable[[], None]
) -> None:
    store_job(fresh_url)
    release_next()
    with pytest.raises(StoreUnavailable, match=f"{NEWEST}.* needs {NEXT}.*gaitswarm db upgrade"):
        open_store(fresh_url)
    assert revision(fresh_url) == NEWEST


def test_an_upgrade_brings_an_older_database_to_the_newest_schema_with_its_jobs(
    fresh_url: str, release_next: Callable[[], None]
) -> None:
    job_id = store_job(fresh_url)
    release_next()
    assert upgrade(fresh_url) == NEWEST
    assert upgrade(fresh_url) == NEXT
    with closing(open_store(fresh_url)) as store:
        assert store.job(job_id).spec.iterations == 7


def test_an_upgrade_makes_the_tables_of_an_empty_database(fresh_url: str) -> None:
    assert upgrade(fresh_url) is None
    assert revision(fresh_url) == head()


def test_no_upgrade_touches_what_a_newer_gaitswarm_has_made(fresh_url: str) -> None:
    open_store(fresh_url).close()
    edit(fresh_url, "UPDATE alembic_version SET version_num = '9999'")
    with pytest.raises(StoreUnavailable, match=f"9999.*to {head()}.*another version of gaitswarm"):
        upgrade(fresh_url)


@pytest.mark.slow
def test_a_database_that_an_idle_process_has_open_is_not_upgraded(
    fresh_url: str, release_next: Callable[[], None]
) -> None:
    store_job(fresh_url)
    process = ForkedCommand(
        fresh_url, program=worker_process.stay_open, stdin=subprocess.PIPE, stderr=None
    )
    with process:
        assert output(process.stdout).readline() == "ready\n"
        release_next()
        with pytest.raises(Conflict, match=r"in use by .*end all that use it first"):
            upgrade(fresh_url)
        output(process.stdin).write("end\n")
        output(process.stdin).flush()
        process.wait(timeout=30.0)
    assert upgrade(fresh_url) == NEWEST


@pytest.mark.parametrize("year", [2026, 2126])
def test_a_database_with_a_job_under_way_is_not_upgraded(
    fresh_url: str, year: int, release_next: Callable[[], None]
) -> None:
    job_id = store_job(fresh_url)
    now = datetime.now(UTC)
    expires = now + timedelta(seconds=LONGEST_LEASE_SECONDS / 2)
    lease = (
        "UPDATE jobs SET state = 'running', lease_owner = 'elsewhere:7',"
        " lease_renewed_at = '{:%Y-%m-%d %H:%M:%S}', lease_expires_at = '{:%Y-%m-%d %H:%M:%S}'"
    )
    edit(fresh_url, lease.format(now, expires))
    release_next()
    with pytest.raises(Conflict, match=f"job {job_id} is run by elsewhere:7"):
        upgrade(fresh_url)
    wrong = datetime(year, 1, 1, tzinfo=UTC)
    edit(fresh_url, lease.format(wrong, wrong))
    assert upgrade(fresh_url) == NEWEST


def test_a_process_that_outlived_an_upgrade_is_refused_when_it_connects_again(
    fresh_url: str,
) -> None:
    with closing(open_store(fresh_url)) as store:
        # As a network does that parts it from the server.
        store.close()
        edit(fresh_url, "UPDATE alembic_version SET version_num = '9999'")
        for _ in range(2):
            with pytest.raises(StoreUnavailable, match=f"9999.*to {head()}"):
                store.create_job(spec())


def test_no_process_opens_the_database_during_an_upgrade(
    fresh_url: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("gaitswarm.services.optimizer.store.engine.BUSY_SECONDS", 0.2)
    open_store(fresh_url).close()
    with (
        closing(Database(fresh_url, for_migration=True)) as database,
        exclusive(database),
        pytest.raises(StoreUnavailable, match=r"being upgraded|locked"),
    ):
        open_store(fresh_url).jobs()
    with closing(open_store(fresh_url)) as store:
        assert store.jobs().items == ()


def test_an_upgrade_that_fails_on_its_way_changes_nothing(
    fresh_url: str, release_next: Callable[[], None]
) -> None:
    store_job(fresh_url)
    edit(fresh_url, "CREATE TABLE next (theirs TEXT)")
    release_next()
    with pytest.raises(StoreUnavailable, match=r"next.*already exists"):
        upgrade(fresh_url)
    assert revision(fresh_url) == NEWEST
    edit(fresh_url, "DROP TABLE next")
    assert upgrade(fresh_url) == NEWEST
