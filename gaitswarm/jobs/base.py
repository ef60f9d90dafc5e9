"""The interface to jobs, in a database or behind a server."""

from __future__ import annotations

import os
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from functools import partial
from itertools import islice
from types import TracebackType
from typing import Any, Final, Self, TypeAlias, TypeVar, Unpack

from pydantic import BaseModel, ConfigDict, field_validator

from gaitswarm import operations
from gaitswarm.errors import InvalidRequest
from gaitswarm.firmware import (
    FirmwareOptions,
    FirmwareRequest,
    FirmwareView,
    firmware_request_of_best,
)
from gaitswarm.operations import Operation
from gaitswarm.recordings import RecordingEntryView, RecordingView
from gaitswarm.replay import WalkReplay, decoded_replay
from gaitswarm.robustness_index import RobustnessOptions, RobustnessView
from gaitswarm.services.optimizer.analysis.certificate import CertificateView
from gaitswarm.services.optimizer.analysis.comparison import JobComparisonView
from gaitswarm.services.optimizer.analysis.failures import FailuresView
from gaitswarm.services.optimizer.analysis.front import FrontView
from gaitswarm.services.optimizer.analysis.identifiability import IdentifiabilityView
from gaitswarm.services.optimizer.analysis.importance import ImportanceView
from gaitswarm.services.optimizer.analysis.preferences import (
    PreferenceForView,
    RobustPreferencesView,
)
from gaitswarm.services.optimizer.analysis.ranking import RankingView
from gaitswarm.services.optimizer.analysis.scenario_families import ScenarioFamiliesView
from gaitswarm.services.optimizer.analysis.targets import LeaveOut, TargetsView
from gaitswarm.services.optimizer.jobs.fork import ForkRequest
from gaitswarm.services.optimizer.jobs.job import Command, JobOrder, JobState
from gaitswarm.services.optimizer.jobs.labels import ANY_JOB, JobFilter
from gaitswarm.services.optimizer.jobs.notification import unusable_url
from gaitswarm.services.optimizer.jobs.priority import check_priority
from gaitswarm.services.optimizer.views import PageView
from gaitswarm.sim.controllers import ControllerName
from gaitswarm.sim.identification.recorded_walk import RecordedWalk
from gaitswarm.sim.kernel.walk import Precision
from gaitswarm.sim.robot import DEFAULT_ROBOT
from gaitswarm.simulation import SimulationResult
from gaitswarm.specs import (
    ForkOptions,
    PreferenceInput,
    RobotInput,
    ScenarioInput,
    SpecInput,
    SpecOptions,
    checked,
    chosen_spec,
    laid_options,
)
from gaitswarm.surface import SurfaceView
from gaitswarm.tables import EvaluationTable, TableFormat
from gaitswarm.views.history import BestView, HistoryIterationView, IterationView
from gaitswarm.views.job import EstimateView, JobSummaryView, JobView, StateView
from gaitswarm.views.verification import HistoryVerificationView
from gaitswarm.zip_archive import unzipped

T = TypeVar("T")
V = TypeVar("V", bound=BaseModel)

PAGE: Final = 100
"""Items that are read at once."""

JobEvent: TypeAlias = IterationView | StateView
"""An iteration was committed, or the state of a job changed."""

_COMMANDS: Final[Mapping[Command, Operation[JobView]]] = {
    Command.PAUSE: operations.pause_job,
    Command.RESUME: operations.resume_job,
    Command.CANCEL: operations.cancel_job,
}


class Submission(BaseModel):
    """What accompanies a new job.

    Attributes:
        idempotency_key: The same key and job again create no second job.
        notify_url: Receives a document when the job has ended.
    """

    model_config = ConfigDict(frozen=True)

    idempotency_key: str | None = None
    priority: int = 0
    notify_url: str | None = None

    @field_validator("notify_url")
    @classmethod
    def _is_usable(cls, url: str | None) -> str | None:
        reason = None if url is None else unusable_url(url)
        if reason is not None:
            raise ValueError(reason)
        return url


