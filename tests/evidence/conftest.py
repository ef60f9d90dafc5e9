"""Evidence of one small job, and evidence that somebody has tampered with."""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import gaitswarm
from gaitswarm.evidence.archive import MANIFEST, archived, read_archive
from tests.examples.walks import SHORT_WALK

JOB: dict[str, Any] = {
    "name": "to be <proved>",
    "controller": "pi",
    "scenarios": [SHORT_WALK],
    "optimizer": "pso",
    "particles": 4,
    "iterations": 3,
    "seed": 5,
}

EVALUATIONS = "history/evaluations.parquet"
ASKS = "history/asks.parquet"


@dataclass(frozen=True, slots=True)
class Proved:
    """A database with a finished job, and the job's evidence."""

    db: Path
    id: str
    content: bytes


@pytest.fixture(scope="session")
def proved(tmp_path_factory: pytest.TempPathFactory) -> Proved:
    db = tmp_path_factory.mktemp("proved") / "jobs.db"
    run = gaitswarm.optimize(db=db, **JOB)
    with gaitswarm.open(db) as jobs:
        return Proved(db, run.job.id, jobs.evidence(run.job.id))


Change = Callable[[bytes], bytes]


def tampered(content: bytes, changes: dict[str, Change]) -> bytes:
    """Evidence with other members, and a manifest that says so."""
    members = read_archive(content)
    del members[MANIFEST]
    return archived(
        {name: changes[name](m) if name in changes else m for name, m in members.items()}
    )


def with_cells(changes: Callable[[dict[str, list[Any]]], None]) -> Change:
    """A table whose columns were changed, as lists by name."""

    def change(content: bytes) -> bytes:
        table = pq.read_table(pa.BufferReader(content))
        columns = {name: table.column(name).to_pylist() for name in table.column_names}
        changes(columns)
        arrays = [pa.array(columns[f.name], type=f.type) for f in table.schema]
        sink = io.BytesIO()
        pq.write_table(pa.table(arrays, schema=table.schema), sink)
        return sink.getvalue()

    return change


def with_manifest(content: bytes, manifest: dict[str, Any]) -> bytes:
    """An archive with a manifest of one's own."""
    members = read_archive(content) | {MANIFEST: json.dumps(manifest).encode()}
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_STORED) as archive:
        for name, member in members.items():
            archive.writestr(name, member)
    return file.getvalue()
