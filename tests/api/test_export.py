"""A job's evaluations as a file, over HTTP."""

from __future__ import annotations

import csv
import io
from typing import Any

import httpx2
import pyarrow.parquet as pq
import pytest

from gaitswarm.services.optimizer.analysis.history import read_columns
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.store import Store
from gaitswarm.sim.outcome import OBJECTIVE_NAMES
from gaitswarm.tables import encoded_table
from tests.api.conftest import PARTICLES, Commit

pytestmark = pytest.mark.slow


def export(client: httpx2.Client, job: Job, file_format: str) -> httpx2.Response:
    answer = client.get(f"/v1/jobs/{job.id}/export", params={"format": file_format})
    assert answer.status_code == 200, answer.text
    name = f"{job.id}.{file_format}"
    assert answer.headers["content-disposition"] == f'attachment; filename="{name}"'
    return answer


@pytest.fixture
def expected(client: httpx2.Client, job: Job, commit: Commit) -> list[dict[str, Any]]:
    """Rows of the table, from the evaluations one by one."""
    commit(job, 3)
    rows = []
    for index in range(3):
        path = f"/v1/jobs/{job.id}/iterations/{index}/evaluations"
        for evaluation in client.get(path).json()["items"]:
            row = {name: evaluation[name] for name in ("iteration", "particle", "fitness")}
            row |= {f"design.{name}": value for name, value in evaluation["design"].items()}
            for scenario, walk in evaluation["scenarios"].items():
                row[f"{scenario}.status"] = walk["status"]
                row[f"{scenario}.utility"] = walk["utility"]
                row |= {f"{scenario}.{name}": walk["objectives"][name] for name in OBJECTIVE_NAMES}
                row |= {f"{scenario}.{name}": v for name, v in walk["measurements"].items()}
            rows.append(row)
    return rows


def test_parquet_holds_every_evaluation_exactly(
    client: httpx2.Client, job: Job, expected: list[dict[str, Any]]
) -> None:
    answer = export(client, job, "parquet")
    assert answer.headers["content-type"] == "application/vnd.apache.parquet"
    assert pq.read_table(io.BytesIO(answer.content)).to_pylist() == expected


def test_csv_holds_every_evaluation_exactly_and_what_is_missing_is_empty(
    client: httpx2.Client, job: Job, expected: list[dict[str, Any]]
) -> None:
    answer = export(client, job, "csv")
    assert answer.headers["content-type"].startswith("text/csv")
    rows = list(csv.DictReader(io.StringIO(answer.text, newline="")))
    assert [{name: _value(name, text) for name, text in row.items()} for row in rows] == expected


def _value(name: str, text: str) -> str | float | None:
    if name.endswith(".status"):
        return text
    return float(text) if text else None


@pytest.mark.parametrize("file_format", ["csv", "parquet"])
def test_a_job_that_has_committed_nothing_has_a_table_without_rows(
    client: httpx2.Client, job: Job, file_format: str
) -> None:
    content = export(client, job, file_format).content
    if file_format == "csv":
        assert content.decode().startswith("iteration,particle,fitness,design.")
        assert content.count(b"\n") == 1
    else:
        assert pq.read_table(io.BytesIO(content)).num_rows == 0


def test_the_file_is_written_as_it_is_read(store: Store, job: Job, commit: Commit) -> None:
    commit(job, 3)
    committed = store.job(job.id)
    for file_format in ("csv", "parquet"):
        pieces = read_columns(store, committed, rows=PARTICLES)
        parts = encoded_table(file_format, job.spec, pieces)
        # One for the head or the foot of the file, and one for every piece.
        assert len(list(parts)) == 1 + 3


def test_another_format_is_refused_by_name(client: httpx2.Client, job: Job) -> None:
    answer = client.get(f"/v1/jobs/{job.id}/export", params={"format": "xlsx"})
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["field"] == "format"


def test_an_unknown_job_is_not_found_before_a_download_begins(client: httpx2.Client) -> None:
    answer = client.get("/v1/jobs/bcdfghjkmnpq/export")
    assert answer.status_code == 404
    assert answer.headers["content-type"] == "application/problem+json"
