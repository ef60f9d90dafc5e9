"""Verification of histories: the digest chain, recomputed from what is stored"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.analysis.history import PIECE, iterations_of
from gaitswarm.services.optimizer.errors import NotFound
from gaitswarm.services.optimizer.jobs.chain import (
    ChainDocuments,
    Link,
    ask_digest,
    iteration_digest,
)
from gaitswarm.services.optimizer.jobs.documents import AnySpec
from gaitswarm.services.optimizer.jobs.iteration import (
    EvaluationColumns,
    Reevaluation,
    best_particle,
    fitness_summary,
)
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.jobs.listing import every

if TYPE_CHECKING:
    from gaitswarm.services.optimizer.store import Store

_ROUNDING: Final = 1e-12
"""Relative tolerance for means computed in another order on another processor."""

_UNREADABLE: Final = (
    ArithmeticError,
    AttributeError,
    LookupError,
    RecursionError,
    TypeError,
    ValueError,
)
"""Errors raised by damaged documents."""


class BrokenChain(Exception):
    """A stored iteration differs from what was committed."""

    def __init__(self, iteration: int, problem: str) -> None:
        super().__init__(f"iteration {iteration}: {problem}")
        self.iteration, self.problem = iteration, problem


@dataclass(slots=True)
class Chain:
    """A chain being recomputed, iteration by iteration."""

    documents: ChainDocuments
    spec: AnySpec | None  # for explanations; None if unreadable
    iterations: int = 0  # number verified
    head: str | None = None  # digest of the last; None before the first
    places: dict[str, int] = field(default_factory=dict)  # index of each digest

    def extend(
        self, link: Link, columns: EvaluationColumns, reevaluation: Reevaluation | None
    ) -> None:
        """Verify the next iteration. Raises BrokenChain."""
        index = self.iterations
        if link.iteration != index:
            raise BrokenChain(index, "it is missing")
        if link.digest is None:
            raise BrokenChain(index, "it has no digest")
        try:
            before = self.head or self.documents.digest
            digest = iteration_digest(before, self.documents, link, columns, reevaluation)
        except _UNREADABLE as error:
            raise BrokenChain(index, f"it cannot be read: {str(error)[:200]}") from error
        if digest != link.digest:
            raise BrokenChain(index, _why(self.spec, link, columns))
        self.head = digest
        self.places[digest] = index
        self.iterations += 1


@dataclass(frozen=True, slots=True)
class HistoryCheck:
    """Result of verifying a job's history."""

    iterations: int  # number of intact iterations, from the first
    head: str | None  # digest of the last of them; None if there is none
    broken_at: int | None = None  # first damaged iteration; None if all are intact
    problem: str = ""  # description of the damage, for people; empty if intact
    head_found_at: int | None = None  # iteration with the requested digest; None if there is none
    sizes: tuple[int, ...] = ()  # number of designs of each intact iteration


def check_history(store: Store, job: Job, *, head: str | None = None) -> HistoryCheck:
    """Verify a job's chain from its rows, piece by piece."""
    spec = job.spec if job.readable else None
    chain = Chain(store.chain_documents(job.id), spec)
    broken_at, problem, sizes = None, "", list[int]()
    try:
        summary, end, step = _Summary(job), job.progress.iterations, iterations_of(PIECE, job)
        for first in range(0, end, step):
            stored = _between(store, job.id, first, min(first + step, end))
            for link, columns, reevaluation in stored:
                chain.extend(link, columns, reevaluation)
                _check_ask(link)
                summary.extend(link, columns, reevaluation)
                sizes.append(len(columns))
        _check_next(store, job)
        problem = summary.problem() or (
            "the digest of the job is not that of its last iteration"
            if job.progress.head != chain.head
            else ""
        )
    except BrokenChain as broken:
        broken_at, problem = broken.iteration, broken.problem
    place = chain.places.get(head or "")
    return HistoryCheck(len(sizes), chain.head, broken_at, problem, place, tuple(sizes))


Stored = tuple[Link, EvaluationColumns, Reevaluation | None]


def _between(store: Store, job_id: str, first: int, last: int) -> Iterator[Stored]:
    """Yield a job's committed iterations, in order. Raises BrokenChain."""
    try:
        links = {link.iteration: link for link in store.links(job_id, first, last)}
        columns = store.evaluation_columns(job_id, first, last)
        reevaluations = store.reevaluations(job_id, first, last)
    except _UNREADABLE as error:
        if last == first + 1:
            raise BrokenChain(first, f"it cannot be read: {str(error)[:200]}") from error
        # Locate the damage.
        for index in range(first, last):
            yield from _between(store, job_id, index, index + 1)
        return
    for index in range(first, last):
        link = links.get(index)
        if link is None or not link.committed:
            raise BrokenChain(index, "it is missing")
        designs = None if columns is None else columns.of_iteration(index)
        asked = np.arange(len(link.positions))
        if designs is None or not np.array_equal(designs.particle, asked):
            raise BrokenChain(index, "its particles differ from those asked for")
        again = [entry for iteration, entry in reevaluations if iteration == index]
        if len(again) > 1:
            raise BrokenChain(index, "several of its designs were reevaluated")
        yield link, designs, again[0] if again else None


