"""Outcomes of a long iteration are stored as its tasks finish, and not evaluated again"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gaitswarm.services.optimizer.errors import StoreUnavailable
from gaitswarm.services.optimizer.jobs.iteration import JournalEntry
from gaitswarm.services.optimizer.jobs.job import Claim
from gaitswarm.services.optimizer.run.evaluator import EvaluationRequest
from gaitswarm.services.optimizer.run.execution import Journal
from gaitswarm.sim.outcome import Outcome
from tests.optimizer.formula import HERE, FormulaEvaluator, job, walk


class Entries:
    """The store of a journal. gone: whether it is unavailable."""

    def __init__(self) -> None:
        self.stored = list[JournalEntry]()
        self.gone = False

    def journal(self, _claim: Claim, entries: list[JournalEntry]) -> None:
        if self.gone:
            raise StoreUnavailable("gone")
        self.stored += entries


def of_row(outcome: Outcome, row: int) -> Outcome:
    return Outcome(outcome.objectives[row : row + 1], outcome.statuses[row : row + 1])


class ByTask(FormulaEvaluator):
    """Evaluates design by design and case by case; `tasks` are those evaluated."""

    def __init__(self) -> None:
        super().__init__()
        self.tasks = list[tuple[str, float]]()

    def evaluate(self, request: EvaluationRequest, should_stop: Any) -> tuple[Outcome, ...]:
        outcomes = walk(request)
        for number, (case, outcome) in enumerate(zip(request.cases, outcomes, strict=True)):
            for row, design in enumerate(request.designs):
                self.tasks.append((case.name, float(design[0])))
                if request.on_outcome is not None:
                    request.on_outcome(number, row, of_row(outcome, row))
        return outcomes


def request() -> tuple[EvaluationRequest, list[bytes]]:
    designs = np.array([[0.5, 0.1], [0.2, 0.3], [0.7, 0.2]])
    cases = job().spec.cases({})
    return EvaluationRequest("a-job", cases, designs, HERE.simulation), [b"a", b"b", b"c"]


def journal(store: Entries, claim: Claim, seconds: list[float]) -> tuple[Journal, ByTask]:
    evaluator = ByTask()
    made = Journal(claim, store, evaluator, after_seconds=10.0, clock=lambda: seconds[0])  # type: ignore[arg-type]
    return made, evaluator


CLAIM = Claim(job(), "runner", 1, None)


def test_outcomes_are_stored_once_an_iteration_or_the_one_before_took_long() -> None:
    store, time_ = Entries(), [0.0]
    kept, _ = journal(store, CLAIM, time_)
    asked, keys = request()
    kept.evaluate(asked, keys, lambda: False)
    time_[0] = 10.0
    kept.store_finished()
    assert not store.stored
    time_[0] = 10.1
    kept.store_finished()
    kept.store_finished()
    assert len(store.stored) == 6
    assert kept.close()
    kept.clear()
    kept.evaluate(asked, keys, lambda: False)
    kept.store_finished()
    assert len(store.stored) == 12


def test_an_iteration_after_a_short_one_is_not_stored() -> None:
    store, time_ = Entries(), [0.0]
    kept, _ = journal(store, CLAIM, time_)
    for _ in range(3):
        kept.evaluate(*request(), lambda: False)
        kept.store_finished()
        assert not kept.close()
        kept.clear()
        time_[0] += 9.0
    assert not store.stored


def test_what_could_not_be_stored_is_stored_later() -> None:
    store, time_ = Entries(), [0.0]
    kept, _ = journal(store, CLAIM, time_)
    kept.evaluate(*request(), lambda: False)
    time_[0], store.gone = 11.0, True
    with pytest.raises(StoreUnavailable):
        kept.store_finished()
    store.gone = False
    kept.store_finished()
    assert len(store.stored) == 6


def test_only_what_no_entry_has_is_evaluated_and_the_bits_are_the_same() -> None:
    asked, keys = request()
    whole, store = walk(asked), Entries()
    entries = [
        JournalEntry(case, (keys[row],), of_row(outcome, row))
        for case, outcome in enumerate(whole)
        for row in range(3)
        if (case, row) in ((0, 0), (1, 0), (0, 2))
    ]
    claim = Claim(job(), "runner", 2, None, journal=tuple(entries))
    kept, evaluator = journal(store, claim, [0.0])
    outcomes = kept.evaluate(asked, keys, lambda: False)
    first, second = (case.name for case in asked.cases)
    assert sorted(evaluator.tasks) == sorted([(first, 0.2), (second, 0.2), (second, 0.7)])
    for outcome, expected in zip(outcomes, whole, strict=True):
        assert outcome.objectives.tobytes() == expected.objectives.tobytes()
        assert outcome.statuses.tobytes() == expected.statuses.tobytes()
    assert kept.close(), "what is stored is to be removed"
