"""The port through which programs reach jobs: in a database of their own, or behind a server."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator
from types import TracebackType
from typing import TYPE_CHECKING, Self, TypeAlias, Unpack

from gaitswarm.jobs.findings import Findings
from gaitswarm.jobs.walks import Walks
from gaitswarm.services.optimizer.jobs.job import Command, JobOrder, JobState
from gaitswarm.services.optimizer.jobs.labels import ANY_JOB, JobFilter
from gaitswarm.views import IterationView, StateView

if TYPE_CHECKING:
    from gaitswarm.sim.identification.recorded_walk import RecordedWalk
    from gaitswarm.specs import ForkOptions, SpecInput, SpecOptions
    from gaitswarm.views import (
        EstimateView,
        JobSummaryView,
        JobView,
    )
    from gaitswarm.views.identification import RecordingEntryView, RecordingView

JobEvent: TypeAlias = IterationView | StateView
"""What happens to a job: an iteration was committed, or its state is another."""


class Jobs(Findings, Walks, ABC):
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
        priority: int = 0,
        notify_url: str | None = None,
        **options: Unpack[SpecOptions],
    ) -> JobView:
        """Check that a job can be simulated, and queue it.

        Args:
            spec: What to do, as `JobSpec`, `IdentificationSpec`, or a document as in docs/api.md;
                None for the defaults, those of the thesis's chapter 4.
            idempotency_key: A text of your own. The same key and job again make no second job.
            priority: From -10 to 10: of waiting jobs the one of highest priority is run first, and
                of running jobs one that is a step higher has twice the share of the workers. No
                result depends on it.
            notify_url: Where a JSON document is sent when the job has ended, by a server or runner
                that allows the URL's host.
            **options: Fields laid over the spec, see `SpecOptions`, such as `controller="pi"`.

        Returns:
            The queued job, or the one that the key made before.

        Raises:
            InvalidRequest: It makes no sense or cannot be simulated, or a server does not send to
                that URL; names the field.
            IdempotencyConflict: The key was used before for another job.
        """

    @abstractmethod
    def fork(
        self,
        job_id: str,
        from_iteration: int,
        *,
        idempotency_key: str | None = None,
        priority: int = 0,
        notify_url: str | None = None,
        **options: Unpack[ForkOptions],
    ) -> JobView:
        """Queue a job that begins with iterations of another one, its parent.

        With the same settings it goes on as the parent did, bit for bit. Under another preference
        what the parent's designs came to is judged anew, and the search is told that, if its method
        can be; else, and with another optimizer, robot or other scenarios, a new search starts from
        the parent's best designs. The fork's `lineage` says which.

        Args:
            job_id: Identifier of the parent, of which nothing is changed.
            from_iteration: First iteration that is the fork's own, counted from 0: it begins with
                those before it, 0 to `from_iteration` - 1.
            idempotency_key: A text of your own. The same key and fork again make no second job.
            priority: As for `submit`; the parent's is not taken over.
            notify_url: As for `submit`.
            **options: What is to be different, see `ForkOptions`, such as `preference="B"`.

        Returns:
            The queued fork.

        Raises:
            InvalidRequest: It makes no sense or cannot be simulated; names the field.
            ProvenanceChanged: It would go on with numbers of another provenance, and that is not
                accepted.
            Conflict: The parent's search cannot be taken over, or it has no design to start from.
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
        parent: str | None = None,
        search: str = "",
        where: JobFilter = ANY_JOB,
        order: JobOrder | str = JobOrder.CREATED,
        reverse: bool = False,
        limit: int | None = None,
    ) -> Iterator[JobSummaryView]:
        """List jobs.

        Args:
            state: Only jobs in this state, such as "running".
            parent: Only jobs that were forked from the job of this id.
            search: Only jobs whose name, id, note or tags contain this, whatever its case.
            where: Only jobs that this admits, such as `JobFilter(controller="pi")`.
            order: "created" (newest first), "fitness" (best first), "gain" over the published
                design (greatest first), "name", "state", "iterations", "evaluations", "priority",
                "rate" (most first) or "time_left" (least first).
            reverse: Whether the order is reversed; jobs without what they are sorted by stay last.
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
    def prioritize(self, job_id: str, priority: int) -> JobView:
        """Give a job that has not ended another priority.

        A runner that has the job shares its workers accordingly from the next iteration on.

        Args:
            job_id: Identifier of the job.
            priority: As for `submit`.

        Returns:
            The job as it is then.

        Raises:
            Conflict: It has ended.
            InvalidRequest: The priority is out of bounds.
        """

    @abstractmethod
    def label(
        self,
        job_id: str,
        *,
        name: str | None = None,
        note: str | None = None,
        tags: Iterable[str] | None = None,
        archived: bool | None = None,
    ) -> JobView:
        """Write on a job what people want to know of it; its spec and its results stay.

        Args:
            job_id: Identifier of the job.
            name: Shown in place of the spec's; "" to show that again. None leaves it, as it does
                with the others.
            note: Text of any kind.
            tags: Words to find it by, in place of those before.
            archived: Whether it is out of the way in lists.

        Returns:
            The job as it is then.

        Raises:
            InvalidRequest: A label is too long; names it.
        """

    @abstractmethod
    def keep(self, job_id: str, *, kept: bool = True) -> JobView:
        """Protect a job from deletion, or release it.

        Args:
            job_id: Identifier of the job.
            kept: Whether it is protected; False releases it.

        Returns:
            The job as it is then.
        """

    @abstractmethod
    def delete(self, job_id: str) -> None:
        """Delete a job with its iterations and evaluations; nothing brings them back.

        Forks of it have copies of what they took over, certificates of its designs are jobs of
        their own: they stay.

        Args:
            job_id: Identifier of the job.

        Raises:
            Conflict: It has not ended and is not paused, or is kept.
        """

    @abstractmethod
    def follow(self, job_id: str, *, after: int | None = None) -> Iterator[JobEvent]:
        """Follow a job until it has ended; a paused one is waited for.

        Args:
            job_id: Identifier of the job.
            after: Leave out iterations up to this index, which are known already.

        Returns:
            What is committed, then what comes: an IterationView for each iteration, once and in
            order, and a StateView for the present state and for every other that is seen, or if
            what the job waits for is another. The last is the state in which it ended.
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
    def record(self, walk: RecordedWalk) -> RecordingView:
        """Keep a recorded walk, to which jobs can fit parameters of the robot.

        Args:
            walk: Motor currents of a measured walk. The same walk again is the same recording.

        Returns:
            The recording's id, and the walk at a glance.
        """

    @abstractmethod
    def recordings(
        self, *, search: str = "", limit: int | None = None
    ) -> Iterator[RecordingEntryView]:
        """List recorded walks, the newest first.

        Args:
            search: Only walks whose id, scenario or controller contain this, whatever its case.
            limit: Most walks to list; None for all.

        Returns:
            The walks without their currents.
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
