"""`gaitswarm.optimize`: a job run in this process."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Unpack

import numpy as np

from gaitswarm.jobs.database import check_same, check_workers
from gaitswarm.jobs.open import open as open_database
from gaitswarm.services.optimizer.analysis.verdict import VerdictView
from gaitswarm.services.optimizer.errors import GaitswarmError, InvalidRequest, NotFound
from gaitswarm.services.optimizer.jobs.iteration import SUMMARY
from gaitswarm.services.optimizer.jobs.job import JobState
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.services.optimizer.run.evaluator import Evaluator
from gaitswarm.services.runtime import EvaluatorKind
from gaitswarm.specs import SpecInput, SpecOptions, job_spec
from gaitswarm.tables import EvaluationTable, Table
from gaitswarm.views.job import BestView, IterationView, JobView


class JobEnded(GaitswarmError):
    """The awaited job did not succeed.

    Attributes:
        job: The job: paused, cancelled or failed.
    """

    def __init__(self, job: JobView) -> None:
        self.job = job
        super().__init__(f"job {job.id} is {job.state}" + (f": {job.error}" if job.error else ""))


@dataclass(frozen=True, slots=True)
class OptimizationResult:
    """A job that has succeeded, and its results.

    Attributes:
        job: The job: spec, state, rates.
        iterations: Its committed iterations, in order: fitness of the designs.
        db: The database that it is in, for `gaitswarm.open` and `optimize(resume=...)`.
    """

    job: JobView
    iterations: tuple[IterationView, ...]
    db: str = field(repr=False)

    @property
    def best(self) -> BestView:
        """The design of least fitness in double precision, with its result in every scenario."""
        if self.job.best is None:
            raise NotFound(f"job {self.job.id} has no design that succeeds in every scenario")
        return self.job.best

    def convergence(self) -> Table:
        """The iterations as a table.

        Returns:
            One row an iteration: index, designs (judged in it), best, mean, median, worst,
            best_so_far (fitness, minimized, NaN where no design has one), failed and infeasible
            (designs), least_violation (NaN without constraints) and evaluate_seconds [s].
        """
        whole = ("index", "designs", "failed", "infeasible")
        return Table(
            {
                name: np.array(
                    [getattr(i, name) for i in self.iterations],
                    dtype=np.int64 if name in whole else np.float64,
                )
                for name in _CONVERGENCE
            }
        )

    def evaluations(self) -> EvaluationTable:
        """All evaluations of the job, read from the database.

        Returns:
            One row an evaluation: design, fitness, and status, utility and objectives by scenario.

        Raises:
            StoreUnavailable: The database can no longer be opened.
            NotFound: Its file no longer exists.
        """
        with open_database(self.db, create=False) as jobs:
            return jobs.evaluations(self.job.id)

    def verdict(self) -> VerdictView:
        """The best design against the published or the start design, as `Jobs.verdict`.

        Raises:
            StoreUnavailable: The database can no longer be opened.
            NotFound: Its file no longer exists.
        """
        with open_database(self.db, create=False) as jobs:
            return jobs.verdict(self.job.id)


_CONVERGENCE = ("index", "designs", *SUMMARY, "evaluate_seconds")


def optimize(
    spec: SpecInput | None = None,
    *,
    resume: str | None = None,
    reuse: bool = False,
    accept_changes: bool = False,
    db: str | os.PathLike[str] | None = None,
    evaluator: EvaluatorKind | Evaluator = "auto",
    cpus: int | None = None,
    ray_address: str | None = None,
    on_iteration: Callable[[IterationView], None] | None = None,
    **options: Unpack[SpecOptions],
) -> OptimizationResult:
    """Run a job in this process; every iteration is stored before the next begins.

    Ctrl-C, an exception in `on_iteration`, or the death of the process leave a job that
    `optimize(resume=...)` continues to the same bits as if it had never stopped.

    Args:
        spec: A `JobSpec`, `IdentificationSpec` or document (docs/api.md); None: thesis chapter 4.
        resume: Identifier of a job to resume; a spec or options, if given, must be its own.
        reuse: Whether to take the job of the same name and specification that the same code ran
            before, or to resume it if it has not ended, in place of a new job.
        accept_changes: Whether to resume under a changed provenance (code, robot, compiler), which
            is recorded with the job.
        db: Database to keep the job in: a file, or a URL as for `gaitswarm.open`. None: that of
            the environment (GAITSWARM_DB), else the user's own.
        evaluator: "in-process": threads of this process; "ray": Ray; "auto": Ray at
            `ray_address`, else threads; or an open evaluator, which stays open.
        cpus: Simulations to run at once on this machine; default all processors.
        ray_address: A running Ray cluster, for all simulations.
        on_iteration: Called after each iteration is committed, for progress.
        **options: Fields laid over the spec, see `SpecOptions`: name, robot, controller,
            scenarios, variables, fixed, preference, optimizer, particles, iterations, seed, start,
            precision.

    Returns:
        The finished job with its best design and history.

    Raises:
        InvalidRequest: The job is invalid or cannot be simulated, and not stored; names the field.
        NotFound: The job to resume does not exist.
        Conflict: The job to resume has another spec, or was cancelled.
        ProvenanceChanged: That of the job to resume has changed, which is not accepted.
        JobEnded: The job failed, or was paused or cancelled by another client.
        Interrupted: Ctrl-C; a KeyboardInterrupt that says how to resume.
        Unavailable: The database or the workers cannot be used.
    """
    if accept_changes and resume is None:
        raise InvalidRequest("a new job has no changes to accept", field="accept_changes")
    begun: str | Spec = resume or job_spec(spec, **options)
    again = job_spec(spec, **options) if resume and (spec is not None or options) else None
    check_workers(evaluator, cpus)
    with open_database(db, create=resume is None) as jobs:
        if again is not None and resume is not None:
            check_same(jobs.job(resume).spec, again, resume)
        job = jobs.run(
            begun,
            reuse=reuse,
            evaluator=evaluator,
            cpus=cpus,
            ray_address=ray_address,
            accept_changes=accept_changes,
            on_iteration=on_iteration,
        )
        if job.state is not JobState.SUCCEEDED:
            raise JobEnded(job)
        return OptimizationResult(job, tuple(jobs.iterations(job.id)), jobs.url)
