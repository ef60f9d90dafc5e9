"""Whether a job's history is what was committed: its chain, computed again from what is stored."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import islice
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.errors import NotFound
from gaitswarm.services.optimizer.jobs.chain import (
    ChainDocuments,
    Link,
    Outcomes,
    ask_digest,
    iteration_digest,
)
from gaitswarm.services.optimizer.jobs.columns import EvaluationColumns
from gaitswarm.services.optimizer.jobs.documents import AnySpec
from gaitswarm.services.optimizer.jobs.iteration import Reevaluation, best_particle
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.store.port.base import Store
from gaitswarm.services.optimizer.store.port.reading import StoredLink
from gaitswarm.services.optimizer.store.rows.evaluation_rows import fitness_summary

_PIECE: Final = 2000
"""Evaluations read in one transaction."""

_ROUNDING: Final = 1e-12
"""Relative, of a mean that another processor has added up in another order."""

_UNREADABLE: Final = (
    ArithmeticError,
    AttributeError,
    LookupError,
    RecursionError,
    TypeError,
    ValueError,
)
"""What comes of stored documents that are not what they should be."""


class BrokenChain(Exception):
    """What is stored of an iteration is not what was committed."""

    def __init__(self, iteration: int, problem: str) -> None:
        super().__init__(f"iteration {iteration}: {problem}")
        self.iteration = iteration
        self.problem = problem


@dataclass(slots=True)
class Chain:
    """A chain that is computed again, iteration by iteration.

    Attributes:
        documents: Of the job.
        spec: Of the job, to say what is wrong; None if it cannot be read.
        iterations: How many were looked at.
        head: Digest of the last; None before the first.
        places: Index of each digest.
    """

    documents: ChainDocuments
    spec: AnySpec | None
    iterations: int = 0
    head: str | None = None
    places: dict[str, int] = field(default_factory=dict)

    def extend(self, link: Link, outcomes: Outcomes) -> None:
        """Look at the next iteration."""
        index = self.iterations
        if link.iteration != index:
            raise BrokenChain(index, "it is missing")
        if link.digest is None:
            raise BrokenChain(index, "it has no digest")
        try:
            before = self.head or self.documents.digest
            digest = iteration_digest(before, self.documents, link, outcomes)
        except _UNREADABLE as error:
            raise BrokenChain(index, f"it cannot be read: {str(error)[:200]}") from error
        if digest != link.digest:
            raise BrokenChain(index, _why(self.spec, link, outcomes))
        self.head = digest
        self.places[digest] = index
        self.iterations += 1


@dataclass(frozen=True, slots=True)
class HistoryCheck:
    """What was found of a job's history.

    Attributes:
        iterations: How many are as they were committed, from the first on.
        head: Digest of the last of them; None if there is none.
        broken_at: The first that is not as it was committed; None if all are.
        problem: What is wrong with it or with the job, for people; empty if nothing is.
        head_found_at: Where the digest that was looked for is; None if it is nowhere.
        sizes: Designs of each of these iterations.
    """

    iterations: int
    head: str | None
    broken_at: int | None = None
    problem: str = ""
    head_found_at: int | None = None
    sizes: tuple[int, ...] = ()


def check_history(store: Store, job: Job, *, head: str | None = None) -> HistoryCheck:
    """Compute a job's chain again from its rows, by pieces."""
    spec = job.spec if job.readable else None
    chain = Chain(store.chain_documents(job.id), spec)
    broken_at, problem, sizes = None, "", list[int]()
    try:
        summary = _Summary(job)
        for stored, columns, anew in _stored(store, job):
            chain.extend(stored.link, Outcomes.read(columns, anew))
            _check_ask(stored)
            summary.extend(stored, columns, anew)
            sizes.append(len(columns))
        _check_next(store, job)
        problem = summary.problem() or (
            "the digest of the job is not that of its last iteration"
            if job.progress.head != chain.head
            else ""
        )
    except BrokenChain as broken:
        broken_at, problem = broken.iteration, broken.problem
    return HistoryCheck(
        len(sizes),
        chain.head,
        broken_at,
        problem,
        None if head is None else chain.places.get(head),
        tuple(sizes),
    )


