"""Cancellation of asynchronous calls."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import aclosing, closing
from pathlib import Path
from typing import Any, cast

import anyio
import httpx2
import pytest
from anyio import to_thread

import gaitswarm
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.runtime import open_store
from tests.examples.servers import Server
from tests.library.conftest import SMALL

pytestmark = pytest.mark.slow

SECONDS = 5.0
"""Far less than a stream is silent in these tests."""


def open_streams(url: str) -> float:
    """Event streams that a server has open."""
    text = httpx2.get(f"{url}/metrics", verify=False).text
    (line,) = [x for x in text.splitlines() if x.startswith("gaitswarm_event_streams ")]
    return float(line.split()[1])


def ended(count: Callable[[], float]) -> bool:
    """Whether a count becomes 0 soon."""
    ends = time.monotonic() + SECONDS
    while count() > 0 and time.monotonic() < ends:
        time.sleep(0.02)
    return count() == 0


async def follow(jobs: gaitswarm.AsyncJobs, job_id: str, *, cancel: bool) -> None:
    """Follow a queued job beyond its first event, until cancelled, or leave the loop."""
    with anyio.CancelScope() as scope:
        async with aclosing(cast(Any, jobs.follow(job_id))) as events:
            async for _ in events:
                if not cancel:
                    break
                scope.deadline = anyio.current_time() + 0.05


@pytest.mark.parametrize("cancel", [True, False], ids=["cancelled", "left"])
def test_a_stream_that_is_followed_no_longer_is_closed_at_once(db: Path, cancel: bool) -> None:
    async def work(url: str) -> None:
        async with gaitswarm.AsyncJobs(gaitswarm.connect(url)) as there:
            job = await there.submit(**SMALL)
            begun = time.monotonic()
            await follow(there, job.id, cancel=cancel)
            assert time.monotonic() - begun < SECONDS
            assert await to_thread.run_sync(ended, lambda: open_streams(url))

    with closing(open_store(str(db))) as store, closing(Server(JobService(store))) as server:
        anyio.run(work, server.url)


@pytest.mark.parametrize("cancel", [True, False], ids=["cancelled", "left"])
def test_a_database_that_is_followed_no_longer_is_read_no_longer(db: Path, cancel: bool) -> None:
    reads = list[str]()

    class Counted(JobService):
        def job(self, job_id: str) -> Any:
            reads.append(job_id)
            return super().job(job_id)

    async def work() -> None:
        service = Counted(open_store(str(db)))
        here = gaitswarm.DatabaseJobs(service, str(db), poll_seconds=0.1)
        async with gaitswarm.AsyncJobs(here) as jobs:
            job = await jobs.submit(**SMALL)
            await follow(jobs, job.id, cancel=cancel)
            await anyio.sleep(0.05)
            read = len(reads)
            await anyio.sleep(0.3)
            assert len(reads) == read

    anyio.run(work)


def test_a_cancelled_question_returns_at_once() -> None:
    def refused(_: httpx2.Request) -> httpx2.Response:
        raise httpx2.ConnectError("refused")

    patient = gaitswarm.Backoff(first=1.0, longest=1.0, attempts=2)
    way = httpx2.MockTransport(refused)

    async def work() -> None:
        with closing(
            gaitswarm.ServerJobs("http://robots", backoff=patient, transport=way)
        ) as there:
            jobs = gaitswarm.AsyncJobs(there)
            with anyio.move_on_after(0.1) as scope:
                await jobs.job("k2q7zr5dm9xw")
            assert scope.cancelled_caught

    begun = time.monotonic()
    anyio.run(work)
    assert time.monotonic() - begun < 1.0
