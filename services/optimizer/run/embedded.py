"""Jobs run by the calling process, or followed while another process runs them"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from gaitswarm.services.optimizer.errors import GaitswarmError, LeaseLost
from gaitswarm.services.optimizer.jobs.iteration import CompletedIteration, Iteration
from gaitswarm.services.optimizer.jobs.job import Claim, Job, JobState
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


def run_embedded(
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
    """Run one job until it ends or is paused; return immediately if it has.

    While another process holds the job, follow it. Once that process releases the job or its lease
    expires, continue the job here.
    """
    claim = None if isinstance(job, str) else job
    begun = store.job(job) if isinstance(job, str) else job.job
    run = _EmbeddedRun(
        store,
        evaluator,
        begun,
        on_commit or (lambda *_: None),
        on_retry,
        on_follow or (lambda _: None),
        on_news or (lambda _: None),
        stop or threading.Event(),
        accepts_changes,
        cache,
        runner=runner_name() if claim is None else claim.runner,
        seen=(begun.progress.iterations if followed_iterations is None else followed_iterations)
        - 1,
    )
    return run.to_the_end(claim)


@dataclass(slots=True)
class _EmbeddedRun:
    """job: as last read; seen: index of the last iteration reported to a callback."""

    store: Store
    evaluator: Evaluator | Callable[[], Evaluator]
    job: Job
    on_commit: OnCommit
    on_retry: OnRetry | None
    on_follow: OnFollow
    on_news: OnNews
    stop: threading.Event
    accepts_changes: bool
    cache: bool
    runner: str
    seen: int
    news: str = field(default=_HELD, init=False)
    following: bool = field(default=False, init=False)

    def to_the_end(self, claim: Claim | None) -> Job:
        while self.job.state in _UNDER_WAY and not self.stop.is_set():
            if claim is None:
                claim = self.store.claim(
                    self.runner, lease_seconds=EMBEDDED_LEASE_SECONDS, job_id=self.job.id
                )
            if claim is None:
                self._follow()
            else:
                self._run(claim)
                claim = None
        if claim is not None:
            with suppress(LeaseLost):
                self.store.release(claim, JobState.QUEUED)
            self.job = self.store.job(self.job.id)
        if self.job.state.terminal and self.seen + 1 < self.job.progress.iterations:
            # The lease was lost, and the job ended elsewhere before the next poll.
            self.on_news(_LOST)
            self._catch_up()
        if self.job.state.terminal:
            self.store.verify()
        return self.job

    def _run(self, claim: Claim) -> None:
        self._catch_up()
        if self.following:
            self.on_news(_FREE)
        try:
            evaluator = self._opened(claim)
        except EvaluationStopped:
            self.job = self.store.job(self.job.id)
            return
        around = RunContext(
            self.store,
            evaluator,
            lease_seconds=EMBEDDED_LEASE_SECONDS,
            on_commit=self._committed,
            on_retry=self.on_retry,
            accepts_changes=self.accepts_changes,
            cache=self.cache,
        )
        self.job = run_claim(claim, around, self.stop)
        # A new holder has taken the job from this process.
        self.news, self.following = _TAKEN, False

    def _opened(self, claim: Claim) -> Evaluator:
        """Open the evaluator, keeping the lease meanwhile; queue the job on failure."""
        if not callable(self.evaluator):
            return self.evaluator
        try:
            with Heartbeat(self.store, claim, lease_seconds=EMBEDDED_LEASE_SECONDS):
                return self.evaluator()
        except BaseException:
            with suppress(GaitswarmError):
                self.store.release(claim, JobState.QUEUED)
            raise

    def _committed(self, done: CompletedIteration, state: JobState) -> None:
        self.seen = done.iteration
        self.on_commit(done, state)

    def _follow(self) -> None:
        # The job first: the iterations read next include all that it counts.
        self.job = self.store.job(self.job.id)
        if self.job.state in _UNDER_WAY and not self.following:
            self.on_news(self.news)
            self.following = True
        self._catch_up()
        if self.job.state in _UNDER_WAY:
            # `stop.wait` would hold the lock that a signal handler takes to set `stop`.
            until = time.monotonic() + _POLL_SECONDS
            while time.monotonic() < until and not self.stop.is_set():
                time.sleep(_GLANCE)

    def _catch_up(self) -> None:
        more = True
        while more:
            page = self.store.iterations(self.job.id, after=self.seen)
            for iteration in page.items:
                self.seen = iteration.index
                self.on_follow(iteration)
            more = page.next is not None
