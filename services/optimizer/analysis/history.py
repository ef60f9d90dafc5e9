"""Committed history as columns in memory, and the questions that read it"""

from __future__ import annotations

import threading
import weakref
from collections import OrderedDict
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import groupby
from operator import attrgetter
from typing import Final

import numpy as np

from gaitswarm.services.optimizer.errors import Conflict, EvaluatorUnavailable
from gaitswarm.services.optimizer.jobs.columns import EvaluationColumns
from gaitswarm.services.optimizer.jobs.iteration import Evaluation, Iteration
from gaitswarm.services.optimizer.jobs.job import Job
from gaitswarm.services.optimizer.store.port.base import Store

PIECE: Final = 2000
"""Evaluations read in one transaction."""

_PIECE_ITERATIONS: Final = 16


def read_history(
    store: Store, job_id: str, *, after: int | None
) -> Iterator[tuple[Iteration, tuple[Evaluation, ...]]]:
    """Read committed iterations with their particles, piece by piece as they are consumed."""
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
    """Read a job's evaluations as columns, piece by piece as they are consumed."""
    step = iterations_of(rows, job)
    for first in range(0, job.progress.iterations, step):
        piece = store.evaluation_columns(job.id, first, min(first + step, job.progress.iterations))
        if piece is not None:
            yield piece


