"""Jobs in a database, opened by this process."""

from __future__ import annotations

import shlex
import signal
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, closing, contextmanager, suppress
from functools import cache
from itertools import groupby
from operator import attrgetter
from typing import TYPE_CHECKING, Any, Final, get_args

from gaitswarm.jobs.base import JobEvent, Jobs, Stop, Submission, job_view
from gaitswarm.jobs.operation import Operation
from gaitswarm.services.optimizer.errors import (
    Conflict,
    InvalidRequest,
    ProvenanceChanged,
    simulation_errors,
)
from gaitswarm.services.optimizer.jobs.documents import AnySpec
from gaitswarm.services.optimizer.jobs.job import Claim, Command, Job, JobState
from gaitswarm.services.optimizer.jobs.listing import every
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.services.optimizer.masking import masked_url
from gaitswarm.services.worker import EvaluatorKind
from gaitswarm.settings import default_database, read_settings
from gaitswarm.tables import EvaluationTable
from gaitswarm.views.job import HistoryIterationView, IterationView, JobView, StateView

if TYPE_CHECKING:
    from gaitswarm.services.optimizer.jobs.fork import ForkRequest
    from gaitswarm.services.optimizer.jobs.iteration import Iteration
    from gaitswarm.services.optimizer.run.evaluator import Evaluator
    from gaitswarm.services.optimizer.service import JobService

_RESUMED: Final = (JobState.PAUSED, JobState.PAUSING, JobState.FAILED)
"""States from which a job continues only by a command."""

POLL_SECONDS: Final = 0.5
"""Time between two readings of a followed job [s]."""


class Interrupted(KeyboardInterrupt):
    """Ctrl-C while running a job. Committed iterations are stored, and the job is queued again.

    A job that was only followed continues in the process that runs it.

    Attributes:
        job: The job as it was then.
    """

    def __init__(self, job: JobView, db: str) -> None:
        self.job = job
        left = "continues in another process" if job.state == "running" else "was queued again"
        super().__init__(
            f"job {job.id} {left} after {job.spent};"
            f" resume it with gaitswarm.optimize(resume={job.id!r}, db={masked_url(db)!r})"
        )


