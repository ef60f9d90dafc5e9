"""Retries of requests, and errors of servers."""

from __future__ import annotations

import json
import ssl
from collections.abc import Callable, Iterator
from contextlib import aclosing
from pathlib import Path
from typing import Any, cast

import anyio
import httpx2
import pytest

import gaitswarm
from gaitswarm.jobs.server import Attempts, authorities, error_of
from tests.library.conftest import SMALL, Finished

URL = "http://127.0.0.1:1"
PI = {"P": 0.45, "I": 0.1}
QUICK = gaitswarm.Backoff(first=0.001, longest=0.001, attempts=3)

LOST = (httpx2.ConnectError, httpx2.ReadError, httpx2.RemoteProtocolError, httpx2.ConnectTimeout)
"""The connection was not made, or broke."""


def refusal(status: int, kind: str = "unavailable", **headers: str) -> httpx2.Response:
    problem = {
        "type": f"urn:gaitswarm:problem:{kind}",
        "title": "",
        "status": status,
        "detail": "speed: too fast",
        "instance": "/v1/jobs",
        "errors": [{"field": "speed", "message": "too fast"}] if status == 422 else [],
    }
    return httpx2.Response(status, json=problem, headers=headers)


def attempts(*, repeatable: bool = True) -> Attempts:
    backoff = gaitswarm.Backoff(first=1.0, longest=10.0, attempts=3)
    return Attempts(URL, backoff, repeatable=repeatable)


def test_waits_grow_and_end() -> None:
    tried = attempts()
    assert [tried.after(httpx2.ConnectError("refused")) for _ in range(3)] == [1, 2, 4]
    with pytest.raises(gaitswarm.StoreUnavailable, match="refused"):
        tried.after(httpx2.ConnectError("refused"))


@pytest.mark.parametrize("error", LOST)
def test_a_lost_connection_is_made_again_for_what_may_be_repeated(error: type) -> None:
    assert attempts().after(error("lost")) == 1.0
    with pytest.raises(gaitswarm.StoreUnavailable, match=URL):
        attempts(repeatable=False).after(error("lost"))


@pytest.mark.parametrize("error", [httpx2.ReadTimeout, httpx2.UnsupportedProtocol])
def test_any_other_failure_is_final(error: type) -> None:
    with pytest.raises(gaitswarm.StoreUnavailable):
        attempts().after(error("no"))


def test_a_busy_server_is_asked_again_when_it_wants_to_be() -> None:
    assert attempts().after(refusal(503)) == 1.0
    assert attempts().after(refusal(503, **{"Retry-After": "7"})) == 7.0
    assert attempts().after(refusal(503, **{"Retry-After": "0"})) == 1.0
    assert attempts().after(refusal(503, **{"Retry-After": "soon"})) == 1.0


def test_a_server_that_wants_more_patience_than_there_is_is_not_asked_again() -> None:
    with pytest.raises(gaitswarm.StoreUnavailable, match="too fast"):
        attempts().after(refusal(503, **{"Retry-After": "3600"}))


def test_a_command_to_a_busy_server_is_not_repeated() -> None:
    with pytest.raises(gaitswarm.StoreUnavailable):
        attempts(repeatable=False).after(refusal(503))


@pytest.mark.parametrize(
    ("status", "kind", "error"),
    [
        (404, "not-found", gaitswarm.NotFound),
        (409, "conflict", gaitswarm.Conflict),
        (409, "idempotency-conflict", gaitswarm.IdempotencyConflict),
        (409, "unreadable", gaitswarm.Unreadable),
        (422, "invalid-request", gaitswarm.InvalidRequest),
        (500, "internal-error", gaitswarm.StoreUnavailable),
    ],
)
def test_every_other_refusal_is_final_and_becomes_the_error_that_the_server_had(
    status: int, kind: str, error: type[gaitswarm.GaitswarmError]
) -> None:
    with pytest.raises(error, match=r"^speed: too fast$") as raised:
        attempts().after(refusal(status, kind))
    assert type(raised.value) is error
    if isinstance(raised.value, gaitswarm.InvalidRequest):
        assert raised.value.field == "speed"


