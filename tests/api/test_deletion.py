"""DELETE of jobs: what is answered, who may, what streams say; and housekeeping."""

from __future__ import annotations

import json
import sqlite3
from contextlib import closing
from datetime import UTC, datetime, timedelta
from pathlib import Path

import httpx2
import pytest

from gaitswarm.services.optimizer.errors import NotFound
from gaitswarm.services.optimizer.jobs.job import Command, Job
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.store import Store, open_store
from gaitswarm.services.optimizer.store.maintenance import Housekeeping
from tests.api.conftest import Commit
from tests.examples.processes import eventually
from tests.examples.servers import ServerProcess
from tests.store.examples import Clock


def test_a_job_is_deleted_once(client: httpx2.Client, job: Job, commit: Commit) -> None:
    commit(job, 3)
    answer = client.delete(f"/v1/jobs/{job.id}")
    assert (answer.status_code, answer.content) == (204, b"")
    assert client.get(f"/v1/jobs/{job.id}").status_code == 404
    assert client.delete(f"/v1/jobs/{job.id}").status_code == 404
    assert client.get(f"/v1/jobs/{job.id}/events").status_code == 404
    assert client.get("/v1/jobs").json()["items"] == []


def test_a_deleted_job_is_restored_once(client: httpx2.Client, job: Job, commit: Commit) -> None:
    commit(job, 3)
    before = client.get(f"/v1/jobs/{job.id}").json()
    assert client.post(f"/v1/jobs/{job.id}/restore").status_code == 404
    client.delete(f"/v1/jobs/{job.id}")
    assert client.post(f"/v1/jobs/{job.id}/restore").json() == before
    assert client.get(f"/v1/jobs/{job.id}").json() == before
    missing = client.post(f"/v1/jobs/{job.id}/restore")
    assert missing.status_code == 404
    assert "was deleted in the last 24 hours" in missing.json()["detail"]


def test_links_say_when_a_job_can_be_deleted(
    client: httpx2.Client, job: Job, commit: Commit
) -> None:
    here = f"/v1/jobs/{job.id}"
    assert "delete" not in client.get(here).json()["links"]
    refused = client.delete(here)
    assert refused.status_code == 409
    assert f"POST {here}/cancel" in refused.json()["detail"]

    commit(job, 3)
    assert client.get(here).json()["links"]["delete"] == here
    assert client.put(f"{here}/keep").json()["kept"]
    assert "delete" not in client.get(here).json()["links"]
    assert client.delete(here).status_code == 409
    assert not client.delete(f"{here}/keep").json()["kept"]
    assert client.delete(here).status_code == 204


def test_the_stream_of_a_job_that_is_deleted_ends_with_that(
    client: httpx2.Client, store: Store, job: Job
) -> None:
    store.command(job.id, Command.PAUSE)
    with client.stream("GET", f"/v1/jobs/{job.id}/events") as answer:
        lines = answer.iter_lines()
        assert next(lines) == "event: state"
        store.delete_job(job.id)
        rest = list(lines)
    assert "event: deleted" in rest
    assert json.loads(rest[rest.index("event: deleted") + 1].removeprefix("data: ")) == {
        "id": job.id
    }


def test_housekeeping_deletes_what_ended_longer_ago_than_it_is_kept(
    database: Path, spec: JobSpec, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("gaitswarm.services.optimizer.store.maintenance._STEADY_SECONDS", -1.0)
    clock = Clock()
    clock.now = datetime.now(UTC) - timedelta(hours=2)
    with closing(open_store(str(database), clock=clock)) as store:
        old, young = (store.create_job(spec)[0] for _ in range(2))
        store.command(old.id, Command.CANCEL)
        clock.now = datetime.now(UTC)
        store.command(young.id, Command.CANCEL)

        Housekeeping(store, retention_days=None).round()
        assert len(store.jobs().items) == 2
        Housekeeping(store, retention_days=1 / 24).round()
        assert [job.id for job in store.jobs().items] == [young.id]


def test_housekeeping_removes_a_deleted_job_after_a_day_only(
    database: Path, spec: JobSpec, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("gaitswarm.services.optimizer.store.maintenance._STEADY_SECONDS", -1.0)
    clock = Clock()
    with closing(open_store(str(database), clock=clock)) as store:
        job, _ = store.create_job(spec)
        store.command(job.id, Command.CANCEL)
        keeper = Housekeeping(store)
        for seconds, restorable in ((86_000.0, True), (86_500.0, False)):
            store.delete_job(job.id)
            clock.advance(seconds)
            keeper.round()
            with closing(sqlite3.connect(database)) as connection:
                (count,) = connection.execute("SELECT count(*) FROM jobs").fetchone()
            assert count == restorable
            if restorable:
                store.restore_job(job.id)


def test_housekeeping_deletes_nothing_until_the_clock_was_steady_for_a_day(
    database: Path, spec: JobSpec, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    clock = Clock()
    clock.now = datetime.now(UTC) - timedelta(days=60)
    with closing(open_store(str(database), clock=clock)) as store:
        job, _ = store.create_job(spec)
        store.command(job.id, Command.CANCEL)
    with closing(open_store(str(database))) as store:
        keeper = Housekeeping(store, retention_days=1.0)
        keeper.round()
        assert [found.id for found in store.jobs().items] == [job.id]
        assert "ahead of the last change" in caplog.text
        monkeypatch.setattr("gaitswarm.services.optimizer.store.maintenance._STEADY_SECONDS", 0.0)
        keeper.round()
        assert store.jobs().items == ()


def test_housekeeping_removes_old_entries_of_the_audit_log_only_if_configured(
    store: Store, spec: JobSpec
) -> None:
    store.create_job(spec)
    Housekeeping(store, retention_days=1.0).round()
    Housekeeping(store, audit_days=1.0).round()
    assert len(store.audit().items) == 1
    since = datetime.now(UTC)
    eventually(lambda: datetime.now(UTC) > since + timedelta(seconds=0.2))
    Housekeeping(store, audit_days=0.1 / 86_400).round()
    assert store.audit().items == ()


def test_housekeeping_that_is_started_does_its_rounds(store: Store, spec: JobSpec) -> None:
    job, _ = store.create_job(spec)
    store.command(job.id, Command.CANCEL)
    keeper = Housekeeping(store, retention_days=1e-9)
    keeper.start()
    eventually(lambda: not store.jobs().items)
    keeper.stop()
    with pytest.raises(NotFound):
        store.job(job.id)


@pytest.mark.slow
def test_a_server_keeps_jobs_and_its_audit_log_as_long_as_it_is_set_to(
    store: Store, spec: JobSpec, database: Path
) -> None:
    job, _ = store.create_job(spec)
    store.command(job.id, Command.CANCEL)
    kept = {"GAITSWARM_RETENTION_DAYS": "1e-9", "GAITSWARM_AUDIT_DAYS": "1e-9"}
    with closing(ServerProcess(database, "--no-runner", environment=kept)):
        eventually(lambda: not store.jobs().items and not store.audit().items)
