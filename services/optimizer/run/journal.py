"""Evaluation without what is stored: outcomes of other jobs, and the journal of a long iteration"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.services.optimizer.errors import StoreUnavailable
from gaitswarm.services.optimizer.jobs.iteration import JournalEntry
from gaitswarm.services.optimizer.jobs.job import Claim
from gaitswarm.services.optimizer.run.evaluator import EvaluationRequest, Evaluator
from gaitswarm.sim.outcome import Outcome, Status

if TYPE_CHECKING:
    from gaitswarm.services.optimizer.store import Store

JOURNAL_SECONDS: Final = 10.0
"""Iterations that take longer, as the previous one did or as this one does, are journaled [s]."""

_log = logging.getLogger(__name__)


def evaluate_uncached(
    journal: Journal,
    store: Store | None,
    request: EvaluationRequest,
    keys: Sequence[bytes],
    should_stop: Callable[[], bool],
) -> tuple[tuple[Outcome, ...], tuple[bytes | None, ...]]:
    """Evaluate a request without its cached and duplicate designs."""
    if store is None or not keys:
        return journal.evaluate(request, keys, should_stop), tuple(keys)
    first = {key: index for index, key in reversed(list(enumerate(keys)))}
    cached = _cached(store, request, tuple(first))
    chosen = sorted(first.values())
    part = replace(request, designs=request.designs[chosen])
    found = journal.evaluate(part, [keys[index] for index in chosen], should_stop, cached)
    place = {keys[index]: row for row, index in enumerate(chosen)}
    rows = [place[key] for key in keys]
    outcomes = tuple(Outcome(each.objectives[rows], each.statuses[rows]) for each in found)
    new = [key not in cached and first[key] == index for index, key in enumerate(keys)]
    return outcomes, tuple(key if is_new else None for key, is_new in zip(keys, new, strict=True))


def _cached(
    store: Store, request: EvaluationRequest, keys: tuple[bytes, ...]
) -> dict[bytes, Outcome]:
    try:
        stored = store.known(keys)
    except StoreUnavailable as error:
        _log.warning("job %s: simulating all designs without the cache: %s", request.job_id, error)
        return {}
    shapes = {(len(request.cases), len(case.objectives)) for case in request.cases}
    return {
        key: outcome
        for key, outcome in stored.items()
        # Infinities are stored as NaN.
        if outcome.objectives.shape in shapes
        and np.isfinite(outcome.objectives[outcome.statuses == Status.OK]).all()
    }


class Journal:
    """Evaluates the requests of a claimed job, without what an earlier run of it has stored."""

    def __init__(
        self,
        claim: Claim,
        store: Store,
        evaluator: Evaluator,
        *,
        after_seconds: float = JOURNAL_SECONDS,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._claim = claim
        self._store = store
        self._evaluator = evaluator
        self._after_seconds = after_seconds
        self._clock = clock
        self._known: dict[tuple[int, bytes], tuple[NDArray[np.float64], int]] = {}
        for entry in claim.journal:
            self._know(entry)
        self._finished: list[JournalEntry] = []
        self._is_stored = bool(claim.journal)
        self._begun: float | None = None
        self._was_long = False
        self._writing = threading.Lock()

    def evaluate(
        self,
        request: EvaluationRequest,
        keys: Sequence[bytes],
        should_stop: Callable[[], bool],
        cached: Mapping[bytes, Outcome] = MappingProxyType({}),
    ) -> tuple[Outcome, ...]:
        """Evaluate as `Evaluator.evaluate`; designs are identified by their keys."""
        if not keys:
            return self._evaluator.evaluate(request, should_stop)
        if self._begun is None:
            self._begun = self._clock()
        numbers, count = range(len(request.cases)), len(keys)
        known = self._known | {
            (number, key): (outcome.objectives[number], int(outcome.statuses[number]))
            for key, outcome in cached.items()
            for number in numbers
        }
        if not known:
            return self._run(request, numbers, keys, should_stop)
        missing = np.array([[(number, key) not in known for number in numbers] for key in keys])
        outcomes = [
            Outcome(np.empty((count, len(case.objectives))), np.empty(count, dtype=np.uint8))
            for case in request.cases
        ]
        for row, number in np.argwhere(~missing).tolist():
            outcome = outcomes[number]
            outcome.objectives[row], outcome.statuses[row] = known[number, keys[row]]
        # Designs that are missing in the same cases make up a request.
        for pattern in np.unique(missing[missing.any(axis=1)], axis=0):
            rows = np.flatnonzero((missing == pattern).all(axis=1)).tolist()
            cases = np.flatnonzero(pattern).tolist()
            part = replace(
                request,
                cases=tuple(request.cases[number] for number in cases),
                designs=request.designs[rows],
            )
            evaluated = self._run(part, cases, [keys[row] for row in rows], should_stop)
            for number, outcome in zip(cases, evaluated, strict=True):
                outcomes[number].objectives[rows] = outcome.objectives
                outcomes[number].statuses[rows] = outcome.statuses
        return tuple(outcomes)

    def _run(
        self,
        request: EvaluationRequest,
        cases: Sequence[int],
        keys: Sequence[bytes],
        should_stop: Callable[[], bool],
    ) -> tuple[Outcome, ...]:
        def on_outcome(case: int, first: int, outcome: Outcome) -> None:
            of_designs = tuple(keys[first : first + len(outcome.statuses)])
            self._finished.append(JournalEntry(cases[case], of_designs, outcome))

        return self._evaluator.evaluate(replace(request, on_outcome=on_outcome), should_stop)

    def store_finished(self) -> None:
        """Store what tasks have finished, if the iteration is a long one. Thread-safe."""
        with self._writing:
            begun, count = self._begun, len(self._finished)
            if begun is None or not count:
                return
            if self._was_long or self._clock() - begun > self._after_seconds:
                entries = self._finished[:count]
                self._is_stored = True
                self._store.journal(self._claim, entries)
                del self._finished[:count]
                for entry in entries:
                    self._know(entry)

    def close(self) -> bool:
        """Store nothing more of the iteration; return whether any of it is stored."""
        with self._writing:
            if self._begun is not None:
                self._was_long = self._clock() - self._begun > self._after_seconds
                self._begun = None
            return self._is_stored

    def clear(self) -> None:
        """Forget the iteration, which was committed."""
        self._known.clear()
        self._finished.clear()
        self._is_stored = False

    def _know(self, entry: JournalEntry) -> None:
        rows = zip(
            entry.keys, entry.outcome.objectives, entry.outcome.statuses.tolist(), strict=True
        )
        for key, objectives, status in rows:
            self._known[entry.case, key] = objectives, status
