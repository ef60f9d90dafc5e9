"""Contents of an evidence file."""

from __future__ import annotations

import io
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import resources
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.errors import Conflict
from gaitswarm.evidence.archive import archived
from gaitswarm.evidence.certificates import FOLDER, SUMMARY, certificates_of, summary
from gaitswarm.evidence.page import CertificateOnPage, bars, convergence, heat_map, page
from gaitswarm.services.optimizer.analysis.certificate import CertificateView
from gaitswarm.services.optimizer.analysis.fork import budgets_of
from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.chain import VERSION as CHAIN_VERSION
from gaitswarm.services.optimizer.jobs.chain import Link
from gaitswarm.services.optimizer.jobs.columns import EvaluationColumns
from gaitswarm.services.optimizer.jobs.documents import AnySpec
from gaitswarm.services.optimizer.jobs.iteration import Evaluation, Reevaluation, best_particle
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.jobs.kinds.certificate import CertificateSpec
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.provenance import job_provenance
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.sim.kernel.emitted.source import kernel_identity
from gaitswarm.sim.robot import RobotFiles, RobotSource, RobotVariant, load_robot
from gaitswarm.surface import SurfaceRequest, run_surface
from gaitswarm.tables import encoded_table
from gaitswarm.views.history import BestView, IterationView

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

_PIECE: Final = 1000


def evidence(service: JobService, job_id: str) -> bytes:
    """Write the evidence of a job, with the finished certificates of its designs."""
    job = service.job(job_id)
    if not job.progress.iterations:
        raise Conflict(f"job {job_id} has committed no iteration yet, so there is no evidence")
    run = _run(service, job)
    files = dict(run.files)
    shown = [] if run.summary is None else [CertificateOnPage(run.summary, None)]
    for certified in certificates_of(service, job, run.columns, run.place):
        own = _run(service, certified.job)
        files |= {f"{FOLDER}/{certified.job.id}/{name}": c for name, c in own.files.items()}
        if own.summary is not None:
            shown.append(CertificateOnPage(own.summary, certified))
    pictures = dict(_pictures(job.spec, run.best, run.iterations))
    files |= {f"figures/{name}.svg": picture.encode() for name, picture in pictures.items()}
    files[PAGE] = page(job, run.best, run.provenance, pictures, shown, tuple(files)).encode()
    return archived(files)


@dataclass(frozen=True, slots=True)
class _Run:
    """The stored data of one job.

    Attributes:
        files: Members by name, without the page and figures.
        columns: Evaluations.
        iterations: Summaries.
        provenance: As `provenance_document` has it.
        best: The best design, with its `place`: iteration and particle.
        summary: Of a certificate with at least one drawn world.
    """

    files: Mapping[str, bytes]
    columns: EvaluationColumns
    iterations: Sequence[IterationView]
    provenance: Mapping[str, Any]
    best: BestView | None
    summary: CertificateView | None

    @property
    def place(self) -> tuple[int, int] | None:
        return None if self.best is None else (self.best.iteration, self.best.particle)


def _run(service: JobService, job: Job) -> _Run:
    spec, columns = job.spec, _committed(service.columns(job), job)
    reevaluated = None
    if spec.precision != "double":
        reevaluated = _reevaluated(service, job, columns)
    # Not the store's best: a running job's may be in an iteration that is not in the file.
    best = best_of(columns, reevaluated)
    iterations = list(_iterations(service, job))
    view = None if best is None else BestView.from_evaluation(best, spec)
    provenance = provenance_document(job)
    documents: dict[str, Any] = {
        JOB: _job(job, best),
        SPEC: json.loads(spec.model_dump_json()),
        PROVENANCE: provenance,
        BEST: None if view is None else json.loads(view.model_dump_json()),
        ITERATIONS: [json.loads(iteration.model_dump_json()) for iteration in iterations],
    }
    documents[CHAIN] = chain_document(service, job)
    certified = None
    if isinstance(spec, CertificateSpec) and len(columns) > spec.nominal_rows:
        certified = summary(job.id, spec, columns)
        documents[SUMMARY] = json.loads(certified.model_dump_json())
    files: dict[str, bytes] = {name: _json(document) for name, document in documents.items()}
    files[EVALUATIONS] = b"".join(encoded_table("parquet", spec, [columns]))
    files[ASKS] = _asks(spec, service.asked_positions(job))
    if reevaluated is not None:
        parts = [reevaluated] if len(reevaluated) else []
        files[REEVALUATIONS] = b"".join(encoded_table("parquet", spec.in_double(), parts))
    for name in spec.recording_ids:
        files[f"recordings/{name}.json"] = service.recording(name).model_dump_json().encode()
    for number, robot in enumerate(spec.robot_sources):
        files |= _robot(f"robots/{number}", robot)
    return _Run(files, columns, iterations, provenance, view, certified)


def provenance_document(job: Job) -> dict[str, Any]:
    """Provenance of a job's numbers and of this file."""
    here = job_provenance(job.spec)
    kernels = [
        kernel_identity(load_robot(robot), job.spec.precision).hex()
        for robot in job.spec.robot_sources
    ]
    return {
        "records": [record.model_dump(mode="json") for record in job.provenance],
        "written_by": here.model_dump(mode="json"),
        "kernels": kernels,
    }


def chain_document(service: JobService, job: Job) -> dict[str, Any]:
    """Stored documents that the chain of a job's history covers besides its tables."""
    stored = service.store.chain_documents(job.id)
    links = [link for piece in _links(service, job) for link in piece]
    return {
        "version": CHAIN_VERSION,
        "spec": stored.spec,
        "lineage": stored.lineage,
        "provenance": stored.provenance,
        "asks": [link.ask_digest for link in links],
        "digests": [link.digest for link in links],
    }


