"""The interface to jobs, in a database or behind a server."""

from __future__ import annotations

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial, wraps
from itertools import islice
from types import TracebackType
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    Concatenate,
    Final,
    ParamSpec,
    Self,
    TypeAlias,
    TypeVar,
    Unpack,
    cast,
)

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, field_validator

from gaitswarm.jobs.operation import (
    ZIP,
    After,
    AfterIteration,
    Context,
    Index,
    JobIdText,
    Operation,
    PageLimit,
    SearchText,
    analysis,
    commands,
    core,
    robots,
)
from gaitswarm.services.optimizer.errors import Conflict, InvalidRequest, NotFound
from gaitswarm.services.optimizer.jobs.documents import AnySpec
from gaitswarm.services.optimizer.jobs.job import (
    HIGHEST_PRIORITY,
    LARGEST_BUDGET,
    LOWEST_PRIORITY,
    Command,
    Job,
    JobOrder,
    JobState,
)
from gaitswarm.services.optimizer.jobs.kinds.tuning_worlds import ScenarioAggregate
from gaitswarm.services.optimizer.jobs.labels import JobFilter, LabelsChange
from gaitswarm.services.optimizer.jobs.notification import unusable_url
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.services.optimizer.jobs.time_left import EstimateView
from gaitswarm.services.optimizer.views import PageView
from gaitswarm.specs import (
    ConstraintInput,
    ForkOptions,
    PreferenceInput,
    SpecInput,
    SpecOptions,
    checked,
    chosen_spec,
    laid_options,
)
from gaitswarm.tables import MEDIA_TYPES, EvaluationTable, TableFormat, decoded_table, encoded_table
from gaitswarm.views.job import (
    BestView,
    HistoryIterationView,
    IterationView,
    JobKind,
    JobSummaryView,
    JobView,
    StateView,
)

if TYPE_CHECKING:
    from gaitswarm.jobs import types
    from gaitswarm.services.optimizer.service import JobService

P = ParamSpec("P")
T = TypeVar("T")
S = TypeVar("S", bound=Spec)
V = TypeVar("V", bound=BaseModel)

if TYPE_CHECKING:
    StateName = JobState | str
    OrderName = JobOrder | str
else:
    # Validation makes enumerators of names.
    StateName, OrderName = JobState, JobOrder

PAGE: Final = 100
"""Items that are read at once."""

JobEvent: TypeAlias = IterationView | StateView
"""An iteration was committed, or the state of a job changed."""

Runs: TypeAlias = Annotated[
    Sequence[str],
    Field(max_length=31, description="Further runs of the same problem, with other seeds."),
]
"""Ids of jobs; a request has the first in its path."""

Priority = Annotated[int, Field(strict=True, ge=LOWEST_PRIORITY, le=HIGHEST_PRIORITY, examples=[5])]


class Submission(BaseModel):
    """What accompanies a new job, see `Jobs.submit`."""

    model_config = ConfigDict(frozen=True, defer_build=True)

    idempotency_key: str | None = None
    priority: Priority = 0
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


def items(
    method: Callable[Concatenate[Any, P], PageView[V]],
) -> Callable[Concatenate[Any, P], Iterator[V]]:
    """Make an iterator of a method that returns a page: over all items, or the first `limit`."""

    @wraps(method)
    def iterate(self: Any, /, *arguments: P.args, **options: P.kwargs) -> Iterator[V]:
        given: dict[str, Any] = {"after": None, **options}
        return islice(pages(partial(method, self, *arguments), given), given.pop("limit", None))

    def pages(page: Callable[..., PageView[V]], given: dict[str, Any]) -> Iterator[V]:
        while True:
            read = page(**given, limit=PAGE)
            yield from read.items
            if read.next is None:
                return
            given["after"] = read.next

    return iterate