class DatabaseJobs(Jobs):
    """Jobs in a database, which this process can also run. Owns its store."""

    def __init__(
        self, service: JobService, url: str, *, poll_seconds: float = POLL_SECONDS
    ) -> None:
        """Take over a service; a followed job is read every `poll_seconds`."""
        self._service = service
        self._url = url
        self._poll_seconds = poll_seconds

    @property
    def place(self) -> str:
        """Options by which a command reaches the same jobs; none for the default database."""
        if self._url == str(default_database()):
            return ""
        return f" --db {shlex.quote(masked_url(self._url))}"

    def _answer(self, operation: Operation, arguments: Mapping[str, Any]) -> Any:
        given = operation.arguments(*operation.validated(arguments))
        with simulation_errors(operation.names[0] if operation.names else ""):
            return operation.function(self, **given)

    def _submit(self, spec: AnySpec, submission: Submission) -> JobView:
        with simulation_errors("spec"):
            job, _ = self._service.submit(spec, **dict(submission))
        return job_view(self._service, job)

    def _fork(self, job_id: str, request: ForkRequest, submission: Submission) -> JobView:
        with simulation_errors("fork"):
            job, _ = self._service.fork(job_id, request, **dict(submission))
        return job_view(self._service, job)

    def _follow(self, job_id: str, after: int | None, stop: Stop) -> Iterator[JobEvent]:
        sent = None
        while True:
            # The job is read first: the iterations that it counts are then among those read.
            job = self._service.job(job_id)
            for iteration in self.iterations(job_id, after=after):
                after = iteration.index
                yield iteration
            if (job.state, job.waiting) != sent:
                sent = (job.state, job.waiting)
                yield StateView.from_job(job)
            if job.state.terminal:
                self._service.store.verify()
                return
            if not stop.wait(self._poll_seconds):
                return

    def history(self, job_id: str) -> Iterator[HistoryIterationView]:
        """Read the designs of many iterations at once."""
        from gaitswarm.services.optimizer.analysis.evaluations import evaluation_views
        from gaitswarm.services.optimizer.analysis.history import read_columns
        from gaitswarm.services.optimizer.jobs.iteration import evaluations_of

        job, iterations = self._service.job(job_id), self.iterations(job_id)
        for columns in read_columns(self._service.store, job):
            views = evaluation_views(evaluations_of(columns), job.spec)
            for _, designs in groupby(views, key=attrgetter("iteration")):
                yield HistoryIterationView(**dict(next(iterations)), evaluations=list(designs))

    def evaluations(self, job_id: str) -> EvaluationTable:
        """Read every evaluation."""
        from gaitswarm.services.optimizer.analysis.history import read_columns

        job = self._service.job(job_id)
        return EvaluationTable(job.spec, *read_columns(self._service.store, job))

    def delete(self, job_id: str) -> None:
        """Delete a job, and remove the rows of those that can no longer be restored."""
        from gaitswarm.services.optimizer.store.jobs import TRASH

        super().delete(job_id)
        self._service.store.purge_deleted(older_than=TRASH)

    def run(
        self,
        job: str | Spec,
        *,
        reuse: bool = False,
        evaluator: EvaluatorKind | Evaluator = "auto",
        cpus: int | None = None,
        ray_address: str | None = None,
        accept_changes: bool = False,
        on_iteration: Callable[[IterationView], None] | None = None,
        stop: threading.Event | None = None,
    ) -> JobView:
        """Run a job in this process, from its last committed iteration to its end.

        A paused or failed job is resumed. One that another process runs is followed, and continues
        here when that process returns it to the queue or its lease runs out. Ctrl-C returns the job
        to the queue, as does an exception of `on_iteration`, which is passed on.

        Args:
            job: Identifier of the job; or the specification of a new one, which no other process
                is to run.
            reuse: Whether to take an earlier job in place of a new one: of the same name and
                specification, not cancelled, and of the same provenance.
            evaluator: "in-process": threads of this process; "ray": Ray; "auto": Ray at
                `ray_address`, else threads; or an open evaluator, which stays open.
            cpus: Simulations to run at once on this machine; default all processors.
            ray_address: A running Ray cluster, for all simulations.
            accept_changes: Whether the job continues although its provenance (code, robot,
                compiler) has changed; the change is recorded with it.
            on_iteration: Called after each iteration is committed.
            stop: When it is set, the job is returned to the queue and the method returns.

        Returns:
            The job as it is then: ended, paused, or queued if it was stopped.

        Raises:
            InvalidRequest: The new job cannot be simulated; names the field.
            Interrupted: Ctrl-C; says how to resume.
            Conflict: The job was cancelled.
            ProvenanceChanged: The provenance has changed, which is not accepted.
            EvaluatorUnavailable: The cluster cannot be reached.
        """
        from gaitswarm.services.optimizer.analysis.reference import note_reference
        from gaitswarm.services.runtime import open_evaluator, run_embedded

        check_workers(evaluator, cpus)
        stop = stop or threading.Event()
        begun = self._begun(job, reuse=reuse) if isinstance(job, Spec) else job
        job_id = begun if isinstance(begun, str) else begun.job.id
        if isinstance(begun, str):
            taken_up(self._service, begun, accept_changes=accept_changes)

        def committed(iteration: Iteration) -> None:
            if on_iteration is not None:
                on_iteration(IterationView.model_validate(iteration))

        try:
            with ctrl_c(stop) as interrupted, ExitStack() as stack:

                @cache
                def opened() -> Evaluator:
                    if not isinstance(evaluator, str):
                        return evaluator
                    workers = open_evaluator(
                        evaluator, address=ray_address, cpus=cpus, should_stop=stop.is_set
                    )
                    return stack.enter_context(closing(workers))

                ended = run_embedded(
                    self._service.store,
                    opened,
                    begun,
                    on_iteration=committed,
                    stop=stop,
                    accepts_changes=accept_changes,
                    cache=read_settings().cache,
                )
        except KeyboardInterrupt as error:
            raise Interrupted(self.job(job_id), self._url) from error
        view = job_view(self._service, note_reference(self._service.store, ended))
        if interrupted.is_set() and not ended.state.terminal:
            raise Interrupted(view, self._url)
        return view

    def _begun(self, spec: Spec, *, reuse: bool) -> str | Claim:
        """Store a new job, or return the id of an earlier one."""
        earlier = earlier_job(self._service, spec) if reuse else None
        if earlier is not None:
            return earlier.id
        with simulation_errors("spec"):
            return self._service.submit_embedded(spec)

    def close(self) -> None:
        """Close the store."""
        self._service.store.close()


