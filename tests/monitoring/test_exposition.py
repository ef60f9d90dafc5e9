"""Metrics: the API's route and a runner's port."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from unittest.mock import Mock

import httpx2
import pytest

from gaitswarm.api.server import metrics_server
from gaitswarm.services.monitoring.metrics import Metrics
from gaitswarm.services.optimizer.access import Scope, Token
from gaitswarm.services.optimizer.errors import EvaluatorUnavailable, StoreUnavailable
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.store import Store
from gaitswarm.settings import Settings
from tests.examples.forked import ForkedCommand
from tests.examples.processes import eventually, line_with
from tests.examples.servers import Server
from tests.monitoring.scraped import Scrape, parsed, scraped

get = partial(httpx2.get, verify=False)
"""Without a context of TLS, which takes longer to make than the request."""


def test_every_token_reads_metrics_where_tokens_are_required(store: Store) -> None:
    secret = store.tokens.create("prometheus", Scope.READ)[1]
    server = Server(JobService(store), api_access="token")
    try:
        refused = server.client.get("/metrics")
        assert refused.status_code == 401
        assert refused.headers["WWW-Authenticate"] == "Bearer"
        assert "--scope read" in refused.json()["detail"]
        wrong = {"Authorization": "Bearer gaitswarm_nobody"}
        assert server.client.get("/metrics", headers=wrong).status_code == 401
        right = {"Authorization": f"Bearer {secret}"}
        assert scraped(server.client, headers=right).value("gaitswarm_database_up") == 1
    finally:
        server.close()


def test_without_tokens_every_local_client_reads_metrics(
    lasting_server: Server, store: Store
) -> None:
    lasting_server.serve(JobService(store))
    answer = lasting_server.client.get("/metrics")
    assert answer.headers["Content-Type"].startswith("text/plain; version=")
    asked = {"Accept": "application/openmetrics-text; version=1.0.0"}
    openmetrics = lasting_server.client.get("/metrics", headers=asked)
    assert openmetrics.headers["Content-Type"].startswith("application/openmetrics-text")
    assert openmetrics.text.endswith("# EOF\n")


class _Tokens:
    """One token."""

    def find(self, secret: str) -> Token | None:
        return Token("p", Scope.READ, None) if secret == "right" else None  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("settings", "needed"),
    [
        ({}, False),
        ({"metrics_host": "0.0.0.0"}, True),  # noqa: S104
        ({"api_access": "token"}, True),
    ],
)
def test_a_runners_port_asks_for_a_token_beyond_the_machine(
    settings: dict[str, str], *, needed: bool
) -> None:
    assert Settings(**settings).metrics_need_token is needed


def served(
    check: Callable[[str], None],
    *,
    required: bool = False,
    trouble: Callable[[], str | None] = lambda: None,
    port: int = 0,
) -> None:
    settings = Settings(
        api_access="token" if required else "auto",
        api_allowed_hosts=("optimizer", "proxy:9000"),
        metrics_port=port,
    )
    with metrics_server(Metrics(), _Tokens, settings, trouble) as url:  # type: ignore[arg-type]
        check(url)


def test_a_separate_port_serves_only_metrics() -> None:
    def check(url: str) -> None:
        assert url.endswith("/metrics")
        assert parsed(get(url).text).value("gaitswarm_lease_losses_total") == 0
        assert get(url.removesuffix("metrics")).status_code == 404
        assert httpx2.post(url, verify=False).status_code == 405

    served(check)


def test_a_separate_port_requires_a_token_and_closes() -> None:
    ended = []

    def check(url: str) -> None:
        assert get(url).status_code == 401
        known = get(url, headers={"Authorization": "Bearer right"})
        assert known.status_code == 200
        ended.append(url)

    served(check, required=True)
    with pytest.raises(httpx2.ConnectError):
        get(ended[0])


def test_a_separate_port_rejects_other_host_names() -> None:
    def check(url: str) -> None:
        def status(path: str, host: str) -> int:
            return get(url.replace("/metrics", path), headers={"Host": host}).status_code

        for path, own in (("/metrics", 200), ("/healthz", 200), ("/other", 404)):
            for host in ("localhost:9464", "192.0.2.7", "[::1]:1", "Optimizer:9464", "proxy:9000"):
                assert status(path, host) == own
            for host in ("evil.example:9464", "proxy:9001"):
                assert status(path, host) == 421

    served(check)


def test_a_cached_token_reads_metrics_of_a_server_without_its_database(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("gaitswarm.api.access.CACHE_SECONDS", 0.0)
    headers = {"Authorization": f"Bearer {store.tokens.create('prometheus', Scope.READ)[1]}"}
    server = Server(JobService(store), api_access="token")
    try:
        assert server.client.get("/metrics", headers=headers).status_code == 200
        away = Mock(side_effect=StoreUnavailable("the database is away"))
        monkeypatch.setattr(type(store.tokens), "find", away)
        assert server.client.get("/metrics", headers=headers).status_code == 200
        assert server.client.get("/v1/jobs", headers=headers).status_code == 503
        other = {"Authorization": "Bearer other"}
        assert server.client.get("/metrics", headers=other).status_code == 503
        assert away.call_count == 3
    finally:
        server.close()


def test_a_port_in_use_is_named() -> None:
    def check(url: str) -> None:
        port = int(url.split(":")[2].split("/", maxsplit=1)[0])
        with pytest.raises(EvaluatorUnavailable, match="GAITSWARM_METRICS_PORT"):
            served(check, port=port)

    served(check)


def test_a_probe_needs_no_token() -> None:
    said: list[str | None] = [None]

    def check(url: str) -> None:
        probe = url.replace("/metrics", "/healthz")
        assert (get(probe).status_code, get(probe).text) == (200, "ok\n")
        said[0] = "it has ended and runs no more jobs; restart this process"
        answer = get(probe)
        assert (answer.status_code, answer.text) == (503, f"{said[0]}\n")

    served(check, required=True, trouble=lambda: said[0])


@pytest.mark.slow
def test_a_runner_serves_its_own_metrics_but_not_the_databases(database: Path) -> None:
    options = ("runner", "--db", str(database), "--evaluator", "in-process", "--cpus", "2")
    process = ForkedCommand(*options, environment={"GAITSWARM_METRICS_PORT": "0"}, stdout=None)
    try:
        url = line_with(process.stderr, r"metrics: (http://\S+)")[1]
        seen: list[Scrape] = []

        def has_asked_the_database() -> bool:
            seen.append(parsed(get(url, timeout=60.0).text))
            return bool(seen[-1].labels("gaitswarm_database_operation_duration_seconds_count"))

        # It is ready before it looks for a job.
        eventually(has_asked_the_database)
        scrape = seen[-1]
        assert scrape.value("gaitswarm_worker_slots", workers="threads") == 2
        assert not scrape.labels("gaitswarm_jobs") and not scrape.labels("gaitswarm_queue_jobs")
        assert get(url.replace("/metrics", "/healthz")).text == "ok\n"
    finally:
        process.terminate()
        process.communicate(timeout=60.0)
    assert process.returncode == 0
