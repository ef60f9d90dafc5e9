"""The built page as the server answers it: paths, caching, compression, security headers."""

from __future__ import annotations

import base64
import hashlib
import re
from collections.abc import Iterator
from pathlib import Path

import httpx2
import pytest

from gaitswarm.api.page import is_built
from gaitswarm.services.optimizer.errors import StoreUnavailable
from gaitswarm.services.optimizer.jobs.job import Job
from tests.api.conftest import Commit, Serve
from tests.examples.api_document import api_document
from tests.examples.servers import Server

HTML = '<!doctype html><script type="module" src="/assets/index-A1b2.js"></script><p>Grüße</p>'
SCRIPT = "const n = 1\n" * 1000


def build(folder: Path) -> Path:
    """A page as the build leaves it."""
    (folder / "assets").mkdir(parents=True)
    (folder / "index.html").write_text(HTML, encoding="utf-8")
    (folder / "assets" / "index-A1b2.js").write_text(SCRIPT, encoding="utf-8")
    (folder / "assets" / "icon-C3d4.svg").write_text("<svg/>", encoding="utf-8")
    (folder / "assets" / ".hidden").write_text("no", encoding="utf-8")
    (folder / "secret.txt").write_text("no", encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[httpx2.Client]:
    server = Server(None, page_folder=build(tmp_path_factory.mktemp("built") / "page"))
    yield server.client
    server.close()


@pytest.mark.parametrize(
    "path",
    ["/", "/jobs", "/jobs/new", "/jobs/k2q7zr5dm9xw/what-if?particle=3", "/walk", "/controller/x"],
)
def test_paths_of_the_page_are_answered_with_it_and_asked_for_every_time(
    page: httpx2.Client, path: str
) -> None:
    answer = page.get(path)

    assert answer.status_code == 200
    assert answer.headers["content-type"] == "text/html; charset=utf-8"
    assert answer.headers["cache-control"] == "no-cache"
    assert answer.text == HTML


@pytest.mark.parametrize("path", ["/v1/nothing", "/v1", "/jobsearch", "/robots.txt", "/secret.txt"])
def test_other_paths_stay_problems(page: httpx2.Client, path: str) -> None:
    answer = page.get(path)

    assert answer.status_code == 404
    assert answer.headers["content-type"] == "application/problem+json"


@pytest.mark.parametrize(
    "name",
    [
        *("index-Gone.js", ".hidden", "", "..%2fsecret.txt", "%2e%2e/secret.txt"),
        *("%2e%2e%2fsecret.txt", "a" * 256 + "%0aERROR%1b[2J", "%00"),
    ],
)
def test_what_is_no_asset_is_a_problem(page: httpx2.Client, name: str) -> None:
    answer = page.get(f"/assets/{name}")

    assert answer.status_code == 404
    assert answer.json()["type"] == "urn:gaitswarm:problem:not-found"


@pytest.mark.parametrize("error", [RuntimeError("a bug"), StoreUnavailable("away")])
def test_a_path_forges_no_log_lines(
    page: httpx2.Client,
    error: Exception,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    def fail(*_: object) -> None:
        raise error

    monkeypatch.setattr("gaitswarm.api.page._file", fail)
    page.get("/assets/x%0aERROR%1b[2J")

    (record,) = caplog.records
    assert "/assets/x" in record.getMessage() and record.getMessage().isprintable()


def test_assets_are_compressed_and_kept_for_good(page: httpx2.Client) -> None:
    script = page.get("/assets/index-A1b2.js")
    icon = page.get("/assets/icon-C3d4.svg")

    assert script.text == SCRIPT
    assert script.headers["content-encoding"] == "gzip"
    assert int(script.headers["content-length"]) < len(SCRIPT) / 10
    assert script.headers["content-type"].startswith("text/javascript")
    assert icon.headers["content-type"].startswith("image/svg+xml")
    for answer in (script, icon):
        assert answer.headers["cache-control"] == "public, max-age=31536000, immutable"


def test_a_client_that_cannot_decompress_gets_the_asset_as_it_is(page: httpx2.Client) -> None:
    answer = page.get("/assets/index-A1b2.js", headers={"Accept-Encoding": "identity"})

    assert "content-encoding" not in answer.headers
    assert answer.content == SCRIPT.encode()


@pytest.mark.parametrize("path", ["/", "/jobs/new", "/assets/index-A1b2.js"])
def test_head_answers_as_get_without_the_body(page: httpx2.Client, path: str) -> None:
    head, get = (page.request(method, path) for method in ("HEAD", "GET"))

    assert (head.status_code, head.content) == (200, b"")
    for name in ("content-type", "cache-control", "content-security-policy"):
        assert head.headers[name] == get.headers[name]


@pytest.mark.parametrize("path", ["/", "/assets/index-A1b2.js", "/v1/healthz", "/v1/nothing"])
def test_nothing_but_the_servers_own_files_and_data_is_allowed(
    page: httpx2.Client, path: str
) -> None:
    headers = page.get(path).headers

    assert headers["x-content-type-options"] == "nosniff"
    assert headers["referrer-policy"] == "no-referrer"
    assert headers["content-security-policy"] == (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:;"
        " connect-src 'self'; font-src 'self'; base-uri 'none'; form-action 'none';"
        " frame-ancestors 'none'"
    )


def test_the_documentation_may_run_its_own_inline_script_and_no_other(
    client: httpx2.Client,
) -> None:
    answer = client.get("/docs")

    (script,) = re.findall(r"<script>(.*?)</script>", answer.text, re.DOTALL)
    expected = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    scripts = re.findall(r"script-src ([^;]*)", answer.headers["content-security-policy"])
    assert scripts == [f"'self' 'sha256-{expected}'"]


def test_without_a_page_the_root_leads_to_the_documentation(client: httpx2.Client) -> None:
    root = client.get("/")
    deep = client.get("/jobs/new")

    assert (root.status_code, root.headers["location"]) == (307, "/docs")
    assert deep.status_code == 404
    assert "`make page`" in deep.json()["detail"]


def test_without_a_page_a_jobs_page_leads_to_the_job_as_json(client: httpx2.Client) -> None:
    answer = client.get("/jobs/k2q7zr5dm9xw")

    assert (answer.status_code, answer.headers["location"]) == (307, "/v1/jobs/k2q7zr5dm9xw")


def test_a_page_that_is_built_while_the_server_runs_is_served(serve: Serve, tmp_path: Path) -> None:
    folder = build(tmp_path / "page")
    (folder / "index.html").rename(folder / "later.html")
    client = serve(page_folder=folder).client
    assert not is_built(folder)
    assert client.get("/").status_code == 307

    (folder / "later.html").rename(folder / "index.html")

    assert is_built(folder)
    assert client.get("/").text == HTML


def test_an_event_stream_is_not_compressed_and_not_held_back(
    client: httpx2.Client, job: Job, commit: Commit
) -> None:
    claim = commit(job, 1)
    headers = {"Accept-Encoding": "gzip"}

    with client.stream("GET", f"/v1/jobs/{job.id}/events", headers=headers) as answer:
        lines = answer.iter_lines()
        assert "content-encoding" not in answer.headers
        assert next(line for line in lines if line.startswith("id:")) == "id: 0"
        # The next one comes while the answer is still open.
        commit(job, 1, claim=claim)
        assert next(line for line in lines if line.startswith("id:")) == "id: 1"


def test_long_json_is_compressed(page: httpx2.Client) -> None:
    answer = page.get("/v1/controllers")

    assert answer.headers["content-encoding"] == "gzip"
    assert answer.headers["vary"] == "Accept-Encoding"
    assert answer.json()["items"]


def test_the_document_of_the_api_is_made_without_server_database_or_settings(
    client: httpx2.Client,
) -> None:
    assert api_document() == client.get("/openapi.json").json()
