"""A job run by this process: taken up, run to its end, given back on Ctrl-C."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Any, Final, get_args

from gaitswarm.errors import Conflict, Interrupted, InvalidRequest, ProvenanceChanged
from gaitswarm.services.optimizer.analysis.reference import note_reference
from gaitswarm.services.optimizer.jobs.iteration import CompletedIteration
from gaitswarm.services.optimizer.jobs.job import Claim, Command, Job, JobState
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.services.optimizer.run.evaluator import Evaluator
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.runtime import EvaluatorKind, open_evaluator, run_embedded
from gaitswarm.settings import read_settings
from gaitswarm.views import JobView

_TAKEN_UP: Final = (JobState.PAUSED, JobState.PAUSING, JobState.FAILED)
"""States in which going on with a job needs the command to."""


@dataclass(frozen=True, slots=True)
class Workers:
    """What walks run on.

    Attributes:
        evaluator: A kind of workers to open, or workers that are open already.
        cpus: Walks to compute at once on this machine; all of its cores by default.
        ray_address: Of a Ray cluster, as for `open_evaluator`.

    Raises:
        InvalidRequest: The kind does not exist, or `cpus` is less than 1.
    """

    evaluator: EvaluatorKind | Evaluator
    cpus: int | None = None
    ray_address: str | None = None

    def __post_init__(self) -> None:
        kinds = get_args(EvaluatorKind)
        if isinstance(self.evaluator, str) and self.evaluator not in kinds:
            raise InvalidRequest(
                f"{self.evaluator!r} is none of {', '.join(kinds)}", field="evaluator"
            )
        if self.cpus is not None and self.cpus < 1:
            raise InvalidRequest("must be at least 1", field="cpus")

    @contextmanager
    def when_needed(
        self, should_stop: Callable[[], bool]
    ) -> Iterator[Evaluator | Callable[[], Evaluator]]:
        """Open workers no earlier than they are needed, and close those again.

        Args:
            should_stop: Polled while they are opened, which it ends with EvaluationStopped.

        Yields:
            Workers that are open already, or a function that opens them at its first call.
        """
        if not isinstance(self.evaluator, str):
            yield self.evaluator
            return
        kind, opened = self.evaluator, list[Evaluator]()

        def open_once() -> Evaluator:
            if not opened:
                opened.append(
                    open_evaluator(
                        kind, address=self.ray_address, cpus=self.cpus, should_stop=should_stop
                    )
                )
            return opened[0]

        try:
            yield open_once
        finally:
            for evaluator in opened:
                evaluator.close()


def check_same(stored: Spec, asked: Spec, job_id: str) -> None:
    """Check that a job to be resumed is the one that is asked for.

    Args:
        stored: Spec of the job.
        asked: Spec that was given once more.
        job_id: Identifier of the job.

    Raises:
        Conflict: They differ in more than the name; names the fields.
    """
    before, wanted = stored.model_dump(), asked.resolved().model_dump()
    changed = [f for f in before if f != "name" and before[f] != wanted.get(f)]
    if changed:
        raise Conflict(
            f"job {job_id} was submitted with another {', '.join(changed)}, and a job stays what it"
            " is; resume it without a spec and options, or start a new one"
        )


def run_here(
    service: JobService,
    url: str,
    job: str | Claim,
    *,
    workers: Workers,
    on_iteration: Callable[[int], None],
    stop: threading.Event | None,
    accept_changes: bool = False,
) -> Job:
    """Run a job until it ends, is paused, or `stop` is set.

    Args:
        service: Of the database that the job is in.
        url: Of the database, for messages.
        job: Identifier of the job, or the claim of this process, which has submitted it.
        workers: What walks run on.
        on_iteration: Called with the index of every iteration that is committed, here or by another
            process that runs the job meanwhile.
        stop: When set, the job is given back to the queue.
        accept_changes: Whether it goes on although what its numbers depend on has changed.

    Returns:
        The job as it is then.

    Raises:
        Interrupted: Ctrl-C, unless the job has ended meanwhile.
        Conflict: The job was cancelled.
        ProvenanceChanged: What its numbers depend on has changed, and that is not accepted.
    """
    job_id = job if isinstance(job, str) else job.job.id
    if isinstance(job, str):
        taken_up(service, job, accept_changes=accept_changes)

    def committed(done: CompletedIteration, _state: JobState) -> None:
        on_iteration(done.iteration)

    stop = stop or threading.Event()
    try:
        with _ctrl_c(stop) as interrupted, workers.when_needed(stop.is_set) as evaluator:
            ended = run_embedded(
                service.store,
                evaluator,
                job,
                on_commit=committed,
                on_follow=lambda iteration: on_iteration(iteration.index),
                stop=stop,
                accepts_changes=accept_changes,
                cache=read_settings().cache,
            )
    except KeyboardInterrupt as error:
        raise _interrupted(service.job(job_id), url) from error
    if interrupted.is_set() and not ended.state.terminal:
        raise _interrupted(ended, url)
    return note_reference(service.store, ended)


def taken_up(service: JobService, job_id: str, *, accept_changes: bool) -> Job:
    """An earlier job, ready to be gone on with.

    Args:
        service: Of the database that the job is in.
        job_id: Identifier of the job.
        accept_changes: Whether it may go on although what its numbers depend on has changed.

    Returns:
        The job, queued again if it was paused or had failed.

    Raises:
        NotFound: There is no such job.
        Conflict: It was cancelled.
        ProvenanceChanged: What its numbers depend on has changed, and that is not accepted.
    """
    job = service.job(job_id)
    if job.state is JobState.CANCELLED:
        raise Conflict(f"job {job_id} was cancelled, which is for good; start a new one")
    if job.state is not JobState.SUCCEEDED and not accept_changes:
        service.check_unchanged(job)
    return service.command(job_id, Command.RESUME) if job.state in _TAKEN_UP else job


def earlier_job(service: JobService, spec: Spec, *, any_budget: bool = False) -> Job | None:
    """The job that was submitted before to do the same, under the same name.

    Args:
        service: Of the database to look in.
        spec: What the job is to do; its name should be its alone.
        any_budget: Whether it may have been given more or fewer iterations.

    Returns:
        One that was not cancelled, and whose numbers depend on what they would depend on if it were
        run now, from its first iteration on; None if there is none.
    """
    wanted = spec.resolved()
    after: str | None = None
    while True:
        page = service.jobs(search=spec.name, after=after)
        for job in page.items:
            if not job.readable or job.state is JobState.CANCELLED:
                continue
            budget = wanted.iterations
            if job.spec != wanted and not (
                any_budget and job.spec.with_budget(budget) == wanted.with_budget(budget)
            ):
                continue
            with suppress(ProvenanceChanged):
                service.check_unchanged(job)
                if len(job.provenance) <= 1:
                    return job
        if page.next is None:
            return None
        after = page.next


def _interrupted(job: Job, url: str) -> Interrupted:
    return Interrupted(JobView.from_job_and_best(job, None), url)


@contextmanager
def _ctrl_c(stop: threading.Event) -> Iterator[threading.Event]:
    """The first Ctrl-C sets `stop` and the event that is yielded; the second interrupts at once.

    Where Python's own handler is not in place, or is not this thread's to replace, Ctrl-C does
    what it does there.
    """
    pressed = threading.Event()
    mine = threading.current_thread() is threading.main_thread()
    if not mine or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
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
