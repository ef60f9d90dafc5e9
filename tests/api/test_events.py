"""The event stream: complete, ordered, resumable, finite."""

from __future__ import annotations

import json
import sqlite3
import threading
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import httpx2
import pytest

from gaitswarm.services.optimizer.jobs.job import Command, Job
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.store import Store
from tests.api.conftest import PARTICLES, Commit, Serve

pytestmark = pytest.mark.slow

Event = dict[str, Any]


def parsed(lines: Iterator[str]) -> Iterator[Event]:
    """Events of a stream, as the SSE specification reads them."""
    event: Event = {}
    for line in lines:
        if line:
            name, _, value = line.partition(": ")
            event[name] = json.loads(value) if name == "data" else value
        elif "data" in event:
            yield event
            event = {}
        else:
            event = {}


def events_of(client: httpx2.Client, job: Job, **options: Any) -> list[Event]:
    """All events until the server ends the stream."""
    with client.stream("GET", f"/v1/jobs/{job.id}/events", **options) as answer:
        assert answer.status_code == 200
        assert answer.headers["content-type"].startswith("text/event-stream")
        return list(parsed(answer.iter_lines()))


def ids(events: list[Event]) -> list[str]:
    return [event["id"] for event in events if event["event"] == "iteration"]


def states(events: list[Event]) -> list[str]:
    return [event["data"]["state"] for event in events if event["event"] == "state"]


def test_a_finished_jobs_stream_has_all_iterations_then_the_state_and_ends(
    client: httpx2.Client, job: Job, commit: Commit
) -> None:
    commit(job, 3)

    events = events_of(client, job)

    assert [event["event"] for event in events] == ["iteration"] * 3 + ["state"]
    assert ids(events) == ["0", "1", "2"]
    assert [event["data"]["index"] for event in events[:3]] == [0, 1, 2]
    assert events[-1]["data"]["state"] == "succeeded"
    assert "id" not in events[-1]


def test_iterations_are_streamed_as_they_are_committed(
    client: httpx2.Client, job: Job, commit: Commit
) -> None:
    claim = commit(job, 1)

    with client.stream("GET", f"/v1/jobs/{job.id}/events") as answer:
        stream = parsed(answer.iter_lines())
        assert next(stream)["id"] == "0"
        assert next(stream)["data"]["state"] == "running"
        commit(job, 1, claim=claim)
        assert next(stream)["id"] == "1"
        commit(job, 1, claim=claim)
        assert next(stream)["id"] == "2"
        assert next(stream)["data"] == {
            "id": job.id,
            "state": "succeeded",
            "error": None,
            "iterations": 3,
            "evaluations": 3 * PARTICLES,
            "waiting": None,
        }
        assert list(stream) == []


def test_what_a_job_waits_for_is_streamed_once_and_shown_of_the_job(
    client: httpx2.Client, store: Store, job: Job, commit: Commit
) -> None:
    claim = commit(job, 1)
    with client.stream("GET", f"/v1/jobs/{job.id}/events", params={"after": 0}) as answer:
        stream = parsed(answer.iter_lines())
        assert next(stream)["data"]["waiting"] is None
        for _ in range(2):
            store.renew(claim, lease_seconds=60.0, waiting="no route to host")
        news = next(stream)["data"]
        assert (news["state"], news["waiting"]) == ("running", "no route to host")
        view = client.get(f"/v1/jobs/{job.id}").json()
        assert (view["waiting"], view["eta_seconds"]) == ("no route to host", None)
        store.renew(claim, lease_seconds=60.0)
        assert next(stream)["data"]["waiting"] is None


def test_a_broken_stream_continues_without_gap_or_repeat(
    client: httpx2.Client, job: Job, commit: Commit
) -> None:
    claim = commit(job, 2)
    received = []
    with client.stream("GET", f"/v1/jobs/{job.id}/events") as answer:
        for event in parsed(answer.iter_lines()):
            received.append(event)
            break
    commit(job, 1, claim=claim)

    received += events_of(client, job, headers={"Last-Event-ID": received[-1]["id"]})

    assert ids(received) == ["0", "1", "2"]


