"""Parts of running a job in this process: earlier jobs, checks and Ctrl-C."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any, Final, get_args

from gaitswarm.services.optimizer.errors import Conflict, InvalidRequest, ProvenanceChanged
from gaitswarm.services.optimizer.jobs.job import Command, Job, JobState
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.services.optimizer.run.evaluator import Evaluator
from gaitswarm.services.optimizer.service import JobService

if TYPE_CHECKING:
    from gaitswarm.services.runtime import EvaluatorKind

_RESUMED: Final = (JobState.PAUSED, JobState.PAUSING, JobState.FAILED)
"""States from which a job continues only by a command."""


def check_workers(evaluator: EvaluatorKind | Evaluator, cpus: int | None) -> None:
    """Raise InvalidRequest for an unknown kind of workers, or less than one thread."""
    from gaitswarm.services.runtime import EvaluatorKind

    kinds = get_args(EvaluatorKind)
    if isinstance(evaluator, str) and evaluator not in kinds:
        raise InvalidRequest(f"{evaluator!r} is none of {', '.join(kinds)}", field="evaluator")
    if cpus is not None and cpus < 1:
        raise InvalidRequest("must be at least 1", field="cpus")


def check_same(stored: Spec, asked: Spec, job_id: str) -> None:
    """Raise Conflict if a spec differs from that of the job to resume in more than the name."""
    before, wanted = stored.model_dump(), asked.resolved().model_dump()
    changed = [f for f in before if f != "name" and before[f] != wanted.get(f)]
    if changed:
        raise Conflict(
            f"job {job_id} was submitted with another {', '.join(changed)}, which cannot change;"
            " resume it without a spec and options, or start a new one"
        )


def taken_up(service: JobService, job_id: str, *, accept_changes: bool) -> Job:
    """Resume a paused or failed job; return any other as it is.

    Raises Conflict if it was cancelled, and ProvenanceChanged if that is not accepted.
    """
    job = service.job(job_id)
    if job.state is JobState.CANCELLED:
        raise Conflict(f"job {job_id} was cancelled, which is final; start a new one")
    if job.state is not JobState.SUCCEEDED and not accept_changes:
        service.check_unchanged(job)
    return service.store.command(job_id, Command.RESUME) if job.state in _RESUMED else job


def earlier_job(service: JobService, spec: Spec, *, any_budget: bool = False) -> Job | None:
    """Find a job of the same spec and name that was not cancelled and has today's provenance.

    any_budget: whether its number of iterations may differ.
    """
    wanted = spec.resolved()
    after: str | None = None
    while True:
        page = service.store.jobs(search=spec.name, after=after)
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


@contextmanager
def ctrl_c(stop: threading.Event) -> Iterator[threading.Event]:
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
