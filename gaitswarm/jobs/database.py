"""Jobs in a database that this process opens itself."""

from __future__ import annotations

import os
import shlex
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import islice
from typing import Final, Unpack

from gaitswarm.errors import NotFound, simulation_errors
from gaitswarm.jobs.embedded import Workers, run_here
from gaitswarm.jobs.local_walks import LocalWalks
from gaitswarm.jobs.news import PAGE, JobNews
from gaitswarm.jobs.port import JobEvent, Jobs
from gaitswarm.jobs.tournaments import DatabaseTournaments
from gaitswarm.requests import arguments, design_arguments
from gaitswarm.requests.certificate import run_certificate
from gaitswarm.requests.families import run_scenario_families
from gaitswarm.requests.firmware import FirmwareOptions
from gaitswarm.requests.preferences import run_preferences
from gaitswarm.requests.targets import run_targets
from gaitswarm.requests.trade_offs import DESIGNS, run_front, run_preference_for
from gaitswarm.settings import default_database
from gaitswarm.specs import ForkOptions, PreferenceInput, SpecInput, SpecOptions, chosen_spec
from gaitswarm.tables import EvaluationTable, TableFormat, encoded_table
from gaitswarm.views import (
    BestView,
    EstimateView,
    HistoryIterationView,
    IterationView,
    JobSummaryView,
    JobView,
    RankingView,
)
from gaitswarm.views.calibration import TargetsView
from gaitswarm.views.certificate import CertificateView
from gaitswarm.views.families import ScenarioFamiliesView
from gaitswarm.views.firmware import FirmwareView
from gaitswarm.views.identification import IdentifiabilityView, RecordingView
from gaitswarm.views.preferences import RobustPreferencesView
from gaitswarm.views.trade_offs import FrontView, PreferenceForView
from services.optimizer.analysis.fits.targets import LeaveOut
from services.optimizer.jobs.job import Claim, Command, Job, JobOrder, JobState
from services.optimizer.run.evaluator import Evaluator
from services.optimizer.service import JobService
from services.runtime import EvaluatorKind
from sim.identification.recorded_walk import RecordedWalk
from sim.kernel.walk import Precision

POLL_SECONDS: Final = 0.5
"""How often a job that is followed is looked at [s]."""


