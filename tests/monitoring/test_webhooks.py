"""Notifications: created by a job's end, delivered at least once, to allowed hosts only"""

from __future__ import annotations

import base64
import hashlib
import hmac
import signal
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest

from gaitswarm.services.monitoring.webhooks import Notifier
from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.job import Command, JobState
from gaitswarm.services.optimizer.jobs.notification import MOST_ATTEMPTS, check_url, pause_after
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.store import Store, open_store
from gaitswarm.settings import Settings
from tests.examples.forked import ForkedCommand
from tests.examples.jobs import SMALL_SPEC
from tests.examples.processes import eventually
from tests.examples.servers import Server
from tests.monitoring.receiver import Receiver, answering_endlessly, receiving
from tests.optimizer.formula import SPEC
from tests.store.examples import Clock

SECRET = "whsec_" + base64.b64encode(b"of the tests").decode()


@pytest.fixture
def receiver() -> Iterator[Receiver]:
    with receiving() as started:
        yield started


@contextmanager
def notifying(
    store: Store, receiver: Receiver, *, hosts: tuple[str, ...] | None = None
) -> Iterator[None]:
    notifier = Notifier(store, (receiver.host,) if hosts is None else hosts, SECRET)
    notifier.start()
    try:
        yield
    finally:
        notifier.stop()


def cancelled(store: Store, url: str) -> str:
    """A job that has ended, with a URL to notify."""
    job, _ = store.create_job(SPEC, notify_url=url)
    store.command(job.id, Command.CANCEL)
    return job.id


def test_the_end_of_a_job_is_notified_once_and_signed(store: Store, receiver: Receiver) -> None:
    job_id = cancelled(store, receiver.url)
    store.create_job(SPEC)
    with notifying(store, receiver):
        eventually(lambda: store.outbox.about(job_id)[0].delivered_at is not None)
    ((headers, body),) = receiver.received
    (notification,) = receiver.documents()
    assert (notification["type"], notification["data"]["id"]) == ("job.cancelled", job_id)
    assert (
        notification["data"] | {"state": "cancelled", "iterations": 0, "error": None}
        == notification["data"]
    )
    (stored,) = store.outbox.about(job_id)
    assert (stored.id, stored.attempts, stored.error) == (headers["webhook-id"], 1, None)
    signed = f"{stored.id}.{headers['webhook-timestamp']}.".encode() + body
    expected = hmac.new(b"of the tests", signed, hashlib.sha256).digest()
    assert headers["webhook-signature"] == f"v1,{base64.b64encode(expected).decode()}"
    assert "authorization" not in headers and "cookie" not in headers


def test_failed_and_succeeded_jobs_are_notified_and_pauses_are_not(store: Store) -> None:
    url = "http://ci.example/"
    job, _ = store.create_job(SPEC, notify_url=url)
    for state in (JobState.QUEUED, JobState.PAUSED, JobState.FAILED):
        if store.job(job.id).state is JobState.PAUSED:
            store.command(job.id, Command.RESUME)
        claim = store.claim("runner", lease_seconds=30.0)
        assert claim is not None
        store.release(claim, state, error="of the test" if state is JobState.FAILED else None)
    (failed,) = store.outbox.about(job.id)
    assert failed.document["type"] == "job.failed"
    assert failed.document["data"]["error"] == "of the test"
    store.command(job.id, Command.RESUME)
    store.command(job.id, Command.CANCEL)
    first, second = store.outbox.about(job.id)
    assert first.id != second.id
    assert {first.document["type"], second.document["type"]} == {"job.failed", "job.cancelled"}


def test_failed_deliveries_are_repeated_with_the_same_id_and_redirections_are_not_followed(
    database: Path, receiver: Receiver
) -> None:
    clock = Clock()
    store = open_store(str(database), clock=clock)
    receiver.statuses = [500, 404, "http://127.0.0.1:9/elsewhere"]
    job_id = cancelled(store, receiver.url)
    with notifying(store, receiver):
        for number, status in enumerate((500, 404, 307), 1):
            eventually(lambda: store.outbox.about(job_id)[0].attempts == number)  # noqa: B023
            (waiting,) = store.outbox.about(job_id)
            assert waiting.error == f"the receiver answered {status}"
            assert waiting.delivered_at is None and waiting.next_attempt_at is not None
            pause = pause_after(number)
            assert (waiting.next_attempt_at - clock.now).total_seconds() == pause
            clock.advance(pause)
        eventually(lambda: store.outbox.about(job_id)[0].delivered_at is not None)
    assert len(receiver.ids()) == 4 and len(set(receiver.ids())) == 1
    assert store.outbox.about(job_id)[0].attempts == 4
    store.close()


