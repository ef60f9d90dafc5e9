"""How near runs of a calibration come to their targets. Knows nothing of HTTP."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from gaitswarm.services.optimizer.analysis.fits.identifiability import check_comparable
from gaitswarm.services.optimizer.analysis.fits.targets import LeaveOut, target_results
from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.columns import EvaluationColumns
from gaitswarm.services.optimizer.jobs.iteration import Evaluation
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.jobs.kinds.calibration import CalibrationSpec
from gaitswarm.views.calibration import TargetsView


class Histories(Protocol):
    """Where jobs and their evaluations are."""

    def job(self, job_id: str) -> Job:
        """A job."""

    def columns(self, job: Job) -> EvaluationColumns:
        """All evaluations of a job."""

    def best(self, job_id: str) -> Evaluation | None:
        """The best design of a job."""


def run_targets(
    histories: Histories, job_ids: Sequence[str], leave_out: LeaveOut | None
) -> TargetsView:
    """Compare the best design of several runs with their targets, from what is stored."""
    jobs = [histories.job(job_id) for job_id in job_ids]
    first, spec = jobs[0], jobs[0].spec
    if not isinstance(spec, CalibrationSpec):
        raise InvalidRequest(
            f"job {first.id} is of kind {spec.kind}; only a calibration has targets", field="job_id"
        )
    check_comparable(jobs)
    runs = [histories.columns(job) for job in jobs]
    bests = None
    if spec.precision != "double":
        found = [histories.best(job.id) for job in jobs]
        bests = [best for best in found if best is not None]
    results = target_results(spec, runs, leave_out, bests=bests)
    return TargetsView.from_results([job.id for job in jobs], spec, results)
