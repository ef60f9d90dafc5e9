"""A job run in this process: resumed, run to its end, returned to the queue on Ctrl-C."""

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

_RESUMED: Final = (JobState.PAUSED, JobState.PAUSING, JobState.FAILED)
"""States from which a job continues only by a command."""


@dataclass(frozen=True, slots=True)
class Workers:
    """Workers of simulations; raises InvalidRequest for an unknown kind.

    Attributes:
        evaluator: A kind of workers to open, or open workers.
        cpus: Simulations to run at once on this machine; default all processors.
        ray_address: Of a Ray cluster, as for `open_evaluator`.
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
        """Yield open workers, or a function that opens them at its first call.

        Those are closed again. `should_stop` is polled while they are opened.
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
    """Raise Conflict if a spec differs from that of the job to resume in more than the name."""
    before, wanted = stored.model_dump(), asked.resolved().model_dump()
    changed = [f for f in before if f != "name" and before[f] != wanted.get(f)]
    if changed:
        raise Conflict(
            f"job {job_id} was submitted with another {', '.join(changed)}, which cannot change;"
            " resume it without a spec and options, or start a new one"
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
        service: Of the job's database.
        url: Of the database, for messages.
        job: Identifier of the job, or the claim of this process, which submitted it.
        workers: Workers of its simulations.
        on_iteration: Called with the index of every committed iteration, also while another process
            runs the job.
        stop: When set, the job is returned to the queue.
        accept_changes: Whether it continues although its provenance has changed.

    Raises:
        Interrupted: Ctrl-C, unless the job has ended meanwhile.
        Conflict: The job was cancelled.
        ProvenanceChanged: The provenance has changed, which is not accepted.
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
    """Resume a paused or failed job; return any other as it is.

    Raises Conflict if it was cancelled, and ProvenanceChanged if that is not accepted.
    """
    job = service.job(job_id)
    if job.state is JobState.CANCELLED:
        raise Conflict(f"job {job_id} was cancelled, which is final; start a new one")
    if job.state is not JobState.SUCCEEDED and not accept_changes:
        service.check_unchanged(job)
    return service.command(job_id, Command.RESUME) if job.state in _RESUMED else job


def earlier_job(service: JobService, spec: Spec, *, any_budget: bool = False) -> Job | None:
    """Find a job of the same spec and name that was not cancelled and has today's provenance.

    any_budget: whether its number of iterations may differ.
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
    """Yield an event that the first Ctrl-C sets, as it sets `stop`; the second one interrupts.

    Nothing changes where Python's own handler is not in place, or outside the main thread.
    """
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
