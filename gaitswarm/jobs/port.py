"""The port through which programs reach jobs: in a database of their own, or behind a server."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from types import TracebackType
from typing import TYPE_CHECKING, Self, TypeAlias, Unpack

from gaitswarm.jobs.tournaments import Tournaments
from gaitswarm.jobs.walks import Walks
from gaitswarm.views import IterationView, StateView
from services.optimizer.jobs.job import Command, JobOrder, JobState

if TYPE_CHECKING:
    from gaitswarm.specs import PreferenceInput, SpecInput, SpecOptions
    from gaitswarm.tables import EvaluationTable, TableFormat
    from gaitswarm.views import (
        BestView,
        EstimateView,
        HistoryIterationView,
        JobSummaryView,
        JobView,
        RankingView,
    )
    from gaitswarm.views.calibration import TargetsView
    from gaitswarm.views.certificate import CertificateView
    from gaitswarm.views.families import ScenarioFamiliesView
    from gaitswarm.views.identification import IdentifiabilityView, RecordingView
    from services.optimizer.analysis.targets import LeaveOut
    from sim.identification.recorded_walk import RecordedWalk

JobEvent: TypeAlias = IterationView | StateView
"""What happens to a job: an iteration was committed, or its state is another."""


class Jobs(Tournaments, Walks, ABC):
    """Jobs, in a database (`gaitswarm.open`) or behind a server (`gaitswarm.connect`).

    Both answer alike and raise the same errors: every method raises Unavailable if the database or
    the server cannot be reached, and methods that take an id raise NotFound for an unknown one.
    Iterators read as they are consumed, so that a long history is never held in memory. A context
    manager: leaving the block closes it.
    """

    @property
    @abstractmethod
    def url(self) -> str:
        """Where the jobs are: the database's file or URL, or the server's URL."""

    @property
    @abstractmethod
    def place(self) -> str:
        """Options by which a command finds the same jobs, such as " --db jobs.db"."""

    @abstractmethod
    def submit(
        self,
        spec: SpecInput | None = None,
        *,
        idempotency_key: str | None = None,
        **options: Unpack[SpecOptions],
    ) -> JobView:
        """Check that a job can be simulated, and queue it.

        Args:
            spec: What to do, as `JobSpec`, `IdentificationSpec`, or a document as in docs/api.md;
                None for the defaults, those of the thesis's chapter 4.
            idempotency_key: A text of your own. The same key and job again make no second job.
            **options: Fields laid over the spec, see `SpecOptions`, such as `controller="pi"`.

        Returns:
            The queued job, or the one that the key made before.

        Raises:
            InvalidRequest: It makes no sense or cannot be simulated; names the field.
            IdempotencyConflict: The key was used before for another job.
        """

    @abstractmethod
    def estimate(
        self, spec: SpecInput | None = None, **options: Unpack[SpecOptions]
    ) -> EstimateView:
        """Say what a job would cost; nothing is stored.

        Args:
            spec: As for `submit`.
            **options: As for `submit`.

        Returns:
            Walks, simulated time and computing time.

        Raises:
            InvalidRequest: As `submit`.
        """

    @abstractmethod
    def jobs(
        self,
        *,
        state: JobState | str | None = None,
        search: str = "",
        order: JobOrder | str = JobOrder.CREATED,
        limit: int | None = None,
    ) -> Iterator[JobSummaryView]:
        """List jobs.

        Args:
            state: Only jobs in this state, such as "running".
            search: Only jobs whose name or id contains this, whatever its case.
            order: "created" (newest first), "fitness" (best first) or "name".
            limit: Most jobs to list; None for all.

        Returns:
            The jobs with their progress, in order.

        Raises:
            InvalidRequest: There is no such state or order.
        """

    @abstractmethod
    def job(self, job_id: str) -> JobView:
        """Look at one job.

        Args:
            job_id: Identifier of the job.

        Returns:
            Its spec, state, progress and best design so far.
        """

    @abstractmethod
    def command(
        self, job_id: str, command: Command | str, *, accept_changes: bool = False
    ) -> JobView:
        """Pause, resume or cancel a job.

        Args:
            job_id: Identifier of the job.
            command: "pause": end when its present iteration is committed; "resume": queue a paused
                or failed job again; "cancel": end for good, what is committed stays.
            accept_changes: For a job that is resumed: whether it goes on although what its numbers
                depend on (code, robot, compiler) has changed, which is then recorded with it.

        Returns:
            The job as it is then.

        Raises:
            Conflict: The job's present state does not allow it.
            InvalidRequest: There is no such command.
        """

    def pause(self, job_id: str) -> JobView:
        """Pause a job when its present iteration is committed.

        Args:
            job_id: Identifier of the job.

        Raises:
            Conflict: It is paused already, or has ended.
        """
        return self.command(job_id, Command.PAUSE)

    def resume(self, job_id: str, *, accept_changes: bool = False) -> JobView:
        """Queue a paused or failed job again; it goes on to the same bits as if it never stopped.

        Args:
            job_id: Identifier of the job.
            accept_changes: As for `command`.

        Raises:
            Conflict: It is queued or running, or has ended otherwise.
        """
        return self.command(job_id, Command.RESUME, accept_changes=accept_changes)

    def cancel(self, job_id: str) -> JobView:
        """End a job for good; what it has committed stays.

        Args:
            job_id: Identifier of the job.

        Raises:
            Conflict: It has ended.
        """
        return self.command(job_id, Command.CANCEL)

    @abstractmethod
    def extend(self, job_id: str, iterations: int) -> JobView:
        """Give a job another budget; one that has succeeded is queued again.

        Args:
            job_id: Identifier of the job.
            iterations: Iterations in all, more than it has committed.

        Returns:
            The job as it is then.

        Raises:
            Conflict: It was cancelled.
            InvalidRequest: The budget is spent already, or too large.
        """

    @abstractmethod
    def best(self, job_id: str) -> BestView:
        """Take the best design that a job has found so far.

        Args:
            job_id: Identifier of the job.

        Returns:
            The design of least fitness, with its result in every case.

        Raises:
            NotFound: No design has walked in every scenario yet.
        """

    @abstractmethod
    def iterations(self, job_id: str, *, after: int | None = None) -> Iterator[IterationView]:
        """List the committed iterations of a job.

        Args:
            job_id: Identifier of the job.
            after: Only iterations with a greater index.

        Returns:
            Fitness of the designs, iteration by iteration, in order.
        """

    @abstractmethod
    def history(self, job_id: str) -> Iterator[HistoryIterationView]:
        """List the committed iterations of a job with every design.

        Args:
            job_id: Identifier of the job.

        Returns:
            Iterations in order, each with its evaluations.
        """

    @abstractmethod
    def evaluations(self, job_id: str) -> EvaluationTable:
        """Take every evaluation of a job at once, as arrays.

        Args:
            job_id: Identifier of the job.

        Returns:
            One row an evaluation: design, fitness, and status, utility and objectives by case.
        """

    @abstractmethod
    def follow(self, job_id: str, *, after: int | None = None) -> Iterator[JobEvent]:
        """Follow a job until it has ended; a paused one is waited for.

        Args:
            job_id: Identifier of the job.
            after: Leave out iterations up to this index, which are known already.

        Returns:
            What is committed, then what comes: an IterationView for each iteration, once and in
            order, and a StateView for the present state and for every other that is seen. The last
            is the state in which it ended.
        """

    def wait(self, job_id: str) -> JobView:
        """Wait until a job has ended; a paused one is waited for.

        Args:
            job_id: Identifier of the job.

        Returns:
            The job; its `state` says how it ended.
        """
        for _ in self.follow(job_id, after=self.job(job_id).last_iteration):
            pass
        return self.job(job_id)

    @abstractmethod
    def ranking(self, job_id: str, preference: PreferenceInput, *, top: int = 20) -> RankingView:
        """Judge all designs of a job by another preference; no walk is run.

        Args:
            job_id: Identifier of a job that tunes a drive.
            preference: How objectives are weighed: A, B, C of table 4.5, `chapter-3` (eq. 3.1), or
                `Preference`.
            top: How many of the best designs to list, 1 to 1000.

        Returns:
            The best designs beside their places before, and how far the rankings agree.

        Raises:
            InvalidRequest: The job has no preference, or an argument makes no sense.
            Conflict: The job is too large to be held in memory.
        """

    @abstractmethod
    def scenarios(self, job_id: str, *, tolerance: float = 0.01) -> ScenarioFamiliesView:
        """See which scenarios of a job matter, from what is stored.

        Args:
            job_id: Identifier of a job that tunes a drive.
            tolerance: Largest regret of the smallest family of scenarios, as a share.

        Returns:
            What the job would have taken for its best without each scenario, and with few.

        Raises:
            InvalidRequest: The job tunes no drive, or the tolerance makes no sense.
            Conflict: No design of it walks in all scenarios, or it is too large to be held in
                memory.
        """

    @abstractmethod
    def parameters(self, job_ids: Sequence[str]) -> IdentifiabilityView:
        """See which parameters runs of one problem agree on, so that they can be trusted.

        Args:
            job_ids: Jobs that differ in name, seed, optimizer and iterations alone; at least one.

        Returns:
            Intervals of every variable among designs close to the best.

        Raises:
            InvalidRequest: The jobs are of different problems, or have one seed.
            Conflict: One of them has no design yet that did not fail.
        """

    @abstractmethod
    def targets(self, job_ids: Sequence[str], *, leave_out: LeaveOut | None = None) -> TargetsView:
        """See how near runs of a calibration come to their targets.

        Args:
            job_ids: Calibrations that differ in name, seed, optimizer and iterations alone; at
                least one.
            leave_out: "target" to predict every target by the design that is best without it,
                "walk" for without all targets of its walk; nothing is simulated.

        Returns:
            What the best design of all runs comes to, and what was left out.

        Raises:
            InvalidRequest: A job of another kind, jobs of different problems, or of one seed.
            Conflict: One of them has no design yet that did not fail.
        """

    @abstractmethod
    def certificate(
        self, job_id: str, *, worlds: int | None = None, most: int = 5
    ) -> CertificateView:
        """See what a design comes to in many worlds.

        Args:
            job_id: Identifier of a certificate.
            worlds: Worlds to take, the first ones; None for all that have walked.
            most: Worst worlds to name, 0 to 1000.

        Returns:
            Chances of failure, spreads by scenario, the worst worlds, and what goes with them.

        Raises:
            InvalidRequest: The job is of another kind, or an argument makes no sense.
            Conflict: No drawn world has walked yet, or the job is too large to be held in memory.
        """

    @abstractmethod
    def export(self, job_id: str, file_format: TableFormat = "parquet") -> Iterator[bytes]:
        """Write every evaluation of a job as a file.

        Args:
            job_id: Identifier of the job.
            file_format: "parquet" or "csv".

        Returns:
            The file in parts, to be written one after the other.
        """

    @abstractmethod
    def record(self, walk: RecordedWalk) -> RecordingView:
        """Keep a recorded walk, to which jobs can fit parameters of the robot.

        Args:
            walk: Motor currents of a measured walk. The same walk again is the same recording.

        Returns:
            The recording's id, and the walk at a glance.
        """

    @abstractmethod
    def recording(self, recording_id: str) -> RecordedWalk:
        """Take a recorded walk.

        Args:
            recording_id: Identifier, as `record` returned it.

        Returns:
            The walk as it was given.
        """

    @abstractmethod
    def close(self) -> None:
        """Release connections. Closing twice does no harm."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()