Stored = tuple[StoredLink, EvaluationColumns, Reevaluation | None]


@dataclass(frozen=True, slots=True, eq=False)
class _Piece:
    """Rows of a range of iterations, as they were found."""

    links: dict[int, StoredLink]
    columns: EvaluationColumns | None
    anew: tuple[tuple[int, Reevaluation], ...]

    @classmethod
    def read(cls, store: Store, job_id: str, first: int, last: int) -> _Piece:
        """Raises one of _UNREADABLE for rows that are damaged."""
        return cls(
            {stored.link.iteration: stored for stored in store.links(job_id, first, last)},
            store.evaluation_columns(job_id, first, last),
            store.reevaluations_between(job_id, first, last),
        )

    def iteration(self, index: int) -> Stored:
        """Raises BrokenChain."""
        stored = self.links.get(index)
        if stored is None or not stored.committed:
            raise BrokenChain(index, "it is missing")
        columns = None if self.columns is None else self.columns.of_iteration(index)
        asked = np.arange(len(stored.link.positions))
        if columns is None or not np.array_equal(columns.particle, asked):
            raise BrokenChain(index, "it has other particles than were asked for")
        anew = [one for iteration, one in self.anew if iteration == index]
        if len(anew) > 1:
            raise BrokenChain(index, "several of its designs were evaluated anew")
        return stored, columns, anew[0] if anew else None


