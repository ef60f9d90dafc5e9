"""Jobs that are deleted are gone wholly, others stay; old ones go by themselves, some never."""

from __future__ import annotations

import threading
from datetime import timedelta

import pytest
from sqlalchemy import func, select

from gaitswarm.services.optimizer.errors import Conflict, LeaseLost, NotFound
from gaitswarm.services.optimizer.jobs.fork import Fork, Lineage, TakenHistory
from gaitswarm.services.optimizer.jobs.iteration import CompletedIteration
from gaitswarm.services.optimizer.jobs.job import Command, Job, JobState
from gaitswarm.services.optimizer.store import Store
from gaitswarm.services.optimizer.store import jobs as jobs_module
from gaitswarm.services.optimizer.store.engine import Database
from gaitswarm.services.optimizer.store.jobs import TRASH
from gaitswarm.services.optimizer.store.tables import metadata
from tests.store.examples import LEASE, Clock, ask, begun, completed, spec


@pytest.fixture(autouse=True)
def short_transactions(monkeypatch: pytest.MonkeyPatch) -> None:
    """Remove fifty evaluations in one transaction."""
    monkeypatch.setattr(jobs_module, "_EVALUATIONS_AT_ONCE", 50)


KEYS = (b"\0" * 16, b"\xff" * 16)
TABLES = ("jobs", "iterations", "evaluations", "reevaluations", "notifications")


def rows(database_url: str) -> dict[str, int]:
    """How many there are in every table that has rows of jobs."""
    database = Database(database_url)
    with database.read() as connection:
        found = {
            table: connection.execute(
                select(func.count()).select_from(metadata.tables[table])
            ).scalar_one()
            for table in TABLES
        }
    database.close()
    return found


def ended(store: Store, done: CompletedIteration | None = None) -> Job:
    """A job that has succeeded, of one iteration."""
    claim = begun(store, notify_url="http://127.0.0.1:9/ended", iterations=1)
    store.commit(claim, done or completed(0), None)
    return store.job(claim.job.id)


def large(particles: int = 60) -> CompletedIteration:
    """More evaluations than are removed in one transaction."""
    return completed(0, [float(k) for k in range(particles)])


@pytest.mark.variants("*-2")
@pytest.mark.parametrize("particles", [2, 60])
def test_all_of_a_job_goes_and_nothing_of_another(
    store: Store, database_url: str, particles: int
) -> None:
    other = ended(store)
    before = rows(database_url)
    job = ended(store, large(particles))
    store.delete_job(job.id)
    assert [listed.id for listed in store.jobs().items] == [other.id]
    store.purge_deleted()
    assert rows(database_url) == before
    assert len(store.evaluations(other.id, 0)) == 2


def test_rows_of_a_long_job_go_by_pieces_that_can_be_gone_on_with(
    store: Store, database_url: str
) -> None:
    claim = begun(store, iterations=3, particles=40)
    for index in range(3):
        following = None if index == 2 else ask(index + 1, particles=40)
        done = completed(index, [float(k) for k in range(40)])
        store.commit(claim, done, following)
    store.delete_job(claim.job.id)
    assert rows(database_url)["evaluations"] == 120
    asked = iter([False, True])
    store.purge_deleted(lambda: next(asked))
    assert rows(database_url) == {
        "jobs": 1,
        "iterations": 2,
        "evaluations": 80,
        "reevaluations": 0,
        "notifications": 0,
    }
    with pytest.raises(NotFound):
        store.iterations(claim.job.id)
    store.purge_deleted()
    assert set(rows(database_url).values()) == {0}


def test_a_deleted_job_is_restored_as_it_was_for_a_day(
    store: Store, clock: Clock, database_url: str
) -> None:
    job = ended(store, large())
    before = rows(database_url)
    store.delete_job(job.id)
    clock.advance(86_399.0)
    store.purge_deleted(older_than=TRASH)
    assert store.deleted_job(job.id).id == job.id
    assert store.restore_job(job.id) == job
    assert rows(database_url) == before
    assert len(store.evaluations(job.id, 0)) == 60

    store.delete_job(job.id)
    clock.advance(86_400.0)
    for ask_for in (store.deleted_job, store.restore_job):
        with pytest.raises(NotFound, match="in the last 24 hours"):
            ask_for(job.id)
    store.purge_deleted(older_than=TRASH)
    assert set(rows(database_url).values()) == {0}


def test_a_job_of_which_rows_are_gone_is_not_restored(store: Store) -> None:
    job = ended(store, large())
    store.delete_job(job.id)
    asked = iter([False, True])
    store.purge_deleted(lambda: next(asked))
    with pytest.raises(NotFound, match="in the last 24 hours"):
        store.restore_job(job.id)
    store.purge_deleted(older_than=TRASH)


def test_a_deleted_job_is_not_found(store: Store) -> None:
    job = ended(store, large())
    store.delete_job(job.id)
    for ask_for in (
        lambda: store.job(job.id),
        lambda: store.best(job.id),
        lambda: store.evaluations(job.id, 0),
        lambda: store.command(job.id, Command.RESUME),
        lambda: store.extend(job.id, 9),
        lambda: store.delete_job(job.id),
        lambda: store.claim("runner-b", lease_seconds=LEASE, job_id=job.id),
    ):
        with pytest.raises(NotFound):
            ask_for()
    assert store.jobs(state=JobState.SUCCEEDED).items == ()
    assert store.jobs(search=job.id).items == ()


