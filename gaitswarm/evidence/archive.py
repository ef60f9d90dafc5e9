"""The evidence file: its members and its page, how they are written, and checks before use.

Members are not compressed. Equal members then make equal bytes whatever the zip library, and an
archive that claims to hold more than it is long is recognized before anything of it is read.
"""

from __future__ import annotations

import hashlib
import io
import re
import stat
import zipfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import PurePosixPath
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError
from pydantic_core import from_json, to_json

from gaitswarm.services.optimizer.analysis.certificate import CertificateView, certificate
from gaitswarm.services.optimizer.analysis.fork import budgets_of
from gaitswarm.services.optimizer.errors import Conflict, InvalidRequest
from gaitswarm.services.optimizer.jobs.chain import VERSION as CHAIN_VERSION
from gaitswarm.services.optimizer.jobs.chain import Link
from gaitswarm.services.optimizer.jobs.documents import SPECS, AnySpec
from gaitswarm.services.optimizer.jobs.fork import Lineage
from gaitswarm.services.optimizer.jobs.iteration import (
    Evaluation,
    EvaluationColumns,
    Reevaluation,
    best_particle,
    evaluations_of,
)
from gaitswarm.services.optimizer.jobs.job import Job, JobState
from gaitswarm.services.optimizer.jobs.kinds.certificate import CertificateSpec
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.listing import every
from gaitswarm.services.optimizer.jobs.provenance import RECORDS, ProvenanceRecords
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.views import fields_of
from gaitswarm.settings import place_of
from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.errors import RobotFileError
from gaitswarm.sim.identification import RecordedWalk, Recordings
from gaitswarm.sim.input import message_of
from gaitswarm.sim.robot import RobotSource, load_robot
from gaitswarm.sim.robot.check import MOST_ROBOTS, check_files, files_of, objects_in
from gaitswarm.tables import decoded_table, encoded_table
from gaitswarm.views.job import BestView, IterationView

if TYPE_CHECKING:
    import pyarrow as pa
    from matplotlib.figure import Figure


LARGEST_ARCHIVE: Final = 1 << 30
"""Largest archive that is read [B]."""

MOST_MEMBERS: Final = 10_000

_UNIX: Final = 3

_NEW: Final = stat.S_IFREG | 0o644


class BadArchive(ValueError):
    """A file is not such an archive, or is damaged."""


def zipped(members: Mapping[str, bytes]) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_STORED) as archive:
        for name, content in sorted(members.items()):
            entry = zipfile.ZipInfo(name)
            entry.create_system = _UNIX
            entry.external_attr = _NEW << 16
            archive.writestr(entry, content)
    return file.getvalue()


def unzipped(content: bytes) -> dict[str, bytes]:
    """Read all members of an archive after checking that this is safe."""
    if len(content) > LARGEST_ARCHIVE:
        raise BadArchive(f"it is larger than {LARGEST_ARCHIVE >> 30} GiB")
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            entries = archive.infolist()
            _check_entries(entries, len(content))
            return {entry.filename: archive.read(entry) for entry in entries}
    except BadArchive:
        raise
    except (
        zipfile.BadZipFile,
        EOFError,
        LookupError,
        OSError,
        OverflowError,
        RuntimeError,
        ValueError,
    ) as error:
        raise BadArchive(f"it is not a complete zip archive: {error}") from error


def _check_entries(entries: list[zipfile.ZipInfo], length: int) -> None:
    if len(entries) > MOST_MEMBERS:
        raise BadArchive(f"it has more than {MOST_MEMBERS} members")
    names = [entry.filename for entry in entries]
    if len(set(names)) < len(names):
        raise BadArchive("a name occurs twice in it")
    for entry in entries:
        name = entry.filename
        if not _is_safe(name):
            raise BadArchive(f"the name of a member leads out of it: {name[:80]!r}")
        if entry.compress_type != zipfile.ZIP_STORED or entry.file_size != entry.compress_size:
            raise BadArchive(f"{name[:80]!r} is compressed, which no evidence is")
        if entry.flag_bits & 0x1:
            raise BadArchive(f"{name[:80]!r} is encrypted")
    # Overlapping members would be read several times.
    if sum(entry.file_size for entry in entries) > length:
        raise BadArchive("its members claim to be longer than it is")


