"""The reading half of the memory's port: what jobs have committed, which never changes."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any, Final, Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.jobs.chain import ChainDocuments, Link
from gaitswarm.services.optimizer.jobs.columns import EvaluationColumns
from gaitswarm.services.optimizer.jobs.iteration import (
    CachedOutcome,
    Evaluation,
    Iteration,
    Reevaluation,
)
from gaitswarm.services.optimizer.jobs.job import JobState

T = TypeVar("T")

SUMMARY: Final = ("best", "mean", "median", "worst", "best_so_far", "failed")
"""Columns of an iteration that follow from its fitness."""


@dataclass(frozen=True, slots=True, eq=False)
class StoredLink:
    """A stored iteration beside its evaluations.

    Attributes:
        link: What is chained of it.
        committed: Whether it is; an iteration that is not has been asked.
        state: The optimizer's state; empty once it is cleared.
        summary: Values of the columns `SUMMARY`.
    """

    link: Link
    committed: bool
    state: Any
    summary: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Page(Generic[T]):
    """A page of a long list, told by where the one before it ended.

    Attributes:
        items: In the list's order.
        next: The `after` of the following page; None on the last.
    """

    items: tuple[T, ...]
    next: str | None


class Changes(Protocol):
    """Changes of jobs, whichever process commits them. Thread-safe, as all of `Store` is."""

    def watch(
        self, job_id: str, wake: Callable[[], None], *, poll_seconds: float
    ) -> AbstractContextManager[None]:
        """Call a function on each change of a job's state or iterations.

        What was committed before the block is entered may be told or not: who waits looks at the
        job inside the block first. Several changes may be told as one, and none as some.

        Args:
            job_id: Of the job, whether it exists or not.
            wake: Called in another thread; it must return at once.
            poll_seconds: How late a change may be told, where databases tell of none [s].

        Returns:
            The block in which the function is called.
        """

    def trouble(self) -> str | None:
        """Why changes are not told any more, for people; None if they are."""


@dataclass(frozen=True, slots=True)
class Queue:
    """How many jobs there are, and how long they wait.

    Attributes:
        jobs: Number of jobs by state, of all states.
        under_way: Number of jobs that have not ended, by state and kind.
        longest_wait: Since when the job that waits longest for a runner is queued [s]; 0 if none
            waits.
        errors: Beginnings of what the failed jobs failed with.
    """

    jobs: Mapping[JobState, int]
    under_way: Mapping[tuple[JobState, str], int]
    longest_wait: float
    errors: tuple[str, ...] = ()


class CommittedHistory(Protocol):
    """Committed iterations of jobs. Thread-safe, as all of `Store` is."""

    def iterations(
        self, job_id: str, *, after: int | None = None, limit: int = 100
    ) -> Page[Iteration]:
        """Read a page of committed iterations, in order.

        Args:
            job_id: Of the job.
            after: Only iterations with a greater index.
            limit: Most iterations on the page.

        Returns:
            The page.

        Raises:
            InvalidRequest: `limit` is less than 1.
        """

    def evaluations(self, job_id: str, iteration: int) -> tuple[Evaluation, ...]:
        """Read all designs of a committed iteration.

        Args:
            job_id: Of the job.
            iteration: Index of the iteration, from 0.

        Returns:
            The particles, in order.

        Raises:
            NotFound: There is no such job, or the iteration is not committed.
        """

    def evaluations_between(self, job_id: str, first: int, last: int) -> tuple[Evaluation, ...]:
        """Read all designs of a range of committed iterations.

        For reading a long history by pieces, each a transaction of its own; committed iterations
        never change, so the pieces fit together.

        Args:
            job_id: Of the job.
            first: Least index of an iteration.
            last: Index after the greatest.

        Returns:
            The particles, in order of iteration and particle.
        """

    def known(self, keys: Sequence[bytes]) -> dict[bytes, CachedOutcome]:
        """Find what designs came to in any job.

        Args:
            keys: As `walk_keys` gives them.

        Returns:
            Outcomes of those that are known, by key; what cannot be read is not among them.
        """

    def evaluation_columns(self, job_id: str, first: int, last: int) -> EvaluationColumns | None:
        """Read all designs of a range of committed iterations as columns, for many at once.

        Args:
            job_id: Of the job.
            first: Least index of an iteration.
            last: Index after the greatest.

        Returns:
            Rows in the order of `evaluations_between`; None if there is none.
        """

    def best(self, job_id: str) -> Evaluation | None:
        """Read the best design so far.

        Args:
            job_id: Of the job.

        Returns:
            The evaluation of least fitness in double precision, the earliest of equals; None if
            none is finite. Its `reevaluation` is there if the job searches in single.
        """

    def asked(self, job_id: str, first: int, last: int) -> tuple[NDArray[np.float64], ...]:
        """Read the positions that the search asked for in a range of committed iterations.

        Args:
            job_id: Of the job.
            first: Least index of an iteration.
            last: Index after the greatest.

        Returns:
            (n, d) of each iteration, in order.
        """

    def chain_documents(self, job_id: str) -> ChainDocuments:
        """Read what a job's chain depends on beside its iterations.

        Args:
            job_id: Of the job.

        Returns:
            The documents as they are stored, whether they can be read or not.
        """

    def links(self, job_id: str, first: int, last: int) -> tuple[StoredLink, ...]:
        """Read a range of iterations beside their evaluations, the one under way with them.

        Args:
            job_id: Of the job.
            first: Least index of an iteration.
            last: Index after the greatest.

        Returns:
            Those that there are, in order.

        Raises:
            ValueError: One is damaged.
        """

    def reevaluations_between(
        self, job_id: str, first: int, last: int
    ) -> tuple[tuple[int, Reevaluation], ...]:
        """As `reevaluations`, of a range of committed iterations.

        Args:
            job_id: Of the job.
            first: Least index of an iteration.
            last: Index after the greatest.

        Returns:
            Index of the iteration, and what its best design came to, in order.
        """

    def reevaluations(self, job_id: str) -> tuple[tuple[int, Reevaluation], ...]:
        """Read what designs came to that were evaluated anew in double precision.

        Args:
            job_id: Of the job.

        Returns:
            Index of the iteration, and what its best design came to, in order; none of a job that
            searches in double.
        """
