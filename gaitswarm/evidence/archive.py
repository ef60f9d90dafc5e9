"""The evidence file: its members, their documents, and checks of each before use."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import TYPE_CHECKING, Annotated, Any, Final, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, ValidationError
from pydantic_core import from_json

from gaitswarm.services.optimizer.jobs.documents import SPECS, AnySpec
from gaitswarm.services.optimizer.jobs.fork import Lineage
from gaitswarm.services.optimizer.jobs.iteration import EvaluationColumns
from gaitswarm.services.optimizer.jobs.job import JobState
from gaitswarm.services.optimizer.jobs.provenance import JobProvenance, ProvenanceRecord
from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.identification import RecordedWalk, Recordings
from gaitswarm.sim.input import message_of
from gaitswarm.sim.robot.check import MOST_ROBOTS, check_files, files_of, objects_in
from gaitswarm.tables import decoded_table
from gaitswarm.zip_archive import BadArchive, zipped

if TYPE_CHECKING:
    import pyarrow as pa

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


_LARGEST_TABLE: Final = 1 << 30
"""Largest table in memory [B]."""

_THRIFT: Final = 1 << 22
"""Limit on strings and lists in a Parquet file's metadata."""

_WITH_ROBOTS: Final = (SPEC, CHAIN)
"""Documents that hold specs."""

M = TypeVar("M", bound=BaseModel)

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """The contents of an evidence file."""

    job: JobDocument
    spec: AnySpec
    provenance: ProvenanceDocument
    columns: EvaluationColumns
    asked: tuple[Floats, ...]  # (n, d) positions, by iteration
    reevaluated: EvaluationColumns | None  # in double precision; None for a search in double
    recordings: Recordings  # that its cases need
    chain: ChainDocument


def read_evidence(members: Mapping[str, bytes]) -> Evidence:
    """Read the members of an archive."""
    spec = _spec(_member(members, SPEC))
    job = _parsed(JobDocument, members, JOB)
    columns = _evaluations(members, EVALUATIONS, spec)
    reevaluated = None
    if spec.precision != "double":
        reevaluated = _evaluations(members, REEVALUATIONS, spec.in_double())
    evidence = Evidence(
        job,
        spec,
        _parsed(ProvenanceDocument, members, PROVENANCE),
        columns,
        _asks(_member(members, ASKS), spec),
        reevaluated,
        {
            name: _parsed(RecordedWalk, members, f"recordings/{name}.json")
            for name in spec.recording_ids
        },
        _parsed(ChainDocument, members, CHAIN),
    )
    _check_order(evidence)
    return evidence


def check_robots(members: Mapping[str, bytes]) -> None:
    """Check the robots of all documents of an archive in a limited process."""
    robots: dict[tuple[str, str], str] = {}
    for name, content in members.items():
        if name.endswith(_WITH_ROBOTS):
            for _, part in objects_in(parsed_json(content, name)):
                files = files_of(part)
                if files is not None:
                    robots.setdefault(files, name)
                if len(robots) > MOST_ROBOTS:
                    raise BadArchive(f"{name}: it has more than {MOST_ROBOTS} robots")
    for files, name in robots.items():
        try:
            check_files(*files)
        except RobotFileError as error:
            raise BadArchive(f"{name} cannot be read: {error}") from error


def _check_order(evidence: Evidence) -> None:
    """Check that iterations are whole, in order, and as large as the asks."""
    job, columns = evidence.job, evidence.columns
    sizes = [len(positions) for positions in evidence.asked]
    expected = np.repeat(np.arange(len(sizes)), sizes)
    particles = np.concatenate([np.arange(size) for size in sizes])
    if (
        len(sizes) != job.iterations
        or len(columns) != job.evaluations
        or not np.array_equal(columns.iteration, expected)
        or not np.array_equal(columns.particle, particles)
    ):
        raise BadArchive(
            f"{EVALUATIONS}, {ASKS} and {JOB} do not have the same iterations and particles"
        )


def _spec(content: bytes) -> AnySpec:
    try:
        return SPECS.validate_python(parsed_json(content, SPEC))
    except ValidationError as error:
        raise _unreadable(SPEC, error) from error
    except BadArchive:
        raise
    except Exception as error:
        # A robot's files are read with it, by parsers of other projects.
        raise BadArchive(f"{SPEC} cannot be read: {type(error).__name__}") from error


def _parsed(kind: type[M], members: Mapping[str, bytes], name: str) -> M:
    document = parsed_json(_member(members, name), name)
    try:
        return kind.model_validate(document)
    except ValidationError as error:
        raise _unreadable(name, error) from error


def _unreadable(name: str, error: ValidationError) -> BadArchive:
    first = error.errors(include_url=False, include_input=False)[0]
    where = ".".join(str(part) for part in first["loc"])
    return BadArchive(
        f"{name} cannot be read by this gaitswarm: {where}: {message_of(first)[:200]}"
    )


def _member(members: Mapping[str, bytes], name: str) -> bytes:
    if name not in members:
        raise BadArchive(f"it has no {name}")
    return members[name]


def _evaluations(members: Mapping[str, bytes], name: str, spec: AnySpec) -> EvaluationColumns:
    content = _member(members, name)
    _checked_table(content, name)
    try:
        columns = decoded_table(spec, content)
    except (AttributeError, ArithmeticError, LookupError, OSError, TypeError, ValueError) as error:
        raise BadArchive(f"{name} is not a table of this job: {type(error).__name__}") from error
    space = spec.design_space()
    if not np.isfinite(columns.designs).all() or columns.designs.shape[1] != len(space.names):
        raise BadArchive(f"{name} has designs with values that are not finite")
    return columns


def _asks(content: bytes, spec: AnySpec) -> tuple[Floats, ...]:
    table = _checked_table(content, ASKS)
    try:
        names = [f"position.{variable.name}" for variable in spec.design_space().variables]
        iteration = table.column("iteration").to_numpy().astype(np.int64, casting="safe")
        columns = [np.asarray(table.column(name).to_numpy(), dtype=np.float64) for name in names]
    except (KeyError, ValueError, TypeError) as error:
        raise BadArchive(f"{ASKS} is not a table of this job: {type(error).__name__}") from error
    positions = np.stack(columns, axis=1)
    steps = np.diff(iteration, prepend=0)
    if not len(positions) or not np.isfinite(positions).all() or iteration[0] != 0:
        raise BadArchive(f"{ASKS} has positions that are not finite")
    if not np.isin(steps, (0, 1)).all():
        raise BadArchive(f"{ASKS} is not in the order of its iterations")
    return tuple(np.split(positions, np.flatnonzero(steps)))


def _checked_table(content: bytes, name: str) -> pa.Table:
    """Read a Parquet table within the limit on its size in memory."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    limits = {"thrift_string_size_limit": _THRIFT, "thrift_container_size_limit": _THRIFT}
    try:
        file = pq.ParquetFile(pa.BufferReader(content), **limits)
        described = file.metadata
        cells = described.num_rows * max(1, described.num_columns)
        claimed = sum(
            described.row_group(k).total_byte_size for k in range(described.num_row_groups)
        )
        if described.num_rows < 0 or max(8 * cells, claimed) > _LARGEST_TABLE:
            raise BadArchive(f"{name} claims more values than are allowed")
        return file.read()
    except (pa.ArrowException, OSError, ValueError, MemoryError) as error:
        if isinstance(error, BadArchive):
            raise
        raise BadArchive(f"{name} is not a complete Parquet file") from error
