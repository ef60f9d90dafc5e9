"""A server that anybody may post to: 200 hostile bodies, posted one after the other.

Each is refused by its field or taken for what it is; the server lives, answers others meanwhile,
and does not grow.
"""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import httpx2
import pytest

from tests.examples.hostile import Body, corpus
from tests.examples.servers import ServerProcess

pytestmark = pytest.mark.slow

BLOCKED = 0.1
"""Seconds that the event loop may compute before it turns to another request."""

PAUSE = 0.01
"""Seconds between two of the others' requests: so much of a block may pass unseen."""

GROWTH = 256
"""Mebibytes that the server may grow by."""


@dataclass(frozen=True)
class Lag:
    """One request of another.

    took: seconds; computed: seconds that the event loop's thread computed until it had answered,
    which tells a block from a machine with other work; behind: the body posted when it was asked.
    """

    took: float
    computed: float
    behind: str


@dataclass
class Posted:
    """What came back for each body, and what the server was doing.

    slowest: the seconds of the body that took longest, and its name; lags: how others fared, who
    asked for next to nothing meanwhile; idle: the same before the first body.
    """

    server: ServerProcess
    answers: list[tuple[Body, httpx2.Response]] = field(default_factory=list)
    slowest: tuple[float, str] = (0.0, "")
    idle: list[Lag] = field(default_factory=list)
    lags: list[Lag] = field(default_factory=list)
    posting: str = "nothing"
    memory: tuple[int, int] = (0, 0)


@pytest.fixture(scope="module")
def posted(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Posted]:
    server = ServerProcess(tmp_path_factory.mktemp("hostile") / "jobs.db", "--no-runner")
    found = Posted(server)
    ended = threading.Event()
    pid = server.process.pid

    def lag(client: httpx2.Client) -> Lag:
        ended.wait(PAUSE)
        begun, computed, behind = time.perf_counter(), _computed(pid), found.posting
        assert client.get("/v1/healthz").status_code == 200
        return Lag(time.perf_counter() - begun, _computed(pid) - computed, behind)

    def ask() -> None:
        with httpx2.Client(base_url=server.url, timeout=60.0, verify=False) as client:
            while not ended.is_set():
                found.lags.append(lag(client))

    asking = threading.Thread(target=ask)
    found.idle += [lag(server.client) for _ in range(40)]
    asking.start()
    try:
        before = _resident(pid)
        for body in corpus():
            found.posting = body.name
            begun = time.perf_counter()
            answer = server.client.post(
                body.path, content=body.content, headers={"Content-Type": "application/json"}
            )
            found.slowest = max(found.slowest, (time.perf_counter() - begun, body.name))
            found.answers.append((body, answer))
        found.memory = before, _resident(pid)
        yield found
    finally:
        ended.set()
        asking.join()
        server.close()


def _computed(pid: int) -> float:
    """Seconds of a processor that a process's first thread, the event loop's, has had."""
    path = Path(f"/proc/{pid}/task/{pid}/schedstat")
    return int(path.read_text().split()[0]) * 1e-9 if path.exists() else 0.0


def _resident(pid: int) -> int:
    """Memory of a process [MiB]."""
    path = Path(f"/proc/{pid}/statm")
    return (int(path.read_text().split()[1]) * 4096) >> 20 if path.exists() else 0


def test_a_server_outlives_them_all(posted: Posted) -> None:
    """One test: posting them takes long, and workers of the tests do not share it."""
    assert len(posted.answers) >= 200
    _every_body_is_refused_or_taken_for_what_it_is(posted)
    _every_refusal_is_a_short_problem_that_names_the_field(posted)
    _others_are_answered_meanwhile(posted)
    if sys.platform == "linux":
        _no_body_blocks_the_event_loop(posted)
        _the_server_does_not_grow_by_what_it_refuses_or_takes(posted)
    _the_server_lives_and_serves(posted)


def _every_body_is_refused_or_taken_for_what_it_is(posted: Posted) -> None:
    wrong = [
        (body.name, answer.status_code, answer.text[:200])
        for body, answer in posted.answers
        if answer.status_code not in body.statuses
    ]
    assert wrong == []


def _every_refusal_is_a_short_problem_that_names_the_field(posted: Posted) -> None:
    refusals = [(body, answer) for body, answer in posted.answers if answer.status_code >= 400]
    assert len(refusals) > 150
    for body, answer in refusals:
        assert answer.headers["content-type"] == "application/problem+json", body.name
        assert len(answer.content) < 50_000, body.name
        fields = [error["field"] for error in answer.json()["errors"]]
        if body.field is not None:
            named = [f for f in fields if f == body.field or f.startswith(f"{body.field}.")]
            assert named, (body.name, fields)


def _the_server_lives_and_serves(posted: Posted) -> None:
    assert posted.server.process.poll() is None
    job = posted.server.submit({"scenarios": ["1"], "iterations": 1})
    assert posted.server.job(job)["state"] == "queued"


def _no_body_blocks_the_event_loop(posted: Posted) -> None:
    assert [lag for lag in posted.lags if lag.computed > BLOCKED - PAUSE] == []


def _others_are_answered_meanwhile(posted: Posted) -> None:
    assert len(posted.lags) > 50
    # A machine has other work, too, which delays answers of an idle server as much.
    assert _common(posted.lags) < _common(posted.idle) + BLOCKED
    # Where a body were checked in the event loop, others would wait for as long as it takes.
    seconds, name = posted.slowest
    waited = [lag.took for lag in posted.lags if lag.behind == name]
    assert max(waited) < seconds / 2.0


def _common(lags: list[Lag]) -> float:
    """Seconds that 19 of 20 do not exceed."""
    return sorted(lag.took for lag in lags)[len(lags) * 95 // 100]


def _the_server_does_not_grow_by_what_it_refuses_or_takes(posted: Posted) -> None:
    before, after = posted.memory
    assert after - before < GROWTH
