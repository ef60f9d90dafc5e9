"""Jobs run in this process: start or resume, show progress, report."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import asdict
from typing import TYPE_CHECKING

from gaitswarm.cli.exit_codes import JobEnded
from gaitswarm.cli.output import Parts, Printed, note, show
from gaitswarm.cli.progress import Progress, show_progress
from gaitswarm.cli.tables import design_table, results_table, search_line, verdict_lines, worth
from gaitswarm.jobs.database import DatabaseJobs, check_same, earlier_job, taken_up
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
from gaitswarm.views.job import JobSummaryView

if TYPE_CHECKING:
    from gaitswarm.cli.options import WorkerOptions
    from gaitswarm.services.optimizer.analysis.verdict import VerdictView
    from gaitswarm.services.optimizer.jobs.documents import AnySpec
    from gaitswarm.services.optimizer.jobs.job import Claim, Job
    from gaitswarm.services.optimizer.jobs.spec import Spec
    from gaitswarm.services.optimizer.run.evaluator import Evaluator
    from gaitswarm.views.job import JobView


class Embedded:
    """A database whose jobs run in this process, and workers opened when a job needs them."""

    def __init__(self, workers: WorkerOptions, *, accepts_changes: bool = False) -> None:
        self._settings = read_settings(**asdict(workers))
        # Fail before a job is stored: workers are opened only for the first job.
        check_address(self._settings.ray_address)
        url = database_to_write(self._settings)
        self.database = masked_url(url)
        self.store = open_store(url)
        self.service = JobService(self.store)
        self.jobs = DatabaseJobs(self.service, url)
        self._accepts_changes = accepts_changes
        self._evaluator: Evaluator | None = None

    def resumed(self, job_id: str, spec: Spec | None) -> Job:
        """Return an earlier job, ready to run; raise Conflict if it cannot be resumed."""
        if spec is not None:
            check_same(self.service.job(job_id).spec, spec, job_id)
        return taken_up(self.service, job_id, accept_changes=self._accepts_changes)

    def run(self, job: Job, claim: Claim | None = None) -> bool:
        """Run a job, or follow another process that runs it; return whether a signal came."""
        stop = threading.Event()
        with (
            stop_on_signals(stop),
            show_progress(Progress(JobSummaryView.from_job(job))) as progress,
        ):
            try:
                ended = run_embedded(
                    self.store,
                    lambda: self._opened(progress, stop),
                    job.id if claim is None else claim,
                    on_iteration=progress.show,
                    on_retry=lambda seconds, why: progress.remark(
                        f"{why}; retrying in {seconds:.0f} s"
                    ),
                    on_news=progress.remark,
                    stop=stop,
                    accepts_changes=self._accepts_changes,
                    cache=self._settings.cache,
                    followed_iterations=job.progress.iterations,
                )
            except Exception as error:
                error.add_note(_resume_hint(job.id, self.jobs.place))
                raise
            if not stop.is_set():
                note_reference(self.store, ended)
        return stop.is_set()

    def run_to_end(self, spec: Spec, *, any_budget: bool = False) -> Job:
        """Run an earlier job of the same spec, or a new one, to its end."""
        service, claim = self.service, None
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
        if self.run(job, claim):
            note("stopped; to resume, run the same command")
            raise KeyboardInterrupt
        job = self.store.job(job.id)
        if job.state is not JobState.SUCCEEDED:
            raise ended(self.jobs.job(job.id), self.jobs.place)
        return job

    def close(self) -> None:
        if self._evaluator is not None:
            self._evaluator.close()
        self.store.close()

    def _opened(self, progress: Progress, stop: threading.Event) -> Evaluator:
        if self._evaluator is None:
            kind, address = self._settings.evaluator, self._settings.ray_address
            if kind == "ray" or (kind == "auto" and address):
                progress.remark("connecting to Ray" if address else "starting Ray")
            self._evaluator = open_evaluator(
                kind, address=address, cpus=self._settings.cpus, should_stop=stop.is_set
            )
        return self._evaluator


def run_seeds(
    specs: Sequence[AnySpec],
    workers: WorkerOptions,
    report: Callable[[DatabaseJobs, list[str]], Printed],
    *,
    report_command: str,
) -> Printed:
    """Run jobs that differ in their seed one after another, then report on all."""
    with closing(Embedded(workers)) as embedded:
        jobs = embedded.jobs
        submitted = [embedded.service.submit(spec)[0] for spec in specs]
        ids = [job.id for job in submitted]
        for number, job in enumerate(submitted, start=1):
            note(f"run {number} of {len(specs)}: job {job.id} in database {embedded.database}")
            if embedded.run(job):
                rest = [f"  gaitswarm optimize --resume {i}{jobs.place}" for i in ids[number - 1 :]]
                last = f"  gaitswarm {report_command} {' '.join(ids)}{jobs.place}"
                note("\n".join(["stopped; to resume, run", *rest, last]))
                raise KeyboardInterrupt
            ended = embedded.store.job(job.id)
            if ended.state is not JobState.SUCCEEDED:
                note(f"job {job.id} is {ended.state}: {ended.error or 'no reason given'}")
        return report(jobs, ids)


def finish(
    jobs: DatabaseJobs,
    job_id: str,
    interrupted: bool,
    *,
    as_json: bool,
) -> None:
    job = jobs.job(job_id)
    if interrupted and not job.state.terminal:
        _explain_interruption(job, jobs.place)
        raise KeyboardInterrupt
    verdict = jobs.verdict(job_id)
    document = {**job.model_dump(mode="json"), "verdict": verdict}
    show(document, _report(job, verdict, jobs.place), as_json=as_json)
    if job.state is not JobState.SUCCEEDED:
        raise ended(job, jobs.place)


def ended(job: JobView, place: str) -> JobEnded:
    """Return the error for a job that did not succeed, with a remedy."""
    reason = f": {job.error}" if job.error else ""
    error = JobEnded(f"job {job.id} is {job.state}{reason}")
    if job.state is JobState.CANCELLED:
        error.add_note(f"committed iterations remain: gaitswarm history {job.id}{place}")
    else:
        error.add_note(_resume_hint(job.id, place))
    return error


def _explain_interruption(job: JobView, place: str) -> None:
    done = f"after {job.spent}"
    if job.state is JobState.RUNNING:
        note(
            f"job {job.id} continues in another process, {done}; to follow it, run\n"
            f"  gaitswarm watch {job.id}{place}"
        )
    else:
        note(f"stopped {done}; {_resume_hint(job.id, place)}")


def _resume_hint(job_id: str, place: str) -> str:
    return f"to resume, run\n  gaitswarm optimize --resume {job_id}{place}"


def _report(job: JobView, verdict: VerdictView, place: str) -> Parts:
    if job.best is None and job.closest is None:
        yield "no design walks in every scenario"
    elif job.best is not None:
        yield design_table(job.spec, {"best": job.best.design})
        yield results_table({"best": job.best.scenarios}, job.objectives)
        yield f"fitness of best: {worth(job.best)}"
        yield from search_line(job.best)
    if job.kind == "tuning":
        yield from verdict_lines(verdict, place)
    if job.kind == "preferences":
        note(f"to see what each preference buys, run: gaitswarm preferences {job.id}{place}")
    rate = job.simulations_per_second
    speed = f" at {rate:.0f} simulations/s" if rate else ""
    saved = f"; {job.evaluations_saved} of them cached" if job.evaluations_saved else ""
    note(f"{job.evaluations} designs in {len(job.spec.case_names)} simulations each{speed}{saved}")
    if job.evaluated_on is not None:
        in_threads = job.evaluated_on.startswith("threads")
        hint = " (--evaluator ray runs it on Ray)" if in_threads else ""
        note(f"simulated on {job.evaluated_on}{hint}")
    note(f"history: gaitswarm history {job.id}{place}")
    note(f"page: gaitswarm serve{place}, then http://127.0.0.1:8000/jobs/{job.id}")
