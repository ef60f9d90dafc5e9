"""Access: tokens, their scopes, and browsers' cookies."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator

import httpx2
import pytest

import gaitswarm
from gaitswarm.api.access import (
    COOKIE,
    TokenGuesses,
    address_of,
    may_command,
    may_restore,
    may_submit,
)
from gaitswarm.services.optimizer.access import Scope
from gaitswarm.services.optimizer.jobs.job import Command, Job
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.store import Store
from gaitswarm.settings import Settings
from tests.api.conftest import Serve
from tests.examples.api_document import api_document
from tests.examples.servers import Server, operations

Bearer = Callable[[Scope], dict[str, str]]

QUESTIONS = {
    *("rank_designs", "controller_surface", "estimate_job", "simulate", "estimate_robustness"),
    *("find_front", "draft_robot", "check_robot"),
    *("replay", "verify_history", "begin_session", "end_session"),
}
"""Operations that are no GET, and yet change nothing that is stored."""


@pytest.fixture(scope="module")
def guarded_server() -> Iterator[Server]:
    """One server that asks for tokens."""
    server = Server(None, api_access="token")
    yield server
    server.close()


@pytest.fixture
def guarded(guarded_server: Server, service: JobService) -> Iterator[httpx2.Client]:
    """A client, without token or cookie, of a server that asks for tokens."""
    guarded_server.serve(service)
    with httpx2.Client(base_url=guarded_server.url, timeout=20.0, verify=False) as client:
        yield client


@pytest.fixture
def bearer(store: Store) -> Bearer:
    """Make a token named as its scope; its header."""

    def make(scope: Scope) -> dict[str, str]:
        return {"Authorization": f"Bearer {store.tokens.create(scope.value, scope)[1]}"}

    return make


@pytest.mark.parametrize(
    ("host", "required"),
    [
        ("127.0.0.1", False),
        ("127.8.0.1", False),
        ("::1", False),
        ("localhost", False),
        ("0.0.0.0", True),  # noqa: S104
        ("::", True),
        ("192.0.2.7", True),
        ("gait.example", True),
    ],
)
def test_tokens_are_needed_beyond_the_machine_itself(host: str, *, required: bool) -> None:
    assert Settings(api_host=host).tokens_required is required
    assert Settings(api_host=host, api_access="token").tokens_required


def test_without_a_token_nothing_is_reported(guarded: httpx2.Client, job: Job) -> None:
    for path in ("/v1/jobs", f"/v1/jobs/{job.id}", f"/v1/jobs/{job.id}/events", "/v1/robots"):
        answer = guarded.get(path)
        assert answer.status_code == 401, path
        assert answer.headers["WWW-Authenticate"] == "Bearer"
        assert answer.json()["type"] == "urn:gaitswarm:problem:unauthorized"
        assert "GAITSWARM_TOKEN" in answer.json()["detail"]
    assert guarded.post(f"/v1/jobs/{job.id}/cancel").status_code == 401


def test_every_operation_that_documents_401_needs_a_token(guarded: httpx2.Client) -> None:
    for path, methods in api_document()["paths"].items():
        for method, operation in methods.items():
            if "401" in operation["responses"]:
                answer = guarded.request(method, re.sub(r"{\w+}", "1", path), json={"token": "no"})
                assert answer.status_code == 401, (method, path)


@pytest.mark.parametrize("path", ["/v1/healthz", "/v1/readyz", "/healthz", "/docs", "/v1/session"])
def test_probes_and_the_documentation_need_no_token(guarded: httpx2.Client, path: str) -> None:
    assert guarded.get(path, follow_redirects=True).status_code == 200


@pytest.mark.parametrize("path", ["/v1//jobs", "//v1/jobs", "/v1/healthz/../jobs", "/V1/jobs"])
def test_no_spelling_of_a_path_goes_round_the_token(guarded: httpx2.Client, path: str) -> None:
    request = httpx2.Request("GET", str(guarded.base_url).rstrip("/") + path)
    assert guarded.send(request).status_code in (401, 404)


def test_a_wrong_token_is_refused_even_where_none_is_needed(serve: Serve) -> None:
    answer = serve().client.get("/v1/jobs", headers={"Authorization": "Bearer gaitswarm_guessed"})
    assert answer.status_code == 401
    assert "unknown or was revoked" in answer.json()["detail"]


@pytest.mark.parametrize("value", ["Bearer", "Bearer x y", "Bearer \xff", "Basic Zm9vOmJhcg=="])
def test_a_header_that_holds_no_token_opens_nothing(guarded: httpx2.Client, value: str) -> None:
    headers = {b"Authorization": value.encode("latin-1")}
    assert guarded.get("/v1/jobs", headers=headers).status_code == 401


def test_a_token_to_read_reads_and_asks_but_submits_nothing(
    guarded: httpx2.Client, bearer: Bearer, job: Job, spec: JobSpec
) -> None:
    guarded.headers.update(bearer(Scope.READ))
    assert guarded.get(f"/v1/jobs/{job.id}").status_code == 200
    document = spec.model_dump(mode="json")
    assert guarded.post("/v1/estimates", json=document).status_code == 200
    refused = guarded.post("/v1/jobs", json=document)
    assert refused.status_code == 403
    assert refused.json()["type"] == "urn:gaitswarm:problem:forbidden"
    assert "`submit`" in refused.json()["detail"]
    assert guarded.post(f"/v1/jobs/{job.id}/pause").status_code == 403
    assert guarded.get(f"/v1/jobs/{job.id}").json()["state"] == "queued"


def test_a_token_to_submit_commands_its_own_jobs_and_no_others(
    guarded: httpx2.Client, bearer: Bearer, job: Job, spec: JobSpec
) -> None:
    guarded.headers.update(bearer(Scope.SUBMIT))
    own = guarded.post("/v1/jobs", json=spec.model_dump(mode="json")).json()
    assert own["owner"] == "submit"
    assert guarded.post(f"/v1/jobs/{own['id']}/pause").status_code == 202
    refused = guarded.post(f"/v1/jobs/{job.id}/pause")
    assert refused.status_code == 403
    assert "has no owner" in refused.json()["detail"]


def test_only_a_token_of_all_rights_puts_a_job_before_those_of_others(
    guarded: httpx2.Client, bearer: Bearer, spec: JobSpec
) -> None:
    own, every = bearer(Scope.SUBMIT), bearer(Scope.ADMIN)
    document = spec.model_dump(mode="json")

    def submitted(headers: dict[str, str], priority: int) -> httpx2.Response:
        headers = headers | {"Job-Priority": str(priority)}
        return guarded.post("/v1/jobs", json=document, headers=headers)

    def changed(headers: dict[str, str], job_id: str, priority: int) -> int:
        path = f"/v1/jobs/{job_id}/priority"
        return guarded.put(path, json={"priority": priority}, headers=headers).status_code

    refused = submitted(own, 1)
    assert refused.status_code == 403 and "may not set a priority above 0" in refused.text
    job = submitted(own, -1).json()
    assert job["priority"] == -1
    assert [changed(own, job["id"], priority) for priority in (-5, 0, 1)] == [200, 200, 403]
    assert changed(every, job["id"], 1) == 200
    # What an administrator has raised, its owner can lower, and not raise again.
    assert [changed(own, job["id"], priority) for priority in (0, 1)] == [200, 403]
    urgent = submitted(every, 10).json()
    assert urgent["priority"] == 10
    assert changed(own, urgent["id"], -1) == 403
    assert changed(bearer(Scope.READ), job["id"], -1) == 403


def test_a_token_of_all_rights_commands_every_job(
    guarded: httpx2.Client, bearer: Bearer, store: Store, spec: JobSpec
) -> None:
    job, _ = store.create_job(spec, owner="someone")
    answer = guarded.post(f"/v1/jobs/{job.id}/cancel", headers=bearer(Scope.ADMIN))
    assert answer.status_code == 200


def test_a_deleted_job_is_restored_by_its_owner_and_administrators_only(
    guarded: httpx2.Client, bearer: Bearer, store: Store, spec: JobSpec
) -> None:
    job, _ = store.create_job(spec, owner="someone")
    store.command(job.id, Command.CANCEL)
    store.delete_job(job.id)
    restore = f"/v1/jobs/{job.id}/restore"
    assert guarded.post(restore, headers=bearer(Scope.SUBMIT)).status_code == 403
    assert guarded.post(restore, headers=bearer(Scope.ADMIN)).status_code == 200


def test_a_job_that_a_client_may_not_see_looks_like_a_missing_one(
    guarded: httpx2.Client, job: Job
) -> None:
    there, gone = (guarded.post(f"/v1/jobs/{name}/cancel") for name in (job.id, "nosuchjob123"))
    assert there.status_code == gone.status_code == 401


def test_every_operation_that_changes_something_asks_who_may(serve: Serve) -> None:
    server: Server = serve()
    for route in operations(server.app):
        if not (route.methods or set()) - {"GET", "HEAD"}:
            continue
        asked = {dependency.call for dependency in route.dependant.dependencies}
        assert bool(asked & {may_submit, may_command, may_restore}) is (
            route.operation_id not in QUESTIONS
        ), route.operation_id


def test_the_audit_log_names_tokens_and_is_for_administrators(
    guarded: httpx2.Client, bearer: Bearer, spec: JobSpec
) -> None:
    submit, admin = bearer(Scope.SUBMIT), bearer(Scope.ADMIN)
    body = spec.model_dump(mode="json")
    job_id = guarded.post("/v1/jobs", json=body, headers=submit).json()["id"]
    guarded.post(f"/v1/jobs/{job_id}/pause", headers=submit)
    guarded.post(f"/v1/jobs/{job_id}/resume", headers=admin)
    guarded.post(f"/v1/jobs/{job_id}/extend", json={"iterations": 9}, headers=submit)
    guarded.post(f"/v1/jobs/{job_id}/cancel", headers=admin)
    for scope, headers in ((Scope.READ, bearer(Scope.READ)), (Scope.SUBMIT, submit)):
        refused = guarded.get("/v1/audit", headers=headers)
        assert refused.status_code == 403, scope
        assert "admin" in refused.json()["detail"]
    page = guarded.get(f"/v1/audit?job_id={job_id}", headers=admin).json()
    found = [(entry["actor"], entry["action"]) for entry in page["items"][::-1]]
    assert found == [
        *(("submit", "submit"), ("submit", "pause"), ("admin", "resume")),
        *(("submit", "extend"), ("admin", "cancel")),
    ]
    assert page["items"][1]["details"] == {"iterations": 9}
    first = guarded.get("/v1/audit?limit=1", headers=admin).json()
    rest = guarded.get(f"/v1/audit?after={first['next']}&limit=200", headers=admin).json()
    assert len(rest["items"]) == 7 and rest["next"] is None
    wrong = guarded.get("/v1/audit?after=x", headers=admin)
    assert wrong.status_code == 422 and wrong.json()["errors"][0]["field"] == "after"


def test_a_revoked_token_is_refused_within_seconds(
    guarded: httpx2.Client, bearer: Bearer, store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("gaitswarm.api.access.CACHE_SECONDS", 0.0)
    headers = bearer(Scope.READ)
    assert guarded.get("/v1/jobs", headers=headers).status_code == 200
    store.tokens.revoke("read")
    assert guarded.get("/v1/jobs", headers=headers).status_code == 401


def test_a_browser_asks_with_a_cookie_that_no_script_reads(
    guarded: httpx2.Client, bearer: Bearer
) -> None:
    secret = bearer(Scope.READ)["Authorization"].removeprefix("Bearer ")
    begun = guarded.post("/v1/session", json={"token": secret})
    assert begun.json() == {"required": True, "name": "read", "scope": "read", "manual": False}
    cookie = begun.headers["Set-Cookie"].lower()
    assert cookie.startswith(f"{COOKIE}={secret}".lower())
    assert "httponly" in cookie and "samesite=strict" in cookie
    assert guarded.get("/v1/jobs").status_code == 200
    guarded.delete("/v1/session")
    assert guarded.get("/v1/jobs").status_code == 401


def test_a_session_begins_with_a_valid_token_only(guarded: httpx2.Client) -> None:
    answer = guarded.post("/v1/session", json={"token": "guessed"})
    assert answer.status_code == 401
    assert "Set-Cookie" not in answer.headers
    open_session = {"required": True, "name": None, "scope": None, "manual": False}
    assert guarded.get("/v1/session").json() == open_session


def test_a_program_sends_the_token_of_its_environment(
    guarded: httpx2.Client, bearer: Bearer, job: Job, monkeypatch: pytest.MonkeyPatch
) -> None:
    url = str(guarded.base_url)
    with gaitswarm.connect(url) as jobs, pytest.raises(gaitswarm.Unauthorized, match="token"):
        jobs.job(job.id)
    secret = bearer(Scope.READ)["Authorization"].removeprefix("Bearer ")
    with gaitswarm.connect(url, token=secret) as jobs:
        assert jobs.job(job.id).id == job.id
        with pytest.raises(gaitswarm.Forbidden, match="may not command"):
            jobs.cancel(job.id)
    monkeypatch.setenv("GAITSWARM_TOKEN", secret)
    with gaitswarm.connect(url) as jobs:
        assert jobs.job(job.id).id == job.id


def test_the_document_says_that_a_token_may_be_needed() -> None:
    document = api_document()
    assert document["components"]["securitySchemes"]["token"]["scheme"] == "bearer"
    assert document["security"] == [{"token": []}, {}]
    assert "401" in document["paths"]["/v1/jobs"]["get"]["responses"]
    assert "401" not in document["paths"]["/v1/healthz"]["get"]["responses"]


def test_a_token_to_submit_has_a_quota_and_one_of_all_rights_has_none(
    serve: Serve, bearer: Bearer, spec: JobSpec
) -> None:
    client = serve(api_access="token", api_max_unfinished_jobs=1).client
    document = spec.model_dump(mode="json")
    headers = bearer(Scope.SUBMIT)
    own = client.post("/v1/jobs", json=document, headers=headers).json()["id"]
    refused = client.post("/v1/jobs", json=document, headers=headers)
    assert refused.status_code == 409
    assert refused.json()["type"] == "urn:gaitswarm:problem:quota-exceeded"
    assert "cancel one" in refused.json()["detail"]
    admin = bearer(Scope.ADMIN)
    for _ in range(2):
        assert client.post("/v1/jobs", json=document, headers=admin).status_code == 202
    client.post(f"/v1/jobs/{own}/cancel", headers=headers)
    assert client.post("/v1/jobs", json=document, headers=headers).status_code == 202


def test_what_a_quota_refuses_is_named_by_its_field(
    serve: Serve, service: JobService, spec: JobSpec
) -> None:
    limited = JobService(service.store, longest_job=1e9)
    server = serve(limited, api_max_unfinished_seconds=10.0)
    refused = server.client.post("/v1/jobs", json=spec.model_dump(mode="json"))
    assert refused.status_code == 409
    (error,) = refused.json()["errors"]
    assert error["field"] == "iterations" and "the limit is 10 s" in error["message"]
    with (
        gaitswarm.connect(server.url) as jobs,
        pytest.raises(gaitswarm.QuotaExceeded, match=r"^iterations: the unfinished"),
    ):
        jobs.submit(spec)


def test_a_cookie_that_came_by_https_goes_no_other_way(serve: Serve, bearer: Bearer) -> None:
    server = serve(api_access="token")
    secret = bearer(Scope.READ)["Authorization"].removeprefix("Bearer ")

    def cookie(**headers: str) -> str:
        begun = server.client.post("/v1/session", json={"token": secret}, headers=headers)
        return str(begun.headers["Set-Cookie"]).lower()

    assert "secure" not in cookie()
    # The server's own machine is trusted as a proxy, unless another one is named.
    by_https = {"X-Forwarded-Proto": "https"}
    assert "secure" in cookie(**by_https)
    server = serve(api_access="token", api_trusted_proxies="192.0.2.1")
    assert "secure" not in cookie(**by_https)


def test_throttle_allows_a_burst_and_then_a_steady_rate(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gaitswarm.api.access.GUESS_BURST", 3)
    monkeypatch.setattr("gaitswarm.api.access.GUESSES_PER_SECOND", 2.0)
    now = [100.0]
    guesses = TokenGuesses(lambda: now[0])

    def guess(address: str) -> float:
        wait = guesses.seconds_to_wait(address)
        if wait == 0.0:
            guesses.count(address)
        return wait

    assert [guess("a") for _ in range(5)] == [0.0, 0.0, 0.0, 0.5, 0.5]
    assert guess("b") == 0.0
    now[0] += 0.5
    assert [guess("a") for _ in range(2)] == [0.0, 0.5]


@pytest.mark.parametrize(
    ("host", "address"),
    [
        ("203.0.113.9", "203.0.113.9"),
        ("::ffff:203.0.113.9", "203.0.113.9"),
        ("2001:db8:1:2:3:4:5:6", "2001:db8:1:2::/64"),
        ("::1", "::1"),
        ("a-name", "a-name"),
    ],
)
def test_ipv6_addresses_of_one_network_count_together(host: str, address: str) -> None:
    assert address_of({"type": "http", "client": (host, 1234)}) == address


def test_guessed_tokens_are_throttled_before_any_lookup(
    serve: Serve, store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("gaitswarm.api.access.GUESS_BURST", 3)
    monkeypatch.setattr("gaitswarm.api.access.GUESSES_PER_SECOND", 0.001)
    client = serve(api_access="token").client
    valid = {"Authorization": f"Bearer {store.tokens.create('valid', Scope.READ)[1]}"}
    assert client.get("/v1/jobs", headers=valid).status_code == 200

    def guess(path: str, number: int, **headers: str) -> httpx2.Response:
        return client.get(path, headers={"Authorization": f"Bearer {number}", **headers})

    statuses = [guess(path, 0).status_code for path in ("/v1/jobs", "/metrics", "/v1/session")]
    assert statuses == [401, 401, 200]
    refused = guess("/v1/jobs", 4)
    assert refused.status_code == 429
    assert refused.json()["type"] == "urn:gaitswarm:problem:too-many-requests"
    assert int(refused.headers["Retry-After"]) > 100
    assert guess("/metrics", 5).status_code == 429
    assert client.post("/v1/session", json={"token": "guess"}).status_code == 429
    # A valid token is exempt, as are clients of a trusted proxy at other addresses, and probes.
    assert {client.get("/v1/jobs", headers=valid).status_code for _ in range(9)} == {200}
    assert guess("/v1/jobs", 6, **{"X-Forwarded-For": "203.0.113.9"}).status_code == 401
    assert guess("/v1/readyz", 7).status_code == 200
