"""`db check` and `db prune`."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from gaitswarm.services.optimizer.analysis.verification import check_histories
from gaitswarm.services.optimizer.errors import Conflict, NotFound, StoreUnavailable
from gaitswarm.services.optimizer.jobs.job import Command, JobState
from gaitswarm.services.optimizer.store import Store, open_store
from gaitswarm.services.optimizer.store.maintenance import Pruned, check, prune
from tests.store.examples import Clock, ask, begun, completed
from tests.store.examples import spec as walks
from tests.store.test_opening import edit
from tests.store.test_recordings import recording
from tests.store.test_recordings import spec as fit_to


@pytest.fixture
def job_id(store: Store) -> str:
    """A job with two iterations, and a third one under way."""
    claim = begun(store, iterations=5)
    store.commit(claim, completed(0), ask(1))
    store.commit(claim, completed(1), ask(2))
    return claim.job.id


def test_a_database_in_use_is_as_it_should_be(job_id: str, database_url: str) -> None:
    assert check(database_url) == []


def test_histories_are_compared_with_their_digests_and_a_deleted_one_is_left_out(
    job_id: str, store: Store, database_url: str
) -> None:
    assert check_histories(store) == []
    edit(database_url, "UPDATE iterations SET evaluate_seconds = 9")
    assert check_histories(store) == [], "how long it took is no part of a history"
    edit(database_url, "UPDATE evaluations SET fitness = 0.5 WHERE iteration = 1")
    (finding,) = check_histories(store)
    assert finding.startswith(f"job {job_id} differs from what was committed: iteration 1: ")
    edit(database_url, "UPDATE jobs SET deleted_at = '2026-01-01 00:00:00'")
    assert check_histories(store) == []


def test_a_database_without_schema_is_not_checked(fresh_url: str) -> None:
    with pytest.raises(StoreUnavailable, match="revision none"):
        check(fresh_url)


def test_rows_that_refer_to_nothing_are_found(database: Path) -> None:
    with closing(sqlite3.connect(database)) as connection, connection:
        connection.execute(
            "INSERT INTO evaluations"
            " (job_id, iteration, particle, design, objectives, statuses, fitness)"
            " VALUES ('gone', 0, 0, x'', x'', x'', 1.0)"
        )
    (finding,) = [found for found in check(str(database)) if "refers" in found]
    assert "of evaluations refers to a row of iterations that is not there" in finding


def test_damaged_pages_are_found(database: Path) -> None:
    with closing(sqlite3.connect(database)) as connection, connection:
        # Its pages belong to nothing then.
        connection.execute("PRAGMA writable_schema = ON")
        connection.execute("DELETE FROM sqlite_master WHERE name = 'ix_jobs_parent_id'")
    assert any("damaged" in found for found in check(str(database)))


def test_recordings_that_nothing_refers_to_are_removed_a_day_after_they_came(
    store: Store, database_url: str
) -> None:
    wanted, unused = (store.add_recording(recording(first_tick=tick)) for tick in (20, 21))
    store.create_job(fit_to(wanted))
    edit(database_url, "UPDATE recordings SET created_at = '2026-01-01 00:00:00'")
    waiting = store.add_recording(recording(first_tick=22))
    later = (
        "UPDATE recordings SET created_at = '2126-01-01 00:00:00' WHERE created_at > '2026-01-02'"
    )
    edit(database_url, later)
    assert prune(database_url) == Pruned((), 1)
    assert set(store.recordings([wanted, waiting])) == {wanted, waiting}
    with pytest.raises(NotFound):
        store.recordings([unused])
    assert prune(database_url) == Pruned((), 0)


def test_space_that_rows_have_left_is_given_back(database: Path) -> None:
    with closing(open_store(str(database))) as store:
        for tick in range(60):
            store.add_recording(recording(first_tick=tick))
    edit(str(database), "UPDATE recordings SET created_at = '2026-01-01 00:00:00'")
    before = database.stat().st_size
    assert prune(str(database)).recordings == 60
    assert database.stat().st_size < before / 2


def test_jobs_that_ended_long_ago_are_removed_by_state_and_kept_ones_stay(
    store: Store, database_url: str
) -> None:
    cancelled, kept, waiting = (store.create_job(walks())[0].id for _ in range(3))
    succeeded = store.create_job(walks(), idempotency_key="succeeded")[0].id
    for job in (cancelled, kept, succeeded):
        store.command(job, Command.CANCEL)
    store.keep(kept, True)
    later = "UPDATE jobs SET finished_at = '2026-01-01 00:00:00' WHERE state = 'cancelled'"
    edit(database_url, later)
    edit(database_url, "UPDATE jobs SET state = idempotency_key WHERE idempotency_key <> ''")
    assert prune(database_url, older_than=timedelta(days=36_500)).jobs == ()
    day = timedelta(days=1)
    assert prune(database_url, older_than=day, states={JobState.CANCELLED}).jobs == (cancelled,)
    assert prune(database_url, older_than=day).jobs == (succeeded,)
    assert {job.id for job in store.jobs().items} == {kept, waiting}


def test_a_jump_of_the_clock_is_noticed_until_there_are_changes_for_a_day(
    store: Store, clock: Clock
) -> None:
    def after(hours: float) -> timedelta | None:
        clock.advance(hours * 3600.0)
        return store.clock_jump()

    assert store.clock_jump() is None
    for _ in range(4):
        store.create_job(walks())
        assert after(hours=12) is None
    jumped = after(hours=60 * 24)
    assert jumped is not None and jumped.days == 60
    for _ in range(2):
        store.create_job(walks())
        assert after(hours=11) is not None
    store.create_job(walks())
    assert after(hours=11) is None


def test_nothing_is_pruned_by_age_after_a_jump_of_the_clock_unless_it_is_trusted(
    database: Path, clock: Clock
) -> None:
    clock.now = datetime.now(UTC) - timedelta(days=60)
    with closing(open_store(str(database), clock=clock)) as store:
        job, _ = store.create_job(walks())
        store.command(job.id, Command.CANCEL)
    day = timedelta(days=1)
    with pytest.raises(Conflict, match=r"days.* ahead of the last change .*--trust-clock"):
        prune(str(database), older_than=day)
    assert prune(str(database), older_than=day, trusts_clock=True).jobs == (job.id,)