def test_a_receiver_that_answers_endlessly_delays_neither_others_nor_the_stop(
    store: Store, receiver: Receiver
) -> None:
    with answering_endlessly() as endless:
        slow = cancelled(store, endless)
        hosts = (receiver.host, urlsplit(endless).netloc)
        with notifying(store, receiver, hosts=hosts):
            leased = store.outbox.about(slow)[0].next_attempt_at
            eventually(lambda: store.outbox.about(slow)[0].next_attempt_at != leased)
            prompt = cancelled(store, receiver.url)
            eventually(lambda: store.outbox.about(prompt)[0].delivered_at is not None)
            stopped = time.monotonic()
        assert time.monotonic() - stopped < 5.0
        # The attempt was abandoned, and is repeated when its lease ends.
        assert store.outbox.about(slow)[0].attempts == 0


def test_an_attempt_ends_at_its_deadline_however_slowly_the_receiver_answers(
    store: Store, receiver: Receiver, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("gaitswarm.services.monitoring.webhooks._DEADLINE", 0.5)
    with answering_endlessly() as endless:
        slow = cancelled(store, endless)
        with notifying(store, receiver, hosts=(urlsplit(endless).netloc,)):
            eventually(lambda: store.outbox.about(slow)[0].attempts == 1)
    (waiting,) = store.outbox.about(slow)
    assert waiting.error == "the receiver did not answer within 0.5 s"
    assert waiting.next_attempt_at is not None


def test_a_host_whose_address_is_never_found_delays_neither_others_nor_the_stop(
    store: Store, receiver: Receiver, monkeypatch: pytest.MonkeyPatch
) -> None:
    lookup, answers, waiting = socket.getaddrinfo, threading.Event(), list[threading.Thread]()

    def resolve(host: Any, *args: Any, **options: Any) -> Any:
        if "silent.example" in str(host):
            waiting.append(threading.current_thread())
            answers.wait(60.0)
        return lookup(host, *args, **options)

    monkeypatch.setattr(socket, "getaddrinfo", resolve)
    monkeypatch.setattr("gaitswarm.services.monitoring.webhooks._AT_ONCE", 2)
    monkeypatch.setattr("gaitswarm.services.monitoring.webhooks._DEADLINE", 0.1)
    try:
        silent = [cancelled(store, "http://silent.example/") for _ in range(4)]
        with notifying(store, receiver, hosts=(receiver.host, "silent.example")):
            eventually(lambda: all(store.outbox.about(job)[0].attempts for job in silent))
            prompt = cancelled(store, receiver.url)
            eventually(lambda: store.outbox.about(prompt)[0].delivered_at is not None)
            stopped = time.monotonic()
        assert time.monotonic() - stopped < 5.0
        # The end of the process waits for threads that are no daemons.
        assert len(waiting) == 4 and all(thread.daemon for thread in waiting)
    finally:
        answers.set()


def test_pauses_grow_to_an_hour_and_end() -> None:
    pauses = [pause_after(attempts) for attempts in range(1, MOST_ATTEMPTS)]
    assert None not in pauses and pauses == sorted(pauses, key=float)  # type: ignore[arg-type]
    assert (pauses[0], pauses[-1]) == (5.0, 3600.0)
    assert pause_after(MOST_ATTEMPTS) is None


def test_a_notification_that_is_never_accepted_is_given_up(database: Path) -> None:
    clock = Clock()
    store = open_store(str(database), clock=clock)
    job_id = cancelled(store, "http://ci.example/")
    for _ in range(MOST_ATTEMPTS):
        due = store.outbox.take(lease_seconds=60.0)
        assert due is not None
        store.outbox.settle(due, "the receiver answered 500")
        clock.advance(3601.0)
    assert store.outbox.take(lease_seconds=60.0) is None
    (given_up,) = store.outbox.about(job_id)
    assert (given_up.attempts, given_up.next_attempt_at) == (MOST_ATTEMPTS, None)
    assert given_up.delivered_at is None
    store.close()


def test_a_notification_that_a_wrong_clock_put_off_is_due(database: Path) -> None:
    clock = Clock()
    store = open_store(str(database), clock=clock)
    cancelled(store, "http://ci.example/")
    clock.advance(86_400.0)
    ahead = store.outbox.take(lease_seconds=60.0)
    clock.advance(-86_400.0)
    due = store.outbox.take(lease_seconds=60.0)
    assert ahead is not None and due is not None and due.id == ahead.id
    assert store.outbox.take(lease_seconds=60.0) is None
    store.close()


def test_a_notification_is_leased_by_one_sender_at_a_time(
    database: Path,
) -> None:
    clock = Clock()
    store = open_store(str(database), clock=clock)
    cancelled(store, "http://ci.example/")
    lost = store.outbox.take(lease_seconds=60.0)
    assert store.outbox.take(lease_seconds=60.0) is None
    clock.advance(61.0)
    again = store.outbox.take(lease_seconds=60.0)
    assert lost is not None and again is not None and lost.id == again.id
    store.close()


ALLOWED = ("ci.example", "hooks.example:8443", "[::1]:80")


@pytest.mark.parametrize(
    "url",
    [
        "https://ci.example/hook",
        "https://CI.example:9000/x?y=1",
        "https://hooks.example:8443",
        "http://[::1]/",
    ],
)
def test_allowed_hosts_are_notified(url: str) -> None:
    check_url(url, ALLOWED, field="Notify-URL")


@pytest.mark.parametrize(
    "url",
    [
        "https://hooks.example/",
        "https://hooks.example:80/",
        "http://127.0.0.1/",
        "http://localhost:8000/v1/jobs",
        "http://169.254.169.254/latest/meta-data",
        "https://ci.example.evil.example/",
        "https://evil.example/ci.example",
        "https://ci.example@evil.example/",
        "https://user:password@ci.example/",
        "https://evil.example\\@ci.example/",
        "file:///etc/passwd",
        "gopher://ci.example/",
        "//ci.example/",
        "https://",
        "https://[",
        "https://ci.example:99999/",
        "https://ci.example/a b",
        "https://ci.example/\r\nX: 1",
        "https://cı.example/",
        "https://ci.example/" + "x" * 2000,
    ],
)
def test_all_others_are_refused(url: str) -> None:
    with pytest.raises(InvalidRequest, match=r"^Notify-URL: "):
        check_url(url, ALLOWED, field="Notify-URL")


def test_without_allowed_hosts_nothing_is_sent() -> None:
    assert Settings().webhook_hosts == ()
    with pytest.raises(InvalidRequest, match="GAITSWARM_WEBHOOK_HOSTS"):
        check_url("https://ci.example/", Settings().webhook_hosts, field="Notify-URL")


def test_a_host_that_is_no_longer_allowed_is_not_notified(store: Store, receiver: Receiver) -> None:
    job_id = cancelled(store, receiver.url)
    with notifying(store, receiver, hosts=("ci.example",)):
        eventually(lambda: store.outbox.about(job_id)[0].attempts == 1)
    (given_up,) = store.outbox.about(job_id)
    assert given_up.next_attempt_at is None and "not among the hosts" in str(given_up.error)
    assert receiver.received == []


def test_the_url_is_a_header_and_deliveries_are_listed_at_the_job(
    store: Store, receiver: Receiver
) -> None:
    server = Server(JobService(store), webhook_hosts=receiver.host)
    try:
        post = server.client.post
        refused = post("/v1/jobs", json=SMALL_SPEC, headers={"Notify-URL": "http://127.0.0.1/"})
        assert refused.status_code == 422
        assert refused.json()["errors"][0]["field"] == "Notify-URL"
        headers = {"Notify-URL": receiver.url}
        job = post("/v1/jobs", json=SMALL_SPEC, headers=headers).json()["id"]
        path = f"/v1/jobs/{job}/notifications"
        assert server.client.get(path).json() == []
        post(f"/v1/jobs/{job}/cancel")
        (waiting,) = server.client.get(path).json()
        assert (waiting["state"], waiting["event"]) == ("waiting", "job.cancelled")
        assert waiting["host"] == "127.0.0.1" and "key=1" not in str(waiting)
        with notifying(store, receiver):
            eventually(lambda: server.client.get(path).json()[0]["state"] == "delivered")
        assert server.client.get("/v1/jobs/none/notifications").status_code == 404
    finally:
        server.close()


@pytest.mark.slow
def test_a_server_killed_before_the_delivery_delivers_after_its_restart(
    database: Path, receiver: Receiver
) -> None:
    options = ("--db", str(database), "--port", "0", "--evaluator", "in-process", "--cpus", "1")
    environment: dict[str, Any] = {"GAITSWARM_WEBHOOK_HOSTS": receiver.host}
    receiver.statuses = [500]
    store = open_store(str(database))
    job_id = cancelled(store, receiver.url)
    for kill in (True, False):
        process = ForkedCommand(
            "serve", *options, environment=environment, stdout=None, stderr=None
        )
        try:
            if kill:
                eventually(lambda: store.outbox.about(job_id)[0].attempts == 1)
            else:
                eventually(lambda: store.outbox.about(job_id)[0].delivered_at is not None)
        finally:
            process.send_signal(signal.SIGKILL if kill else signal.SIGTERM)
            process.wait(timeout=60.0)
    assert len(set(receiver.ids())) == 1 and len(receiver.received) == 2
    store.close()
