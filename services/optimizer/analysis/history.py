"""Memory for the columns of committed histories"""

from __future__ import annotations

import threading
import weakref
from collections import OrderedDict
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import groupby
from operator import attrgetter
from typing import TYPE_CHECKING, Final

import numpy as np

from gaitswarm.services.optimizer.errors import Conflict, EvaluatorUnavailable
from gaitswarm.services.optimizer.jobs.iteration import Evaluation, EvaluationColumns, Iteration
from gaitswarm.services.optimizer.jobs.job import Job

if TYPE_CHECKING:
    from gaitswarm.services.optimizer.store import Store

PIECE: Final = 2000
"""Evaluations per transaction."""

_PIECE_ITERATIONS: Final = 16


def read_history(store: Store, job_id: str) -> Iterator[tuple[Iteration, tuple[Evaluation, ...]]]:
    """Yield committed iterations with their evaluations, read piece by piece.

    No transaction stays open, and iterations committed meanwhile are included.
    """
    after: int | None = None
    while True:
        page = store.iterations(job_id, after=after, limit=_PIECE_ITERATIONS)
        if page.items:
            first, last = page.items[0].index, page.items[-1].index
            evaluations = store.evaluations_between(job_id, first, last + 1)
            by_iteration = {
                k: tuple(g) for k, g in groupby(evaluations, key=attrgetter("iteration"))
            }
            for iteration in page.items:
                yield iteration, by_iteration.get(iteration.index, ())
            after = last
        if page.next is None:
            return


def read_columns(store: Store, job: Job, *, rows: int = PIECE) -> Iterator[EvaluationColumns]:
    """Yield a job's evaluations as columns, read piece by piece."""
    step = iterations_of(rows, job)
    for first in range(0, job.progress.iterations, step):
        piece = store.evaluation_columns(job.id, first, min(first + step, job.progress.iterations))
        if piece is not None:
            yield piece