def test_an_error_page_of_something_else_says_so() -> None:
    error = error_of(httpx2.Response(502, text="<html>bad gateway</html>"))
    assert isinstance(error, gaitswarm.StoreUnavailable)
    assert "502" in str(error)


class Flaky(httpx2.BaseTransport):
    """The way to a server, on which the first answers get lost."""

    def __init__(self, losses: int) -> None:
        self.losses = losses
        self.sent: list[httpx2.Request] = []
        self._way = httpx2.HTTPTransport()

    def handle_request(self, request: httpx2.Request) -> httpx2.Response:
        self.sent.append(request)
        response = self._way.handle_request(request)
        if len(self.sent) <= self.losses:
            response.close()
            raise httpx2.ReadError("the connection broke before the answer came")
        return response

    def close(self) -> None:
        self._way.close()


@pytest.mark.slow
def test_a_job_whose_submission_is_repeated_is_submitted_once(
    serve: Callable[[Path], str], db: Path
) -> None:
    way = Flaky(losses=2)
    with gaitswarm.ServerJobs(serve(db), backoff=QUICK, transport=way) as jobs:
        job = jobs.submit(**SMALL)
        keys = [request.headers["Idempotency-Key"] for request in way.sent]
        assert len(keys) == 3 and len(set(keys)) == 1
        assert [found.id for found in jobs.jobs()] == [job.id]
        assert jobs.submit(**SMALL).id != job.id


@pytest.mark.slow
def test_a_command_whose_answer_was_lost_is_not_repeated(
    serve: Callable[[Path], str], db: Path
) -> None:
    url = serve(db)
    with gaitswarm.connect(url) as jobs:
        job = jobs.submit(**SMALL)
    way = Flaky(losses=1)
    with gaitswarm.ServerJobs(url, backoff=QUICK, transport=way) as jobs:
        with pytest.raises(gaitswarm.StoreUnavailable, match="before the answer came"):
            jobs.pause(job.id)
        assert len(way.sent) == 1
        assert jobs.job(job.id).state == "paused"


@pytest.mark.slow
def test_reading_gets_over_losses_and_gives_up_in_the_end(
    serve: Callable[[Path], str], finished: Finished
) -> None:
    url = serve(finished.db)
    for losses, ways in ((3, 4), (4, 4)):
        way = Flaky(losses)
        with gaitswarm.ServerJobs(url, backoff=QUICK, transport=way) as jobs:
            if losses < ways:
                assert len(b"".join(jobs.export(finished.id, "csv")).splitlines()) == 7
            else:
                with pytest.raises(gaitswarm.StoreUnavailable):
                    b"".join(jobs.export(finished.id, "csv"))
        assert len(way.sent) == ways


@pytest.mark.slow
def test_a_list_is_asked_for_as_it_is_consumed(
    serve: Callable[[Path], str], many_jobs: Path
) -> None:
    way = Flaky(losses=0)
    with gaitswarm.ServerJobs(serve(many_jobs), transport=way) as jobs:
        listed = jobs.jobs()
        assert len(way.sent) == 0
        next(listed)
        assert len(way.sent) == 1
        assert len(list(listed)) == 102
        assert len(way.sent) == 2


@pytest.mark.slow
def test_a_program_with_an_event_loop_makes_the_same_attempts(
    serve: Callable[[Path], str], db: Path
) -> None:
    url = serve(db)

    async def work() -> None:
        way = Flaky(losses=2)
        there = gaitswarm.ServerJobs(url, backoff=QUICK, transport=way)
        async with gaitswarm.AsyncJobs(there) as jobs:
            job = await jobs.submit(**SMALL)
            assert len({request.headers["Idempotency-Key"] for request in way.sent}) == 1
            assert [found.id async for found in jobs.jobs()] == [job.id]
            sent = len(way.sent)
            way.losses = sent + 1
            with pytest.raises(gaitswarm.StoreUnavailable):
                await jobs.pause(job.id)
            assert len(way.sent) == sent + 1
            assert (await jobs.job(job.id)).state == "paused"

    anyio.run(work)


