"""Streams of one job share what is read for them, and none of them misses a change."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Awaitable, Callable

import pytest

from api.topics import News, Topic, Topics
from services.optimizer.errors import StoreUnavailable
from services.optimizer.jobs.job import Command, Job
from services.optimizer.service import JobService
from services.optimizer.store.sql_store import SqlStore
from tests.api.conftest import Commit

LIMIT = 100


class Counted(JobService):
    """A service that counts how often a job is read, and lets no read end while it is held."""

    def __init__(self, store: SqlStore) -> None:
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
def counted(store: SqlStore) -> Counted:
    return Counted(store)


def run(service: JobService, job: Job, use: Callable[[Topic], Awaitable[None]]) -> None:
    """Use the topic of a job in an event loop; changes are polled for often."""

    async def follow() -> None:
        with Topics().follow(service, job.id, poll_seconds=0.01) as topic:
            await asyncio.wait_for(use(topic), timeout=20.0)

    asyncio.run(follow())


async def read_by(streams: int, topic: Topic) -> list[asyncio.Task[News]]:
    """As many streams, each of which has asked."""
    tasks = [asyncio.ensure_future(topic.news(None, limit=LIMIT)) for _ in range(streams)]
    await asyncio.sleep(0)
    return tasks


def test_streams_that_ask_for_the_same_share_the_answer(counted: Counted, job: Job) -> None:
    async def use(topic: Topic) -> None:
        tasks = await read_by(20, topic)
        counted.free.set()
        answers = await asyncio.gather(*tasks)
        assert {id(answer) for answer in answers} == {id(answers[0])}

    run(counted, job, use)
    assert counted.reads == [job.id]


def test_an_answer_of_before_a_change_is_not_given_to_who_asks_after_it(
    counted: Counted, store: SqlStore, job: Job
) -> None:
    async def use(topic: Topic) -> None:
        (before,) = await read_by(1, topic)
        version = topic.version
        await asyncio.to_thread(counted.read.wait, 10.0)
        store.command(job.id, Command.PAUSE)
        await topic.changed(version, seconds=10.0)
        (after,) = await read_by(1, topic)
        counted.free.set()
        await before
        assert (await after).job.state == "paused"

    run(counted, job, use)


def test_a_stream_that_leaves_takes_the_answer_from_nobody(counted: Counted, job: Job) -> None:
    async def use(topic: Topic) -> None:
        leaves, stays = await read_by(2, topic)
        leaves.cancel()
        counted.free.set()
        assert (await stays).job.id == job.id

    run(counted, job, use)


def test_a_read_that_failed_is_tried_anew(
    store: SqlStore, job: Job, commit: Commit, monkeypatch: pytest.MonkeyPatch
) -> None:
    commit(job, 1)
    service = JobService(store)
    failures = [StoreUnavailable("away")]
    read = SqlStore.job

    def job_or_failure(self: SqlStore, job_id: str) -> Job:
        if failures:
            raise failures.pop()
        return read(self, job_id)

    monkeypatch.setattr(SqlStore, "job", job_or_failure)

    async def use(topic: Topic) -> None:
        with pytest.raises(StoreUnavailable):
            await topic.news(None, limit=LIMIT)
        iterations = (await topic.news(None, limit=LIMIT)).iterations
        assert [iteration.index for iteration in iterations] == [0]

    run(service, job, use)