@pytest.mark.parametrize("state", ["queued", "running", "pausing"])
def test_a_job_under_way_is_not_deleted_and_the_way_out_is_named(store: Store, state: str) -> None:
    if state == "queued":
        job, _ = store.create_job(spec())
    else:
        job = begun(store).job
    if state == "pausing":
        store.command(job.id, Command.PAUSE)
    with pytest.raises(Conflict, match=f"that is {state}; cancel it first"):
        store.delete_job(job.id)
    assert store.job(job.id).state == state


def test_a_paused_job_is_deleted_with_its_outstanding_ask(store: Store, database_url: str) -> None:
    claim = begun(store)
    store.release(claim, JobState.PAUSED)
    store.delete_job(claim.job.id)
    store.purge_deleted()
    assert set(rows(database_url).values()) == {0}


def test_an_idempotency_key_is_free_again(store: Store) -> None:
    job, _ = store.create_job(spec(), idempotency_key="mine")
    store.command(job.id, Command.CANCEL)
    store.delete_job(job.id)
    again, new = store.create_job(spec(name="another"), idempotency_key="mine")
    assert new and again.id != job.id


def test_designs_that_other_jobs_walked_stay_known(store: Store) -> None:
    gone = ended(store, completed(0)._replace(keys=(KEYS[0], None)))
    ended(store, completed(0)._replace(keys=(None, KEYS[1])))
    assert set(store.known(KEYS)) == set(KEYS)
    store.delete_job(gone.id)
    store.purge_deleted()
    assert set(store.known(KEYS)) == {KEYS[1]}


def test_a_runner_that_still_holds_a_cancelled_job_learns_that_it_was_deleted(
    store: Store,
) -> None:
    claim = begun(store)
    store.command(claim.job.id, Command.CANCEL)
    store.delete_job(claim.job.id)
    for write in (
        lambda: store.renew(claim, lease_seconds=LEASE),
        lambda: store.commit(claim, completed(0), None),
        lambda: store.release(claim, JobState.QUEUED),
    ):
        with pytest.raises(LeaseLost, match="it was deleted"):
            write()


def fork_of(store: Store, parent: Job) -> Job:
    lineage = Lineage(parent=parent.id, from_iteration=1, carried="search", evaluations=2)
    taken = TakenHistory(state={}, fitness=None, provenance=(), accepts_changes=False)
    return store.create_job(spec(iterations=3), fork=Fork(lineage, taken))[0]


def test_a_fork_outlives_its_parent_and_none_is_made_of_one_that_is_gone(store: Store) -> None:
    parent = ended(store)
    fork = fork_of(store, parent)
    store.delete_job(parent.id)
    assert len(store.evaluations(fork.id, 0)) == 2
    with pytest.raises(Conflict, match="was deleted"):
        fork_of(store, parent)


def test_jobs_that_ended_long_ago_are_deleted_and_no_others(store: Store, clock: Clock) -> None:
    old = ended(store)
    claim = begun(store)
    store.renew(claim, lease_seconds=1000.0)
    clock.advance(100.0)
    moment = clock.now
    clock.advance(100.0)
    new = ended(store)
    assert store.delete_ended_before(moment) == (old.id,)
    assert {job.id for job in store.jobs().items} == {claim.job.id, new.id}


def test_old_jobs_that_are_kept_or_whose_forks_have_not_ended_stay(
    store: Store, clock: Clock
) -> None:
    kept, parent = ended(store), ended(store)
    assert store.keep(kept.id, kept=True).kept
    fork = fork_of(store, parent)
    later = clock.now + timedelta(days=400)
    assert store.delete_ended_before(later) == ()
    with pytest.raises(Conflict, match="release it first"):
        store.delete_job(kept.id)
    store.command(fork.id, Command.CANCEL)
    assert set(store.delete_ended_before(later)) == {parent.id, fork.id}
    store.keep(kept.id, kept=False)
    assert store.delete_ended_before(later) == (kept.id,)


def test_only_jobs_that_ended_in_the_states_asked_for_are_deleted(
    store: Store, clock: Clock
) -> None:
    succeeded = ended(store)
    cancelled, _ = store.create_job(spec())
    store.command(cancelled.id, Command.CANCEL)
    later = clock.now + timedelta(days=1)
    assert store.delete_ended_before(later, [JobState.CANCELLED]) == (cancelled.id,)
    assert store.delete_ended_before(later, [JobState.PAUSED]) == ()
    assert store.job(succeeded.id).state is JobState.SUCCEEDED


def test_two_processes_that_remove_the_same_job_do_no_harm(store: Store, database_url: str) -> None:
    claim = begun(store, iterations=3, particles=40)
    for index in range(3):
        following = None if index == 2 else ask(index + 1, particles=40)
        store.commit(claim, completed(index, [float(k) for k in range(40)]), following)
    store.delete_job(claim.job.id)
    threads = [threading.Thread(target=store.purge_deleted) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert set(rows(database_url).values()) == {0}
