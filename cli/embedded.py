"""A job run by this process: start or take up, show progress, report."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import TYPE_CHECKING

from cli.exit_codes import JobEnded
from cli.output import note, print_json, stdout_console
from cli.progress import show_progress
from services.optimizer.errors import Conflict
from services.optimizer.jobs.job import Command, Job, JobState
from services.runtime import EvaluatorKind, open_evaluator, run_embedded, stop_on_signals

if TYPE_CHECKING:
    from gaitswarm.jobs.database import DatabaseJobs
    from gaitswarm.views import JobView
    from services.optimizer.jobs.job import CompletedIteration
    from services.optimizer.jobs.spec import Spec
    from services.optimizer.service import JobService
    from services.optimizer.store.base import Store

_TAKEN_UP = (JobState.PAUSED, JobState.PAUSING, JobState.FAILED)
"""States in which going on with a job needs the command to."""


def resumed_job(
    service: JobService, job_id: str, asked: Spec | None, *, accept_changes: bool
) -> Job:
    """An earlier job, ready to be run on.

    asked: the spec that the user gave once more, if any. Raises NotFound, and Conflict if the job
    was cancelled, is another than asked, or would go on with something else than it was begun with
    and that is not accepted.
    """
    job = service.job(job_id)
    if asked is not None:
        _check_same(job, asked)
    if job.state is JobState.CANCELLED:
        raise Conflict(f"job {job_id} was cancelled, which is for good; start a new one")
    if job.state is not JobState.SUCCEEDED and not accept_changes:
        service.check_unchanged(job)
    return service.command(job_id, Command.RESUME) if job.state in _TAKEN_UP else job


def _check_same(job: Job, asked: Spec) -> None:
    stored, wanted = job.spec.model_dump(), asked.resolved().model_dump()
    changed = [field for field in stored if field != "name" and stored[field] != wanted[field]]
    if changed:
        raise Conflict(
            f"job {job.id} was submitted with another {', '.join(changed)}, and a job stays what"
            " it is; resume it without --spec and options of the job, or start a new one"
        )


@dataclass(frozen=True, slots=True)
class Embedded:
    """Workers that a process runs its own job on.

    accepts_changes: whether a job goes on although what its numbers depend on has changed.
    """

    kind: EvaluatorKind
    ray_address: str | None = None
    cpus: int | None = None
    accepts_changes: bool = False

    def run(self, store: Store, job: Job) -> bool:
        """Until the job ends, or a signal comes: true if one did."""
        if job.state.terminal:
            return False
        spec = job.spec
        best = job.progress.best_fitness
        stop = threading.Event()
        with (
            stop_on_signals(stop),
            show_progress(
                iterations=spec.iterations,
                particles=spec.optimizer.particles,
                done=job.progress.iterations,
            ) as progress,
        ):
            if self.kind == "ray":
                progress.remark("connecting to Ray" if self.ray_address else "starting Ray")
            evaluator = open_evaluator(self.kind, address=self.ray_address, cpus=self.cpus)

            def committed(done: CompletedIteration, _state: JobState) -> None:
                nonlocal best
                finite = [f for f in (best, *done.fitness.tolist()) if f is not None]
                best = min(finite)
                progress.iteration(done.iteration, best, done.evaluate_seconds)

            try:
                run_embedded(
                    store,
                    evaluator,
                    job.id,
                    on_commit=committed,
                    on_retry=lambda seconds, why: progress.remark(
                        f"{why}; trying again in {seconds:.0f} s"
                    ),
                    on_wait=lambda why: progress.remark(f"{why}; waiting for it"),
                    stop=stop,
                    accepts_changes=self.accepts_changes,
                )
            finally:
                evaluator.close()
        return stop.is_set()


def finish(
    jobs: DatabaseJobs, job_id: str, interrupted: bool, *, as_json: bool, compare: bool
) -> None:
    """Print the result. Raises KeyboardInterrupt if interrupted, JobEnded unless it succeeded."""
    job = jobs.job(job_id)
    if interrupted and not job.state.terminal:
        note(
            f"stopped after {job.iterations} of {job.iterations_planned} iterations; go on with\n"
            f"  gaitswarm optimize --resume {job_id}{jobs.place}"
        )
        raise KeyboardInterrupt
    if as_json:
        print_json(job)
    else:
        _report(job, jobs.place, compare=compare)
    if job.state is not JobState.SUCCEEDED:
        raise JobEnded(f"job {job_id} is {job.state}" + (f": {job.error}" if job.error else ""))


def _report(job: JobView, place: str, *, compare: bool) -> None:
    from cli.comparison import published_beside
    from cli.tables import design_table, number, results_table

    console = stdout_console()
    if job.best is None:
        console.print("no design walks in every scenario", markup=False)
    else:
        evaluations = {"best": job.best} | (published_beside(job.spec) if compare else {})
        console.print(design_table(job.spec, {k: e.design for k, e in evaluations.items()}))
        results = {k: e.scenarios for k, e in evaluations.items()}
        console.print(results_table(results, job.objectives))
        for name, evaluation in evaluations.items():
            console.print(f"fitness of {name}: {number(evaluation.fitness)}", markup=False)
    speed = f" at {job.simulations_per_second:.0f} walks/s" if job.simulations_per_second else ""
    note(f"{job.evaluations} designs in {len(job.spec.case_names)} walks each{speed}")
    note(f"its history: gaitswarm history {job.id}{place}")
    note(f"look at it: gaitswarm serve{place}, then http://127.0.0.1:8000/jobs/{job.id}")
