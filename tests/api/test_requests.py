"""Every request: its id, answers to bugs, and an unavailable database."""

from __future__ import annotations

import shutil
from pathlib import Path

import httpx2
import pytest

from gaitswarm.api.dependencies import Component
from gaitswarm.services.optimizer.errors import EvaluatorUnavailable, LeaseLost, StoreUnavailable
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.store import Store
from gaitswarm.sim.errors import KernelBuildError
from tests.api.conftest import Commit, Serve

pytestmark = pytest.mark.slow


def test_every_answer_has_a_request_id_of_its_own(client: httpx2.Client) -> None:
    first, second = (client.get("/v1/healthz").headers["X-Request-ID"] for _ in range(2))

    assert first
    assert first != second


def test_a_clients_request_id_is_kept(client: httpx2.Client) -> None:
    answer = client.get("/v1/nowhere", headers={"X-Request-ID": "my-id.7"})

    assert answer.headers["X-Request-ID"] == "my-id.7"


def test_a_request_id_that_could_forge_log_lines_is_replaced(client: httpx2.Client) -> None:
    answer = client.get("/v1/healthz", headers={"X-Request-ID": "a b\tc"})

    assert answer.headers["X-Request-ID"].isalnum()


def test_a_bug_is_a_problem_that_shows_nothing_of_the_inside(
    client: httpx2.Client,
    store: Store,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    def broken(*_: object, **__: object) -> None:
        raise RuntimeError("the password is swordfish")

    monkeypatch.setattr(type(store), "jobs", broken)

    answer = client.get("/v1/jobs")

    assert answer.status_code == 500
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.json()["type"] == "urn:gaitswarm:problem:internal-error"
    assert "swordfish" not in answer.text
    assert answer.headers["X-Request-ID"] in answer.json()["detail"]
    assert answer.headers["X-Request-ID"] in caplog.text
    assert "swordfish" in caplog.text


@pytest.mark.parametrize(
    ("error", "status"),
    [
        (StoreUnavailable("the database is away"), 503),
        (EvaluatorUnavailable("the workers are away"), 503),
        (KernelBuildError("cc said no"), 503),
        (LeaseLost("another runner has it"), 409),
    ],
)
def test_what_cannot_be_done_now_is_distinguished_from_bugs(
    client: httpx2.Client,
    store: Store,
    monkeypatch: pytest.MonkeyPatch,
    error: Exception,
    status: int,
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise error

    monkeypatch.setattr(type(store), "jobs", fail)

    answer = client.get("/v1/jobs")

    assert answer.status_code == status
    said = error.for_clients if isinstance(error, StoreUnavailable) else str(error)
    assert answer.json()["detail"] == said
    assert ("Retry-After" in answer.headers) == (status == 503)


def test_the_server_is_alive_and_ready(client: httpx2.Client) -> None:
    assert client.get("/v1/healthz").json() == {"status": "ok"}
    ready = {"status": "ok", "components": [{"name": "database", "status": "ok", "detail": ""}]}
    assert client.get("/v1/readyz").json() == ready


def test_without_a_database_the_server_is_alive_but_not_ready_and_only_the_log_says_why(
    client: httpx2.Client,
    store: Store,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    def away(_: object) -> None:
        raise StoreUnavailable("jobs.db is gone; restore it or create another")

    monkeypatch.setattr(type(store), "ping", away)

    assert client.get("/v1/healthz").status_code == 200
    answer = client.get("/v1/readyz")
    assert answer.status_code == 503
    assert answer.json()["detail"] == f"database: {StoreUnavailable.for_clients}"
    assert "restore it" in caplog.text and "restore it" not in answer.text


@pytest.mark.parametrize("replaced", [False, True], ids=["removed", "replaced"])
def test_a_database_file_that_is_no_longer_the_open_one_takes_no_jobs(
    client: httpx2.Client, database: Path, spec: JobSpec, *, replaced: bool
) -> None:
    body = spec.model_dump(mode="json", exclude_unset=True)
    assert client.post("/v1/jobs", json=body).status_code == 202
    copy = Path(shutil.copy(database, database.with_name("copy.db")))
    database.unlink()
    if replaced:
        copy.rename(database)

    for answer in (client.post("/v1/jobs", json=body), client.get("/v1/readyz")):
        assert answer.status_code == 503
        assert "removed or replaced while it was open; restart" in answer.json()["detail"]
    assert client.get("/v1/healthz").status_code == 200


def test_a_component_that_has_failed_is_named_and_the_server_is_alive_but_not_ready(
    serve: Serve,
) -> None:
    troubles = [None, "its thread has ended; restart this process"]
    client = serve(components=[Component("runner", troubles.pop)]).client

    answer = client.get("/v1/readyz")
    assert answer.status_code == 503
    assert answer.json()["detail"] == "runner: its thread has ended; restart this process"
    assert [error["field"] for error in answer.json()["errors"]] == ["runner"]
    assert client.get("/v1/healthz").status_code == 200
    assert client.get("/v1/readyz").status_code == 200


def test_a_component_that_the_server_can_do_without_is_reported(serve: Serve) -> None:
    workers = Component("workers", lambda: "Ray is out of reach", vital=False)
    answer = serve(components=[workers]).client.get("/v1/readyz")

    assert answer.status_code == 200
    assert answer.json()["components"][1] == {
        "name": "workers",
        "status": "degraded",
        "detail": "Ray is out of reach",
    }


@pytest.mark.parametrize(
    ("path", "target"),
    [("/", "/docs"), ("/healthz", "/v1/healthz"), ("/readyz", "/v1/readyz")],
)
def test_short_paths_lead_to_the_real_ones(client: httpx2.Client, path: str, target: str) -> None:
    answer = client.get(path)

    assert answer.is_redirect
    assert answer.headers["Location"] == target
    assert client.get(path, follow_redirects=True).status_code == 200


def test_a_stream_outlives_an_absence_of_the_database(
    client: httpx2.Client,
    store: Store,
    job: Job,
    commit: Commit,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    commit(job, 3)
    answers = iter([None, StoreUnavailable("away"), StoreUnavailable("away")])
    read = type(store).job

    def sometimes(self: Store, job_id: str) -> Job:
        error = next(answers, None)
        if error is not None:
            raise error
        return read(self, job_id)

    monkeypatch.setattr(type(store), "job", sometimes)

    answer = client.get(f"/v1/jobs/{job.id}/events")

    assert answer.text.count("event: iteration") == 3