@pytest.mark.parametrize(
    "read",
    [
        lambda jobs: jobs.estimate(**SMALL),
        lambda jobs: jobs.ranking("k2q7zr5dm9xw", "B"),
    ],
    ids=["estimate", "ranking"],
)
def test_whatever_only_reads_is_sent_again_although_it_has_a_body(
    read: Callable[[gaitswarm.Jobs], object],
) -> None:
    sent = list[httpx2.Request]()

    def busy(request: httpx2.Request) -> httpx2.Response:
        sent.append(request)
        return refusal(503)

    way = httpx2.MockTransport(busy)
    with (
        gaitswarm.ServerJobs(URL, backoff=QUICK, transport=way) as jobs,
        pytest.raises(gaitswarm.StoreUnavailable),
    ):
        read(jobs)
    assert [request.method for request in sent] == ["POST"] * 4


def test_a_server_that_is_missing_is_unavailable_and_named() -> None:
    with (
        gaitswarm.connect(URL, backoff=QUICK) as jobs,
        pytest.raises(gaitswarm.StoreUnavailable, match=f"{URL}.*gaitswarm serve"),
    ):
        jobs.job("k2q7zr5dm9xw")


def test_what_is_no_url_is_refused_at_once() -> None:
    with pytest.raises(gaitswarm.InvalidRequest, match="not a URL"):
        gaitswarm.connect("jobs.db")


def test_a_server_without_certificates_is_trusted_for_none() -> None:
    default = authorities("http://127.0.0.1:8000")
    assert isinstance(default, ssl.SSLContext)
    assert default.verify_mode is ssl.CERT_REQUIRED
    assert default.cert_store_stats()["x509"] == 0
    assert authorities("HTTPS://gaitswarm.example") is True


@pytest.mark.parametrize("body", [b"<html>", b"{}", b'{"items": 3}'])
def test_another_kind_of_server_is_distinguished_from_gaitswarms(body: bytes) -> None:
    way = httpx2.MockTransport(lambda _: httpx2.Response(200, content=body))
    with gaitswarm.ServerJobs(URL, transport=way) as jobs:
        for ask in (lambda: jobs.job("k2q7zr5dm9xw"), lambda: jobs.evaluations("k2q7zr5dm9xw")):
            with pytest.raises(gaitswarm.StoreUnavailable, match="does not answer as a gaitswarm"):
                ask()


def test_headers_go_with_every_request() -> None:
    seen = []

    def answer(request: httpx2.Request) -> httpx2.Response:
        seen.append(request.headers["Authorization"])
        return refusal(404, "not-found")

    way = httpx2.MockTransport(answer)
    with gaitswarm.ServerJobs(URL, headers={"Authorization": "Bearer x"}, transport=way) as jobs:
        for ask in (lambda: jobs.job("a"), lambda: list(jobs.export("a")), lambda: jobs.pause("a")):
            with pytest.raises(gaitswarm.NotFound):
                ask()
    assert seen == ["Bearer x"] * 3


class Stream(httpx2.SyncByteStream):
    """Server-sent events, after which the connection ends or breaks."""

    def __init__(self, events: str, *, breaks: bool) -> None:
        self._events = events.encode()
        self._breaks = breaks

    def __iter__(self) -> Iterator[bytes]:
        yield self._events
        if self._breaks:
            raise httpx2.ReadError("the connection broke")


class Script:
    """A server that tells a job's events over several connections."""

    def __init__(self, job: gaitswarm.JobView, *connections: httpx2.Response) -> None:
        self.last_ids: list[str | None] = []
        self._job = job
        self._connections = iter(connections)

    def __call__(self, request: httpx2.Request) -> httpx2.Response:
        if not request.url.path.endswith("/events"):
            return httpx2.Response(200, text=self._job.model_dump_json())
        self.last_ids.append(request.headers.get("Last-Event-ID"))
        return next(self._connections)


def stream(events: str, *, breaks: bool = False) -> httpx2.Response:
    headers = {"Content-Type": "text/event-stream"}
    return httpx2.Response(200, headers=headers, stream=Stream(events, breaks=breaks))


def state(name: str, waiting: str | None = None) -> str:
    counts = {"iterations": 0, "evaluations": 0}
    data = {"id": "k2q7zr5dm9xw", "state": name, "error": None, "waiting": waiting, **counts}
    return f"event: state\ndata: {json.dumps(data)}\n\n"


