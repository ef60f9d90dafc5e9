"""The port of the memory: jobs, iterations, evaluations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

from services.optimizer.jobs.columns import EvaluationColumns
from services.optimizer.jobs.job import (
    Ask,
    Claim,
    Command,
    CompletedIteration,
    Evaluation,
    Iteration,
    Job,
    JobOrder,
    JobState,
)
from services.optimizer.jobs.provenance import JobProvenance
from services.optimizer.jobs.spec import Spec
from sim.identification.recorded_walk import RecordedWalk, Recordings

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Page(Generic[T]):
    """A keyset page. `next` is the `after` of the following page, None on the last."""

    items: tuple[T, ...]
    next: str | None


class Store(Protocol):
    """Thread-safe. Every method is one transaction: it happens wholly or not at all.

    Methods that take an id raise NotFound for an unknown one. Methods that take a claim raise
    LeaseLost, and change nothing, if the claim's token is no longer the job's.
    """

    def create_job(
        self,
        spec: Spec,
        *,
        provenance: JobProvenance | None = None,
        idempotency_key: str | None = None,
        request: Any = None,
    ) -> tuple[Job, bool]:
        """Insert a queued job of the resolved spec, or find the one that the same key made before.

        Args:
            spec: What the job is to do.
            provenance: What its numbers are to depend on; None leaves that to its first claim.
            idempotency_key: Of the user; a request that is repeated with it makes no second job,
                even if presets or defaults have changed in between.
            request: The JSON document that asked for the job, as it was sent. None: the fields
                that were given to the spec.

        Returns:
            The job, and whether it is new.

        Raises:
            InvalidRequest: The key is empty, too long or not printable.
            IdempotencyConflict: The key was used for a request that is neither this one nor
                resolves to the same spec.
        """

    def create_claimed_job(
        self,
        spec: Spec,
        runner: str,
        *,
        lease_seconds: float,
        provenance: JobProvenance | None = None,
    ) -> Claim:
        """Insert a job of the resolved spec that is running from the start, held by a runner.

        It is never queued, so no other runner can have it before this one's lease runs out.

        Args:
            spec: What the job is to do.
            runner: Who holds it.
            lease_seconds: For how long, unless the claim is renewed [s].
            provenance: What its numbers are to depend on; None leaves that to whoever runs it.

        Returns:
            The claim, as `claim` would have given it for a new job.
        """

    def job(self, job_id: str) -> Job:
        """One job with its progress."""

    def jobs(
        self,
        *,
        state: JobState | None = None,
        search: str = "",
        order: JobOrder = JobOrder.CREATED,
        after: str | None = None,
        limit: int = 50,
    ) -> Page[Job]:
        """Jobs in a state whose name or id contains a text, whatever its case.

        Raises InvalidRequest (field `after`) for a cursor that is none of this order.
        """

    def command(self, job_id: str, command: Command, *, accept_changes: bool = False) -> Job:
        """Apply `commanded`; Conflict if the state does not allow it.

        accept_changes: of a job that is queued again, whether it may go on although what its
            numbers depend on has changed; until it is claimed.

        Cancelling clears the lease, so a runner's next write is refused.
        """

    def extend(self, job_id: str, iterations: int) -> Job:
        """Give a job another budget, of `iterations` in all; see `extended` for what it may be.

        What is committed stays, as does the iteration under way; what is asked after it is asked
        under the new budget. A job that has succeeded is queued again.
        """

    def add_recording(self, walk: RecordedWalk) -> str:
        """Keep a recorded walk; its id, which depends on its content alone."""

    def recordings(self, ids: Sequence[str]) -> Recordings:
        """Recorded walks by id. Raises NotFound for the first that is not there."""

    def claim(
        self, runner: str, *, lease_seconds: float, job_id: str | None = None
    ) -> Claim | None:
        """Take the oldest job that is queued, or running/pausing with a lease that ran out.

        job_id: only that one. A pausing job without a live lease becomes paused and is not claimed.
        The claimed job is running, its token one higher than any before. The claim brings the
        recordings that the job needs.
        """

    def renew(self, claim: Claim, *, lease_seconds: float) -> JobState:
        """Heartbeat: extend the lease; returns the state, so that pausing is seen."""

    def record_provenance(self, claim: Claim, provenance: JobProvenance) -> None:
        """Append what the job's next iterations depend on, unless that is as before.

        Changes that its user has accepted are accepted no longer: they are recorded.
        """

    def begin(self, claim: Claim, ask: Ask) -> None:
        """Store the ask that a job begins with, or goes on with after an extension.

        Repeated, it keeps the ask that is there.

        Args:
            claim: Of whoever runs the job.
            ask: What is to be evaluated next.

        Raises:
            BudgetChanged: The job has another budget than the claim's, under which the ask would
                be another; nothing is stored.
            Conflict: The ask is not of the job's next iteration.
            LeaseLost: The claim is no longer the job's.
        """

    def commit(self, claim: Claim, done: CompletedIteration, following: Ask | None) -> JobState:
        """Store a completed iteration and the next ask, in one transaction.

        following: None at the end of the budget; the job is then succeeded. A pausing job becomes
        paused and gives up its lease. Returns the state after. Unique on (job, iteration): a
        commit whose answer was lost may be repeated, and changes nothing the second time. Raises
        Conflict for an iteration that was not asked, and BudgetChanged, and stores nothing, if the
        job has another budget than the claim's: `following` would be another ask.
        """

    def release(self, claim: Claim, state: JobState, *, error: str | None = None) -> None:
        """Give up the lease: `failed` with its reason, `paused`, or `queued` to be claimed again.

        `queued` means paused for a job that is pausing, so a runner that stops need not look first.
        """

    def iterations(
        self, job_id: str, *, after: int | None = None, limit: int = 100
    ) -> Page[Iteration]:
        """Committed iterations in order, those with index > after."""

    def evaluations(self, job_id: str, iteration: int) -> tuple[Evaluation, ...]:
        """All particles of a committed iteration, in order; NotFound if it is not committed."""

    def evaluations_between(self, job_id: str, first: int, last: int) -> tuple[Evaluation, ...]:
        """All particles of the committed iterations first <= index < last, in order.

        For reading a long history by pieces, each a transaction of its own; committed iterations
        never change, so the pieces fit together.
        """

    def evaluation_columns(self, job_id: str, first: int, last: int) -> EvaluationColumns | None:
        """As `evaluations_between`, as columns, for many at once; None if there is none."""

    def best(self, job_id: str) -> Evaluation | None:
        """The evaluation of least fitness, the earliest of equals; None if none is finite."""

    def ping(self) -> None:
        """Raise StoreUnavailable unless the database answers and has this version's schema."""

    def verify(self) -> None:
        """Read anew what is stored, for a few seconds at most, before it is said to be safe.

        Raises:
            StoreUnavailable: It is damaged or gone, though earlier reads and writes succeeded.
        """

    def close(self) -> None:
        """Release connections. Idempotent."""
