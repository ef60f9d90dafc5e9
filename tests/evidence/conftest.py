"""Evidence of one small job, and tampered copies of it."""

from __future__ import annotations

import io
import json
import shutil
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import gaitswarm
from gaitswarm.evidence.archive import MANIFEST, archived, unzipped
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
CHAIN = "history/chain.json"


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


@dataclass(frozen=True, slots=True)
class Certified:
    """A database with a finished job and certificates of its designs, and the job's evidence."""

    db: Path
    id: str
    of_best: str
    of_another: str
    content: bytes


def certificate_of(design: Mapping[str, float | str], **changes: Any) -> dict[str, Any]:
    """A certificate of five worlds of a step, as a document."""
    return {
        "kind": "certificate",
        "controller": "pi",
        "design": dict(design),
        "scenarios": [SHORT_WALK],
        "worlds": 5,
        "optimizer": {"name": "random", "particles": 3},
        **changes,
    }


@pytest.fixture(scope="session")
def certified(proved: Proved, tmp_path_factory: pytest.TempPathFactory) -> Certified:
    db = Path(shutil.copy(proved.db, tmp_path_factory.mktemp("certified") / "jobs.db"))
    with gaitswarm.open(db) as jobs:
        best = jobs.best(proved.id)
        others = next(jobs.history(proved.id)).evaluations
        other = next(e for e in others if e.design != best.design)
        documents = (
            certificate_of(best.design, name="<of the best>"),
            certificate_of(other.design, precision="single"),
            certificate_of({"P": 0.4, "I": 0.2}),
        )
        of_best, of_another, _ = (jobs.run(jobs.submit(d).id).id for d in documents)
        # Neither finished nor of this job: left out.
        jobs.submit(certificate_of(best.design))
        return Certified(db, proved.id, of_best, of_another, jobs.evidence(proved.id))


Change = Callable[[bytes], bytes]


def tampered(content: bytes, changes: Mapping[str, Change]) -> bytes:
    """Evidence with other members and a manifest that says so."""
    members = {n: m for n, m in unzipped(content).items() if n != MANIFEST}
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
    members = unzipped(content) | {MANIFEST: json.dumps(manifest).encode()}
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_STORED) as archive:
        for name, member in members.items():
            archive.writestr(name, member)
    return file.getvalue()
