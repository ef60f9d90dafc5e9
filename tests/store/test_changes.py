"""Followers of a job are notified of its changes, whichever process commits them."""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterator
from contextlib import ExitStack, closing

import pytest

from gaitswarm.services.optimizer.jobs.job import Command
from gaitswarm.services.optimizer.store import Store, open_store
from tests.examples.processes import eventually
from tests.store.examples import LEASE, Clock, ask, begun, completed, spec
from tests.store.postgres_server import PostgresServer

POLL_SECONDS = 0.02


@pytest.fixture
def waiting(database_url: str) -> Iterator[Store]:
    """A store of another process, as good as: it shares no connection with `store`."""
    with closing(open_store(database_url)) as store:
        yield store


def settle(waiting: Store, woken: threading.Event) -> None:
    """Wait until the watcher has polled once, which may wake without a change."""
    eventually(woken.is_set)
    woken.clear()
    assert waiting.jobs().items


def test_commits_and_commands_of_another_process_are_reported(store: Store, waiting: Store) -> None:
    claim = begun(store)
    woken = threading.Event()
    with waiting.changes.watch(claim.job.id, woken.set, poll_seconds=POLL_SECONDS):
        settle(waiting, woken)
        store.commit(claim, completed(0), ask(1))
        assert woken.wait(10.0)
        woken.clear()
        store.command(claim.job.id, Command.PAUSE)
        assert woken.wait(10.0)


def test_what_a_job_waits_for_is_reported_once(store: Store, waiting: Store) -> None:
    claim = begun(store)
    other, _ = store.create_job(spec())
    mine, theirs = threading.Event(), threading.Event()
    with (
        waiting.changes.watch(claim.job.id, mine.set, poll_seconds=POLL_SECONDS),
        waiting.changes.watch(other.id, theirs.set, poll_seconds=POLL_SECONDS),
    ):
        settle(waiting, mine)
        store.renew(claim, lease_seconds=LEASE, waiting="no route to host")
        assert mine.wait(10.0)
        mine.clear()
        store.renew(claim, lease_seconds=LEASE, waiting="no route to host")
        theirs.clear()
        store.command(other.id, Command.CANCEL)
        assert theirs.wait(10.0)
        assert not mine.is_set()


def test_a_change_there_and_back_between_two_polls_is_reported(
    store: Store, waiting: Store, clock: Clock
) -> None:
    claim = begun(store)
    woken = threading.Event()
    with waiting.changes.watch(claim.job.id, woken.set, poll_seconds=1.0):
        settle(waiting, woken)
        clock.advance(1.0)
        store.renew(claim, lease_seconds=LEASE, waiting="no route to host")
        store.renew(claim, lease_seconds=LEASE)
        assert woken.wait(10.0)


def test_neither_heartbeats_nor_other_jobs_are_reported(store: Store, waiting: Store) -> None:
    claim = begun(store)
    other, _ = store.create_job(spec())
    mine, theirs = threading.Event(), threading.Event()
    with (
        waiting.changes.watch(claim.job.id, mine.set, poll_seconds=POLL_SECONDS),
        waiting.changes.watch(other.id, theirs.set, poll_seconds=POLL_SECONDS),
    ):
        settle(waiting, mine)
        store.renew(claim, lease_seconds=LEASE)
        store.command(other.id, Command.CANCEL)
        assert theirs.wait(10.0)
        assert not mine.is_set()


def test_all_who_wait_in_a_process_share_a_thread_and_a_connection(
    store: Store, waiting: Store
) -> None:
    jobs = [store.create_job(spec())[0] for _ in range(20)]
    woken = [threading.Event() for _ in jobs]

    def threads() -> int:
        return sum(thread.name == "changes" for thread in threading.enumerate())

    before = threads()
    with ExitStack() as watches:
        for job, event in zip(jobs, woken, strict=True):
            watch = waiting.changes.watch(job.id, event.set, poll_seconds=POLL_SECONDS)
            watches.enter_context(watch)
        assert threads() == before + 1
        for job, event in zip(jobs, woken, strict=True):
            event.clear()
            store.command(job.id, Command.CANCEL)
            assert event.wait(10.0)
    waiting.close()
    assert threads() == before


@pytest.mark.slow
def test_changes_are_reported_again_after_a_crash_of_the_server(
    stoppable_server: PostgresServer,
) -> None:
    url = f"{stoppable_server.url}/postgres"
    with closing(open_store(url)) as store, closing(open_store(url)) as waiting:
        claim = begun(store)
        woken = threading.Event()
        with waiting.changes.watch(claim.job.id, woken.set, poll_seconds=0.2):
            settle(waiting, woken)
            stoppable_server.stop()
            stoppable_server.start()
            store.commit(claim, completed(0), ask(1))
            assert woken.wait(10.0)


def test_a_listener_that_has_left_receives_nothing(store: Store, waiting: Store) -> None:
    claim = begun(store)
    left, stays = threading.Event(), threading.Event()
    with waiting.changes.watch(claim.job.id, stays.set, poll_seconds=POLL_SECONDS):
        with waiting.changes.watch(claim.job.id, left.set, poll_seconds=POLL_SECONDS):
            settle(waiting, stays)
        left.clear()
        store.commit(claim, completed(0), ask(1))
        assert stays.wait(10.0)
    assert not left.is_set()


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_a_thread_that_has_ended_is_reported_while_a_client_waits(
    database_url: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    with closing(open_store(database_url)) as store:
        assert store.changes.trouble() is None
        monkeypatch.setattr(
            "gaitswarm.services.optimizer.store.changes.select", lambda *_: sys.exit()
        )
        with store.changes.watch("nosuchjob123", lambda: None, poll_seconds=0.01):
            eventually(lambda: store.changes.trouble() is not None)
            assert "restart this process" in str(store.changes.trouble())
        assert store.changes.trouble() is None
