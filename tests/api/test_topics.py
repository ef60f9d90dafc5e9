"""Streams of one job share what is read for them, and none of them misses a change."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Awaitable, Callable

import pytest

from gaitswarm.api.events import News, Topic, Topics
from gaitswarm.services.optimizer.errors import StoreUnavailable
from gaitswarm.services.optimizer.jobs.job import Command, Job
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.store import Store
from tests.api.conftest import Commit


class Counted(JobService):
    """A service that counts how often a job is read, and lets no read end while it is held."""

    def __init__(self, store: Store) -> None:
        super().__init__(store)
        object.__setattr__(self, "reads", [])
        object.__setattr__(self, "read", threading.Event())
        object.__setattr__(self, "free", threading.Event())

    reads: list[str]
    read: threading.Event
    free: threading.Event

    def job(self, job_id: str) -> Job:
        job = super().job(job_id)
        self.reads.append(job_id)
        self.read.set()
        self.free.wait(10.0)
        return job


@pytest.fixture
def counted(store: Store) -> Counted:
    return Counted(store)


def run(service: JobService, job: Job, use: Callable[[Topic], Awaitable[None]]) -> None:
    """Use the topic of a job in an event loop; changes are polled for often."""

    async def follow() -> None:
        with Topics().follow(service, job.id, poll_seconds=0.01) as topic:
            await asyncio.wait_for(use(topic), timeout=20.0)

    asyncio.run(follow())


async def asked_by(
    streams: int, topic: Topic, known: int | None = None
) -> list[asyncio.Task[News | None]]:
    """As many streams, each of which has asked."""
    tasks = [asyncio.ensure_future(topic.news(None, known=known)) for _ in range(streams)]
    await asyncio.sleep(0)
    return tasks


async def now(topic: Topic) -> News:
    """What is read at once."""
    found = await topic.news(None)
    assert found is not None
    return found


def test_streams_that_ask_for_the_same_share_the_answer(counted: Counted, job: Job) -> None:
    async def use(topic: Topic) -> None:
        tasks = await asked_by(20, topic)
        counted.free.set()
        answers = await asyncio.gather(*tasks)
        assert {id(answer) for answer in answers} == {id(answers[0])}

    run(counted, job, use)
    assert counted.reads == [job.id]


def test_an_answer_of_before_a_change_is_not_given_to_who_asks_after_it(
    counted: Counted, store: Store, job: Job
) -> None:
    async def use(topic: Topic) -> None:
        (before,) = await asked_by(1, topic)
        version = topic.version
        await asyncio.to_thread(counted.read.wait, 10.0)
        store.command(job.id, Command.PAUSE)
        topic.advance()
        assert topic.version > version
        (after,) = await asked_by(1, topic)
        counted.free.set()
        await before
        found = await after
        assert found is not None and found.job.state == "paused"

    run(counted, job, use)


def test_a_stream_that_leaves_takes_the_answer_from_no_one(counted: Counted, job: Job) -> None:
    async def use(topic: Topic) -> None:
        leaves, stays = await asked_by(2, topic)
        leaves.cancel()
        counted.free.set()
        found = await stays
        assert found is not None and found.job.id == job.id

    run(counted, job, use)


def test_a_read_that_failed_is_tried_again(
    store: Store, job: Job, commit: Commit, monkeypatch: pytest.MonkeyPatch
) -> None:
    commit(job, 1)
    service = JobService(store)
    failures = [StoreUnavailable("away")]
    read = Store.job

    def job_or_failure(self: Store, job_id: str) -> Job:
        if failures:
            raise failures.pop()
        return read(self, job_id)

    monkeypatch.setattr(Store, "job", job_or_failure)

    async def use(topic: Topic) -> None:
        with pytest.raises(StoreUnavailable):
            await topic.news(None)
        iterations = (await now(topic)).iterations
        assert [iteration.index for iteration in iterations] == [0]

    run(service, job, use)


def test_a_change_is_read_once_for_all_streams_that_wait_for_it(
    counted: Counted, store: Store, job: Job
) -> None:
    counted.free.set()

    async def use(topic: Topic) -> None:
        # The first look of who watches makes a version.
        first = await topic.news(None, known=0)
        assert first is not None
        tasks = await asked_by(100, topic, first.version)
        counted.reads.clear()
        store.command(job.id, Command.PAUSE)
        answers = await asyncio.gather(*tasks)
        assert {answer and answer.job.state for answer in answers} == {"paused"}
        # Who has been late asks for what has been read meanwhile.
        assert answers[0] is await topic.news(None, known=first.version)

    run(counted, job, use)
    assert counted.reads == [job.id]


def test_streams_that_wait_are_answered_when_the_server_stops(counted: Counted, job: Job) -> None:
    async def follow() -> None:
        topics, stopping = Topics(), asyncio.Event()
        ending = asyncio.ensure_future(topics.end_with(stopping))
        with topics.follow(counted, job.id, poll_seconds=10.0) as topic:
            waiting = await asked_by(2, topic, topic.version)
            # One of which the read has not ended, as of a server that is out of reach.
            waiting += await asked_by(1, topic)
            stopping.set()
            await ending
            assert await asyncio.gather(*waiting) == [None, None, None]
            assert await topic.news(None) is None
            counted.free.set()

    asyncio.run(asyncio.wait_for(follow(), timeout=20.0))