def _is_safe(name: str) -> bool:
    path = PurePosixPath(name)
    return (
        name.isprintable()
        and "\\" not in name
        and ":" not in name
        and not path.is_absolute()
        and ".." not in path.parts
        and str(path) == name
    )


JOB: Final = "job.json"
SPEC: Final = "spec.json"
BEST: Final = "best.json"
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
    model_config = ConfigDict(frozen=True, extra="ignore", allow_inf_nan=False, defer_build=True)


class JobDocument(_Document):
    """The job's metadata."""

    id: str = Field(max_length=64)
    state: JobState
    created_at: datetime
    started_at: datetime | None
    updated_at: datetime
    finished_at: datetime | None
    budgets: tuple[Annotated[int, Field(ge=1, le=1_000_000)], ...] = Field(
        min_length=1, max_length=100
    )


class ChainDocument(_Document):
    """Stored documents that the chain covers besides the tables; the spec is as submitted."""

    version: int
    spec: dict[str, Any]
    lineage: dict[str, Any] | None
    provenance: tuple[dict[str, Any], ...] = Field(min_length=1)
    asks: tuple[str | None, ...]
    digests: tuple[str | None, ...]


class Manifest(BaseModel):
    """SHA-256 of every member."""

    model_config = ConfigDict(frozen=True, defer_build=True)

    format: Literal["gaitswarm-evidence"] = "gaitswarm-evidence"
    version: Literal[1] = 1  # of the layout; others are refused
    files: dict[str, str]


def archived(members: Mapping[str, bytes]) -> bytes:
    files = {name: hashlib.sha256(member).hexdigest() for name, member in sorted(members.items())}
    return zipped({**members, MANIFEST: to_json(Manifest(files=files), indent=2) + b"\n"})


def check_hashes(members: Mapping[str, bytes]) -> list[str]:
    """Compare an archive with its manifest."""
    files = _parsed(Manifest.model_validate, members, MANIFEST).files
    found = [f"{name} is not in the manifest" for name in members if name not in {*files, MANIFEST}]
    for name, digest in files.items():
        if name not in members:
            found.append(f"{name} is missing")
        elif hashlib.sha256(members[name]).hexdigest() != digest:
            found.append(f"{name} has another SHA-256")
    return found


def parsed_json(content: bytes, name: str) -> Any:
    """Read a JSON document as the standard has it, by pydantic's parser, which needs no stack."""
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

T = TypeVar("T")

_LINEAGE: Final[TypeAdapter[Lineage | None]] = TypeAdapter(Lineage | None)


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """The contents of an evidence file."""

    members: Mapping[str, bytes]
    job: JobDocument
    spec: AnySpec
    provenance: ProvenanceRecords
    lineage: Lineage | None
    columns: EvaluationColumns
    asked: tuple[Floats, ...]  # (n, d) positions, by iteration
    reevaluated: EvaluationColumns | None  # in double precision; None for a search in double
    recordings: Recordings  # that its cases need
    chain: ChainDocument


