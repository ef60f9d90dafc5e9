"""A page of another origin, open in the same browser, can change nothing here, and see nothing."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing
from urllib.parse import urlsplit

import httpx2
import pytest

from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.settings import read_settings
from tests.examples.servers import Server

ELSEWHERE = {"Sec-Fetch-Site": "cross-site", "Origin": "https://elsewhere.example"}


@pytest.fixture
def behind_a_proxy(service: JobService) -> Iterator[httpx2.Client]:
    """A client of a server that is reached as gait.example, too."""
    with closing(Server(service, api_allowed_hosts=("gait.example",))) as server:
        yield server.client


@pytest.mark.parametrize(
    "headers",
    [
        ELSEWHERE,
        {"Origin": "http://127.0.0.1:1"},
        {"Origin": "http://127.0.0.1:1", "Sec-Fetch-Site": "same-site"},
        {"Origin": "null"},
        {"Sec-Fetch-Site": "same-site"},
        {"Sec-Fetch-Site": "cross-site"},
    ],
)
def test_the_page_of_another_origin_cannot_cancel_a_job(
    client: httpx2.Client, job: Job, headers: dict[str, str]
) -> None:
    answer = client.post(f"/v1/jobs/{job.id}/cancel", headers=headers)
    assert answer.status_code == 403
    assert answer.json()["type"] == "urn:gaitswarm:problem:cross-origin"
    assert client.get(f"/v1/jobs/{job.id}").json()["state"] == job.state


@pytest.mark.parametrize("site", ["same-origin", "none", None])
@pytest.mark.parametrize("with_origin", [True, False])
def test_the_servers_own_page_and_other_programs_can(
    client: httpx2.Client, job: Job, site: str | None, *, with_origin: bool
) -> None:
    headers = {} if site is None else {"Sec-Fetch-Site": site}
    if with_origin:
        headers["Origin"] = str(client.base_url).rstrip("/")
    assert client.post(f"/v1/jobs/{job.id}/cancel", headers=headers).status_code == 200


def test_another_site_may_link_here(client: httpx2.Client) -> None:
    assert client.get("/v1/healthz", headers=ELSEWHERE).status_code == 200


@pytest.mark.parametrize("path", ["/", "/v1/jobs", "/docs", "/openapi.json"])
def test_a_site_whose_name_is_made_to_resolve_to_this_server_sees_nothing(
    client: httpx2.Client, path: str
) -> None:
    port = urlsplit(str(client.base_url)).port
    rebound = {"Host": f"evil.example:{port}", "Sec-Fetch-Site": "same-origin"}
    answer = client.get(path, headers=rebound)
    assert answer.status_code == 421
    assert answer.json()["type"] == "urn:gaitswarm:problem:unknown-host"
    assert "GAITSWARM_API_ALLOWED_HOSTS" in answer.json()["detail"]


@pytest.mark.parametrize("host", ["localhost", "LOCALHOST:8000", "192.0.2.7:8000", "[::1]:8000"])
def test_a_server_is_reached_by_its_addresses_and_as_localhost(
    client: httpx2.Client, host: str
) -> None:
    assert client.get("/v1/healthz", headers={"Host": host}).status_code == 200


@pytest.mark.parametrize(
    "host", ["localhost.evil.example", "127.0.0.1.evil.example", "", "[", "::", "[::1].evil"]
)
def test_what_only_looks_like_its_name_is_refused(client: httpx2.Client, host: str) -> None:
    assert client.get("/v1/healthz", headers={"Host": host}).status_code == 421


def test_a_server_may_have_further_names(behind_a_proxy: httpx2.Client) -> None:
    assert behind_a_proxy.get("/v1/healthz", headers={"Host": "gait.example"}).status_code == 200
    assert behind_a_proxy.get("/v1/healthz", headers={"Host": "a.gait.example"}).status_code == 421


def test_the_page_of_a_further_name_may_change_jobs_though_a_proxy_renames_the_host(
    behind_a_proxy: httpx2.Client, job: Job
) -> None:
    headers = {"Origin": "https://gait.example", "Sec-Fetch-Site": "same-origin"}
    assert behind_a_proxy.post(f"/v1/jobs/{job.id}/cancel", headers=headers).status_code == 200


def test_further_names_are_read_from_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GAITSWARM_API_ALLOWED_HOSTS", "gait.example, gait.example:8443")
    assert read_settings().api_allowed_hosts == ("gait.example", "gait.example:8443")


def test_a_name_that_is_invalid_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("GAITSWARM_API_ALLOWED_HOSTS", "https://gait.example")
    with pytest.raises(InvalidRequest, match="GAITSWARM_API_ALLOWED_HOSTS"):
        read_settings()