def iterations_of(rows: int, job: Job) -> int:
    """Return how many iterations of a job have `rows` evaluations on average."""
    progress = job.progress
    return max(1, rows * progress.iterations // max(1, progress.evaluations))


DEFAULT_BYTES: Final = 512 << 20
"""Ten jobs of 100 000 evaluations in six scenarios."""

_LONGEST_WAIT: Final = 10.0
"""Time to wait for memory that other analyses use [s]."""


class HistoryMemory:
    """Memory budget of histories, shared by all threads and databases. Thread-safe.

    An array counts until it is garbage-collected, even after its history was dropped. The least
    recently used history is dropped first.

    longest_wait: time to wait for memory [s].
    """

    def __init__(
        self, max_bytes: int = DEFAULT_BYTES, *, longest_wait: float = _LONGEST_WAIT
    ) -> None:
        self.max_bytes = max_bytes
        self._longest_wait = longest_wait
        # Reentrant, as arrays may be finalized in a thread that holds the lock.
        self._changed = threading.Condition(threading.RLock())
        self._used = 0
        self._histories: OrderedDict[tuple[int, str], _History] = OrderedDict()

    @property
    def nbytes(self) -> int:
        """Memory in use."""
        with self._changed:
            return self._used

    @contextmanager
    def history(self, cache: HistoryCache, job: Job) -> Iterator[_History]:
        """Lock the history of a job; it becomes the most recently used."""
        key = (id(cache), job.id)
        while True:
            with self._changed:
                history = self._histories.setdefault(key, _History(_empty_columns(job)))
                self._histories.move_to_end(key)
            with history.lock:
                # It may have been dropped during the wait.
                if self._histories.get(key) is history:
                    yield history
                    return

    def forget(self, cache_id: int) -> None:
        """Drop the histories of a cache."""
        with self._changed:
            for key in [key for key in self._histories if key[0] == cache_id]:
                del self._histories[key]

    def columns(self, rows: int, like: EvaluationColumns, *, job_id: str) -> EvaluationColumns:
        """Allocate columns, dropping histories that are not being read, and waiting for others."""
        nbytes = rows * _row_bytes(like)
        with self._changed:
            fits = self._changed.wait_for(
                lambda: self._used + nbytes <= self.max_bytes or self._make_room(nbytes),
                timeout=self._longest_wait,
            )
            if not fits:
                raise EvaluatorUnavailable(
                    f"the history of job {job_id} needs {nbytes >> 20} MiB, but others use"
                    f" the {self.max_bytes >> 20} MiB for histories; try again in a few seconds"
                )
            made = _allocated(rows, like)
            for array in made.arrays:
                self._used += array.nbytes
                weakref.finalize(array, self._free, array.nbytes).atexit = False
        return made

    def _make_room(self, nbytes: int) -> bool:
        """Drop histories one by one; return whether there is room."""
        for key, history in tuple(self._histories.items()):
            if history.lock.acquire(blocking=False):
                try:
                    del self._histories[key]
                    history.clear()
                finally:
                    history.lock.release()
            if self._used + nbytes <= self.max_bytes:
                return True
        return False

    def _free(self, nbytes: int) -> None:
        with self._changed:
            self._used -= nbytes
            self._changed.notify_all()


MEMORY: Final = HistoryMemory()
"""Shared by the process."""


@dataclass(eq=False)
class _History:
    """Columns with room to grow: rows are appended in place and never rewritten."""

    room: EvaluationColumns
    rows: int = 0
    iterations: int = 0
    lock: threading.Lock = field(default_factory=threading.Lock)

    def clear(self) -> None:
        """Drop all rows. Columns that were returned remain valid."""
        self.iterations = self.rows = 0
        self.room = _allocated(0, self.room)


def _empty_columns(job: Job) -> EvaluationColumns:
    spec = job.spec
    cases = len(spec.case_names)
    return EvaluationColumns(
        iteration=np.empty(0, dtype=np.int64),
        particle=np.empty(0, dtype=np.int64),
        designs=np.empty((0, len(spec.design_space().names))),
        objectives=np.empty((0, cases, len(spec.objectives))),
        statuses=np.empty((0, cases), dtype=np.uint8),
        fitness=np.empty(0),
    )


def _allocated(rows: int, like: EvaluationColumns) -> EvaluationColumns:
    arrays = (np.empty((rows, *array.shape[1:]), dtype=array.dtype) for array in like.arrays)
    return EvaluationColumns(*arrays)


def _row_bytes(columns: EvaluationColumns) -> int:
    return sum(array.nbytes for array in _allocated(1, columns).arrays)


class HistoryCache:
    """Columns of a store's recently used jobs. Thread-safe."""

    def __init__(self, store: Store, *, memory: HistoryMemory = MEMORY) -> None:
        self._store = store
        self._memory = memory
        weakref.finalize(self, memory.forget, id(self)).atexit = False

    def columns(self, job: Job) -> EvaluationColumns:
        """Return the evaluations of a job's committed iterations, as read-only views."""
        with self._memory.history(self, job) as history:
            self._reserve(history, job, job.progress.evaluations)
            while history.iterations < job.progress.iterations:
                self._read_on(history, job)
            views = history.room.rows(slice(history.rows))
        for array in views.arrays:
            array.flags.writeable = False
        return views

    def _read_on(self, history: _History, job: Job) -> None:
        first = history.iterations
        last = min(first + iterations_of(PIECE, job), job.progress.iterations)
        piece = self._store.evaluation_columns(job.id, first, last)
        if piece is not None:
            rows = history.rows + len(piece)
            self._reserve(history, job, rows)
            for room, new in zip(history.room.arrays, piece.arrays, strict=True):
                room[history.rows : rows] = new
            history.rows = rows
        history.iterations = last

    def _reserve(self, history: _History, job: Job, rows: int) -> None:
        """Make room for `rows` rows in total. Columns that were returned remain valid.

        Without room for a larger copy, all rows are dropped and read again. Raises Conflict if they
        can never fit, and EvaluatorUnavailable if others use the memory.
        """
        present = len(history.room)
        if rows <= present:
            return
        most = self._memory.max_bytes // _row_bytes(history.room)
        if rows > most:
            raise Conflict(
                f"job {job.id} has {rows} evaluations, more than fit into the"
                f" {self._memory.max_bytes >> 20} MiB for histories; export it and analyze the file"
                " instead"
            )
        room = max(rows, present + present // 2)
        if present + room > most:
            room = rows
        if present + room > most:
            history.clear()
        larger = self._memory.columns(room, history.room, job_id=job.id)
        for new, old in zip(larger.arrays, history.room.arrays, strict=True):
            new[: history.rows] = old[: history.rows]
        history.room = larger
