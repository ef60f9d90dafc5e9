"""Jobs run by the calling process, or followed while another process runs them"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING, Final

from gaitswarm.services.optimizer.errors import GaitswarmError, LeaseLost
from gaitswarm.services.optimizer.jobs.iteration import CompletedIteration, Iteration
from gaitswarm.services.optimizer.jobs.job import Claim, Job, JobState
from gaitswarm.services.optimizer.jobs.listing import Page, every
from gaitswarm.services.optimizer.run.evaluator import EvaluationStopped, Evaluator
from gaitswarm.services.optimizer.run.execution import (
    Heartbeat,
    OnCommit,
    OnRetry,
    RunContext,
    run_claim,
)
from gaitswarm.services.optimizer.run.runner import runner_name

if TYPE_CHECKING:
    from gaitswarm.services.optimizer.store import Store

EMBEDDED_LEASE_SECONDS: Final = 5.0
"""Short, because a user waits for its end when the previous process was killed."""

OnFollow = Callable[[Iteration], None]
"""Called for an iteration stored by another process."""

OnNews = Callable[[str], None]
"""Called with a message for people when another process takes or releases the job."""

_POLL_SECONDS: Final = 0.5
"""Poll interval of a job that another process holds."""

_GLANCE: Final = 0.05
"""Poll interval of the stop event meanwhile."""

_UNDER_WAY: Final = (JobState.QUEUED, JobState.RUNNING, JobState.PAUSING)

_HELD: Final = "another process runs this job, or was killed while running it; following it"

_LOST: Final = (
    f"this process lost its lease after {EMBEDDED_LEASE_SECONDS:g} s without contact, and another"
    " process has taken the job over"
)

_TAKEN: Final = f"{_LOST}; following it there"

_FREE: Final = "no other process holds the job now; continuing it here"


def run_embedded(  # noqa: C901 - one loop
    store: Store,
    evaluator: Evaluator | Callable[[], Evaluator],
    job: str | Claim,
    *,
    on_commit: OnCommit | None = None,
    on_retry: OnRetry | None = None,
    on_follow: OnFollow | None = None,
    on_news: OnNews | None = None,
    stop: threading.Event | None = None,
    accepts_changes: bool = False,
    cache: bool = False,
    followed_iterations: int | None = None,
) -> Job:
    """Run one job until it ends or is paused; return immediately if it has."""
    claim = None if isinstance(job, str) else job
    latest = store.job(job) if isinstance(job, str) else job.job
    job_id = latest.id
    runner = runner_name() if claim is None else claim.runner
    stop = stop or threading.Event()
    seen = (latest.progress.iterations if followed_iterations is None else followed_iterations) - 1
    tell, news, following = on_news or (lambda _: None), _HELD, False

    def committed(done: CompletedIteration, state: JobState) -> None:
        nonlocal seen
        seen = done.iteration
        if on_commit is not None:
            on_commit(done, state)

    def later(_: object) -> Page[Iteration]:
        return store.iterations(job_id, after=seen)

    def catch_up() -> None:
        nonlocal seen
        for iteration in every(later):
            seen = iteration.index
            if on_follow is not None:
                on_follow(iteration)

    while latest.state in _UNDER_WAY and not stop.is_set():
        claim = claim or store.claim(runner, lease_seconds=EMBEDDED_LEASE_SECONDS, job_id=job_id)
        if claim is None:
            # The job first: the iterations read next include all that it counts.
            latest = store.job(job_id)
            if latest.state in _UNDER_WAY and not following:
                tell(news)
                following = True
            catch_up()
            if latest.state in _UNDER_WAY:
                _pause(stop)
            continue
        catch_up()
        if following:
            tell(_FREE)
        try:
            opened = _opened(store, evaluator, claim) if callable(evaluator) else evaluator
        except EvaluationStopped:
            latest, claim = store.job(job_id), None
            continue
        context = RunContext(
            store,
            opened,
            lease_seconds=EMBEDDED_LEASE_SECONDS,
            on_commit=committed,
            on_retry=on_retry,
            accepts_changes=accepts_changes,
            cache=cache,
        )
        latest, claim = run_claim(claim, context, stop), None
        # A new holder has taken the job from this process.
        news, following = _TAKEN, False
    if claim is not None:
        with suppress(LeaseLost):
            store.release(claim, JobState.QUEUED)
        latest = store.job(job_id)
    if latest.state.terminal:
        if seen + 1 < latest.progress.iterations:
            # The lease was lost, and the job ended elsewhere before the next poll.
            tell(_LOST)
            catch_up()
        store.verify()
    return latest


def _opened(store: Store, evaluator: Callable[[], Evaluator], claim: Claim) -> Evaluator:
    """Open the evaluator, keeping the lease meanwhile; queue the job on failure."""
    try:
        with Heartbeat(store, claim, lease_seconds=EMBEDDED_LEASE_SECONDS):
            return evaluator()
    except BaseException:
        with suppress(GaitswarmError):
            store.release(claim, JobState.QUEUED)
        raise


def _pause(stop: threading.Event) -> None:
    # `stop.wait` would hold the lock that a signal handler takes to set `stop`.
    until = time.monotonic() + _POLL_SECONDS
    while time.monotonic() < until and not stop.is_set():
        time.sleep(_GLANCE)