def _stored(store: Store, job: Job) -> Iterator[Stored]:
    """Iterations that a job has committed, in order. Raises BrokenChain."""
    end = job.progress.iterations
    step = max(1, _PIECE * end // max(1, job.progress.evaluations))
    for first in range(0, end, step):
        last = min(first + step, end)
        try:
            piece = _Piece.read(store, job.id, first, last)
        except _UNREADABLE:
            yield from _one_by_one(store, job.id, first, last)
        else:
            yield from (piece.iteration(index) for index in range(first, last))


def _one_by_one(store: Store, job_id: str, first: int, last: int) -> Iterator[Stored]:
    """To find out which iteration is damaged. Raises BrokenChain."""
    for index in range(first, last):
        try:
            piece = _Piece.read(store, job_id, index, index + 1)
        except _UNREADABLE as error:
            raise BrokenChain(index, f"it cannot be read: {str(error)[:200]}") from error
        yield piece.iteration(index)


def _check_ask(stored: StoredLink) -> None:
    """The search's state, while it is kept, is that of which the chain has the digest."""
    link = stored.link
    if link.ask_digest is None or not (stored.state or not stored.committed):
        return
    try:
        digest = ask_digest(link.positions, stored.state)
    except _UNREADABLE:
        digest = ""
    if digest != link.ask_digest:
        what = "the search's state" if stored.committed else "what is asked, or the search's state,"
        raise BrokenChain(link.iteration, f"{what} is not what it was when it was asked")


def _check_next(store: Store, job: Job) -> None:
    """The iteration under way is the one that was asked."""
    index = job.progress.iterations
    try:
        found = store.links(job.id, index, index + 1)
    except _UNREADABLE as error:
        raise BrokenChain(index, f"it cannot be read: {str(error)[:200]}") from error
    for stored in found:
        _check_ask(stored)


class _Summary:
    """Columns that follow from fitness: of every iteration, and of the job."""

    def __init__(self, job: Job) -> None:
        self._progress = job.progress
        self._single = job.readable and job.spec.precision != "double"
        self._readable = job.readable
        self._best: float | None = None
        self._place: tuple[int, int] | None = None
        self._evaluations = 0

    def extend(
        self, stored: StoredLink, columns: EvaluationColumns, anew: Reevaluation | None
    ) -> None:
        """Look at the next iteration. Raises BrokenChain."""
        index = stored.link.iteration
        self._evaluations += len(columns)
        if not self._readable:
            return
        particle, best = best_particle(columns.fitness), None
        if self._single:
            particle = None if anew is None or math.isinf(anew.fitness) else anew.particle
            best = None if anew is None or particle is None else anew.fitness
        elif particle is not None:
            best = float(columns.fitness[particle])
        expected = fitness_summary(columns.fitness, best, self._best)
        for name, value in expected.items():
            if not _same(value, stored.summary[name]):
                raise BrokenChain(index, f"its {name} does not follow from its fitness")
        if best is not None and particle is not None and (self._best is None or best < self._best):
            self._place = (index, particle)
        self._best = expected["best_so_far"]

    def problem(self) -> str:
        """What the job says that does not follow from its iterations; empty if all does."""
        said = self._progress
        if said.evaluations != self._evaluations:
            return f"it has {self._evaluations} evaluations, not the {said.evaluations} it counts"
        place = None
        if said.best_iteration is not None and said.best_particle is not None:
            place = (said.best_iteration, said.best_particle)
        if self._readable and (said.best_fitness, place) != (self._best, self._place):
            return "the best design that it names is not the best of its iterations"
        return ""


def _same(expected: Any, stored: Any) -> bool:
    if expected is None or stored is None:
        return expected is stored
    return math.isclose(expected, stored, rel_tol=_ROUNDING)


def judged(spec: AnySpec, columns: EvaluationColumns) -> NDArray[np.float64]:
    """Judge stored evaluations again.

    Returns:
        (r,) fitness that follows from their raw objectives.
    """
    # What is not finite is stored as nothing, and was infinite where the walk succeeded.
    lost = ~columns.failed[:, :, np.newaxis] & np.isnan(columns.objectives)
    with np.errstate(all="ignore"):
        objectives = np.where(lost, np.inf, columns.objectives)
        return np.ascontiguousarray(spec.judge(objectives, columns.failed).fitness)


def _why(spec: AnySpec | None, link: Link, outcomes: Outcomes) -> str:
    """What of an iteration was changed, as far as it can be told from the rest of it."""
    generic = (
        "its digest is not that of what is stored: what was asked, evaluations, provenance, digest"
        + (" or the job's spec" if link.iteration == 0 else "")
        + " were changed"
    )
    if spec is None:
        return generic
    try:
        designs = spec.design_space().designs(link.positions)
        (rows,) = np.nonzero((designs != outcomes.designs).any(axis=1))
        if len(rows):
            return f"design {rows[0]} is not what was asked for"
        index = np.full(len(designs), link.iteration)
        columns = EvaluationColumns(
            index,
            np.arange(len(designs)),
            outcomes.designs,
            outcomes.objectives,
            outcomes.statuses,
            outcomes.fitness,
        )
        fitness = judged(spec, columns).view(np.uint64)
        (rows,) = np.nonzero(fitness != outcomes.fitness.view(np.uint64))
    except Exception:  # noqa: BLE001 - whatever comes of numbers that nobody has computed
        return generic
    if len(rows):
        return f"the fitness of design {rows[0]} does not follow from its objectives and statuses"
    return generic


_MOST: Final = 20
"""Findings; what comes after them is not looked at."""


def check_histories(store: Store) -> list[str]:
    """Compute the chain of every job again from its rows, by pieces, one job after the other.

    Jobs may run meanwhile: what they commit after they were read is left out.
    """
    return list(islice(_broken(store), _MOST))


def _broken(store: Store) -> Iterator[str]:
    for job_id in _ids(store):
        try:
            job = store.job(job_id)
            problem = _problem(store, job)
            if problem:
                # Rows of a job that is deleted meanwhile go piece by piece.
                store.job(job_id)
                yield f"job {job_id} is not what was committed: {problem}"
        except NotFound:
            continue


def _ids(store: Store) -> Iterator[str]:
    after: str | None = None
    while True:
        page = store.jobs(after=after)
        yield from (job.id for job in page.items)
        if page.next is None:
            return
        after = page.next


def _problem(store: Store, job: Job) -> str:
    found = check_history(store, job)
    where = "" if found.broken_at is None else f"iteration {found.broken_at}: "
    return f"{where}{found.problem}" if found.problem else ""
