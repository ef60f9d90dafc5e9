"""A job run by this process: start or take up, show progress, report."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import asdict
from typing import TYPE_CHECKING

from gaitswarm.cli.exit_codes import JobEnded
from gaitswarm.cli.output import note, print_json, stdout_console
from gaitswarm.cli.progress import show_progress
from gaitswarm.jobs.database.embedded import check_same, earlier_job, taken_up
from gaitswarm.jobs.database.jobs import DatabaseJobs
from gaitswarm.jobs.open import database_to_write
from gaitswarm.services.optimizer.analysis.reference import note_reference
from gaitswarm.services.optimizer.jobs.job import JobState
from gaitswarm.services.optimizer.masking import masked_url
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.runtime import (
    check_address,
    open_evaluator,
    open_store,
    run_embedded,
    stop_on_signals,
)
from gaitswarm.settings import read_settings

if TYPE_CHECKING:
    from gaitswarm.cli.inputs.options import WorkerOptions
    from gaitswarm.cli.progress import Progress
    from gaitswarm.services.optimizer.jobs.documents import AnySpec
    from gaitswarm.services.optimizer.jobs.iteration import CompletedIteration, Iteration
    from gaitswarm.services.optimizer.jobs.job import Claim, Job
    from gaitswarm.services.optimizer.jobs.spec import Spec
    from gaitswarm.services.optimizer.run.evaluator import Evaluator
    from gaitswarm.services.optimizer.store.port.base import Store
    from gaitswarm.settings import Settings
    from gaitswarm.views import JobView


def resumed_job(
    service: JobService, job_id: str, asked: Spec | None, *, accept_changes: bool
) -> Job:
    """An earlier job, ready to be run on.

    asked: the spec that the user gave once more, if any. Raises NotFound, and Conflict if the job
    was cancelled, is another than asked, or would go on with something else than it was begun with
    and that is not accepted.
    """
    if asked is not None:
        check_same(service.job(job_id).spec, asked, job_id)
    return taken_up(service, job_id, accept_changes=accept_changes)


class Embedded:
    """Workers that a process runs its own jobs on; opened when a job needs them.

    accepts_changes: whether a job goes on although what its numbers depend on has changed.
    """

    def __init__(self, settings: Settings, *, accepts_changes: bool = False) -> None:
        # Workers are opened for the first job, which would be left behind.
        check_address(settings.ray_address)
        self._settings = settings
        self._accepts_changes = accepts_changes
        self._evaluator: Evaluator | None = None

    def run(self, jobs: DatabaseJobs, store: Store, job: Job, claim: Claim | None = None) -> bool:
        """Run a job, or follow it where another process runs it, until it ends or a signal comes"""
        stop = threading.Event()
        with (
            stop_on_signals(stop),
            show_progress(
                particles=job.spec.optimizer.particles,
                iterations_planned=job.spec.iterations,
                evaluations_planned=job.spec.budget,
                iterations=job.progress.iterations,
                evaluations=job.progress.evaluations,
            ) as progress,
        ):
            best = job.progress.best_fitness

            def committed(done: CompletedIteration, _state: JobState) -> None:
                nonlocal best
                if done.best is not None:
                    _, found = done.best
                    best = found if best is None else min(best, found)
                progress.iteration(done.iteration, len(done.fitness), best, done.evaluate_seconds)

            def followed(iteration: Iteration) -> None:
                nonlocal best
                best = iteration.best_so_far
                progress.iteration(
                    iteration.index, iteration.designs, best, iteration.evaluate_seconds
                )

            try:
                ended = run_embedded(
                    store,
                    lambda: self._opened(progress, stop),
                    job.id if claim is None else claim,
                    on_commit=committed,
                    on_retry=lambda seconds, why: progress.remark(
                        f"{why}; trying again in {seconds:.0f} s"
                    ),
                    on_follow=followed,
                    on_news=progress.remark,
                    stop=stop,
                    accepts_changes=self._accepts_changes,
                    cache=self._settings.cache,
                    followed_iterations=job.progress.iterations,
                )
            except Exception as error:
                error.add_note(_how_to_go_on(job.id, jobs.place))
                raise
            if not stop.is_set():
                note_reference(store, ended)
        return stop.is_set()

    def close(self) -> None:
        """End the workers, if any were opened. Idempotent."""
        if self._evaluator is not None:
            self._evaluator.close()
            self._evaluator = None

    def _opened(self, progress: Progress, stop: threading.Event) -> Evaluator:
        if self._evaluator is None:
            kind, address = self._settings.evaluator, self._settings.ray_address
            if kind == "ray" and address:
                progress.remark("connecting to Ray")
            self._evaluator = open_evaluator(
                kind, address=address, cpus=self._settings.cpus, should_stop=stop.is_set
            )
        return self._evaluator


def job_run(
    spec: Spec,
    store: Store,
    jobs: DatabaseJobs,
    embedded: Embedded,
    *,
    any_budget: bool = False,
) -> Job:
    """The job that was submitted before to do the same, or a new one, run to its end.

    spec: its name should be its alone. jobs: of the store. any_budget: whether a job of another
    budget is the same; it is extended if that is less.

    Raises JobEnded if it does not succeed, and KeyboardInterrupt if a signal comes.
    """
    service, claim = JobService(store), None
    job = earlier_job(service, spec, any_budget=any_budget)
    if job is not None and job.spec.budget < spec.budget:
        job = service.extend(job.id, max(spec.iterations, job.spent + 1))
    if job is None:
        claim = service.submit_embedded(spec)
        job = claim.job
    elif job.state is not JobState.SUCCEEDED:
        job = taken_up(service, job.id, accept_changes=False)
    if job.state is JobState.SUCCEEDED:
        return job
    note(f"job {job.id}: {spec.name}")
    if embedded.run(jobs, store, job, claim):
        note("stopped; the same command goes on")
        raise KeyboardInterrupt
    job = store.job(job.id)
    if job.state is not JobState.SUCCEEDED:
        raise ended(jobs.job(job.id), jobs.place)
    return job


def run_seeds(
    specs: Sequence[AnySpec],
    workers: WorkerOptions,
    report: Callable[[DatabaseJobs, list[str]], None],
    *,
    again: str,
) -> None:
    """Run jobs of one problem, one after the other, and report on all of them.

    report: prints what they say together. again: the command that does, for who interrupts it.
    """
    settings = read_settings(**asdict(workers))
    url = database_to_write(settings)
    with closing(open_store(url)) as store, closing(Embedded(settings)) as embedded:
        service = JobService(store)
        jobs = DatabaseJobs(service, url)
        submitted = [service.submit(spec)[0] for spec in specs]
        ids = [job.id for job in submitted]
        for number, job in enumerate(submitted, start=1):
            note(f"run {number} of {len(specs)}: job {job.id} in database {masked_url(url)}")
            if embedded.run(jobs, store, job):
                rest = [f"  gaitswarm optimize --resume {i}{jobs.place}" for i in ids[number - 1 :]]
                last = f"  gaitswarm {again} {' '.join(ids)}{jobs.place}"
                note("\n".join(["stopped; go on with", *rest, last]))
                raise KeyboardInterrupt
            ended = store.job(job.id)
            if ended.state is not JobState.SUCCEEDED:
                note(f"job {job.id} is {ended.state}: {ended.error or 'no reason was given'}")
        report(jobs, ids)


def finish(
    jobs: DatabaseJobs,
    job_id: str,
    interrupted: bool,
    *,
    as_json: bool,
    compare: bool,
    beside: Mapping[str, JobView],
) -> None:
    """Print the result, and what other jobs found of the same problem, by the name to show.

    Raises KeyboardInterrupt if interrupted, JobEnded unless it succeeded.
    """
    job = jobs.job(job_id)
    if interrupted and not job.state.terminal:
        _explain_interruption(job, jobs.place)
        raise KeyboardInterrupt
    if as_json:
        print_json(job)
    else:
        _report(job, jobs.place, compare=compare, beside=beside)
    if job.state is not JobState.SUCCEEDED:
        raise ended(job, jobs.place)


def ended(job: JobView, place: str) -> JobEnded:
    """What to say of a job that did not succeed, and what can be done."""
    because = f": {job.error}" if job.error else ""
    error = JobEnded(f"job {job.id} is {job.state}{because}")
    if job.state is JobState.CANCELLED:
        error.add_note(f"what it has committed stays: gaitswarm history {job.id}{place}")
    else:
        error.add_note(_how_to_go_on(job.id, place))
    return error


def _explain_interruption(job: JobView, place: str) -> None:
    done = f"after {job.spent}"
    if job.state is JobState.RUNNING:
        note(
            f"job {job.id} goes on in another process, {done}; follow it with\n"
            f"  gaitswarm watch {job.id}{place}"
        )
    else:
        note(f"stopped {done}; {_how_to_go_on(job.id, place)}")


def _how_to_go_on(job_id: str, place: str) -> str:
    return f"go on with\n  gaitswarm optimize --resume {job_id}{place}"


def _report(job: JobView, place: str, *, compare: bool, beside: Mapping[str, JobView]) -> None:
    from gaitswarm.cli.comparison import published_beside
    from gaitswarm.cli.tables import design_table, results_table, search_line, worth

    console = stdout_console()
    if job.best is None:
        console.print("no design walks in every scenario", markup=False)
    else:
        others = {name: other.best for name, other in beside.items() if other.best is not None}
        published = published_beside(job.spec) if compare else {}
        evaluations = {"best": job.best} | others | published
        console.print(design_table(job.spec, {k: e.design for k, e in evaluations.items()}))
        results = {k: e.scenarios for k, e in evaluations.items()}
        console.print(results_table(results, job.objectives))
        for name, evaluation in evaluations.items():
            console.print(f"fitness of {name}: {worth(evaluation)}", markup=False)
        searched = search_line(job.best)
        if searched is not None:
            console.print(searched, markup=False)
    speed = f" at {job.simulations_per_second:.0f} walks/s" if job.simulations_per_second else ""
    saved = f"; {job.evaluations_saved} of them were known" if job.evaluations_saved else ""
    note(f"{job.evaluations} designs in {len(job.spec.case_names)} walks each{speed}{saved}")
    note(f"its history: gaitswarm history {job.id}{place}")
    note(f"look at it: gaitswarm serve{place}, then http://127.0.0.1:8000/jobs/{job.id}")