def iterations_of(rows: int, job: Job) -> int:
    """Say how many iterations of a job have so many evaluations on average."""
    progress = job.progress
    return max(1, rows * progress.iterations // max(1, progress.evaluations))


DEFAULT_BYTES: Final = 512 << 20
"""Ten jobs of 100 000 evaluations in six scenarios."""

_LONGEST_WAIT: Final = 10.0
"""Seconds that a history waits for memory that other questions use."""


@dataclass(frozen=True, slots=True)
class Shape:
    """Of a row of columns.

    Attributes:
        variables: Of a design.
        cases: That it is put to.
        objectives: Of each case.
    """

    variables: int
    cases: int
    objectives: int

    @property
    def nbytes(self) -> int:
        """Memory of a row."""
        return sum(array.nbytes for array in self.empty(1).arrays)

    def empty(self, rows: int) -> EvaluationColumns:
        """Make columns."""
        return EvaluationColumns(
            iteration=np.empty(rows, dtype=np.int64),
            particle=np.empty(rows, dtype=np.int64),
            designs=np.empty((rows, self.variables)),
            objectives=np.empty((rows, self.cases, self.objectives)),
            statuses=np.empty((rows, self.cases), dtype=np.uint8),
            fitness=np.empty(rows),
        )


class HistoryMemory:
    """Memory that histories take, in all threads and for all databases together. Thread-safe.

    Every array counts until nobody refers to it: one that was dropped here, but is still computed
    with, as well. The history asked about longest ago is dropped first.

    Args:
        longest_wait: How long a history waits for memory that others use [s].
    """

    def __init__(
        self, max_bytes: int = DEFAULT_BYTES, *, longest_wait: float = _LONGEST_WAIT
    ) -> None:
        self.max_bytes = max_bytes
        self._longest_wait = longest_wait
        # Arrays may die in any thread, also in one that has the lock: it is reentrant.
        self._changed = threading.Condition(threading.RLock())
        self._used = 0
        self._histories: OrderedDict[tuple[int, str], _History] = OrderedDict()

    @property
    def nbytes(self) -> int:
        """Memory that is used now."""
        with self._changed:
            return self._used

    @contextmanager
    def history(self, cache: HistoryCache, job: Job) -> Iterator[_History]:
        """Have the history of a job alone; it is the one that was asked about last."""
        key = (id(cache), job.id)
        while True:
            with self._changed:
                if key not in self._histories:
                    self._histories[key] = _History(job, self)
                self._histories.move_to_end(key)
                history = self._histories[key]
            with history.lock:
                # It may have been dropped while it was waited for.
                if self._histories.get(key) is history:
                    yield history
                    return

    def forget(self, cache_id: int) -> None:
        """Drop the histories of a cache."""
        with self._changed:
            for key in [key for key in self._histories if key[0] == cache_id]:
                del self._histories[key]

    def columns(self, rows: int, shape: Shape, *, job_id: str) -> EvaluationColumns:
        """Make columns, as soon as there is room for them.

        Histories that nobody is reading are dropped for them, and others are waited for.
        """
        nbytes = rows * shape.nbytes
        with self._changed:
            fits = self._changed.wait_for(
                lambda: self._used + nbytes <= self.max_bytes or self._dropped(nbytes),
                timeout=self._longest_wait,
            )
            if not fits:
                raise EvaluatorUnavailable(
                    f"the history of job {job_id} needs {nbytes >> 20} MiB, but others are using"
                    f" the {self.max_bytes >> 20} MiB for histories; try again in a few seconds"
                )
            made = shape.empty(rows)
            for array in made.arrays:
                self._used += array.nbytes
                weakref.finalize(array, self._free, array.nbytes).atexit = False
        return made

    def _dropped(self, nbytes: int) -> bool:
        """Drop one history after the other; whether there is room then."""
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
"""Of this process."""


class HistoryCache:
    """Columns of a store's jobs that were asked about last. Thread-safe."""

    def __init__(self, store: Store, *, memory: HistoryMemory = MEMORY) -> None:
        """Create an empty cache."""
        self._store = store
        self._memory = memory
        weakref.finalize(self, memory.forget, id(self)).atexit = False

    def columns(self, job: Job) -> EvaluationColumns:
        """Every evaluation of a job's committed iterations."""
        with self._memory.history(self, job) as history:
            history.reserve(job.progress.evaluations)
            while history.iterations < job.progress.iterations:
                self._read_on(history, job)
            return history.columns()

    def _read_on(self, history: _History, job: Job) -> None:
        first = history.iterations
        last = min(first + iterations_of(PIECE, job), job.progress.iterations)
        found = self._store.evaluation_columns(job.id, first, last)
        if found is not None:
            history.append(found)
        history.iterations = last


class _History:
    """Columns with room to grow: rows are appended in place, and never written again."""

    def __init__(self, job: Job, memory: HistoryMemory) -> None:
        """Without any row yet."""
        spec = job.spec
        cases, objectives = len(spec.case_names), len(spec.objectives)
        self.lock = threading.Lock()
        self.iterations = 0
        self._job_id = job.id
        self._memory = memory
        self._shape = Shape(len(spec.design_space().names), cases, objectives)
        self._length = 0
        self._room = self._empty(0)

    def clear(self) -> None:
        """Forget all rows. Columns that were handed out stay as they are."""
        self.iterations = self._length = 0
        self._room = self._empty(0)

    def reserve(self, rows: int) -> None:
        """Make room for so many rows in all. Columns that were handed out stay as they are.

        Where there is no room for a larger copy beside the present one, all is read anew. Raises
        Conflict if it would never fit, and EvaluatorUnavailable if others use the memory.
        """
        if rows <= len(self._room):
            return
        most = self._memory.max_bytes // self._shape.nbytes
        if rows > most:
            raise Conflict(
                f"job {self._job_id} has {rows} evaluations, more than fit into the"
                f" {self._memory.max_bytes >> 20} MiB for this; export it and evaluate the file"
                " instead"
            )
        wanted = max(rows, len(self._room) + len(self._room) // 2)
        if len(self._room) + wanted > most:
            wanted = rows
        if len(self._room) + wanted > most:
            self.clear()
        larger = self._empty(wanted)
        for new, old in zip(larger.arrays, self._room.arrays, strict=True):
            new[: self._length] = old[: self._length]
        self._room = larger

    def append(self, rows: EvaluationColumns) -> None:
        """Take over rows, for which there may be room already."""
        needed = self._length + len(rows)
        self.reserve(needed)
        for room, new in zip(self._room.arrays, rows.arrays, strict=True):
            room[self._length : needed] = new
        self._length = needed

    def columns(self) -> EvaluationColumns:
        """What has been read so far, as views that cannot be written to."""
        views = self._room.rows(slice(self._length))
        for array in views.arrays:
            array.flags.writeable = False
        return views

    def _empty(self, rows: int) -> EvaluationColumns:
        return self._memory.columns(rows, self._shape, job_id=self._job_id)