class DatabaseJobs(DatabaseTournaments, LocalWalks, Jobs):
    """Jobs in a database, which this process can run as well. Owns its store."""

    def __init__(
        self, service: JobService, url: str, *, poll_seconds: float = POLL_SECONDS
    ) -> None:
        """Take over a service.

        Args:
            service: Of the database; closed with this.
            url: Of the database, as it was opened.
            poll_seconds: How often a job that is followed is looked at [s].
        """
        self._service = service
        self._url = url
        self.poll_seconds = poll_seconds

    @property
    def url(self) -> str:
        """The database's file name or URL."""
        return self._url

    @property
    def place(self) -> str:
        """Options by which a command finds the same jobs; the default goes without saying."""
        return "" if self._url == str(default_database()) else f" --db {shlex.quote(self._url)}"

    def submit(
        self,
        spec: SpecInput | None = None,
        *,
        idempotency_key: str | None = None,
        **options: Unpack[SpecOptions],
    ) -> JobView:
        """Queue a job in the database, for `run` or a runner of another process."""
        wanted = chosen_spec(spec, options)
        with simulation_errors("spec"):
            job, _ = self._service.submit(wanted, idempotency_key=idempotency_key)
        return self._in_full(job)

    def fork(
        self,
        job_id: str,
        from_iteration: int,
        *,
        idempotency_key: str | None = None,
        **options: Unpack[ForkOptions],
    ) -> JobView:
        """Queue a fork in the database, for `run` or a runner of another process."""
        wanted = arguments.fork(from_iteration, options)
        with simulation_errors("fork"):
            job, _ = self._service.fork(job_id, wanted, idempotency_key=idempotency_key)
        return self._in_full(job)

    def estimate(
        self, spec: SpecInput | None = None, **options: Unpack[SpecOptions]
    ) -> EstimateView:
        """Say what a job would cost on this machine."""
        wanted = chosen_spec(spec, options)
        with simulation_errors("spec"):
            return EstimateView.from_estimate(self._service.estimate(wanted))

    def submit_embedded(self, spec: SpecInput | None) -> Claim:
        """Store a job that this process alone is to run: no runner can take it in between.

        Args:
            spec: As for `submit`.

        Returns:
            A claim on the job, to be given to `run` at once: it lasts some seconds.

        Raises:
            InvalidRequest: The job makes no sense or cannot be simulated; names the field.
        """
        wanted = chosen_spec(spec, {})
        with simulation_errors("spec"):
            return self._service.submit_embedded(wanted)

    def run(
        self,
        job: str | Claim,
        *,
        evaluator: EvaluatorKind | Evaluator = "in-process",
        cpus: int | None = None,
        ray_address: str | None = None,
        accept_changes: bool = False,
        on_iteration: Callable[[IterationView], None] | None = None,
        stop: threading.Event | None = None,
    ) -> JobView:
        """Run a job here and now, from its last committed iteration to its end.

        A paused or failed job is resumed. One that another process runs is followed, and goes on
        here when that process gives it back or is not heard of any more. Ctrl-C gives the job back
        to the queue, as does an exception of `on_iteration`, which is passed on.

        Args:
            job: Identifier of the job; or what `submit_embedded` answered.
            evaluator: "in-process": threads of this process; "ray": the same, and Ray in long
                jobs or at `ray_address`; or an evaluator that is open already and stays so.
            cpus: Walks to compute at once on this machine; default all processors.
            ray_address: A Ray cluster that runs already, for all walks.
            accept_changes: Whether the job goes on although what its numbers depend on (code,
                robot, compiler) has changed, which is then recorded with it.
            on_iteration: Called after each iteration is committed.
            stop: When it is set, by another thread, the job is given back to the queue and the
                method returns.

        Returns:
            The job as it is then: ended, paused, or queued if it was stopped.

        Raises:
            Interrupted: Ctrl-C; says how to go on.
            Conflict: The job was cancelled.
            ProvenanceChanged: What its numbers depend on has changed, and that is not accepted.
            EvaluatorUnavailable: The cluster cannot be reached.
        """
        workers = Workers(evaluator, cpus=cpus, ray_address=ray_address)
        job_id = job if isinstance(job, str) else job.job.id

        def committed(index: int) -> None:
            if on_iteration is not None:
                after = index - 1 if index else None
                on_iteration(next(self.iterations(job_id, after=after)))

        ended = run_here(
            self._service,
            self._url,
            job,
            workers=workers,
            on_iteration=committed,
            stop=stop,
            accept_changes=accept_changes,
        )
        return self._in_full(ended)

    def jobs(
        self,
        *,
        state: JobState | str | None = None,
        parent: str | None = None,
        search: str = "",
        order: JobOrder | str = JobOrder.CREATED,
        limit: int | None = None,
    ) -> Iterator[JobSummaryView]:
        """List the database's jobs, read by pages."""
        found = self._all(arguments.state(state), parent, search, arguments.order(order))
        return map(JobSummaryView.from_job, islice(found, limit))

    def job(self, job_id: str) -> JobView:
        """Read one job."""
        return self._in_full(self._service.job(job_id))

    def command(
        self, job_id: str, command: Command | str, *, accept_changes: bool = False
    ) -> JobView:
        """Change a job's state; a process that runs it sees that."""
        asked = arguments.command(command)
        return self._in_full(self._service.command(job_id, asked, accept_changes=accept_changes))

    def extend(self, job_id: str, iterations: int) -> JobView:
        """Write another budget for a job."""
        return self._in_full(self._service.extend(job_id, iterations))

    def best(self, job_id: str) -> BestView:
        """Read the best design of a job."""
        job, best = self._service.job(job_id), self._service.best(job_id)
        if best is None:
            raise NotFound(
                f"job {job_id} has no design yet that walks in every scenario; ask again after its"
                " next iteration, or see why designs fail in its evaluations"
            )
        return BestView.from_evaluation(best, job.spec)

    def iterations(self, job_id: str, *, after: int | None = None) -> Iterator[IterationView]:
        """Read committed iterations by pages."""
        while True:
            page = self._service.iterations(job_id, after=after, limit=PAGE)
            yield from map(IterationView.from_iteration, page.items)
            if page.next is None or not page.items:
                return
            after = page.items[-1].index

    def history(self, job_id: str) -> Iterator[HistoryIterationView]:
        """Read committed iterations with their designs, by pieces."""
        spec = self._service.job(job_id).spec
        for iteration, evaluations in self._service.history(job_id):
            yield HistoryIterationView.from_iteration_and_evaluations(iteration, evaluations, spec)

    def evaluations(self, job_id: str) -> EvaluationTable:
        """Read every evaluation."""
        job = self._service.job(job_id)
        return EvaluationTable.from_pieces(job.spec, self._service.column_pieces(job))

    def follow(self, job_id: str, *, after: int | None = None) -> Iterator[JobEvent]:
        """Look at the job from time to time, and tell what is new."""
        news = self.news(job_id, after=after)
        while True:
            yield from news.poll()
            if news.ended:
                return
            time.sleep(self.poll_seconds)

    def news(self, job_id: str, *, after: int | None = None) -> JobNews:
        """What is new of a job, for those who do the waiting.

        Args:
            job_id: Identifier of the job.
            after: Leave out iterations up to this index.

        Returns:
            An object that is to be asked from time to time.
        """
        return JobNews(self._service, job_id, after)

    def ranking(self, job_id: str, preference: PreferenceInput, *, top: int = 20) -> RankingView:
        """Rank a job's designs from what is stored."""
        request = arguments.ranking(preference, top)
        job = self._service.job(job_id)
        ranked = self._service.rank(job, request.resolved_preference(), top=request.top)
        return RankingView.from_ranked_job(request, ranked)

    def scenarios(self, job_id: str, *, tolerance: float = 0.01) -> ScenarioFamiliesView:
        """Judge a job's designs by fewer scenarios, from what is stored."""
        return run_scenario_families(self._service, job_id, tolerance)

    def preferences(
        self,
        job_id: str,
        *,
        drawn: int = 512,
        candidates: int = 8,
        samples: int = 0,
        radius: float = 0.02,
        seed: int = 1,
        precision: Precision = "double",
    ) -> RobustPreferencesView:
        """Rank a job's designs under many preferences, from what is stored."""
        request = arguments.preferences(
            drawn=drawn,
            candidates=candidates,
            samples=samples,
            radius=radius,
            seed=seed,
            precision=precision,
        )
        return run_preferences(self._service, job_id, request)

    def front(self, job_id: str, *, most: int = DESIGNS) -> FrontView:
        """Find a job's front from what is stored."""
        return run_front(self._service, job_id, most=most)

    def preference_for(self, job_id: str, iteration: int, particle: int) -> PreferenceForView:
        """Find a design's preference from what is stored."""
        return run_preference_for(self._service, job_id, iteration, particle)

    def parameters(self, job_ids: Sequence[str]) -> IdentifiabilityView:
        """Compare runs from what is stored."""
        jobs = [self._service.job(job_id) for job_id in arguments.runs(job_ids)]
        return IdentifiabilityView.from_identifiability(
            list(job_ids), self._service.identifiability(jobs)
        )

    def targets(self, job_ids: Sequence[str], *, leave_out: LeaveOut | None = None) -> TargetsView:
        """Compare runs with their targets, from what is stored."""
        return run_targets(self._service, arguments.runs(job_ids), arguments.leave_out(leave_out))

    def certificate(
        self, job_id: str, *, worlds: int | None = None, most: int = 5
    ) -> CertificateView:
        """Say what a certificate comes to, from what is stored."""
        arguments.certificate(worlds, most)
        return run_certificate(self._service, job_id, worlds=worlds, most=most)

    def export(self, job_id: str, file_format: TableFormat = "parquet") -> Iterator[bytes]:
        """Write every evaluation as a file, in parts as they are read."""
        chosen = arguments.table_format(file_format)
        job = self._service.job(job_id)
        return encoded_table(chosen, job.spec, self._service.column_pieces(job))

    def evidence(self, job_id: str) -> bytes:
        """Write evidence from what is stored."""
        from gaitswarm.evidence.contents import evidence

        return evidence(self._service, job_id)

    def write_firmware(
        self,
        design: Mapping[str, float | str] | str,
        output: str | os.PathLike[str],
        **options: Unpack[FirmwareOptions],
    ) -> FirmwareView:
        """Make firmware in this process."""
        from gaitswarm.firmware import written_firmware

        if isinstance(design, str):
            best = self.best(design)
            request = design_arguments.firmware_of_best(
                design, self.job(design).spec, best, options
            )
        else:
            request = design_arguments.firmware(design, options)
        return written_firmware(request, output)

    def record(self, walk: RecordedWalk) -> RecordingView:
        """Write a recorded walk into the database."""
        return RecordingView.from_walk(self._service.record(walk), walk)

    def recording(self, recording_id: str) -> RecordedWalk:
        """Read a recorded walk."""
        return self._service.recording(recording_id)

    def close(self) -> None:
        """Close the store."""
        self._service.store.close()

    def _all(
        self, state: JobState | None, parent: str | None, search: str, order: JobOrder
    ) -> Iterator[Job]:
        after: str | None = None
        while True:
            page = self._service.jobs(
                state=state, parent=parent, search=search, order=order, after=after, limit=PAGE
            )
            yield from page.items
            if page.next is None:
                return
            after = page.next

    def _in_full(self, job: Job) -> JobView:
        found = job.progress.best_fitness is not None
        return JobView.from_job_and_best(job, self._service.best(job.id) if found else None)