def read_evidence(members: Mapping[str, bytes]) -> Evidence:
    spec = _parsed(SPECS.validate_python, members, SPEC)
    job = _parsed(JobDocument.model_validate, members, JOB)
    chain = _parsed(ChainDocument.model_validate, members, CHAIN)
    reevaluated = None
    if spec.precision != "double":
        reevaluated = _evaluations(members, REEVALUATIONS, spec.in_double())
    evidence = Evidence(
        members,
        job,
        spec,
        _valid(RECORDS.validate_python, chain.provenance, CHAIN),
        _valid(_LINEAGE.validate_python, chain.lineage, CHAIN),
        _evaluations(members, EVALUATIONS, spec),
        _positions(_member(members, ASKS), spec),
        reevaluated,
        {
            name: _parsed(RecordedWalk.model_validate, members, f"recordings/{name}.json")
            for name in spec.recording_ids
        },
        chain,
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
    columns, sizes = evidence.columns, [len(positions) for positions in evidence.asked]
    expected = np.repeat(np.arange(len(sizes)), sizes)
    particles = np.concatenate([np.arange(size) for size in sizes])
    if not (
        np.array_equal(columns.iteration, expected) and np.array_equal(columns.particle, particles)
    ):
        raise BadArchive(f"{EVALUATIONS} and {ASKS} do not have the same iterations and particles")


def _parsed(validate: Callable[[Any], T], members: Mapping[str, bytes], name: str) -> T:
    return _valid(validate, parsed_json(_member(members, name), name), name)


def _valid(validate: Callable[[Any], T], document: Any, name: str) -> T:
    try:
        return validate(document)
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        where = ".".join(str(part) for part in first["loc"])
        raise BadArchive(
            f"{name} cannot be read by this gaitswarm: {where}: {message_of(first)[:200]}"
        ) from error
    except Exception as error:
        # A robot's files are read with its spec, by parsers of other projects.
        raise BadArchive(f"{name} cannot be read: {type(error).__name__}") from error


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


def _positions(content: bytes, spec: AnySpec) -> tuple[Floats, ...]:
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


WORST: Final = 20
"""Worst worlds in the summary of a certificate."""

_PIECE: Final = 1000

Place = tuple[int, int]
"""Iteration and particle of a design."""


def evidence(service: JobService, job_id: str) -> bytes:
    """Write the evidence of a job, with the finished certificates of its designs."""
    job = service.job(job_id)
    if not job.progress.iterations:
        raise Conflict(f"job {job_id} has committed no iteration yet, so there is no evidence")
    run = _run(service, job)
    files = dict(run.files)
    shown = [] if run.summary is None else [CertificateOnPage(run.summary)]
    best = None if run.best is None else (run.best.iteration, run.best.particle)
    certificates = every(
        lambda after: service.store.jobs(state=JobState.SUCCEEDED, kind="certificate", after=after)
    )
    certified = [
        (place != best, one.created_at, one.id, place, one)
        for one in certificates
        if one.readable
        for place in (certified_place(job.spec, run.columns, one.spec),)
        if place is not None
    ]
    for is_other, _, certificate_id, place, certificate_job in sorted(certified):
        part = _run(service, certificate_job)
        files |= {f"{CERTIFICATES}/{certificate_id}/{name}": c for name, c in part.files.items()}
        if part.summary is not None:
            shown.append(CertificateOnPage(part.summary, place, is_best=not is_other))
    # A running job commits more meanwhile; the file ends where the job did when it was read.
    committed = every(
        lambda after: service.store.iterations(
            job.id, after=None if after is None else int(after), limit=_PIECE
        )
    )
    views = (IterationView.model_validate(one) for one in committed)
    iterations = [view for view in views if view.index < job.progress.iterations]
    files[PAGE] = page(job, run.best, iterations, shown, tuple(files)).encode()
    return archived(files)


@dataclass(frozen=True, slots=True)
class _Run:
    """The stored data of one job: its members without the page, and parts of them."""

    files: Mapping[str, bytes]
    columns: EvaluationColumns
    best: BestView | None
    summary: CertificateView | None  # of a certificate with at least one drawn world


def _run(service: JobService, job: Job) -> _Run:
    spec, store, end = job.spec, service.store, job.progress.iterations
    columns = service.columns(job)
    columns = columns.rows(slice(int(np.searchsorted(columns.iteration, end))))
    reevaluated = None
    if spec.precision != "double":
        reevaluated = in_double(columns, store.reevaluations(job.id, 0, end))
    best = best_of(columns, reevaluated)
    view = None if best is None else BestView.from_evaluation(best, spec)
    links = [
        link
        for first in range(0, end, _PIECE)
        for link in store.links(job.id, first, min(first + _PIECE, end))
    ]
    stored = store.chain_documents(job.id)
    documents: dict[str, object] = {
        JOB: JobDocument(**fields_of(JobDocument, job), budgets=budgets_of(job)),
        SPEC: spec,
        BEST: view,
        CHAIN: ChainDocument(
            version=CHAIN_VERSION,
            spec=stored.spec,
            lineage=stored.lineage,
            provenance=stored.provenance or (),
            asks=[link.ask_digest for link in links],
            digests=[link.digest for link in links],
        ),
    }
    summary = None
    if isinstance(spec, CertificateSpec) and len(columns) > spec.nominal_rows:
        documents[SUMMARY] = summary = certificate(job.id, spec, columns, most=WORST)
    for name in spec.recording_ids:
        documents[f"recordings/{name}.json"] = service.recording(name)
    files = {name: to_json(document, indent=2) + b"\n" for name, document in documents.items()}
    files[EVALUATIONS] = b"".join(encoded_table("parquet", spec, [columns]))
    files[ASKS] = _asks(spec, links)
    if reevaluated is not None:
        parts = [reevaluated] if len(reevaluated) else []
        files[REEVALUATIONS] = b"".join(encoded_table("parquet", spec.in_double(), parts))
    files |= robot_members(spec.robot_sources)
    return _Run(files, columns, view, summary)


def best_of(columns: EvaluationColumns, reevaluated: EvaluationColumns | None) -> Evaluation | None:
    """Find the best design, as the store would."""
    judged = columns if reevaluated is None else reevaluated
    row = best_particle(judged.fitness)
    if row is None:
        return None
    (best,) = evaluations_of(judged.rows(np.array([row])))
    if reevaluated is None:
        return best
    (rows,) = np.nonzero(
        (columns.iteration == best.iteration) & (columns.particle == best.particle)
    )
    (searched,) = evaluations_of(columns.rows(rows))
    again = Reevaluation(best.particle, best.objectives, best.statuses, best.fitness)
    return searched._replace(reevaluation=again)


def in_double(
    columns: EvaluationColumns, found: Sequence[tuple[int, Reevaluation]]
) -> EvaluationColumns:
    """The designs that were reevaluated, with their results in double precision."""
    if not found:
        return columns.rows(slice(0))
    starts = np.searchsorted(columns.iteration, [iteration for iteration, _ in found])
    return replace(
        columns.rows(starts + np.array([again.particle for _, again in found])),
        objectives=np.stack([again.objectives for _, again in found]),
        statuses=np.stack([again.statuses for _, again in found]),
        fitness=np.array([again.fitness for _, again in found]),
    )


def certified_place(
    spec: AnySpec, columns: EvaluationColumns, certificate_spec: AnySpec
) -> Place | None:
    """Find the design of a job that a certificate is of."""
    if not isinstance(spec, JobSpec) or not isinstance(certificate_spec, CertificateSpec):
        return None
    space, numbers = spec.design_space(), certificate_spec.numbers
    if certificate_spec.controller != spec.controller or set(numbers) != set(space.names):
        return None
    design = np.array([numbers[name] for name in space.names])
    (rows,) = np.nonzero((space.simulated(columns.designs) == design).all(axis=1))
    if not len(rows):
        return None
    return int(columns.iteration[rows[0]]), int(columns.particle[rows[0]])


def _asks(spec: AnySpec, links: Sequence[Link]) -> bytes:
    """Positions that the search asked for, one per row, in the variables' units."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    columns: dict[str, NDArray[np.generic]] = {
        "iteration": np.concatenate([np.full(len(k.positions), k.iteration) for k in links]),
        "particle": np.concatenate([np.arange(len(link.positions)) for link in links]),
    }
    positions = np.concatenate([link.positions for link in links])
    for variable, column in zip(spec.design_space().variables, positions.T, strict=True):
        columns[f"position.{variable.name}"] = column
    sink = io.BytesIO()
    pq.write_table(pa.table(columns), sink)
    return sink.getvalue()


def robot_members(sources: Sequence[RobotSource]) -> dict[str, bytes]:
    files = {}
    for number, robot in enumerate(map(load_robot, sources)):
        description = robot.description.model_dump_json()
        files[f"robots/{number}/description.json"] = description.encode()
        files[f"robots/{number}/robot.urdf"] = robot.urdf.text.encode()
    return files


MANIFEST: Final = "manifest.json"

_INK: Final = "#1f3a5f"
_ACCENT: Final = "#d1495b"

_WORST: Final = 10
"""Worst worlds of a certificate that the page lists."""


@dataclass(frozen=True, slots=True)
class CertificateOnPage:
    """A certificate as the page shows it."""

    view: CertificateView
    place: tuple[int, int] | None = None  # of the design in the job; None on the job's own page
    is_best: bool = False

    @property
    def robot(self) -> str:
        return load_robot(self.view.robot).description.name


def page(
    job: Job,
    best: BestView | None,
    iterations: Sequence[IterationView],
    certificates: Sequence[CertificateOnPage],
    files: Sequence[str],
) -> str:
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("gaitswarm.evidence", ""),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    environment.filters |= {"number": _number, "place": lambda place: place_of(*place)}
    return environment.get_template("page.html").render(
        job=job,
        spec=job.spec,
        best=best,
        tunes_a_drive=isinstance(job.spec, JobSpec),
        units={variable.name: variable.unit for variable in job.spec.design_space().variables},
        figure=_svg(draw_convergence(iterations, title="Fitness over iterations")),
        certificates=certificates,
        worst=_WORST,
        files=sorted(files),
        manifest=MANIFEST,
    )


def _number(value: float | str | None) -> str:
    if value is None:
        return "–"
    return value if isinstance(value, str) else f"{value:.6g}"


def draw_convergence(iterations: Sequence[IterationView], *, title: str) -> Figure:
    """Draw fitness (minimized) over iterations: best so far, median, and the best-worst band."""
    from matplotlib.figure import Figure
    from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter, StrMethodFormatter

    if not iterations:
        raise InvalidRequest("the job has no committed iteration to draw yet")
    figure = Figure(figsize=(8.0, 4.5), layout="constrained")
    axes = figure.add_subplot()
    axes.set_title(title, loc="left", weight="bold")
    axes.spines[["top", "right"]].set_visible(False)
    index = [i.index for i in iterations]
    best, median, worst, so_far = (
        # None becomes NaN.
        np.array([getattr(i, name) for i in iterations], dtype=np.float64)
        for name in ("best", "median", "worst", "best_so_far")
    )
    axes.fill_between(index, best, worst, color=_INK, alpha=0.12, lw=0, label="designs")
    axes.plot(index, median, color=_INK, alpha=0.6, lw=1.2, label="median of the iteration")
    label = f"best so far, finally {so_far[-1]:.4g}"
    axes.step(index, so_far, where="post", color=_ACCENT, lw=2.2, label=label)
    axes.set_yscale("log")
    # 25 instead of 2.5 x 10^1: a fitness varies by less than a decade.
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0), numticks=12))
    axes.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.set_xlim(index[0], max(index[-1], index[0] + 1))
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlabel("iteration")
    axes.set_ylabel("fitness, minimized  [1]")
    axes.grid(visible=True, which="both", color="0.9", lw=0.6)
    axes.legend(frameon=False, loc="upper right")
    return figure


def _svg(figure: Figure) -> str:
    """An SVG element; equal figures are equal texts."""
    import matplotlib as mpl

    sink = io.StringIO()
    metadata = dict.fromkeys(("Creator", "Date", "Format", "Type"))
    with mpl.rc_context({"svg.hashsalt": "gaitswarm", "svg.fonttype": "none"}):
        figure.savefig(sink, format="svg", metadata=metadata)
    return re.sub(r"^.*?(?=<svg )", "", sink.getvalue(), flags=re.DOTALL)
