"""Requests of the HTTP API as values: what is sent, and how its answer is read. No I/O here.

The client that blocks and the one that does not send the same ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict

from gaitswarm.jobs.server.call import Call, got, job_path, page, posted, segment
from gaitswarm.services.optimizer.analysis.targets import LeaveOut
from gaitswarm.services.optimizer.jobs.job import JobOrder, JobState
from gaitswarm.services.optimizer.jobs.labels import JobFilter
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.sim.identification.recorded_walk import RecordedWalk
from gaitswarm.tables import EvaluationTable, TableFormat
from gaitswarm.views import (
    BestView,
    CatalogueView,
    EstimateView,
    EvaluationView,
    IterationView,
    JobSummaryView,
    JobView,
    PageView,
)
from gaitswarm.views.calibration import TargetsView
from gaitswarm.views.certificate import CertificateView
from gaitswarm.views.identification import (
    IdentifiabilityView,
    RecordingEntryView,
    RecordingView,
)
from gaitswarm.views.verification import HistoryVerificationView, VerificationRequest


def estimate(spec: Spec) -> Call[EstimateView]:
    """Say what a job would cost.

    Args:
        spec: What it would do.
    """
    return posted("/estimates", EstimateView, spec, reads=True)


def jobs(
    state: JobState | None,
    parent: str | None,
    search: str,
    where: JobFilter,
    in_order: tuple[JobOrder, bool],
    after: str | None,
) -> Call[PageView[JobSummaryView]]:
    """A page of the list of jobs.

    Args:
        state: Of the jobs; None for any.
        parent: Identifier of the job that they were forked from; None for any.
        search: Text that name, id, note or tags contain, whatever its case.
        where: Admits the jobs.
        in_order: In which they are listed, and whether that is reversed.
        after: `next` of the page before; None for the first page.
    """
    order, reverse = in_order
    chosen = {"search": search, "order": order.value}
    if reverse:
        chosen["reverse"] = "true"
    if state is not None:
        chosen["state"] = state.value
    if parent is not None:
        chosen["parent"] = parent
    for name, value in asdict(where).items():
        if value is not None:
            chosen[name] = str(value).lower() if isinstance(value, bool) else value
    return page("/jobs", PageView[JobSummaryView], after, chosen)


def job(job_id: str) -> Call[JobView]:
    """Look at one job.

    Args:
        job_id: Identifier of the job.
    """
    return got(job_path(job_id), JobView)


def best(job_id: str) -> Call[BestView]:
    """Take the best design.

    Args:
        job_id: Identifier of the job.
    """
    return got(f"{job_path(job_id)}/best", BestView)


def iterations(job_id: str, after: str | None) -> Call[PageView[IterationView]]:
    """A page of a job's committed iterations.

    Args:
        job_id: Identifier of the job.
        after: `next` of the page before; None for the first page.
    """
    return page(f"{job_path(job_id)}/iterations", PageView[IterationView], after)


def evaluations_of(job_id: str, iteration: int) -> Call[CatalogueView[EvaluationView]]:
    """Every design of one iteration.

    Args:
        job_id: Identifier of the job.
        iteration: Its index.
    """
    path = f"{job_path(job_id)}/iterations/{iteration}/evaluations"
    return got(path, CatalogueView[EvaluationView])


def evaluations(job_id: str, spec: Spec) -> Call[EvaluationTable]:
    """Every evaluation of a job at once.

    Args:
        job_id: Identifier of the job.
        spec: Of the job, which names the columns.
    """

    def read(content: bytes) -> EvaluationTable:
        return EvaluationTable.from_parquet(spec, content)

    return Call("GET", f"{job_path(job_id)}/export", read, {"format": "parquet"})


def export(job_id: str, file_format: TableFormat) -> Call[bytes]:
    """Every evaluation of a job as a file.

    Args:
        job_id: Identifier of the job.
        file_format: Of the file.
    """
    return Call("GET", f"{job_path(job_id)}/export", bytes, {"format": file_format})


def evidence(job_id: str) -> Call[bytes]:
    """One file that proves a job's run.

    Args:
        job_id: Identifier of the job.
    """
    return Call("GET", f"{job_path(job_id)}/evidence", bytes)


def verify(job_id: str, request: VerificationRequest) -> Call[HistoryVerificationView]:
    """Check that what is stored of a job is what was committed.

    Args:
        job_id: Identifier of the job.
        request: How thoroughly.
    """
    return posted(f"{job_path(job_id)}/verify", HistoryVerificationView, request, reads=True)


def events(job_id: str, last: int | None) -> Call[bytes]:
    """The stream of what happens to a job, after one iteration.

    Args:
        job_id: Identifier of the job.
        last: Index of that iteration; None for all from the beginning.
    """
    headers = {"Accept": "text/event-stream", "Cache-Control": "no-store"}
    if last is not None:
        headers["Last-Event-ID"] = str(last)
    return Call("GET", f"{job_path(job_id)}/events", bytes, headers=headers)


def parameters(job_ids: Sequence[str]) -> Call[IdentifiabilityView]:
    """Find out which parameters runs agree on.

    Args:
        job_ids: Identifiers of the runs, at least one.
    """
    first, *others = job_ids
    path = f"{job_path(first)}/parameters"
    return Call("GET", path, IdentifiabilityView.model_validate_json, {"also": others})


def targets(job_ids: Sequence[str], leave_out: LeaveOut | None) -> Call[TargetsView]:
    """Find out how near runs of a calibration come to their targets.

    Args:
        job_ids: Identifiers of the runs, at least one.
        leave_out: What to leave out and predict, or None.
    """
    first, *others = job_ids
    asked: dict[str, str | Sequence[str]] = {"also": others}
    if leave_out is not None:
        asked["leave_out"] = leave_out
    return Call("GET", f"{job_path(first)}/targets", TargetsView.model_validate_json, asked)


def certificate(job_id: str, worlds: int | None, most: int) -> Call[CertificateView]:
    """Find out what a certificate comes to.

    Args:
        job_id: Identifier of the job.
        worlds: Worlds to take, the first ones; None for all.
        most: Worst worlds to name.
    """
    asked = {"most": str(most)} | ({} if worlds is None else {"worlds": str(worlds)})
    path = f"{job_path(job_id)}/certificate"
    return Call("GET", path, CertificateView.model_validate_json, asked)


def record(walk: RecordedWalk) -> Call[RecordingView]:
    """Keep a recorded walk.

    Args:
        walk: As it was measured.
    """
    return posted("/recordings", RecordingView, walk)


def recordings(search: str, after: str | None) -> Call[PageView[RecordingEntryView]]:
    """A page of the list of recorded walks.

    Args:
        search: Text that id, scenario or controller contain, whatever its case.
        after: `next` of the page before; None for the first page.
    """
    return page("/recordings", PageView[RecordingEntryView], after, {"search": search})


def recording(recording_id: str) -> Call[RecordedWalk]:
    """Take a recorded walk.

    Args:
        recording_id: Its identifier.
    """
    return got(f"/recordings/{segment(recording_id, 'recording')}", RecordedWalk)