class Stop:
    """Ends a stream of events from another thread."""

    def __init__(self) -> None:
        self._event = threading.Event()
        self._wake: Callable[[], None] | None = None

    def is_set(self) -> bool:
        return self._event.is_set()

    def set(self) -> None:
        self._event.set()
        if self._wake is not None:
            self._wake()

    def wait(self, seconds: float) -> bool:
        """Wait; return whether to continue."""
        return not self._event.wait(seconds)

    @contextmanager
    def waking(self, wake: Callable[[], None]) -> Iterator[None]:
        """Call `wake` when the stream is ended inside the block."""
        self._wake = wake
        if self.is_set():
            wake()
        try:
            yield
        finally:
            self._wake = None


class Jobs(ABC):
    """Jobs, in a database (`gaitswarm.open`) or behind a server (`gaitswarm.connect`).

    Both return the same results and raise the same errors: every method raises Unavailable if the
    database or the server cannot be reached, and methods that take an id raise NotFound for an
    unknown one. `job_id` is the identifier of a job. Commands return the job as it is then.
    Analyses raise InvalidRequest for a job of another kind, and Conflict for one that is too large
    to be held in memory. Iterators read as they are consumed, so that a long history is never held
    in memory. Thread-safe. A context manager: leaving the block closes it.
    """

    @abstractmethod
    def _send(
        self, operation: Operation[T], path: tuple[str | int, ...], request: BaseModel | None
    ) -> T:
        """Compute the answer to an operation, here or on the server."""

    @abstractmethod
    def _submit(
        self,
        operation: Operation[JobView],
        path: tuple[str, ...],
        request: BaseModel,
        submission: Submission,
    ) -> JobView:
        """Create a job."""

    @abstractmethod
    def _follow(self, job_id: str, after: int | None, stop: Stop) -> Iterator[JobEvent]:
        """Yield events until the job has ended or `stop` is set."""

    @abstractmethod
    def _export(self, job_id: str, query: operations.ExportQuery) -> Iterator[bytes]:
        """Yield the parts of a file."""

    def _call(self, operation: Operation[T], *path: str | int, **arguments: Any) -> T:
        """Validate keyword arguments and compute the answer to an operation."""
        return self._send(operation, path, operation.request_of(arguments))

    def _items(
        self, operation: Operation[PageView[V]], *path: str, after: Any = None, **arguments: Any
    ) -> Iterator[V]:
        """Yield the items of all pages."""
        while True:
            page = self._call(operation, *path, after=after, limit=PAGE, **arguments)
            yield from page.items
            if page.next is None:
                return
            after = page.next

    def _decoded(self, decode: Callable[[bytes], T], content: bytes) -> T:
        """Decode an answer that is not JSON."""
        return decode(content)

    @property
    @abstractmethod
    def url(self) -> str:
        """URL of the server, or file or URL of the database."""

    @property
    @abstractmethod
    def place(self) -> str:
        """Options by which a command reaches the same jobs, such as " --db jobs.db"."""

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
            spec: A `JobSpec`, `IdentificationSpec`, or a document as in docs/api.md; None for the
                defaults, those of the thesis's chapter 4.
            idempotency_key: Any text. The same key and job again create no second job.
            priority: From -10 to 10: of queued jobs the one of highest priority runs first, and a
                running job has twice the share of workers of one that is a step lower. Results do
                not depend on it.
            notify_url: URL that receives a JSON document when the job has ended, from a server or
                runner that allows the URL's host.
            **options: Fields laid over the spec, see `SpecOptions`, such as `controller="pi"`.

        Returns:
            The queued job, or the one that the key created before.

        Raises:
            InvalidRequest: The job is invalid or cannot be simulated, or the server does not send
                to that URL; names the field.
            IdempotencyConflict: The key was used before for another job.
        """
        chosen = chosen_spec(spec, options)
        submission = _submission(idempotency_key, priority, notify_url)
        return self._submit(operations.submit_job, (), chosen, submission)

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

        With the same settings it continues as the parent did, bit for bit. Under another preference
        the objectives of the parent's designs are judged again and passed to the search, if its
        method supports that; otherwise, and with another optimizer, robot or other scenarios, a new
        search starts from the parent's best designs. The fork's `lineage` says which.

        Args:
            job_id: Identifier of the parent, which does not change.
            from_iteration: First iteration that the fork computes itself, from 0; it takes over
                those before.
            idempotency_key: Any text. The same key and fork again create no second job.
            priority: As for `submit`, not that of the parent.
            notify_url: As for `submit`.
            **options: Differences from the parent, see `ForkOptions`, such as `preference="B"`.

        Returns:
            The queued fork.

        Raises:
            InvalidRequest: The fork is invalid or cannot be simulated; names the field.
            ProvenanceChanged: The provenance has changed since, which is not accepted.
            Conflict: The parent's search cannot be continued, or has no design to start from.
            IdempotencyConflict: The key was used before for another job.
        """
        request = checked(ForkRequest, {"from_iteration": from_iteration, **laid_options(options)})
        submission = _submission(idempotency_key, priority, notify_url)
        return self._submit(operations.fork_job, (job_id,), request, submission)

    def estimate(
        self, spec: SpecInput | None = None, **options: Unpack[SpecOptions]
    ) -> EstimateView:
        """Estimate the cost of a job; nothing is stored.

        Args:
            spec: As for `submit`.
            **options: As for `submit`.

        Returns:
            Simulations, simulated time and computing time.

        Raises:
            InvalidRequest: As `submit`.
        """
        return self._send(operations.estimate_job, (), chosen_spec(spec, options))

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
            parent: Only forks of the job of this id.
            search: Only jobs whose name, id, note or tags contain this, ignoring case.
            where: Further criteria, such as `JobFilter(controller="pi")`.
            order: "created" (newest first), "fitness" (best first), "gain" over the published
                design (largest first), "name", "state", "iterations", "evaluations", "priority",
                "rate" (largest first) or "time_left" (shortest first).
            reverse: Whether to reverse the order; jobs without the value still come last.
            limit: Maximum number of jobs; None for all.

        Returns:
            The jobs with their progress, in order.

        Raises:
            InvalidRequest: No such state or order.
        """
        query = {"state": state, "parent": parent, "search": search, **asdict(where)}
        found = self._items(operations.list_jobs, order=order, reverse=reverse, **query)
        return islice(found, limit)

    def job(self, job_id: str) -> JobView:
        """Return one job.

        Returns:
            Its spec, state, progress and best design so far.
        """
        return self._call(operations.get_job, job_id)

    def command(
        self, job_id: str, command: Command | str, *, accept_changes: bool = False
    ) -> JobView:
        """Pause, resume or cancel a job.

        Args:
            command: "pause": end when the current iteration is committed; "resume": queue a paused
                or failed job again; "cancel": end for good, committed iterations stay.
            accept_changes: For "resume": whether the job continues although its provenance (code,
                robot, compiler) has changed; the change is recorded with it.

        Raises:
            Conflict: The job's state does not allow it.
            InvalidRequest: No such command.
        """
        try:
            operation = _COMMANDS[Command(command)]
        except ValueError:
            known = ", ".join(_COMMANDS)
            raise InvalidRequest(f"{command!r} is none of {known}", field="command") from None
        return self._call(operation, job_id, accept_changes=accept_changes)

    def pause(self, job_id: str) -> JobView:
        """Pause a job when its current iteration is committed.

        Raises:
            Conflict: It is paused already, or has ended.
        """
        return self.command(job_id, Command.PAUSE)

    def resume(self, job_id: str, *, accept_changes: bool = False) -> JobView:
        """Queue a paused or failed job again; it continues as if it had never stopped.

        Args:
            accept_changes: As for `command`.

        Raises:
            Conflict: It is queued or running, or has ended otherwise.
        """
        return self.command(job_id, Command.RESUME, accept_changes=accept_changes)

    def cancel(self, job_id: str) -> JobView:
        """End a job for good; committed iterations stay.

        Raises:
            Conflict: It has ended.
        """
        return self.command(job_id, Command.CANCEL)

    def extend(self, job_id: str, iterations: int) -> JobView:
        """Change the budget of a job; one that has succeeded is queued again.

        Args:
            iterations: Budget in all, more than the job has committed.

        Raises:
            Conflict: It was cancelled.
            InvalidRequest: The budget is spent already, or too large.
        """
        return self._call(operations.extend_job, job_id, iterations=iterations)

    def prioritize(self, job_id: str, priority: int) -> JobView:
        """Change the priority of a job that has not ended.

        A running job's share of the workers changes from its next iteration on.

        Args:
            priority: As for `submit`.

        Raises:
            Conflict: It has ended.
            InvalidRequest: The priority is out of bounds.
        """
        _check_priority(priority)
        return self._call(operations.prioritize_job, job_id, priority=priority)

    def label(
        self,
        job_id: str,
        *,
        name: str | None = None,
        note: str | None = None,
        tags: Iterable[str] | None = None,
        archived: bool | None = None,
    ) -> JobView:
        """Change the labels of a job; its spec and its results stay.

        Args:
            name: Shown in place of the spec's name; "" to show that again. None leaves it
                unchanged, as with the others.
            note: Free text.
            tags: Words to find the job by, in place of the previous ones.
            archived: Whether lists hide the job by default.

        Raises:
            InvalidRequest: A label is too long; names it.
        """
        words = None if tags is None else tuple(tags)
        return self._call(
            operations.label_job, job_id, name=name, note=note, tags=words, archived=archived
        )

    def keep(self, job_id: str, *, kept: bool = True) -> JobView:
        """Protect a job from deletion, or release it.

        Args:
            kept: Whether it is protected.
        """
        return self._call(operations.keep_job if kept else operations.release_job, job_id)

    def delete(self, job_id: str) -> None:
        """Delete a job with its iterations and evaluations, irrevocably.

        Forks of it and certificates of its designs stay.

        Raises:
            Conflict: It is protected, or has neither ended nor is paused.
        """
        self._call(operations.delete_job, job_id)

    def follow(self, job_id: str, *, after: int | None = None) -> Iterator[JobEvent]:
        """Follow a job until it has ended, also while it is paused.

        Args:
            after: Leave out iterations up to this index.

        Returns:
            An IterationView for each committed iteration, once and in order, and a StateView for
            the present state and for every change of it or of what the job waits for. The last is
            the state in which it ended.
        """
        return self._follow(job_id, after, Stop())

    def wait(self, job_id: str) -> JobView:
        """Wait until a job has ended, also while it is paused.

        Returns:
            The job; its `state` says how it ended.
        """
        for _ in self.follow(job_id, after=self.job(job_id).last_iteration):
            pass
        return self.job(job_id)

    def best(self, job_id: str) -> BestView:
        """Return the best design of a job so far.

        Returns:
            The design of least fitness, with its results in every case.

        Raises:
            NotFound: No design is feasible in every scenario yet.
        """
        return self._call(operations.get_best, job_id)

    def iterations(self, job_id: str, *, after: int | None = None) -> Iterator[IterationView]:
        """List the committed iterations of a job.

        Args:
            after: Only iterations with a greater index.

        Returns:
            Fitness of the designs by iteration, in order.
        """
        return self._items(operations.list_iterations, job_id, after=after)

    def history(self, job_id: str) -> Iterator[HistoryIterationView]:
        """List the committed iterations of a job with every design.

        Returns:
            Iterations in order, each with its evaluations.
        """
        for iteration in self.iterations(job_id):
            evaluations = self._call(operations.list_evaluations, job_id, iteration.index)
            yield HistoryIterationView(**dict(iteration), evaluations=evaluations.items)

    def evaluations(self, job_id: str) -> EvaluationTable:
        """Return every evaluation of a job at once, as arrays.

        Returns:
            One row per evaluation: design, fitness, and status, utility and objectives by case.
        """
        spec = self.job(job_id).spec
        read = partial(EvaluationTable.from_parquet, spec)
        return self._decoded(read, b"".join(self.export(job_id)))

    def ranking(self, job_id: str, preference: PreferenceInput, *, top: int = 20) -> RankingView:
        """Rank all designs of a job under another preference; nothing is simulated.

        Args:
            job_id: Identifier of a job that tunes a drive.
            preference: How objectives are weighed: A, B, C of table 4.5, `chapter-3` (eq. 3.1), or
                `Preference`.
            top: How many of the best designs to list, 1 to 1000.

        Returns:
            The best designs with their previous ranks, and how far the rankings agree.

        Raises:
            InvalidRequest: An argument is invalid.
        """
        return self._call(operations.rank_designs, job_id, preference=preference, top=top)

    def scenarios(self, job_id: str, *, tolerance: float = 0.01) -> ScenarioFamiliesView:
        """Determine which scenarios of a job matter; nothing is simulated.

        Args:
            job_id: Identifier of a job that tunes a drive.
            tolerance: Largest regret of the smallest family of scenarios, as a share.

        Returns:
            The best designs that the job would have had without each scenario, and with few.

        Raises:
            InvalidRequest: The tolerance is invalid.
            Conflict: No design of it succeeds in all scenarios.
        """
        return self._call(operations.get_scenario_families, job_id, tolerance=tolerance)

    def failures(self, job_id: str) -> FailuresView:
        """Count the failed designs of a job by case and status; nothing is simulated.

        Args:
            job_id: Identifier of a job of any kind.

        Returns:
            Cases with failures, most failures first; each status with its latest design.
        """
        return self._call(operations.get_failures, job_id)

    def importance(self, job_id: str) -> ImportanceView:
        """Determine which variables of a job matter; nothing is simulated.

        Args:
            job_id: Identifier of a job that tunes a drive or fits parameters.

        Returns:
            First-order Sobol' indices of every variable for the fitness, for each objective and for
            failure, with intervals; and whether the best design lies at a bound.

        Raises:
            Conflict: It has no design yet.
        """
        return self._call(operations.get_importance, job_id)

    def comparison(self, job_ids: Sequence[str]) -> JobComparisonView:
        """Compare jobs; nothing is simulated.

        Args:
            job_ids: 1 to 12 jobs, each once.

        Returns:
            Their convergence by iterations, evaluations and time, the distribution of fitness of
            their designs, and how their specs differ.

        Raises:
            InvalidRequest: There are none, too many, or one is named twice.
        """
        return self._call_about(operations.compare_jobs, job_ids)

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
        """Find the preference whose winner among a job's designs is the most robust.

        The winners' robustness index is estimated on request, by simulations where the jobs are;
        see `gaitswarm.robust_preferences` for simulations in this process.

        Args:
            job_id: Identifier of a job that tunes a drive.
            drawn: Preferences to draw in addition to A, B and C (table 4.5), 1 to 100000.
            candidates: Winners to list: those of A, B and C, and of the others those that win under
                most preferences.
            samples: Designs to simulate around each of them; 0 for no simulation and no index.
            radius: Largest distance from it, as a share of each variable's bounds.
            seed: Of preferences and samples.
            precision: Of the physics.

        Returns:
            The candidates, the most robust first; without simulations those of most preferences.

        Raises:
            InvalidRequest: An argument is invalid, or it takes more than the server allows.
            Conflict: No design of it succeeds in all scenarios.
        """
        return self._call(
            operations.find_robust_preferences,
            job_id,
            drawn=drawn,
            candidates=candidates,
            samples=samples,
            radius=radius,
            seed=seed,
            precision=precision,
        )

    def front(self, job_id: str, *, most: int = 1000) -> FrontView:
        """Find the Pareto front of a job over f1 to f5; nothing is simulated.

        Args:
            job_id: Identifier of a job that tunes a drive.
            most: Maximum number of designs to list, 1 to 10 000; of more, marked designs and others
                that cover the front evenly.

        Returns:
            The front with its knees, extremes and winners, and its hypervolume by iteration.

        Raises:
            InvalidRequest: The number is invalid.
            Conflict: No design of it succeeds in all scenarios.
        """
        return self._call(operations.get_front, job_id, most=most)

    def preference_for(self, job_id: str, iteration: int, particle: int) -> PreferenceForView:
        """Find the preference under which a design wins its job; nothing is simulated.

        Args:
            job_id: Identifier of a job that tunes a drive.
            iteration: Iteration of the design, from 0.
            particle: Number of the design in its iteration, from 0.

        Returns:
            The best preference for each set of biases, with the design's rank under it.

        Raises:
            InvalidRequest: A number is invalid.
            NotFound: The job has no such design.
            Conflict: The design fails in a scenario.
        """
        return self._call(
            operations.get_preference_for, job_id, iteration=iteration, particle=particle
        )

    def parameters(self, job_ids: Sequence[str]) -> IdentifiabilityView:
        """Determine the parameters on which runs of one problem agree.

        Args:
            job_ids: Jobs that differ in name, seed, optimizer and iterations alone; at least one.

        Returns:
            Intervals of every variable among designs close to the best.

        Raises:
            InvalidRequest: The jobs are of different problems, or have one seed.
            Conflict: One of them has no feasible design yet.
        """
        return self._call_about(operations.get_parameters, job_ids)

    def targets(self, job_ids: Sequence[str], *, leave_out: LeaveOut | None = None) -> TargetsView:
        """Return the deviations of runs of a calibration from their targets.

        Args:
            job_ids: Calibrations that differ in name, seed, optimizer and iterations alone; at
                least one.
            leave_out: "target" to predict every target by the design that is best without it,
                "walk" for without all targets of its simulation; nothing is simulated.

        Returns:
            The values of every target for the best design of all runs, and the predictions.

        Raises:
            InvalidRequest: A job of another kind, jobs of different problems, or of one seed.
            Conflict: One of them has no feasible design yet.
        """
        return self._call_about(operations.get_targets, job_ids, leave_out=leave_out)

    def certificate(
        self, job_id: str, *, worlds: int | None = None, most: int = 5
    ) -> CertificateView:
        """Summarize the results of a design in many worlds.

        Args:
            job_id: Identifier of a certificate.
            worlds: Number of worlds, from the first; None for all that were simulated.
            most: Number of worst worlds to list, 0 to 1000.

        Returns:
            Failure rates, spreads by scenario, the worst worlds, and what correlates with them.

        Raises:
            InvalidRequest: An argument is invalid.
            Conflict: No world was simulated yet.
        """
        return self._call(operations.get_certificate, job_id, worlds=worlds, most=most)

    def export(self, job_id: str, file_format: TableFormat = "parquet") -> Iterator[bytes]:
        """Write every evaluation of a job as a file.

        Args:
            file_format: "parquet" or "csv".

        Returns:
            The parts of the file, in order.

        Raises:
            InvalidRequest: No such format.
        """
        try:
            query = checked(operations.ExportQuery, {"format": file_format})
        except InvalidRequest as error:
            message = str(error).removeprefix(f"{error.field}: ")
            raise InvalidRequest(message, field="file_format") from error
        return self._export(job_id, query)

    def evidence(self, job_id: str) -> bytes:
        """Write an archive that documents a job's run, for `gaitswarm.verify`.

        Returns:
            A zip archive as in docs/evidence.md: spec, robot, provenance, all evaluations, finished
            certificates of its designs, figures and a page; identical for the same stored jobs.

        Raises:
            Conflict: The job has no committed iteration yet.
        """
        return self._call(operations.get_evidence, job_id)

    def verify(
        self, job_id: str, *, replay: int = 0, seed: int | None = None, head: str | None = None
    ) -> HistoryVerificationView:
        """Verify the stored history of a job.

        Args:
            replay: Evaluations to draw and simulate again, besides the best one; 0 for none.
            seed: Of the draw; None for a random one.
            head: Digest of an iteration noted earlier, as `JobView.head`, that must be in the
                history.

        Returns:
            Up to which iteration the digests are right, and the first difference.

        Raises:
            InvalidRequest: An argument is invalid, or the simulations exceed the server's limit.
            EvaluatorUnavailable: Simulations cannot be run there.
        """
        return self._call(operations.verify_history, job_id, replay=replay, seed=seed, head=head)

    def record(self, walk: RecordedWalk) -> RecordingView:
        """Store a recorded walk, to which jobs can fit parameters of the robot.

        Args:
            walk: Motor currents of a measured walk. The same walk again is the same recording.

        Returns:
            The recording's id, and a summary of the walk.
        """
        return self._send(operations.add_recording, (), walk)

    def recordings(
        self, *, search: str = "", limit: int | None = None
    ) -> Iterator[RecordingEntryView]:
        """List recorded walks, newest first.

        Args:
            search: Only walks whose id, scenario or controller contain this, ignoring case.
            limit: Maximum number of walks; None for all.

        Returns:
            The walks without their currents.
        """
        return islice(self._items(operations.list_recordings, search=search), limit)

    def recording(self, recording_id: str) -> RecordedWalk:
        """Return a recorded walk.

        Args:
            recording_id: Identifier, as `record` returned it.

        Returns:
            The walk as it was given.
        """
        return self._call(operations.get_recording, recording_id)

    def simulate(
        self,
        design: Mapping[str, float | str],
        *,
        scenarios: ScenarioInput | Iterable[ScenarioInput] | None = None,
        controller: ControllerName = "fuzzy-pi",
        robot: RobotInput = DEFAULT_ROBOT,
        preference: PreferenceInput = "A",
        precision: Precision = "double",
        world: Mapping[str, float] | None = None,
        log: bool = False,
    ) -> SimulationResult:
        """Simulate one design where the jobs are; see `gaitswarm.simulate` for many.

        Args:
            design: Value of each of the controller's variables, and of any gait variable, in the
                variables' units.
            scenarios: One scenario or several: names or numbers of presets, or `Scenario`; default
                all presets.
            controller: Motor controller that drives the robot.
            robot: A shipped robot by name, a `RobotVariant`, or the folder of another.
            preference: How objectives are weighed: A, B, C of table 4.5, `chapter-3` (eq. 3.1), or
                `Preference`.
            precision: Of the physics' numbers: "double", or "single", which is about twice as fast
                and needs a C compiler where it is simulated.
            world: Perturbations of the model, as `values` of a certificate's worlds: numbers by
                perturbation, nominal where there is none; None for the model itself.
            log: Whether to record every simulation at 500 Hz.

        Returns:
            Arrays of one design.

        Raises:
            InvalidRequest: An argument is invalid, the gait leaves the legs' reach, or the
                simulations are longer than the server allows.
        """
        view = self._call(
            operations.simulate,
            design=design,
            scenarios=scenarios,
            controller=controller,
            robot=robot,
            preference=preference,
            precision=precision,
            world=world,
            log=log,
        )
        return SimulationResult.from_view(view)

    def robustness(
        self, design: Mapping[str, float | str], **options: Unpack[RobustnessOptions]
    ) -> RobustnessView:
        """Estimate where the jobs are how robust a design is; see `gaitswarm.robustness`.

        Args:
            design: As for `simulate`.
            **options: Scenarios and sample, see `RobustnessOptions`.

        Returns:
            The robustness index by scenario, objective and variable.

        Raises:
            InvalidRequest: As `simulate`, or the sample is invalid.
        """
        return self._call(operations.estimate_robustness, design=design, **options)

    def replay(
        self,
        design: Mapping[str, float | str],
        *,
        scenario: ScenarioInput = "normal-fast",
        controller: ControllerName = "fuzzy-pi",
        robot: RobotInput = DEFAULT_ROBOT,
        world: Mapping[str, float] | None = None,
        rate: float = 50.0,
    ) -> WalkReplay:
        """Simulate one design and return the pose of every link, frame by frame.

        Args:
            design: As for `simulate`.
            scenario: Name or number of a preset, or `Scenario`.
            controller: Motor controller that drives the robot.
            robot: A shipped robot by name, a `RobotVariant`, or the folder of another.
            world: As for `simulate`.
            rate: Frames a second, 1 to 500 [Hz].

        Returns:
            Channels by name, one row a frame, up to the end of a failed simulation.

        Raises:
            InvalidRequest: As `simulate`.
        """
        content = self._call(
            operations.replay,
            design=design,
            scenario=scenario,
            controller=controller,
            robot=robot,
            world=world,
            rate=rate,
        )
        return self._decoded(decoded_replay, content)

    def surface(
        self,
        design: Mapping[str, float | str],
        *,
        controller: ControllerName = "fuzzy-pi",
        error_points: int = 65,
        current_points: int = 33,
        velocity_error: float = 0.0,
    ) -> SurfaceView:
        """Compute the surfaces of a fuzzy controller, by its rules and by its table.

        Args:
            design: Value of each of the controller's variables, in their units.
            controller: A fuzzy controller.
            error_points: Points of the grid over the error's range, 3 to 129.
            current_points: Points of the grid over the current's range, 2 to 65.
            velocity_error: At which the surfaces of fuzzy-pi-3 are computed [counts/s].

        Returns:
            Sets, rules and surfaces of every output.

        Raises:
            InvalidRequest: The controller is not fuzzy, or an argument is invalid.
            NotFound: No such controller.
        """
        return self._call(
            operations.controller_surface,
            controller,
            design=design,
            error_points=error_points,
            current_points=current_points,
            velocity_error=velocity_error,
        )

    def write_firmware(
        self,
        design: Mapping[str, float | str] | str,
        output: str | os.PathLike[str],
        **options: Unpack[FirmwareOptions],
    ) -> FirmwareView:
        """Write a design as C for the robot's microcontrollers; see `gaitswarm.write_firmware`.

        It is computed where the jobs are, and the folder is written here.

        Args:
            design: As for `simulate`; or the identifier of a job, for its best design, robot and
                scenarios.
            output: Folder to write; one that holds firmware is replaced, as a whole or not at all.
            **options: Scenarios and tables, see `FirmwareOptions`.

        Returns:
            Files, their sizes, and their memory on the thesis's microcontroller.

        Raises:
            InvalidRequest: As `simulate`, or the job tunes no drive, or the folder holds anything
                but firmware or cannot be written.
            NotFound: No such job, or it has no feasible design yet.
        """
        from gaitswarm.firmware import check_replaceable, write_folder

        if isinstance(design, str):
            spec, best = self.job(design).spec, self.best(design)
            request = firmware_request_of_best(design, spec, best, laid_options(options))
        else:
            request = checked(FirmwareRequest, {"design": design, **options})
        check_replaceable(output)
        view, files = self._firmware(request)
        write_folder(output, files)
        return view.model_copy(update={"folder": str(output)})

    def _firmware(self, request: FirmwareRequest) -> tuple[FirmwareView, Mapping[str, bytes]]:
        """Compute firmware and its description."""
        view = self._send(operations.summarize_firmware, (), request)
        archive = self._send(operations.write_firmware, (), request)
        return view, self._decoded(unzipped, archive)

    def _call_about(self, operation: Operation[T], job_ids: Sequence[str], **arguments: Any) -> T:
        if isinstance(job_ids, str) or not job_ids:
            raise InvalidRequest("must be a list of at least one id", field="job_ids")
        first, *also = job_ids
        try:
            return self._call(operation, first, also=also, **arguments)
        except InvalidRequest as error:
            if not error.field.startswith("also"):
                raise
            message = str(error).removeprefix(f"{error.field}: ")
            raise InvalidRequest(f"{message}, after the first", field="job_ids") from error

    @abstractmethod
    def close(self) -> None:
        """Release connections. May be called twice."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()


def _submission(idempotency_key: str | None, priority: int, notify_url: str | None) -> Submission:
    _check_priority(priority)
    return checked(
        Submission,
        {"idempotency_key": idempotency_key, "priority": priority, "notify_url": notify_url},
    )


def _check_priority(priority: int) -> None:
    if type(priority) is not int:
        raise InvalidRequest(f"must be an integer, it is {priority!r}", field="priority")
    check_priority(priority)
