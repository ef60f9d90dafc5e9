"""How often somebody may ask, and how many streams they may have open."""

from __future__ import annotations

from contextlib import ExitStack

import httpx2
import pytest

from gaitswarm.api.rates import RequestRate, address_of
from gaitswarm.services.optimizer.access import Scope
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.store.sql_store import SqlStore
from tests.api.conftest import Serve

SELDOM = {"api_request_rate": 0.001, "api_request_burst": 3}
"""Settings: three requests, and then none for as long as a test takes."""


class Clock:
    """Seconds that a test lets pass."""

    now = 100.0

    def __call__(self) -> float:
        return self.now


def test_a_burst_is_answered_at_once_and_then_as_many_as_the_rate_allows() -> None:
    clock = Clock()
    rate = RequestRate(2.0, 3, clock)
    assert [rate.seconds_to_wait("a") for _ in range(5)] == [0.0, 0.0, 0.0, 0.5, 0.5]
    clock.now += 0.5
    assert [rate.seconds_to_wait("a") for _ in range(2)] == [0.0, 0.5]
    clock.now += 60.0
    assert [rate.seconds_to_wait("a") for _ in range(4)] == [0.0, 0.0, 0.0, 0.5]


def test_askers_do_not_wait_for_each_other() -> None:
    rate = RequestRate(1.0, 1, Clock())
    assert [rate.seconds_to_wait(asker) for asker in ("a", "b", "a")] == [0.0, 0.0, 1.0]


def test_ever_new_askers_take_no_more_memory_and_nobody_who_asks_is_forgotten() -> None:
    rate = RequestRate(1.0, 1, Clock())
    for number in range(20_000):
        rate.seconds_to_wait(f"address {number}")
        if number % 1000 == 0:
            rate.seconds_to_wait("busy")
    assert rate.remembered <= 4096
    assert rate.seconds_to_wait("busy") > 0.0


@pytest.mark.parametrize(
    ("host", "asker"),
    [
        ("203.0.113.9", "203.0.113.9"),
        ("::ffff:203.0.113.9", "203.0.113.9"),
        ("2001:db8:1:2:3:4:5:6", "2001:db8:1:2::/64"),
        ("2001:db8:1:2::9", "2001:db8:1:2::/64"),
        ("::1", "::1"),
    ],
)
def test_a_subscriber_has_one_name_whatever_address_they_take(host: str, asker: str) -> None:
    assert address_of({"type": "http", "client": (host, 1234)}) == asker


def test_too_many_requests_with_a_token_are_told_when_to_come_back(
    serve: Serve, store: SqlStore
) -> None:
    client = serve(api_access="token", **SELDOM).client
    headers = [
        {"Authorization": f"Bearer {store.tokens.create(name, Scope.READ)[1]}"}
        for name in ("often", "seldom")
    ]
    # The first one is counted by address, where the token is yet to be looked up.
    statuses = [client.get("/v1/jobs", headers=headers[0]).status_code for _ in range(5)]
    assert statuses == [200, 200, 200, 200, 429]
    refused = client.get("/v1/jobs", headers=headers[0])
    assert refused.json()["type"] == "urn:gaitswarm:problem:too-many-requests"
    assert int(refused.headers["Retry-After"]) > 100
    assert client.get("/v1/jobs", headers=headers[1]).status_code == 200


def guesses_of_tokens(client: httpx2.Client, path: str) -> list[int]:
    """Statuses of four requests, each with another token that there is not."""
    return [
        client.get(path, headers={"Authorization": f"Bearer {n}"}).status_code for n in range(4)
    ]


def test_who_guesses_tokens_is_stopped_before_any_is_looked_up(
    serve: Serve, store: SqlStore
) -> None:
    client = serve(api_access="token", **SELDOM).client
    known = {"Authorization": f"Bearer {store.tokens.create('known', Scope.READ)[1]}"}
    assert client.get("/v1/jobs", headers=known).status_code == 200
    assert guesses_of_tokens(client, "/v1/jobs") == [401, 401, 429, 429]
    assert client.post("/v1/session", json={"token": "guess"}).status_code == 429
    # Whoever is known already does not suffer from others at the same address.
    assert client.get("/v1/jobs", headers=known).status_code == 200


def test_metrics_are_counted_as_other_requests_are(serve: Serve, store: SqlStore) -> None:
    client = serve(api_access="token", **SELDOM).client
    known = {"Authorization": f"Bearer {store.tokens.create('known', Scope.READ)[1]}"}
    assert client.get("/metrics", headers=known).status_code == 200
    assert guesses_of_tokens(client, "/metrics") == [401, 401, 429, 429]
    refused = client.get("/metrics")
    assert refused.status_code == 429 and refused.headers["Retry-After"]
    # Nor does a Prometheus suffer from others at its address.
    statuses = [client.get("/metrics", headers=known).status_code for _ in range(4)]
    assert statuses == [200, 200, 200, 429]


def test_probes_are_answered_during_a_flood(serve: Serve) -> None:
    client = serve(api_access="token", **SELDOM).client
    assert {client.get("/v1/jobs").status_code for _ in range(9)} == {401, 429}
    for path in ("/v1/healthz", "/v1/readyz"):
        assert client.get(path).status_code == 200


def test_one_person_on_their_own_machine_is_never_told_to_wait(serve: Serve) -> None:
    client = serve(**SELDOM).client
    assert {client.get("/v1/scenarios").status_code for _ in range(20)} == {200}


def test_clients_of_a_proxy_on_this_machine_are_counted_apart(serve: Serve) -> None:
    client = serve(**SELDOM).client

    def ask(address: str) -> int:
        return client.get("/v1/scenarios", headers={"X-Forwarded-For": address}).status_code

    assert [ask("203.0.113.9") for _ in range(4)] == [200, 200, 200, 429]
    assert ask("203.0.113.10") == 200
    # What a client claims goes before the address that the proxy adds, and is not believed.
    assert ask("198.51.100.1, 203.0.113.9") == 429


def test_one_asker_has_only_so_many_streams_open(serve: Serve, job: Job) -> None:
    server = serve(api_max_streams=2)
    path = f"{server.url}/v1/jobs/{job.id}/events"
    with ExitStack() as stack:
        streams = [
            stack.enter_context(httpx2.stream("GET", path, timeout=20.0)).iter_lines()
            for _ in range(2)
        ]
        assert [next(lines) for lines in streams] == ["event: state"] * 2
        refused = server.client.get(path)
        assert refused.status_code == 429
        assert "streams" in refused.json()["detail"]
        assert refused.headers["Retry-After"] == "5"
    # Both are closed: there is room again, as soon as the server has noticed.
    for _ in range(100):
        with httpx2.stream("GET", path, timeout=20.0) as again:
            if again.status_code == 200:
                return
    pytest.fail("no stream was given back")