class Jobs(ABC):
    """Jobs, in a database (`gaitswarm.open`) or behind a server (`gaitswarm.connect`).

    Both return the same results and raise the same errors: every method raises Unavailable if the
    database or the server cannot be reached, InvalidRequest for an invalid argument, which it
    names, and NotFound for an unknown id. `job_id` is the identifier of a job, and
    `after` is where a list continues. Commands return the job as it is then. Analyses raise
    InvalidRequest for a job of another kind, and Conflict for one that is too large to be held in
    memory. Iterators read pages as they are consumed, up to `limit` items, by default all.
    Thread-safe. A context manager: leaving the block closes it.
    """

    _url: str
    _service: JobService
    """Only where operations are computed in this process."""

    _context = Context()

    @abstractmethod
    def _answer(self, operation: Operation, arguments: Mapping[str, Any]) -> Any:
        """Compute the answer to an operation, here or on the server."""

    @abstractmethod
    def _submit(self, spec: AnySpec, submission: Submission) -> JobView:
        """Create a job."""

    @abstractmethod
    def _fork(self, job_id: str, request: types.ForkRequest, submission: Submission) -> JobView:
        """Create a fork."""

    @abstractmethod
    def _follow(self, job_id: str, after: int | None, stop: Stop) -> Iterator[JobEvent]:
        """Yield events until the job has ended or `stop` is set."""

    def _decoded(self, decode: Callable[[bytes], T], content: bytes) -> T:
        """Decode an answer that is not JSON."""
        return decode(content)

    @property
    def url(self) -> str:
        """URL of the server, or file or URL of the database."""
        return self._url

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
            IdempotencyConflict: The key was used before for another job.
        """
        chosen = chosen_spec(spec, options)
        given = {"idempotency_key": idempotency_key, "priority": priority, "notify_url": notify_url}
        return self._submit(chosen, checked(Submission, given))

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
            from_iteration: First iteration that the fork computes itself, from 0; it takes over
                those before.
            idempotency_key: Any text. The same key and fork again create no second job.
            priority: As for `submit`, not that of the parent.
            notify_url: As for `submit`.
            **options: Differences from the parent, see `ForkOptions`, such as `preference="B"`.

        Returns:
            The queued fork.

        Raises:
            ProvenanceChanged: The provenance has changed since, which is not accepted.
            Conflict: The parent's search cannot be continued, or has no design to start from.
            IdempotencyConflict: The key was used before for another job.
        """
        from gaitswarm.services.optimizer.jobs.fork import ForkRequest

        request = checked(ForkRequest, {"from_iteration": from_iteration, **laid_options(options)})
        given = {"idempotency_key": idempotency_key, "priority": priority, "notify_url": notify_url}
        return self._fork(job_id, request, checked(Submission, given))

    @analysis("POST /estimates", "estimate_job", "Estimate a job", body=AnySpec)
    def estimate(
        self, spec: SpecInput | None = None, **options: Unpack[SpecOptions]
    ) -> EstimateView:
        """Check a job as on submission, and estimate its cost. Nothing is stored.

        The time follows from a short simulation on the server, which may have to compile the
        robot's kernel.

        Args:
            spec: As for `submit`.
            **options: As for `submit`.
        """
        return self._service.estimate(chosen_spec(spec, options))

    @items
    @core("GET /jobs", "list_jobs", "List jobs")
    def jobs(
        self,
        *,
        state: StateName | None = None,
        kind: JobKind | None = None,
        parent: JobIdText | None = None,
        search: SearchText = "",
        order: OrderName = JobOrder.CREATED,
        reverse: bool = False,
        robot: SearchText | None = None,
        controller: SearchText | None = None,
        preference: SearchText | None = None,
        tag: SearchText | None = None,
        archived: bool | None = None,
        after: After = None,
        limit: PageLimit = 50,
    ) -> PageView[JobSummaryView]:
        """Return a page of jobs with their progress. New jobs do not shift later pages.

        Args:
            state: Only jobs in this state.
            kind: Only jobs of this kind.
            parent: Only forks of the job of this id.
            search: Only jobs whose name, id, note or tags contain this, ignoring case.
            order: `created`: newest first; `fitness`: best first; `name`: by name, ignoring case;
                `state`: unfinished jobs first; `evaluations`, `iterations`, `priority`, `rate`:
                largest first; `gain` over the `reference`: largest first; `time_left`: shortest
                first. Jobs without the value come last.
            reverse: Reverse the order; jobs without the value still come last.
            robot: Only jobs of this robot; `own` for all custom robots.
            controller: Only jobs that tune this controller.
            preference: Only jobs of this preference; `own` for all custom preferences.
            tag: Only jobs with this tag.
            archived: True: only archived jobs; false: only others.
            limit: Maximum number of jobs.
        """
        page = self._service.store.jobs(
            state=cast(JobState | None, state),
            kind=kind,
            parent=parent,
            search=search,
            where=JobFilter(
                archived=archived,
                robot=robot,
                controller=controller,
                preference=preference,
                tag=tag,
            ),
            order=cast(JobOrder, order),
            reverse=reverse,
            after=after,
            limit=limit,
        )
        items = [JobSummaryView.from_job(job) for job in page.items]
        return PageView[JobSummaryView](items=items, next=page.next)

    @core("GET /jobs/{job_id}", "get_job", "Get a job")
    def job(self, job_id: str) -> JobView:
        """Return a job as it is now, with its spec."""
        return job_view(self._service, self._service.job(job_id))

    @core("POST /jobs/{job_id}/pause", "pause_job", "Pause a job", access="command", status=202)
    def pause(self, job_id: str) -> JobView:
        """Pause a job. A running job first commits its current iteration (`pausing`).

        Raises:
            Conflict: It is paused already, or has ended.
        """
        return self._command(job_id, Command.PAUSE)

    @core(
        "POST /jobs/{job_id}/resume",
        "resume_job",
        "Resume a job",
        access="command",
        status=202,
        body="ResumeRequest",
        optional=True,
    )
    def resume(
        self, job_id: str, *, accept_changes: Annotated[bool, Field(examples=[True])] = False
    ) -> JobView:
        """Queue a paused or failed job again; it continues bit for bit as if it had never stopped.

        Args:
            accept_changes: Whether to continue although its provenance (code, robot, compiler)
                changed, which is then recorded. Otherwise such a job fails and says what has
                changed.

        Raises:
            Conflict: It is queued or running, or has ended otherwise.
        """
        return self._command(job_id, Command.RESUME, accept_changes=accept_changes)

    @core("POST /jobs/{job_id}/cancel", "cancel_job", "Cancel a job", access="command")
    def cancel(self, job_id: str) -> JobView:
        """End a job for good. Committed iterations stay; the current one is dropped.

        Raises:
            Conflict: It has ended.
        """
        return self._command(job_id, Command.CANCEL)

    def _command(self, job_id: str, command: Command, **options: Any) -> JobView:
        change = self._service.store.command
        return self._changed(change, job_id, command, quota=self._context.quota, **options)

    def _changed(self, change: Callable[..., Job], *arguments: Any, **options: Any) -> JobView:
        return job_view(self._service, change(*arguments, actor=self._context.actor, **options))

    @core(
        "POST /jobs/{job_id}/extend",
        "extend_job",
        "Change the budget of a job",
        access="command",
        status=202,
        body="ExtensionRequest",
    )
    def extend(
        self, job_id: str, iterations: Annotated[int, Field(ge=1, le=LARGEST_BUDGET, examples=[50])]
    ) -> JobView:
        """Change the budget of a job; one that has succeeded is queued and continues.

        Committed iterations stay, and the current iteration is committed unchanged. Later ones
        follow the schedule of the new budget, over which a falling inertia falls: a job of 25
        iterations extended to 50 is reproducible, but differs from a job of 50.

        Args:
            iterations: Budget in all, in iterations of `particles` designs each: more than the job
                has spent.

        Raises:
            Conflict: It was cancelled.
        """
        quota = self._context.quota
        return self._changed(self._service.extend, job_id, iterations, quota=quota)

    @commands(
        "PUT /jobs/{job_id}/priority",
        "prioritize_job",
        "Change the priority of a job",
        body="PriorityRequest",
    )
    def prioritize(self, job_id: str, priority: Priority) -> JobView:
        """Change the priority of a job that has not ended.

        Queued jobs start in order of priority, the oldest first among equals. Each step doubles a
        running job's share of the workers, from its next iteration on; no job is interrupted.
        Results do not depend on it.

        Args:
            priority: Higher runs sooner; the default is 0. Values above 0 require a token of scope
                `admin`, where tokens are required.

        Raises:
            Conflict: It has ended.
        """
        self._context.check_priority(priority)
        return self._changed(self._service.store.prioritize, job_id, priority)

    @commands(
        "PATCH /jobs/{job_id}",
        "label_job",
        "Change name, note, tags or archival of a job",
        body=LabelsChange,
    )
    def label(
        self,
        job_id: str,
        *,
        name: str | None = None,
        note: str | None = None,
        tags: Iterable[str] | None = None,
        archived: bool | None = None,
    ) -> JobView:
        """Change the labels of a job, by a JSON merge patch. Its spec and results do not change.

        Args:
            name: Shown in place of the spec's name; "" to show that again. None leaves it
                unchanged, as with the others.
            note: Free text.
            tags: Words to find the job by, in place of the previous ones.
            archived: Whether lists hide the job by default.
        """
        words = None if tags is None else tuple(tags)
        change = LabelsChange(name=name, note=note, tags=words, archived=archived)
        return self._changed(self._service.store.label, job_id, change)

    @commands("PUT /jobs/{job_id}/keep", "keep_job", "Protect a job from deletion")
    def keep(self, job_id: str) -> JobView:
        """Protect a job from deletion by users and by retention."""
        return self._changed(self._service.store.keep, job_id, kept=True)

    @commands("DELETE /jobs/{job_id}/keep", "release_job", "End the protection of a job")
    def release(self, job_id: str) -> JobView:
        """Allow deletion; a server with a retention time deletes the job when that has passed."""
        return self._changed(self._service.store.keep, job_id, kept=False)

    @commands("DELETE /jobs/{job_id}", "delete_job", "Delete a job", status=204)
    def delete(self, job_id: str) -> None:
        """Delete a job with its iterations and evaluations; `restore` reverts this for 24 hours.

        Forks of it and certificates of its designs stay. Its idempotency key can be used again, and
        streams of its events end with an event `deleted`.

        Raises:
            Conflict: It is protected, or has neither ended nor is paused; cancel it first.
        """
        self._service.store.delete_job(job_id, actor=self._context.actor)

    @commands(
        "POST /jobs/{job_id}/restore", "restore_job", "Restore a deleted job", access="restore"
    )
    def restore(self, job_id: str) -> JobView:
        """Bring back a job as it was, except for its idempotency key.

        Raises:
            NotFound: It was not deleted in the last 24 hours.
        """
        return self._changed(self._service.store.restore_job, job_id)

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
        """Wait until a job has ended, also while it is paused."""
        for _ in self.follow(job_id, after=self.job(job_id).last_iteration):
            pass
        return self.job(job_id)

    @core("GET /jobs/{job_id}/best", "get_best", "Get the best design")
    def best(self, job_id: str) -> BestView:
        """Return the best design of a job so far.

        Raises:
            NotFound: No design is feasible in every scenario yet.
            Conflict: The job cannot be read.
        """
        job, best = self._service.job(job_id), self._service.store.best(job_id)
        if best is None:
            closest = self._service.closest(job) if job.readable else None
            raise NotFound(
                f"job {job_id} has no feasible design yet; try again after its next iteration, or"
                " see why designs fail by its failures"
                if closest is None
                else f"job {job_id}: {closest.explanation}"
            )
        return BestView.from_evaluation(best, job.spec)

    @analysis("GET /jobs/{job_id}/verdict", "get_verdict", "Judge the best design in words")
    def verdict(
        self, job_id: str, *, against: Annotated[str, Field(max_length=10_000)] | None = None
    ) -> types.VerdictView:
        """Compare the best design of a tuning job so far with its reference in each scenario, and
        name variables at a bound and constraints at a limit; without a feasible design, name what
        stands in the way.

        The reference is the published design of the job's controller and preference, or without one
        the middle of the bounds. It is simulated once and stored with the job; job lists include it
        from then on.

        Args:
            against: Another reference, which is not stored: `published:NAME`, the id of a job for
                its best design, or a design as a JSON object of its variables.
        """
        from gaitswarm.services.optimizer.analysis.reference import (
            with_other_reference,
            with_reference,
        )
        from gaitswarm.services.optimizer.analysis.utilities import tuning_spec
        from gaitswarm.services.optimizer.analysis.verdict import verdict
        from gaitswarm.services.optimizer.jobs.estimate import duration

        job = self._service.job(job_id)
        if against is None:
            job, reason = with_reference(self._service.store, job)
        else:
            spec, store = tuning_spec(job_id, job.spec, "a reference"), self._service.store
            self._context.limits.check_sampled(duration(spec, spec.cases({})), "against")
            job, reason = with_other_reference(job, spec, against, self._service.job, store.best)
        closest = self._service.closest(job) if job.readable else None
        return verdict(job, self._service.store.best(job_id), reason, closest)

    @items
    @core("GET /jobs/{job_id}/iterations", "list_iterations", "List committed iterations")
    def iterations(
        self,
        job_id: str,
        *,
        after: AfterIteration = None,
        limit: Annotated[int, Field(ge=1, le=1000)] = 100,
    ) -> PageView[IterationView]:
        """Return a page of iterations with statistics of their fitness, for convergence plots.

        Args:
            limit: Maximum number of iterations.
        """
        page = self._service.store.iterations(job_id, after=after, limit=limit)
        items = [IterationView.model_validate(iteration) for iteration in page.items]
        return PageView[IterationView](items=items, next=page.next)

    def history(self, job_id: str) -> Iterator[HistoryIterationView]:
        """List the committed iterations of a job with every design."""
        for iteration in self.iterations(job_id):
            evaluations = self._evaluations(job_id, iteration.index)
            yield HistoryIterationView(**dict(iteration), evaluations=evaluations.items)

    @analysis(
        "GET /jobs/{job_id}/iterations/{iteration}/evaluations",
        "list_evaluations",
        "List the evaluations of an iteration",
        heavy=False,
    )
    def _evaluations(
        self, job_id: str, iteration: int
    ) -> types.CatalogueView[types.EvaluationView]:
        """Return every design with its values, its fitness, and its results in each scenario.

        Objectives are raw; utilities follow from them and the job's preference.

        Raises:
            Conflict: The job cannot be read.
        """
        from gaitswarm.services.optimizer.analysis.evaluations import evaluation_views
        from gaitswarm.views.catalogue import CatalogueView

        spec = self._service.job(job_id).spec
        evaluations = self._service.store.evaluations(job_id, iteration)
        return CatalogueView(items=evaluation_views(evaluations, spec))

    def evaluations(self, job_id: str) -> EvaluationTable:
        """Return every evaluation of a job at once, as arrays."""
        spec = self.job(job_id).spec
        content = b"".join(self.export(job_id, "parquet"))
        return EvaluationTable(spec, self._decoded(partial(decoded_table, spec), content))

    @analysis(
        "POST /jobs/{job_id}/ranking",
        "rank_designs",
        "Rank designs under another preference, other constraints or weights",
        body="types.RankingRequest",
    )
    def ranking(
        self,
        job_id: str,
        preference: PreferenceInput | None = None,
        *,
        constraints: Sequence[ConstraintInput] | None = None,
        scenario_weights: Mapping[str, float] | None = None,
        scenario_aggregate: ScenarioAggregate | None = None,
        top: int = 20,
    ) -> types.RankingView:
        """Rank all designs of a job under another preference, other constraints or weights.

        Stored results are judged; at most references of constraints are simulated.

        Args:
            preference: How objectives are weighed: A, B, C of table 4.5, `chapter-3` (eq. 3.1), or
                `Preference`; None: as by the job.
            constraints: Limits that a design must keep, such as "speed>=0.05"; None: those of the
                job, an empty list: none.
            scenario_weights: Weights of scenarios in the mean, by name; None: those of the job.
            scenario_aggregate: `mean` or `worst`; None: that of the job.
            top: How many of the best designs to list, 1 to 1000.
        """
        from gaitswarm.services.optimizer.analysis.preferences import rank
        from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec

        job = self._service.job(job_id)
        only = "only tuning jobs are judged by a preference"
        spec = self._service.under(
            spec_of(job, JobSpec, only, field="preference"),
            preference=preference,
            constraints=constraints,
            scenario_weights=scenario_weights,
            scenario_aggregate=scenario_aggregate,
        )
        return rank(self._service.columns(job), spec, top=top)

    def _tuning(self, job_id: str, has: str) -> tuple[types.JobSpec, types.EvaluationColumns]:
        from gaitswarm.services.optimizer.analysis.utilities import tuning_spec

        job = self._service.job(job_id)
        return tuning_spec(job_id, job.spec, has), self._service.columns(job)

    def _feasible(self, job_id: str, has: str) -> tuple[types.JobSpec, types.EvaluationColumns]:
        """Return only the designs that keep the job's constraints."""
        from gaitswarm.services.optimizer.analysis.utilities import infeasible_rows

        spec, columns = self._tuning(job_id, has)
        if spec.constraints:
            columns = columns.rows(np.flatnonzero(~infeasible_rows(columns, spec)))
        return spec, columns

    @analysis("GET /jobs/{job_id}/failures", "get_failures", "Get the failures of designs")
    def failures(self, job_id: str) -> types.FailuresView:
        """Count the failed designs of a job by case and status, from stored statuses."""
        from gaitswarm.services.optimizer.analysis.failures import failures

        job = self._service.job(job_id)
        return failures(self._service.columns(job), job.spec.case_names)

    @analysis("GET /jobs/{job_id}/importance", "get_importance", "Get the importance of variables")
    def importance(self, job_id: str) -> types.ImportanceView:
        """Determine which variables of a job matter, from stored objectives.

        Raises:
            Conflict: It has no design yet.
        """
        from gaitswarm.services.optimizer.analysis.importance import importance

        job = self._service.job(job_id)
        if job.spec.kind == "certificate":
            raise InvalidRequest(
                f"job {job_id} is of kind {job.spec.kind}; only a job that tunes a drive or fits"
                " parameters has variables that may matter",
                field="job_id",
            )
        columns = self._service.columns(job)
        if not len(columns):
            raise Conflict(f"job {job_id} has no design yet; try again after its first iteration")
        return importance(job.spec, columns, self._service.store.best(job_id))

    @analysis("GET /jobs/{job_id}/comparison", "compare_jobs", "Compare jobs")
    def comparison(
        self,
        job_ids: Annotated[
            Sequence[str],
            Field(max_length=types.MOST_JOBS - 1, description="Further jobs, each once."),
        ],
    ) -> types.JobComparisonView:
        """Compare jobs by their convergence, their designs and their specs.

        Args:
            job_ids: 1 to 12 jobs, each once.
        """
        from gaitswarm.services.optimizer.analysis.comparison import comparison

        if len(set(job_ids)) < len(job_ids):
            raise InvalidRequest("must name each job once", field="job_ids")
        jobs = [self._service.job(job_id) for job_id in job_ids]
        fitness = [
            self._service.columns(job).fitness if job.progress.iterations else np.empty(0)
            for job in jobs
        ]
        return comparison(self._service.store, jobs, fitness)

    @analysis(
        "POST /jobs/{job_id}/front",
        "find_front",
        "Find the Pareto front",
        body="types.FrontRequest",
    )
    def front(
        self, job_id: str, *, constraints: Sequence[ConstraintInput] | None = None, most: int = 1000
    ) -> types.FrontView:
        """Find the Pareto front of a job over f1 to f5, from stored objectives.

        Args:
            constraints: As for `ranking`.
            most: Maximum number of designs to list, 1 to 10 000; of more, marked designs and others
                that cover the front evenly.

        Raises:
            Conflict: No design of it succeeds in all scenarios.
        """
        from gaitswarm.services.optimizer.analysis.front import pareto_front
        from gaitswarm.services.optimizer.analysis.utilities import (
            fitness_by,
            infeasible_rows,
            objective_vectors,
            require_success,
        )

        spec, columns = self._tuning(job_id, "objectives to trade")
        vectors = objective_vectors(columns, aggregation=spec.aggregation)
        if constraints is not None:
            spec = self._service.under(spec, constraints=constraints)
            preference = spec.resolved_preference()
            own = fitness_by(columns, preference, aggregation=spec.aggregation)
            columns = replace(columns, fitness=own)
        infeasible = infeasible_rows(columns, spec) & np.isfinite(vectors[:, 0])
        vectors[infeasible] = np.inf
        require_success(job_id, vectors)
        count = int(np.count_nonzero(infeasible))
        return pareto_front(columns, vectors, spec, most=most, infeasible=count)

    @analysis(
        "GET /jobs/{job_id}/preference-for", "get_preference_for", "Find a preference for a design"
    )
    def preference_for(
        self, job_id: str, iteration: Index, particle: Index
    ) -> types.PreferenceForView:
        """Find the preference under which a design wins its job, from stored objectives.

        Args:
            iteration: Iteration of the design, from 0.
            particle: Number of the design in its iteration, from 0.

        Raises:
            NotFound: The job has no such design.
            Conflict: The design fails in a scenario, or violates a constraint.
        """
        from gaitswarm.services.optimizer.analysis.preferences import preference_for
        from gaitswarm.services.optimizer.analysis.utilities import objective_vectors

        _, columns = self._tuning(job_id, "objectives to trade")
        place = (columns.iteration == iteration) & (columns.particle == particle)
        if not place.any():
            raise NotFound(f"job {job_id} has no design {iteration}.{particle}")
        spec, columns = self._feasible(job_id, "objectives to trade")
        rows = np.flatnonzero((columns.iteration == iteration) & (columns.particle == particle))
        if not len(rows):
            raise Conflict(
                f"design {iteration}.{particle} violates the job's constraints, so it wins under no"
                " preference"
            )
        if not np.isfinite(
            objective_vectors(columns.rows(rows), aggregation=spec.aggregation)
        ).all():
            raise Conflict(
                f"design {iteration}.{particle} fails in a scenario, so it wins under no preference"
            )
        return preference_for(columns, int(rows[0]), spec)

    @analysis(
        "GET /jobs/{job_id}/parameters", "get_parameters", "Get the identifiability of parameters"
    )
    def parameters(self, job_ids: Runs) -> types.IdentifiabilityView:
        """Determine the parameters on which runs of one problem agree.

        Mainly for jobs of kind `identification`. A single run always narrows; only runs with
        different seeds that narrow to the same values show that a parameter is identifiable.

        Args:
            job_ids: Jobs that differ in name, seed, optimizer and iterations alone; at least one.

        Raises:
            Conflict: One of them has no feasible design yet.
        """
        from gaitswarm.services.optimizer.analysis.identifiability import (
            check_comparable,
            identifiability,
        )

        jobs = [self._service.job(job_id) for job_id in job_ids]
        check_comparable(jobs)
        runs, spec = [self._service.columns(job) for job in jobs], jobs[0].spec
        return identifiability(job_ids, spec.design_space().variables, runs, spec.as_good_as)

    @analysis(
        "GET /jobs/{job_id}/targets",
        "get_targets",
        "Get the deviations of a calibration from its targets",
    )
    def targets(
        self, job_ids: Runs, *, leave_out: types.LeaveOut | None = None
    ) -> types.TargetsView:
        """Return the deviations of runs of a calibration from their targets, in tolerances.

        Args:
            job_ids: Calibrations that differ in name, seed, optimizer and iterations alone; at
                least one.
            leave_out: `target` to predict every target by the design that is best without it,
                `walk` for without all targets of its simulation; nothing is simulated.

        Raises:
            Conflict: One of them has no feasible design yet.
        """
        from gaitswarm.services.optimizer.analysis.identifiability import check_comparable
        from gaitswarm.services.optimizer.analysis.targets import target_results
        from gaitswarm.services.optimizer.jobs.kinds.calibration import CalibrationSpec

        jobs = [self._service.job(job_id) for job_id in job_ids]
        spec = spec_of(jobs[0], CalibrationSpec, "only a calibration has targets")
        check_comparable(jobs)
        bests = None
        if spec.precision != "double":
            stored = (self._service.store.best(job.id) for job in jobs)
            bests = [best for best in stored if best is not None]
        runs = [self._service.columns(job) for job in jobs]
        return target_results(job_ids, spec, runs, leave_out, bests=bests)

    @analysis(
        "GET /jobs/{job_id}/certificate",
        "get_certificate",
        "Get the results of a design in many worlds",
    )
    def certificate(
        self,
        job_id: str,
        *,
        worlds: Annotated[int | None, Field(ge=1, le=1_000_000)] = None,
        most: Annotated[int, Field(ge=0, le=types.MOST_WORST)] = 5,
    ) -> types.CertificateView:
        """Summarize the results of a design in the worlds simulated so far.

        The `replay` of a world is a command; its `values` are the `world` of POST /v1/replays.

        Args:
            worlds: Number of worlds, from the first; by default all that were simulated.
            most: Number of worst worlds to list, 0 to 1000.

        Raises:
            Conflict: No world was simulated yet.
        """
        from gaitswarm.services.optimizer.analysis.certificate import certificate
        from gaitswarm.services.optimizer.jobs.kinds.certificate import CertificateSpec

        job = self._service.job(job_id)
        spec = spec_of(job, CertificateSpec, "only a certificate has worlds")
        return certificate(job_id, spec, self._service.columns(job), worlds=worlds, most=most)

    @analysis(
        "GET /jobs/{job_id}/preferences",
        "get_preferences",
        "Get the results of a search for preferences",
    )
    def preferences(self, job_id: str) -> types.CandidatePreferencesView:
        """List the preferences of a job of kind `preferences`, and what their optima are worth.

        Raises:
            Conflict: None of them has a feasible optimum yet.
        """
        from gaitswarm.services.optimizer.analysis.preferences import (
            candidate_preferences,
        )
        from gaitswarm.services.optimizer.jobs.kinds.preferences import PreferencesSpec

        job = self._service.job(job_id)
        only = "only a search for preferences has candidates"
        remedy = "to submit one, run gaitswarm preferences ID --search"
        spec = spec_of(job, PreferencesSpec, f"{only}; {remedy}")
        return candidate_preferences(job_id, spec, self._service.columns(job))

    @analysis(
        "GET /jobs/{job_id}/export",
        "export_job",
        "Download all evaluations",
        heavy=False,
        media_types=MEDIA_TYPES,
        filename="{job_id}.{format}",
    )
    def export(self, job_id: str, format: TableFormat = "csv") -> Iterator[bytes]:  # noqa: A002
        """Return one row per design: iteration, particle, fitness, `design.<variable>`, and for
        every scenario `<scenario>.status`, `.utility`, and objectives and measurements by name.
        Floats are exact.

        Args:
            format: Format of the file.

        Returns:
            The table, as a file.

        Raises:
            Conflict: The job cannot be read.
        """
        from gaitswarm.services.optimizer.analysis.history import read_columns

        job = self._service.job(job_id)
        return encoded_table(format, job.spec, read_columns(self._service.store, job))

    @analysis(
        "GET /jobs/{job_id}/evidence",
        "get_evidence",
        "Download evidence",
        media_type=ZIP,
        filename="{job_id}.zip",
    )
    def evidence(self, job_id: str) -> bytes:
        """Write an archive that documents a job's run; `gaitswarm verify` checks it anywhere.

        Returns:
            A zip archive as in docs/evidence.md: spec, robot, provenance, all evaluations, finished
            certificates of its designs and a page; identical for the same stored jobs.

        Raises:
            Conflict: The job has no committed iteration yet.
        """
        from gaitswarm.evidence.archive import evidence

        return evidence(self._service, job_id)

    @analysis(
        "POST /jobs/{job_id}/verify",
        "verify_history",
        "Verify the stored history",
        body="VerificationRequest",
    )
    def verify(
        self,
        job_id: str,
        *,
        replay: Annotated[int, Field(ge=0, le=100_000, examples=[20])] = 0,
        seed: Annotated[int | None, Field(ge=0, lt=2**63)] = None,
        head: types.Digest | None = None,
    ) -> types.HistoryVerificationView:
        """Recompute the digests of a job's iterations and report the first that differs.

        Evaluations can be simulated again to compare every bit; their simulated time is limited.

        Args:
            replay: Evaluations to draw and simulate again, besides the best one; 0 for none.
            seed: Of the draw; by default a random one.
            head: Digest of an iteration noted earlier, as `JobView.head`, that must be in the
                history.

        Raises:
            EvaluatorUnavailable: Simulations cannot be run there.
        """
        from gaitswarm.evidence.verify import run_verification

        check = partial(self._context.limits.check_sampled, field="replay")
        return run_verification(
            self._service, job_id, replay=replay, seed=seed, head=head, check=check
        )

    @robots(
        "POST /recordings",
        "add_recording",
        "Add a recording",
        access="submit",
        status=201,
        location=lambda recording: f"/recordings/{recording.id}",
    )
    def record(self, walk: types.RecordedWalk) -> types.RecordingView:
        """Store a recorded walk, to which jobs of kind `identification` can fit parameters.

        The id is a hash of the content. `gaitswarm record` and POST /v1/measured-walks make a
        recording from a measured log.

        Args:
            walk: Motor currents of a measured walk. The same walk again is the same recording.
        """
        from gaitswarm.recordings import RecordingView

        recording_id = self._service.store.add_recording(walk, actor=self._context.actor)
        return RecordingView.from_walk(recording_id, walk)

    @items
    @robots("GET /recordings", "list_recordings", "List recordings")
    def recordings(
        self, *, search: SearchText = "", after: After = None, limit: PageLimit = 50
    ) -> PageView[types.RecordingEntryView]:
        """Return a page of recordings without their numbers, newest first. New ones do not shift
        later pages.

        Every token with read access sees all of them, as with jobs.

        Args:
            search: Only recordings whose id, scenario or controller contain this, ignoring case.
            limit: Maximum number of recordings.
        """
        from gaitswarm.recordings import RecordingEntryView

        page = self._service.store.recording_list(search=search, after=after, limit=limit)
        items = [RecordingEntryView.from_entry(entry) for entry in page.items]
        return PageView[RecordingEntryView](items=items, next=page.next)

    @robots("GET /recordings/{recording_id}", "get_recording", "Get a recording")
    def recording(self, recording_id: str) -> types.RecordedWalk:
        """Return a recorded walk with its numbers.

        Args:
            recording_id: Identifier, as `record` returned it.

        Raises:
            Conflict: The recording cannot be read.
        """
        return self._service.recording(recording_id)

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


def spec_of(job: Job, kind: type[S], reason: str, *, field: str = "job_id") -> S:
    """Return the spec of a job of a kind; refuse one of another kind."""
    if not isinstance(job.spec, kind):
        raise InvalidRequest(f"job {job.id} is of kind {job.spec.kind}; {reason}", field=field)
    return job.spec


def job_view(service: JobService, job: Job) -> JobView:
    """Return the view of a job with its best design."""
    has_best = job.progress.best_fitness is not None
    best = service.store.best(job.id) if has_best else None
    return JobView.from_job_and_best(job, best, service.closest(job) if job.readable else None)