@pytest.fixture
def iteration(finished_once: Finished) -> Callable[[int], str]:
    def event(index: int) -> str:
        view = finished_once.result.iterations[0].model_copy(update={"index": index})
        return f"event: iteration\nid: {index}\ndata: {view.model_dump_json()}\n\n"

    return event


Follow = Callable[..., list[Any]]


@pytest.fixture(params=["blocking", "async"])
def follow(request: pytest.FixtureRequest) -> Follow:
    """What following a job tells: indices of iterations, and states."""

    def requests(script: Script, *, after: int | None = None) -> list[Any]:
        options: dict[str, Any] = {"backoff": QUICK, "reconnect": QUICK}
        way = httpx2.MockTransport(script)
        if request.param == "blocking":
            with gaitswarm.ServerJobs(URL, transport=way, **options) as jobs:
                events = list(jobs.follow("k2q7zr5dm9xw", after=after))
        else:

            async def following() -> list[gaitswarm.JobEvent]:
                there = gaitswarm.ServerJobs(URL, transport=way, **options)
                async with (
                    gaitswarm.AsyncJobs(there) as jobs,
                    aclosing(cast(Any, jobs.follow("k2q7zr5dm9xw", after=after))) as events,
                ):
                    return [event async for event in events]

            events = anyio.run(following)
        return [
            event.index if isinstance(event, gaitswarm.IterationView) else event.state.value
            for event in events
        ]

    return requests


@pytest.mark.slow
def test_a_broken_stream_resumes_where_it_broke_and_tells_a_state_once(
    follow: Follow, iteration: Callable[[int], str], finished_once: Finished
) -> None:
    script = Script(
        finished_once.result.job,
        stream(state("running") + iteration(0) + iteration(1), breaks=True),
        refusal(503),
        stream(iteration(2) + state("running") + iteration(3)),
        stream(state("running") + "event: iteration\nid: 4\ndata: {cut off", breaks=True),
        stream(": ping\n\n" + iteration(4) + state("succeeded")),
    )
    assert follow(script) == ["running", 0, 1, 2, 3, 4, "succeeded"]
    assert script.last_ids == [None, "1", "1", "3", "3"]


@pytest.mark.slow
def test_following_begins_after_what_is_known(
    follow: Follow, iteration: Callable[[int], str], finished_once: Finished
) -> None:
    script = Script(finished_once.result.job, stream(iteration(8) + state("succeeded")))
    assert follow(script, after=7) == [8, "succeeded"]
    assert script.last_ids == ["7"]


@pytest.mark.slow
def test_a_change_of_what_a_job_waits_for_is_an_event(
    follow: Follow, finished_once: Finished
) -> None:
    states = [state("queued", "a worker"), state("queued", "a cluster"), state("succeeded")]
    script = Script(finished_once.result.job, stream("".join(states)))
    assert follow(script) == ["queued", "queued", "succeeded"]


@pytest.mark.slow
def test_a_stream_that_breaks_again_and_again_is_given_up(
    follow: Follow, finished_once: Finished
) -> None:
    script = Script(finished_once.result.job, *(stream("", breaks=True) for _ in range(9)))
    with pytest.raises(gaitswarm.StoreUnavailable, match="broke"):
        follow(script)
    assert len(script.last_ids) == 4


@pytest.mark.slow
def test_every_event_renews_the_patience(
    follow: Follow, iteration: Callable[[int], str], finished_once: Finished
) -> None:
    breaks = (stream(iteration(index), breaks=True) for index in range(8))
    script = Script(finished_once.result.job, *breaks, stream(state("succeeded")))
    assert follow(script) == [*range(8), "succeeded"]


@pytest.mark.slow
def test_a_stream_of_something_else_is_given_up_at_once(
    follow: Follow, finished_once: Finished
) -> None:
    script = Script(finished_once.result.job, stream('event: iteration\ndata: {"index": "x"}\n\n'))
    with pytest.raises(gaitswarm.StoreUnavailable, match="does not answer as"):
        follow(script)
