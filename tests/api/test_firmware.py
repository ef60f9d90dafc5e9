"""A design as firmware, over HTTP."""

from __future__ import annotations

import io
import json
import zipfile
from pathlib import Path

import httpx2
import pytest

from gaitswarm.firmware import write_firmware, write_trajectories
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.service import JobService
from tests.api.conftest import Commit, Serve

pytestmark = pytest.mark.slow

PI = {"P": 0.45, "I": 0.1}


def members(content: bytes) -> dict[str, bytes]:
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def written(folder: Path) -> dict[str, bytes]:
    files = (path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in files}


def test_a_jobs_best_is_written_with_the_jobs_scenarios(
    client: httpx2.Client, job: Job, commit: Commit, service: JobService, tmp_path: Path
) -> None:
    commit(job, 1)
    path = f"/v1/jobs/{job.id}/firmware"
    answer = client.get(path)
    assert answer.status_code == 200, answer.text
    name = f'attachment; filename="{job.id}-firmware.zip"'
    assert answer.headers["Content-Disposition"] == name
    manifest = json.loads(members(answer.content)["firmware.json"])
    best = service.store.best(job.id)
    assert best is not None
    assert list(manifest["design"].values()) == best.design.tolist()
    assert [s["name"] for s in manifest["scenarios"]] == ["normal-fast", "turn-right-fast"]
    unchanged = client.get(path, headers={"If-None-Match": answer.headers["ETag"]})
    assert (unchanged.status_code, unchanged.content) == (304, b"")

    summary = client.get(f"{path}/summary", params={"table_bits": "8x5"}).json()
    assert summary["tables"][0]["shape"] == [256, 32, 1]
    assert summary["label"] == "small"
    smaller = client.get(path, params={"table_bits": "8x5"})
    assert {n: len(c) for n, c in members(smaller.content).items()} == summary["files"]

    best_design = json.loads(client.get(f"/v1/jobs/{job.id}/best").text)["design"]
    scenarios = ["normal-fast", "turn-right-fast"]
    view = write_firmware(best_design, tmp_path / "f", scenarios=scenarios, label="small")
    assert members(answer.content) == written(tmp_path / "f")
    summary = client.get(f"{path}/summary").json()
    assert summary == json.loads(view.model_dump_json()) | {"folder": None}


def test_a_jobs_trajectories_are_those_of_its_best_design(
    client: httpx2.Client, job: Job, commit: Commit, tmp_path: Path
) -> None:
    commit(job, 1)
    path = f"/v1/jobs/{job.id}/trajectories"
    answer = client.get(path, params={"rate": 20})
    assert answer.status_code == 200, answer.text
    name = f'attachment; filename="{job.id}-trajectories.zip"'
    assert answer.headers["Content-Disposition"] == name
    best = client.get(f"/v1/jobs/{job.id}/best").json()["design"]
    scenarios = ["normal-fast", "turn-right-fast"]
    write_trajectories(best, tmp_path / "f", scenarios=scenarios, rate=20.0)
    assert members(answer.content) == written(tmp_path / "f")
    assert client.get(path, params={"rate": 4}).json()["errors"][0]["field"] == "rate"


def test_there_is_no_firmware_without_a_design_that_walks(client: httpx2.Client, job: Job) -> None:
    for path in ("firmware", "firmware/summary", "trajectories"):
        assert client.get(f"/v1/jobs/{job.id}/{path}").status_code == 404
    certificate = {"kind": "certificate", "controller": "pi", "design": PI, "worlds": 1}
    other = client.post("/v1/jobs", json=certificate).json()["id"]
    refused = client.get(f"/v1/jobs/{other}/firmware")
    assert refused.status_code == 422
    assert "only a job that tunes a drive has firmware" in refused.json()["detail"]


def test_walks_that_last_too_long_together_are_refused(
    serve: Serve, job: Job, commit: Commit
) -> None:
    commit(job, 1)
    server = serve(api_max_simulated_seconds=1.5)
    for answer in (
        server.client.get(f"/v1/jobs/{job.id}/firmware"),
        server.client.get(f"/v1/jobs/{job.id}/firmware/summary"),
        server.client.get(f"/v1/jobs/{job.id}/trajectories"),
    ):
        assert answer.status_code == 422
        (error,) = answer.json()["errors"]
        assert error["field"] == "scenarios"
        assert "more than the 1.5 s allowed" in error["message"]