def _links(service: JobService, job: Job) -> Iterator[list[Link]]:
    end = job.progress.iterations
    for first in range(0, end, _PIECE):
        found = service.store.links(job.id, first, min(first + _PIECE, end))
        yield [stored.link for stored in found]


def best_of(columns: EvaluationColumns, reevaluated: EvaluationColumns | None) -> Evaluation | None:
    """Find the best design, as the store would."""
    judged = columns if reevaluated is None else reevaluated
    row = best_particle(judged.fitness)
    if row is None:
        return None
    if reevaluated is None:
        return _evaluation(columns, row)
    best = _evaluation(reevaluated, row)
    searched = _evaluation(columns, row_of(columns, best.iteration, best.particle))
    in_double = Reevaluation(best.particle, best.objectives, best.statuses, best.fitness)
    return replace(searched, reevaluation=in_double)


def row_of(columns: EvaluationColumns, iteration: int, particle: int) -> int:
    """Find an evaluation."""
    (row,) = np.flatnonzero((columns.iteration == iteration) & (columns.particle == particle))
    return int(row)


def _evaluation(columns: EvaluationColumns, row: int) -> Evaluation:
    return Evaluation(
        iteration=int(columns.iteration[row]),
        particle=int(columns.particle[row]),
        design=columns.designs[row],
        objectives=columns.objectives[row],
        statuses=columns.statuses[row],
        fitness=float(columns.fitness[row]),
    )


def _committed(columns: EvaluationColumns, job: Job) -> EvaluationColumns:
    """Evaluations without those committed after the job was read."""
    end = int(np.searchsorted(columns.iteration, job.progress.iterations))
    return columns.rows(slice(end))


def _job(job: Job, best: Evaluation | None) -> dict[str, Any]:
    times = {"created_at": job.created_at, "started_at": job.started_at}
    times |= {"updated_at": job.updated_at, "finished_at": job.finished_at}
    found = None
    if best is not None:
        fitness = best.fitness if best.reevaluation is None else best.reevaluation.fitness
        found = {"iteration": best.iteration, "particle": best.particle, "fitness": fitness}
    return {
        "id": job.id,
        "name": job.spec.name,
        "kind": job.spec.kind,
        "state": job.state.value,
        **{name: None if time is None else time.isoformat() for name, time in times.items()},
        "iterations": job.progress.iterations,
        "evaluations": job.progress.evaluations,
        "lineage": None if job.lineage is None else job.lineage.model_dump(mode="json"),
        "budgets": list(budgets_of(job)),
        "best": found,
    }


def _iterations(service: JobService, job: Job) -> Iterator[IterationView]:
    after: int | None = None
    while True:
        page_of = service.store.iterations(job.id, after=after, limit=_PIECE)
        for iteration in page_of.items:
            if iteration.index < job.progress.iterations:
                yield IterationView.model_validate(iteration)
            after = iteration.index
        if page_of.next is None:
            return


def _asks(spec: AnySpec, asked: Sequence[NDArray[np.float64]]) -> bytes:
    """Positions that the search asked for, one per row, in the variables' units."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    positions = np.concatenate(asked)
    sizes = [len(one) for one in asked]
    columns = {
        "iteration": pa.array(np.repeat(np.arange(len(asked)), sizes)),
        "particle": pa.array(np.concatenate([np.arange(size) for size in sizes])),
    }
    for variable, column in zip(spec.design_space().variables, positions.T, strict=True):
        columns[f"position.{variable.name}"] = pa.array(column)
    sink = io.BytesIO()
    pq.write_table(pa.table(columns), sink)
    return sink.getvalue()


def _reevaluated(service: JobService, job: Job, columns: EvaluationColumns) -> EvaluationColumns:
    """Designs that were reevaluated in double precision."""
    committed = job.progress.iterations
    found = [(k, again) for k, again in service.store.reevaluations(job.id) if k < committed]
    if not found:
        return columns.rows(slice(0))
    starts = np.searchsorted(columns.iteration, [k for k, _ in found])
    return replace(
        columns.rows(starts + np.array([again.particle for _, again in found])),
        objectives=np.stack([again.objectives for _, again in found]),
        statuses=np.stack([again.statuses for _, again in found]),
        fitness=np.array([again.fitness for _, again in found]),
    )


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


def _pictures(
    spec: AnySpec, best: BestView | None, iterations: Sequence[IterationView]
) -> Iterator[tuple[str, str]]:
    yield "convergence", convergence(iterations)
    if best is None:
        return
    results = best.scenarios
    yield (
        "scenarios",
        bars(
            list(results),
            [result.utility for result in results.values()],
            label="utility, minimized",
            title="Best design: utility in each case",
        ),
    )
    if isinstance(spec, JobSpec):
        yield from _surfaces(spec, best.design)


def _surfaces(spec: JobSpec, design: Mapping[str, float | str]) -> Iterator[tuple[str, str]]:
    request = SurfaceRequest(design=dict(design), error_points=49, current_points=25)
    try:
        view = run_surface(spec.controller, request)
    except InvalidRequest:
        # A controller that is not fuzzy has none.
        return
    for output in view.outputs:
        yield (
            f"surface-{output.name}",
            heat_map(
                np.array(output.table),
                across="angle error, from its least to its greatest",
                up="motor current, from its least to its greatest",
                title=f"Output {output.name} over angle error and motor current",
            ),
        )


def _json(document: Any) -> bytes:
    return json.dumps(document, indent=2, allow_nan=False, ensure_ascii=False).encode() + b"\n"
