"""A design as firmware, over HTTP."""

from __future__ import annotations

import io
import json
import zipfile
from pathlib import Path
from typing import Any

import httpx2
import pytest

from gaitswarm.firmware import write_firmware
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.service import JobService
from tests.api.conftest import Commit, Serve
from tests.examples.walks import SHORT_WALK

pytestmark = pytest.mark.slow

PI = {"P": 0.45, "I": 0.1}
ASKED: dict[str, Any] = {"controller": "pi", "design": PI, "scenarios": [SHORT_WALK]}


def members(content: bytes) -> dict[str, bytes]:
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def written(folder: Path) -> dict[str, bytes]:
    files = (path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in files}


def test_the_archive_holds_the_folder_and_is_the_same_every_time(
    client: httpx2.Client, tmp_path: Path
) -> None:
    answers = [client.post("/v1/firmware", json=ASKED | {"label": "mine"}) for _ in range(2)]
    assert [answer.status_code for answer in answers] == [200, 200]
    assert answers[0].headers["Content-Type"] == "application/zip"
    assert answers[0].headers["Content-Disposition"] == 'attachment; filename="firmware.zip"'
    assert answers[0].content == answers[1].content
    write_firmware(PI, tmp_path / "f", controller="pi", scenarios=SHORT_WALK, label="mine")
    assert members(answers[0].content) == written(tmp_path / "f")


def test_the_summary_is_what_the_command_prints(client: httpx2.Client, tmp_path: Path) -> None:
    summary = client.post("/v1/firmware/summary", json=ASKED).json()
    view = write_firmware(PI, tmp_path / "f", controller="pi", scenarios=SHORT_WALK)
    assert summary == json.loads(view.model_dump_json()) | {"folder": None}
    assert (summary["memory"]["flash"], summary["memory"]["ram"]) == (118784, 8192)
    assert [table["scenario"] for table in summary["trajectories"]] == ["short"]


def test_a_jobs_best_is_written_with_the_jobs_scenarios(
    client: httpx2.Client, job: Job, commit: Commit, service: JobService
) -> None:
    commit(job, 1)
    path = client.get(f"/v1/jobs/{job.id}").json()["links"]["firmware"]
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


def test_there_is_no_firmware_without_a_design_that_walks(client: httpx2.Client, job: Job) -> None:
    for path in ("firmware", "firmware/summary"):
        assert client.get(f"/v1/jobs/{job.id}/{path}").status_code == 404
    assert "firmware" not in client.get(f"/v1/jobs/{job.id}").json()["links"]
    certificate = {"kind": "certificate", "controller": "pi", "design": PI, "worlds": 1}
    other = client.post("/v1/jobs", json=certificate).json()["id"]
    refused = client.get(f"/v1/jobs/{other}/firmware")
    assert refused.status_code == 422
    assert "of kind certificate, which tunes no drive" in refused.json()["detail"]


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"table_bits": [8, 6]}, "table_bits"),
        ({"controller": "fuzzy-pi", "design": {}}, "design"),
        ({"scenarios": ["moon"]}, "scenarios.0"),
        ({"scenarios": []}, "scenarios"),
        ({"precision": "single"}, "precision"),
        ({"world": {"friction_factor": 0.9}}, "world"),
        ({"label": "x" * 201}, "label"),
    ],
)
def test_what_makes_no_sense_is_refused_by_field(
    client: httpx2.Client, change: dict[str, Any], field: str
) -> None:
    for path in ("/v1/firmware", "/v1/firmware/summary"):
        answer = client.post(path, json=ASKED | change)
        assert answer.status_code == 422
        assert [error["field"] for error in answer.json()["errors"]] == [field]


def test_walks_that_last_too_long_together_are_refused(
    serve: Serve, job: Job, commit: Commit
) -> None:
    commit(job, 1)
    server = serve(api_max_simulated_seconds=1.5)
    assert server.client.post("/v1/firmware/summary", json=ASKED).status_code == 200
    twice = [SHORT_WALK, SHORT_WALK | {"name": "again"}]
    for answer in (
        server.client.post("/v1/firmware", json=ASKED | {"scenarios": twice}),
        server.client.get(f"/v1/jobs/{job.id}/firmware"),
        server.client.get(f"/v1/jobs/{job.id}/firmware/summary"),
    ):
        assert answer.status_code == 422
        (error,) = answer.json()["errors"]
        assert error["field"] == "scenarios"
        assert "more than the 1.5 s allowed" in error["message"]
