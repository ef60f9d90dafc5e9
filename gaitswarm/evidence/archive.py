"""The evidence archive: names and documents of its members, and a manifest of their hashes."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from datetime import datetime
from typing import Annotated, Any, Final

from pydantic import BaseModel, ConfigDict, Field
from pydantic_core import from_json

from gaitswarm.services.optimizer.jobs.fork import Lineage
from gaitswarm.services.optimizer.jobs.job import JobState
from gaitswarm.services.optimizer.jobs.provenance import JobProvenance, ProvenanceRecord
from gaitswarm.zip_archive import BadArchive, zipped

FORMAT: Final = "gaitswarm-evidence"

VERSION: Final = 1
"""Version of the layout; other versions are refused."""

MANIFEST: Final = "manifest.json"
JOB: Final = "job.json"
SPEC: Final = "spec.json"
PROVENANCE: Final = "provenance.json"
BEST: Final = "best.json"
ITERATIONS: Final = "history/iterations.json"
EVALUATIONS: Final = "history/evaluations.parquet"
ASKS: Final = "history/asks.parquet"
REEVALUATIONS: Final = "history/reevaluations.parquet"
CHAIN: Final = "history/chain.json"
PAGE: Final = "index.html"

CERTIFICATES: Final = "certificates"
"""Folder with a subfolder for each certificate, named by its id."""

SUMMARY: Final = "certificate.json"

LARGEST_TEXT: Final = 64 << 20
"""Largest JSON member [B]."""


class _Document(BaseModel):
    model_config = ConfigDict(frozen=True, extra="ignore", allow_inf_nan=False)


class BestFound(_Document):
    """The best design's place and fitness in double precision."""

    iteration: int = Field(ge=0)
    particle: int = Field(ge=0)
    fitness: float


class JobDocument(_Document):
    """The job's metadata."""

    id: str = Field(max_length=64)
    name: str
    kind: str
    state: JobState
    created_at: datetime
    started_at: datetime | None
    updated_at: datetime
    finished_at: datetime | None
    iterations: int = Field(ge=1)
    evaluations: int = Field(ge=1)
    lineage: Lineage | None
    budgets: tuple[Annotated[int, Field(ge=1, le=1_000_000)], ...] = Field(
        min_length=1, max_length=100
    )
    best: BestFound | None


class ProvenanceDocument(_Document):
    """Provenance of the numbers and of the file, and the identity of each robot's kernel."""

    records: tuple[ProvenanceRecord, ...] = Field(min_length=1)
    written_by: JobProvenance
    kernels: tuple[str, ...]


class ChainDocument(_Document):
    """Stored documents that the chain covers besides the tables."""

    version: int
    spec: dict[str, Any]
    lineage: dict[str, Any] | None
    provenance: tuple[dict[str, Any], ...] | None
    asks: tuple[str | None, ...]
    digests: tuple[str | None, ...]


def archived(members: Mapping[str, bytes]) -> bytes:
    """Write an archive."""
    hashes = {
        name: {"sha256": hashlib.sha256(content).hexdigest(), "bytes": len(content)}
        for name, content in sorted(members.items())
    }
    manifest = {"format": FORMAT, "version": VERSION, "files": hashes}
    text = json.dumps(manifest, indent=2).encode() + b"\n"
    return zipped({**members, MANIFEST: text})


def check_hashes(members: Mapping[str, bytes]) -> list[str]:
    """Compare an archive with its manifest."""
    if MANIFEST not in members:
        raise BadArchive(f"it has no {MANIFEST}")
    manifest = parsed_json(members[MANIFEST], MANIFEST)
    if not isinstance(manifest, dict) or manifest.get("format") != FORMAT:
        raise BadArchive(f"{MANIFEST} is none of {FORMAT}")
    if manifest.get("version") != VERSION:
        raise BadArchive(
            f"it is version {str(manifest.get('version'))[:20]} of {FORMAT}, this gaitswarm reads"
            f" version {VERSION}"
        )
    files = manifest.get("files")
    if not isinstance(files, dict):
        raise BadArchive(f"{MANIFEST} names no files")
    found = [f"{name} is not in the manifest" for name in members if name not in {*files, MANIFEST}]
    for name, expected in files.items():
        if name not in members:
            found.append(f"{name} is missing")
            continue
        digest = hashlib.sha256(members[name]).hexdigest()
        if not isinstance(expected, dict) or expected.get("sha256") != digest:
            found.append(f"{name} has another SHA-256")
    return found


def parsed_json(content: bytes, name: str) -> Any:
    """Read a JSON document as the standard has it: no NaN, no infinities, no endless nesting.

    pydantic's parser does not use Python's stack. The standard library's exhausts it before it
    refuses deep nesting, and finalizers running at that moment fail.
    """
    if len(content) > LARGEST_TEXT:
        raise BadArchive(f"{name} is larger than {LARGEST_TEXT >> 20} MiB")
    try:
        return from_json(content, allow_inf_nan=False)
    except ValueError as error:
        raise BadArchive(f"{name} is not valid JSON: {error}") from error
