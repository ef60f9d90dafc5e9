"""Contents of an evidence file."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import resources
from typing import Final

import numpy as np
from numpy.typing import NDArray
from pydantic_core import to_json

from gaitswarm.evidence.archive import (
    ASKS,
    BEST,
    CERTIFICATES,
    CHAIN,
    EVALUATIONS,
    ITERATIONS,
    JOB,
    PAGE,
    PROVENANCE,
    REEVALUATIONS,
    SPEC,
    SUMMARY,
    BestFound,
    ChainDocument,
    JobDocument,
    ProvenanceDocument,
    archived,
)
from gaitswarm.evidence.page import CertificateOnPage, page, pictures
from gaitswarm.services.optimizer.analysis.certificate import CertificateView, certificate
from gaitswarm.services.optimizer.analysis.fork import budgets_of
from gaitswarm.services.optimizer.errors import Conflict
from gaitswarm.services.optimizer.jobs.chain import VERSION as CHAIN_VERSION
from gaitswarm.services.optimizer.jobs.chain import Link
from gaitswarm.services.optimizer.jobs.documents import AnySpec
from gaitswarm.services.optimizer.jobs.iteration import (
    Evaluation,
    EvaluationColumns,
    Reevaluation,
    best_particle,
)
from gaitswarm.services.optimizer.jobs.job import Job, JobState
from gaitswarm.services.optimizer.jobs.kinds.certificate import CertificateSpec
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.listing import every
from gaitswarm.services.optimizer.jobs.provenance import job_provenance
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.sim.kernel.emitted.source import kernel_identity
from gaitswarm.sim.robot import RobotFiles, RobotSource, RobotVariant, load_robot
from gaitswarm.tables import encoded_table
from gaitswarm.views.job import BestView, IterationView

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
    figures = dict(pictures(job.spec, run.best, run.iterations))
    files |= {f"figures/{name}.svg": picture.encode() for name, picture in figures.items()}
    files[PAGE] = page(job, run.best, run.provenance, figures, shown, tuple(files)).encode()
    return archived(files)


@dataclass(frozen=True, slots=True)
class _Run:
    """The stored data of one job: its members without page and figures, and parts of them.

    Attributes:
        summary: Of a certificate with at least one drawn world.
    """

    files: Mapping[str, bytes]
    columns: EvaluationColumns
    iterations: Sequence[IterationView]
    provenance: ProvenanceDocument
    best: BestView | None
    summary: CertificateView | None


def _run(service: JobService, job: Job) -> _Run:
    # A running job commits more meanwhile; the file ends where the job did when it was read.
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
    committed = every(
        lambda after: store.iterations(
            job.id, after=None if after is None else int(after), limit=_PIECE
        )
    )
    iterations = [IterationView.model_validate(one) for one in committed if one.index < end]
    provenance = ProvenanceDocument(
        records=job.provenance, written_by=job_provenance(spec), kernels=kernels_of(spec)
    )
    stored = store.chain_documents(job.id)
    documents: dict[str, object] = {
        JOB: _job(job, best),
        SPEC: spec,
        PROVENANCE: provenance,
        BEST: view,
        ITERATIONS: iterations,
        CHAIN: ChainDocument(
            version=CHAIN_VERSION,
            spec=stored.spec,
            lineage=stored.lineage,
            provenance=stored.provenance,
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
    for number, robot in enumerate(spec.robot_sources):
        files |= _robot(f"robots/{number}", robot)
    return _Run(files, columns, iterations, provenance, view, summary)


def kernels_of(spec: AnySpec) -> tuple[str, ...]:
    """Identity of the kernel of each robot of a job."""
    robots = map(load_robot, spec.robot_sources)
    return tuple(kernel_identity(robot, spec.precision).hex() for robot in robots)


def best_of(columns: EvaluationColumns, reevaluated: EvaluationColumns | None) -> Evaluation | None:
    """Find the best design, as the store would."""
    judged = columns if reevaluated is None else reevaluated
    row = best_particle(judged.fitness)
    if row is None:
        return None
    if reevaluated is None:
        return _evaluation(columns, row)
    best = _evaluation(reevaluated, row)
    searched = _evaluation(columns, row_of(columns, (best.iteration, best.particle)))
    again = Reevaluation(best.particle, best.objectives, best.statuses, best.fitness)
    return replace(searched, reevaluation=again)


def row_of(columns: EvaluationColumns, place: Place) -> int:
    """Find an evaluation. Raises LookupError if there is none."""
    iteration, particle = place
    (rows,) = np.nonzero((columns.iteration == iteration) & (columns.particle == particle))
    if len(rows) != 1:
        raise LookupError(f"there is no design {iteration}.{particle}")
    return int(rows[0])


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


def _evaluation(columns: EvaluationColumns, row: int) -> Evaluation:
    return Evaluation(
        iteration=int(columns.iteration[row]),
        particle=int(columns.particle[row]),
        design=columns.designs[row],
        objectives=columns.objectives[row],
        statuses=columns.statuses[row],
        fitness=float(columns.fitness[row]),
    )


def _job(job: Job, best: Evaluation | None) -> JobDocument:
    found = None
    if best is not None:
        judged = best.reevaluation or best
        found = BestFound(iteration=best.iteration, particle=best.particle, fitness=judged.fitness)
    return JobDocument(
        id=job.id,
        name=job.spec.name,
        kind=job.spec.kind,
        state=job.state,
        created_at=job.created_at,
        started_at=job.started_at,
        updated_at=job.updated_at,
        finished_at=job.finished_at,
        iterations=job.progress.iterations,
        evaluations=job.progress.evaluations,
        lineage=job.lineage,
        budgets=budgets_of(job),
        best=found,
    )


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


def _robot(folder: str, source: RobotSource) -> dict[str, bytes]:
    """The resolved robot and its source files."""
    robot = load_robot(source)
    files = {
        f"{folder}/description.json": robot.description.model_dump_json().encode(),
        f"{folder}/robot.urdf": robot.urdf.text.encode(),
    }
    if isinstance(source, RobotFiles):
        return {**files, f"{folder}/robot.toml": source.toml.encode()}
    name = source.name if isinstance(source, RobotVariant) else source
    for file in (resources.files("gaitswarm.sim.robot") / name).iterdir():
        if file.name.endswith(".toml"):
            files[f"{folder}/{file.name}"] = file.read_bytes()
    return files
