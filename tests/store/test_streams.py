"""Event streams on both databases: all that is committed, once, in order, whatever happens."""

from __future__ import annotations

import json
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing

import httpx2
import pytest

from gaitswarm.services.optimizer.errors import StoreUnavailable
from gaitswarm.services.optimizer.jobs.job import Claim
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.store import Store, open_store
from tests.examples.processes import within
from tests.examples.servers import Server
from tests.store.examples import ask, begun, completed
from tests.store.postgres_server import PostgresServer

pytestmark = pytest.mark.slow

ITERATIONS = 10
STREAMS = 4


def followed(url: str, job_id: str, opened: threading.Semaphore) -> list[int]:
    """Iterations of a stream, until the server ends it. opened: released at the first event."""
    return list(iterations(url, job_id, opened))


def iterations(url: str, job_id: str, opened: threading.Semaphore) -> Iterator[int]:
    with (
        httpx2.Client(base_url=url, timeout=60.0) as client,
        client.stream("GET", f"/v1/jobs/{job_id}/events") as answer,
    ):
        for line in answer.iter_lines():
            if line.startswith("event: state"):
                opened.release()
            data = json.loads(line[6:]) if line.startswith("data: {") else {}
            if "index" in data:
                yield data["index"]


def commit(store: Store, claim: Claim, index: int) -> None:
    """As a runner does, which tries again where the database is away."""
    following = ask(index + 1) if index + 1 < ITERATIONS else None

    def done() -> bool:
        try:
            store.commit(claim, completed(index), following)
        except StoreUnavailable:
            return False
        return True

    assert within(30.0, done)


def test_many_streams_of_a_job_have_every_iteration_once_and_in_order(
    store: Store, database_url: str
) -> None:
    claim = begun(store, iterations=ITERATIONS)
    with (
        closing(open_store(database_url)) as served,
        closing(Server(JobService(served), api_event_poll_seconds=0.02)) as server,
        ThreadPoolExecutor(STREAMS) as pool,
    ):
        opened = threading.Semaphore(0)
        streams = [pool.submit(followed, server.url, claim.job.id, opened) for _ in range(STREAMS)]
        for _ in streams:
            assert opened.acquire(timeout=30.0)
        for index in range(ITERATIONS):
            commit(store, claim, index)
        for stream in streams:
            assert stream.result(timeout=30.0) == list(range(ITERATIONS))


def test_an_open_stream_survives_a_crash_of_the_database(stoppable_server: PostgresServer) -> None:
    url = f"{stoppable_server.url}/postgres"
    with (
        closing(open_store(url)) as store,
        closing(open_store(url)) as served,
        closing(Server(JobService(served), api_event_poll_seconds=0.2)) as server,
        ThreadPoolExecutor(1) as pool,
    ):
        claim = begun(store, iterations=ITERATIONS)
        opened = threading.Semaphore(0)
        stream = pool.submit(followed, server.url, claim.job.id, opened)
        assert opened.acquire(timeout=30.0)
        for index in range(ITERATIONS):
            if index == ITERATIONS // 2:
                stoppable_server.stop()
                stoppable_server.start()
            commit(store, claim, index)
        assert stream.result(timeout=30.0) == list(range(ITERATIONS))
