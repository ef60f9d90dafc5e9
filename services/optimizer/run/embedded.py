"""One job for the process that asked for it: run here, or followed where another one runs it."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Final

from gaitswarm.services.optimizer.errors import GaitswarmError, LeaseLost
from gaitswarm.services.optimizer.jobs.iteration import CompletedIteration, Iteration
from gaitswarm.services.optimizer.jobs.job import Claim, Job, JobState
from gaitswarm.services.optimizer.run.evaluator import EvaluationStopped, Evaluator
from gaitswarm.services.optimizer.run.execution import OnCommit, OnRetry, Surroundings, run_claim
from gaitswarm.services.optimizer.run.heartbeat import Heartbeat
from gaitswarm.services.optimizer.run.runner import runner_name
from gaitswarm.services.optimizer.store.port.base import Store

EMBEDDED_LEASE_SECONDS: Final = 5.0
"""Short, because a person waits for it when the process before was killed."""

OnFollow = Callable[[Iteration], None]
"""Called for an iteration that another process has stored."""

OnNews = Callable[[str], None]
"""Called with a sentence for people when the job changes hands."""

_POLL_SECONDS: Final = 0.5
"""Between looks at a job that another process holds."""

_GLANCE: Final = 0.05
"""Between looks, meanwhile, whether it is to stop."""

_UNDER_WAY: Final = (JobState.QUEUED, JobState.RUNNING, JobState.PAUSING)

_HELD: Final = "another process runs this job, or was killed while it did; following it"

_LOST: Final = (
    f"this process was not heard of for {EMBEDDED_LEASE_SECONDS:g} s, and another one has taken the"
    " job over"
)

_TAKEN: Final = f"{_LOST}; following it there"

_FREE: Final = "no other process holds the job any more; it goes on here"


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
    known: int | None = None,
) -> Job:
    """Run one job here and now, until it ends or is paused; nothing is done if it has or is.

    While another process holds the job, it is followed instead. As soon as that one gives it back,
    or is not heard of for the time of its lease, the job goes on here.
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
        seen=(begun.progress.iterations if known is None else known) - 1,
    )
    return run.to_the_end(claim)


@dataclass(slots=True)
class _EmbeddedRun:
    """job: as it was last read; seen: index of the last iteration that a callback was told of."""

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
            # It was lost and ended elsewhere before anybody here looked.
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
        around = Surroundings(
            self.store,
            evaluator,
            lease_seconds=EMBEDDED_LEASE_SECONDS,
            on_commit=self._committed,
            on_retry=self.on_retry,
            accepts_changes=self.accepts_changes,
            cache=self.cache,
        )
        self.job = run_claim(claim, around, self.stop)
        # Whoever has it now has taken it from here.
        self.news, self.following = _TAKEN, False

    def _opened(self, claim: Claim) -> Evaluator:
        """The evaluator. The job is kept while it is opened, and queued if it cannot be."""
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
        # The job first: whatever it counts as committed is then among the iterations.
        self.job = self.store.job(self.job.id)
        if self.job.state in _UNDER_WAY and not self.following:
            self.on_news(self.news)
            self.following = True
        self._catch_up()
        if self.job.state in _UNDER_WAY:
            # `stop.wait` would hold the lock that a signal's handler takes when it sets `stop`.
            until = time.monotonic() + _POLL_SECONDS
            while time.monotonic() < until and not self.stop.is_set():
                time.sleep(_GLANCE)

    def _catch_up(self) -> None:
        """Tell of the iterations that another process has stored meanwhile."""
        more = True
        while more:
            page = self.store.iterations(self.job.id, after=self.seen)
            for iteration in page.items:
                self.seen = iteration.index
                self.on_follow(iteration)
            more = page.next is not None