def test_no_iteration_is_missed_however_the_stream_races_with_the_runner(
    client: httpx2.Client, store: Store, spec: JobSpec, commit: Commit
) -> None:
    job = store.create_job(spec.model_copy(update={"iterations": 40}))[0]
    runner = threading.Thread(target=commit, args=(job, 40))
    runner.start()

    received: list[Event] = []
    while states(received)[-1:] != ["succeeded"]:
        last = ids(received)[-1:]
        headers = {"Last-Event-ID": last[0]} if last else {}
        received += events_of(client, job, headers=headers, params={"limit": 7})

    runner.join()
    assert ids(received) == [str(index) for index in range(40)]


def test_resuming_after_the_end_gives_the_final_state_alone(
    client: httpx2.Client, job: Job, commit: Commit
) -> None:
    commit(job, 3)

    events = events_of(client, job, headers={"Last-Event-ID": "2"})

    assert [event["event"] for event in events] == ["state"]


def test_changes_of_state_are_events_and_a_cancellation_ends_the_stream(
    client: httpx2.Client, store: Store, job: Job
) -> None:
    with client.stream("GET", f"/v1/jobs/{job.id}/events") as answer:
        stream = parsed(answer.iter_lines())
        assert next(stream)["data"]["state"] == "queued"
        store.command(job.id, Command.PAUSE)
        assert next(stream)["data"]["state"] == "paused"
        store.command(job.id, Command.CANCEL)
        assert [event["data"]["state"] for event in stream] == ["cancelled"]


def test_a_stream_that_does_not_follow_ends_when_it_has_caught_up(
    client: httpx2.Client, job: Job, commit: Commit
) -> None:
    commit(job, 2)

    events = events_of(client, job, params={"follow": "false"})

    assert ids(events) == ["0", "1"]
    assert states(events) == ["running"]


def test_limit_and_after_bound_a_stream(client: httpx2.Client, job: Job, commit: Commit) -> None:
    commit(job, 3)

    assert ids(events_of(client, job, params={"limit": 2})) == ["0", "1"]
    assert ids(events_of(client, job, params={"after": 0})) == ["1", "2"]


def test_a_foreign_last_event_id_is_refused(client: httpx2.Client, job: Job) -> None:
    answer = client.get(f"/v1/jobs/{job.id}/events", headers={"Last-Event-ID": "last"})

    assert answer.status_code == 422
    assert answer.json()["errors"][0]["field"] == "Last-Event-ID"


def test_an_idle_stream_is_kept_alive_by_comments(
    client: httpx2.Client, job: Job, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("gaitswarm.api.events.KEEP_ALIVE_SECONDS", 0.05)

    with client.stream("GET", f"/v1/jobs/{job.id}/events") as answer:
        assert any(line.startswith(":") for line in answer.iter_lines())


def test_a_waiting_stream_holds_no_transaction(serve: Serve, database: Path, job: Job) -> None:
    server = serve(api_event_poll_seconds=30.0)

    with server.client.stream("GET", f"/v1/jobs/{job.id}/events") as answer:
        stream = parsed(answer.iter_lines())
        next(stream)
        with closing(sqlite3.connect(database)) as connection:
            # SQLite can empty its write-ahead log only while no process reads or writes.
            busy, _, _ = connection.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchone()
        server.stop()

    assert busy == 0


def test_a_stopping_server_ends_open_streams(serve: Serve, job: Job) -> None:
    server = serve(api_event_poll_seconds=60.0, api_shutdown_seconds=60)

    with server.client.stream("GET", f"/v1/jobs/{job.id}/events") as answer:
        stream = parsed(answer.iter_lines())
        next(stream)
        began = time.monotonic()
        server.stop()
        assert list(stream) == []

    assert time.monotonic() - began < 10.0