def check_workers(evaluator: EvaluatorKind | Evaluator, cpus: int | None) -> None:
    """Raise InvalidRequest for an unknown kind of workers, or less than one thread."""
    kinds = get_args(EvaluatorKind)
    if isinstance(evaluator, str) and evaluator not in kinds:
        raise InvalidRequest(f"{evaluator!r} is none of {', '.join(kinds)}", field="evaluator")
    if cpus is not None and cpus < 1:
        raise InvalidRequest("must be at least 1", field="cpus")


def check_same(stored: Spec, asked: Spec, job_id: str) -> None:
    """Raise Conflict if a spec differs from that of the job to resume in more than the name."""
    before, wanted = (_submitted(spec).model_dump() for spec in (stored, asked.resolved()))
    changed = [f for f in before if f != "name" and before[f] != wanted.get(f)]
    if changed:
        raise Conflict(
            f"job {job_id} was submitted with another {', '.join(changed)}, which cannot change;"
            " resume it without a spec and options, or start a new one"
        )


def _submitted(spec: Spec) -> Spec:
    """Return a spec without what is looked up at submission."""
    from gaitswarm.services.optimizer.jobs.kinds.preferences import PreferencesSpec
    from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec

    if isinstance(spec, PreferencesSpec):
        return spec.model_copy(update={"tuning": _submitted(spec.tuning)})
    return spec.without_references() if isinstance(spec, JobSpec) else spec


def taken_up(service: JobService, job_id: str, *, accept_changes: bool) -> Job:
    """Resume a paused or failed job; return any other as it is."""
    job = service.job(job_id)
    if job.state is JobState.CANCELLED:
        raise Conflict(f"job {job_id} was cancelled, which is final; start a new one")
    if job.state is not JobState.SUCCEEDED and not accept_changes:
        service.check_unchanged(job)
    return service.store.command(job_id, Command.RESUME) if job.state in _RESUMED else job


def earlier_job(service: JobService, spec: Spec, *, any_budget: bool = False) -> Job | None:
    """Find a job of the same spec and name that was not cancelled and has today's provenance."""
    wanted = _submitted(spec.resolved())
    for job in every(lambda after: service.store.jobs(search=spec.name, after=after)):
        if not job.readable or job.state is JobState.CANCELLED:
            continue
        budget = wanted.iterations
        stored = _submitted(job.spec)
        if stored != wanted and not (
            any_budget and stored.with_budget(budget) == wanted.with_budget(budget)
        ):
            continue
        with suppress(ProvenanceChanged):
            service.check_unchanged(job)
            if len(job.provenance) <= 1:
                return job
    return None


@contextmanager
def ctrl_c(stop: threading.Event) -> Iterator[threading.Event]:
    """Yield an event that the first Ctrl-C sets, as it sets `stop`; the second one interrupts."""
    pressed = threading.Event()
    in_main = threading.current_thread() is threading.main_thread()
    if not in_main or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield pressed
        return

    def handle(_number: int, _frame: Any) -> None:
        if pressed.is_set():
            raise KeyboardInterrupt
        pressed.set()
        stop.set()

    signal.signal(signal.SIGINT, handle)
    try:
        yield pressed
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