def _check_ask(link: Link) -> None:
    """Check the search's state, while it is stored, against its digest."""
    if link.ask_digest is None or not (link.state or not link.committed):
        return
    try:
        digest = ask_digest(link.positions, link.state)
    except _UNREADABLE:
        digest = ""
    if digest != link.ask_digest:
        what = "the search's state" if link.committed else "the ask or the search's state"
        raise BrokenChain(link.iteration, f"{what} was changed after the ask")


def _check_next(store: Store, job: Job) -> None:
    index = job.progress.iterations
    try:
        links = store.links(job.id, index, index + 1)
    except _UNREADABLE as error:
        raise BrokenChain(index, f"it cannot be read: {str(error)[:200]}") from error
    for link in links:
        _check_ask(link)


class _Summary:
    """Summary values derived from fitness, of every iteration and of the job."""

    def __init__(self, job: Job) -> None:
        self._job = job
        self._progress = job.progress
        self._single = job.readable and job.spec.precision != "double"
        self._readable = job.readable
        self._best: float | None = None
        self._place: tuple[int | None, int | None] = (None, None)
        self._evaluations = self._infeasible = 0
        self._least_violation: float | None = None

    def extend(
        self, link: Link, columns: EvaluationColumns, reevaluation: Reevaluation | None
    ) -> None:
        """Verify the next iteration. Raises BrokenChain."""
        index = link.iteration
        self._evaluations += len(columns)
        if not self._readable:
            return
        particle, best = best_particle(columns.fitness), None
        if self._single:
            particle = None
            if reevaluation is not None and not math.isinf(reevaluation.fitness):
                particle, best = reevaluation.particle, reevaluation.fitness
        elif particle is not None:
            best = float(columns.fitness[particle])
        violations = self._job.spec.violations(columns.objectives, columns.failed)
        expected = fitness_summary(columns.fitness, best, self._best, violations)
        for name, value in expected.items():
            if not _same(value, link.summary[name]):
                raise BrokenChain(index, f"its {name} does not follow from its fitness")
        if best is not None and particle is not None and (self._best is None or best < self._best):
            self._place = (index, particle)
        self._best = expected["best_so_far"]
        self._infeasible += expected["infeasible"]
        known = [v for v in (self._least_violation, expected["least_violation"]) if v is not None]
        self._least_violation = min(known, default=None)

    def problem(self) -> str:
        """Describe a summary value that does not follow from the iterations; empty if all do."""
        progress = self._progress
        if progress.evaluations != self._evaluations:
            return f"it has {self._evaluations} evaluations, not {progress.evaluations} as recorded"
        place = (progress.best_iteration, progress.best_particle)
        if self._readable and (progress.best_fitness, place) != (self._best, self._place):
            return "its recorded best design is not the best of its iterations"
        if self._readable and (
            progress.infeasible != self._infeasible
            or not _same(self._least_violation, progress.least_violation)
        ):
            return "its recorded infeasible designs are not those of its iterations"
        return ""


def _same(expected: Any, stored: Any) -> bool:
    if expected is None or stored is None:
        return expected is stored
    return math.isclose(expected, stored, rel_tol=_ROUNDING)


def judged(spec: AnySpec, columns: EvaluationColumns) -> NDArray[np.float64]:
    """Return the (r,) fitness that follows from stored objectives."""
    # Non-finite values are stored as NaN; they were infinite if the simulation succeeded.
    lost = ~columns.failed[:, :, np.newaxis] & np.isnan(columns.objectives)
    with np.errstate(all="ignore"):
        objectives = np.where(lost, np.inf, columns.objectives)
        return np.ascontiguousarray(spec.judge(objectives, columns.failed).fitness)


def _why(spec: AnySpec | None, link: Link, columns: EvaluationColumns) -> str:
    """Describe what was changed in an iteration, as far as it follows from the rest."""
    generic = (
        "its digest does not match what is stored: the ask, evaluations, provenance or digest"
        + (" or the job's spec" if link.iteration == 0 else "")
        + " were changed"
    )
    if spec is None:
        return generic
    # Damaged values may raise any error.
    with suppress(Exception):
        designs = spec.design_space().designs(link.positions)
        for row in np.flatnonzero((designs != columns.designs).any(axis=1)):
            return f"design {row} differs from the ask"
        fitness = judged(spec, columns).view(np.uint64)
        for row in np.flatnonzero(fitness != columns.fitness.view(np.uint64)):
            return f"the fitness of design {row} does not follow from its objectives and statuses"
    return generic


_MOST: Final = 20
"""Limit on the number of findings."""


def check_histories(store: Store) -> list[str]:
    """Verify the chain of every job from its rows, one job after the other."""
    findings: list[str] = []
    for job_id in (job.id for job in every(lambda after: store.jobs(after=after))):
        with suppress(NotFound):
            check = check_history(store, store.job(job_id))
            if check.problem:
                # The rows of a job deleted meanwhile disappear piece by piece.
                store.job(job_id)
                where = "" if check.broken_at is None else f"iteration {check.broken_at}: "
                findings.append(
                    f"job {job_id} differs from what was committed: {where}{check.problem}"
                )
                if len(findings) == _MOST:
                    break
    return findings
