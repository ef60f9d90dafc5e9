"""Whole histories of jobs: at once as columns that are held in memory, or piece by piece.

Committed iterations never change: what was read once is kept, and only what was committed since is
read. The store is asked by pieces, each a short transaction.
"""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import groupby
from operator import attrgetter
from typing import Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from services.optimizer.errors import Conflict
from services.optimizer.jobs.columns import EvaluationColumns
from services.optimizer.jobs.iteration import Evaluation, Iteration
from services.optimizer.jobs.job import Job
from services.optimizer.store.base import Store

Scalar = TypeVar("Scalar", bound=np.generic)

DEFAULT_BYTES: Final = 512 << 20
"""Ten jobs of 100 000 evaluations in six scenarios."""

PIECE: Final = 2000
"""Evaluations read in one transaction."""

_PIECE_ITERATIONS: Final = 16


def read_history(
    store: Store, job_id: str, *, after: int | None
) -> Iterator[tuple[Iteration, tuple[Evaluation, ...]]]:
    """Read committed iterations with their particles, piece by piece as they are consumed.

    Args:
        store: where they are.
        job_id: id of the job.
        after: only iterations with a greater index; None for all.

    Yields:
        An iteration and its particles, in order.

    Raises:
        NotFound: no job of that id; at the first item.
    """
    while True:
        page = store.iterations(job_id, after=after, limit=_PIECE_ITERATIONS)
        if page.items:
            first, last = page.items[0].index, page.items[-1].index
            found = store.evaluations_between(job_id, first, last + 1)
            by_iteration = {k: tuple(g) for k, g in groupby(found, key=attrgetter("iteration"))}
            for iteration in page.items:
                yield iteration, by_iteration.get(iteration.index, ())
            after = last
        if page.next is None:
            return


def read_columns(store: Store, job: Job, *, rows: int) -> Iterator[EvaluationColumns]:
    """Read a job's evaluations as columns, piece by piece as they are consumed.

    Args:
        store: where they are.
        job: as it was read; iterations committed later are left out.
        rows: evaluations in a piece on average, but one iteration at least.

    Yields:
        Whole iterations, in order.
    """
    step = _iterations_of(rows, job)
    for first in range(0, job.progress.iterations, step):
        piece = store.evaluation_columns(job.id, first, min(first + step, job.progress.iterations))
        if piece is not None:
            yield piece


def _iterations_of(rows: int, job: Job) -> int:
    """How many iterations of a job have so many evaluations on average; one at least."""
    progress = job.progress
    return max(1, rows * progress.iterations // max(1, progress.evaluations))


class HistoryCache:
    """Columns of the jobs that were asked about last. Thread-safe."""

    def __init__(self, store: Store, *, max_bytes: int = DEFAULT_BYTES) -> None:
        """Create an empty cache.

        Args:
            store: where histories are read.
            max_bytes: memory of all jobs together; the job asked about longest ago is dropped
                first.
        """
        self._store = store
        self._max_bytes = max_bytes
        self._lock = threading.Lock()
        self._histories: OrderedDict[str, _History] = OrderedDict()

    def columns(self, job: Job) -> EvaluationColumns:
        """Every evaluation of a job's committed iterations.

        Args:
            job: as it was read.

        Returns:
            Its columns as of its progress or later, which cannot be written to and stay as they
            are when more are read.

        Raises:
            Conflict: the job is too large to be held.
        """
        history = self._history(job)
        with history.lock:
            self._reserve(history, job)
            while history.iterations < job.progress.iterations:
                self._read_on(history, job)
            columns = history.columns()
        self._drop_others(job.id)
        return columns

    @property
    def nbytes(self) -> int:
        """Memory that is held now."""
        with self._lock:
            return sum(history.nbytes for history in self._histories.values())

    def _history(self, job: Job) -> _History:
        with self._lock:
            if job.id not in self._histories:
                self._histories[job.id] = _History.of(job)
            self._histories.move_to_end(job.id)
            return self._histories[job.id]

    def _read_on(self, history: _History, job: Job) -> None:
        first = history.iterations
        last = min(first + _iterations_of(PIECE, job), job.progress.iterations)
        found = self._store.evaluation_columns(job.id, first, last)
        if found is not None:
            history.append(found)
        history.iterations = last

    def _reserve(self, history: _History, job: Job) -> None:
        rows = job.progress.evaluations
        if rows * history.bytes_per_row > self._max_bytes:
            raise Conflict(
                f"job {job.id} has {rows} evaluations, more than fit into the"
                f" {self._max_bytes >> 20} MiB for this; export it and evaluate the file instead"
            )
        history.reserve(rows)

    def _drop_others(self, job_id: str) -> None:
        with self._lock:
            held = sum(history.nbytes for history in self._histories.values())
            for other in tuple(self._histories):
                if held <= self._max_bytes:
                    return
                if other != job_id:
                    held -= self._histories.pop(other).nbytes


@dataclass(slots=True, eq=False)
class _History:
    """Columns with room to grow: rows are appended in place, and never written again."""

    room: EvaluationColumns
    length: int = 0
    iterations: int = 0
    lock: threading.Lock = field(default_factory=threading.Lock)

    @classmethod
    def of(cls, job: Job) -> _History:
        """Without any row yet."""
        spec = job.spec
        cases, objectives = len(spec.case_names), len(spec.objectives)
        return cls(
            EvaluationColumns(
                iteration=np.empty(0, dtype=np.int64),
                particle=np.empty(0, dtype=np.int64),
                designs=np.empty((0, len(spec.design_space().names))),
                objectives=np.empty((0, cases, objectives)),
                statuses=np.empty((0, cases), dtype=np.uint8),
                fitness=np.empty(0),
            )
        )

    @property
    def nbytes(self) -> int:
        """Memory of the columns, free room included."""
        return sum(array.nbytes for array in self.room.arrays)

    @property
    def bytes_per_row(self) -> int:
        """Memory of one evaluation."""
        return sum(
            array.itemsize * int(np.prod(array.shape[1:], dtype=np.int64))
            for array in self.room.arrays
        )

    def reserve(self, rows: int) -> None:
        """Make room for so many rows in all. Columns that were handed out stay as they are."""
        if rows <= len(self.room):
            return
        self.room = EvaluationColumns(
            self._larger(self.room.iteration, rows),
            self._larger(self.room.particle, rows),
            self._larger(self.room.designs, rows),
            self._larger(self.room.objectives, rows),
            self._larger(self.room.statuses, rows),
            self._larger(self.room.fitness, rows),
        )

    def append(self, rows: EvaluationColumns) -> None:
        """Take over rows, for which there may be room already."""
        needed = self.length + len(rows)
        self.reserve(needed)
        for room, new in zip(self.room.arrays, rows.arrays, strict=True):
            room[self.length : needed] = new
        self.length = needed

    def columns(self) -> EvaluationColumns:
        """What has been read so far, as views that cannot be written to."""
        views = self.room.rows(slice(self.length))
        for array in views.arrays:
            array.flags.writeable = False
        return views

    def _larger(self, array: NDArray[Scalar], needed: int) -> NDArray[Scalar]:
        """A copy with room for that many rows, and for half as many again as there was."""
        rows = max(needed, len(array) + len(array) // 2)
        larger = np.empty((rows, *array.shape[1:]), dtype=array.dtype)
        larger[: self.length] = array[: self.length]
        return larger
