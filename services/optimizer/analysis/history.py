"""Memory for the columns of committed histories"""

from __future__ import annotations

import threading
import weakref
from collections import OrderedDict
from collections.abc import Iterator
from itertools import chain
from typing import TYPE_CHECKING, Final

import numpy as np

from gaitswarm.services.optimizer.errors import Conflict, EvaluatorUnavailable
from gaitswarm.services.optimizer.jobs.iteration import EvaluationColumns
from gaitswarm.services.optimizer.jobs.job import Job

if TYPE_CHECKING:
    from gaitswarm.services.optimizer.jobs.spec import Spec
    from gaitswarm.services.optimizer.store import Store

PIECE: Final = 2000
"""Evaluations per transaction."""


def read_columns(
    store: Store, job: Job, *, start: int = 0, rows: int = PIECE
) -> Iterator[EvaluationColumns]:
    """Yield a job's evaluations from an iteration on as columns, read piece by piece."""
    step = iterations_of(rows, job)
    for first in range(start, job.progress.iterations, step):
        piece = store.evaluation_columns(job.id, first, min(first + step, job.progress.iterations))
        if piece is not None:
            yield piece


def iterations_of(rows: int, job: Job) -> int:
    """Return how many iterations of a job have `rows` evaluations on average."""
    progress = job.progress
    return max(1, rows * progress.iterations // max(1, progress.evaluations))


DEFAULT_BYTES: Final = 512 << 20
"""Some six jobs of 100 000 evaluations in six scenarios."""

_LONGEST_WAIT: Final = 10.0
"""Time to wait for memory that other analyses use [s]."""


class HistoryCache:
    """Columns of a store's recently used jobs, in limited memory. Thread-safe.

    An array counts until it is garbage-collected, even after its history was dropped. The least
    recently used history is dropped first. One history is read at a time.

    longest_wait: time to wait for memory [s].
    """

    def __init__(
        self, store: Store, *, max_bytes: int = DEFAULT_BYTES, longest_wait: float = _LONGEST_WAIT
    ) -> None:
        self._store = store
        self._max_bytes = max_bytes
        self._longest_wait = longest_wait
        self._reading = threading.Lock()
        self._histories: OrderedDict[str, EvaluationColumns] = OrderedDict()
        # Reentrant, as arrays may be finalized in a thread that holds the lock.
        self._changed = threading.Condition(threading.RLock())
        self.nbytes = 0  # in use

    def columns(self, job: Job) -> EvaluationColumns:
        """Return the evaluations of a job's committed iterations, read-only."""
        with self._reading:
            history = self._histories.pop(job.id, None) or no_rows(job.spec)
            first = int(history.iteration[-1]) + 1 if len(history) else 0
            if first < job.progress.iterations:
                nbytes = job.progress.evaluations * _row_bytes(history)
                if nbytes + len(history) * _row_bytes(history) > self._max_bytes:
                    # Without room for a larger copy, all is read again.
                    history, first = no_rows(job.spec), 0
                self._make_room(job, nbytes)
                history = self._read(job, history, first)
            self._histories[job.id] = history
            return history

    def _read(self, job: Job, before: EvaluationColumns, first: int) -> EvaluationColumns:
        """Read a job's iterations from `first` on, after those read before."""
        columns = _allocated(job.progress.evaluations, before)
        for array in columns.arrays:
            self._count(array.nbytes)
            weakref.finalize(array, self._count, -array.nbytes).atexit = False
        rows = 0
        for piece in chain([before], read_columns(self._store, job, start=first)):
            for array, new in zip(columns.arrays, piece.arrays, strict=True):
                array[rows : rows + len(piece)] = new
            rows += len(piece)
        for array in columns.arrays:
            array.flags.writeable = False
        return columns.rows(slice(rows))

    def _make_room(self, job: Job, nbytes: int) -> None:
        """Drop other histories, and wait until there is room for another."""
        if nbytes > self._max_bytes:
            raise Conflict(
                f"job {job.id} has {job.progress.evaluations} evaluations, more than fit into the"
                f" {self._max_bytes >> 20} MiB for histories; export it and analyze the file"
                " instead"
            )

        def fits() -> bool:
            while self.nbytes + nbytes > self._max_bytes and self._histories:
                self._histories.popitem(last=False)
            return self.nbytes + nbytes <= self._max_bytes

        with self._changed:
            if not self._changed.wait_for(fits, timeout=self._longest_wait):
                raise EvaluatorUnavailable(
                    f"the history of job {job.id} needs {nbytes >> 20} MiB, but others use"
                    f" the {self._max_bytes >> 20} MiB for histories; try again in a few seconds"
                )

    def _count(self, nbytes: int) -> None:
        with self._changed:
            self.nbytes += nbytes
            self._changed.notify_all()


def no_rows(spec: Spec) -> EvaluationColumns:
    cases = len(spec.case_names)
    return EvaluationColumns(
        iteration=np.empty(0, dtype=np.int64),
        particle=np.empty(0, dtype=np.int64),
        designs=np.empty((0, len(spec.design_space().names))),
        objectives=np.empty((0, cases, len(spec.columns))),
        statuses=np.empty((0, cases), dtype=np.uint8),
        fitness=np.empty(0),
    )


def _allocated(rows: int, like: EvaluationColumns) -> EvaluationColumns:
    arrays = (np.empty((rows, *array.shape[1:]), dtype=array.dtype) for array in like.arrays)
    return EvaluationColumns(*arrays)


def _row_bytes(columns: EvaluationColumns) -> int:
    return sum(array.nbytes for array in _allocated(1, columns).arrays)
