"""Cases are put into the object store once a job, and read from there once a process."""

from __future__ import annotations

import pickle
import signal
from contextlib import suppress
from types import ModuleType, SimpleNamespace
from typing import Any, cast
from unittest.mock import Mock, patch

import pytest

from gaitswarm.services.worker.cluster.shared_cases import CaseShelf, run_sent, sent
from gaitswarm.services.worker.cutting import Part
from gaitswarm.services.worker.tasks import Answer, Failure, Task
from gaitswarm.sim.case import Case
from tests.worker.requests import bits, request, walked_at_once

WANTED = request(4)
PARTS = (Part(1, 0, 2), Part(0, 1, 4))


class Store:
    """Ray's object store, as far as it is used."""

    def __init__(self) -> None:
        self.kept: list[bytes] = []
        self.get = Mock(side_effect=lambda place: pickle.loads(self.kept[place]))  # noqa: S301

    def put(self, value: object) -> int:
        self.kept.append(pickle.dumps(value))
        return len(self.kept) - 1


@pytest.fixture
def store() -> Store:
    return Store()


@pytest.fixture
def shelf(store: Store) -> CaseShelf:
    return CaseShelf(cast(ModuleType, store))


def copied(cases: tuple[Case, ...]) -> tuple[Case, ...]:
    """Equal ones, as the next iteration makes them."""
    copies: tuple[Case, ...] = pickle.loads(pickle.dumps(cases))  # noqa: S301
    return copies


def test_cases_of_all_iterations_of_a_job_are_put_once(store: Store, shelf: CaseShelf) -> None:
    places = {shelf.shared(cases).place for cases in (WANTED.cases, WANTED.cases, WANTED.cases[:])}
    places |= {shelf.shared(copied(WANTED.cases)).place}
    assert len(places) == len(store.kept) == 1
    shelf.shared(WANTED.cases[:1])
    assert len(store.kept) == 2


def test_after_a_loss_they_are_put_again(store: Store, shelf: CaseShelf) -> None:
    before = shelf.shared(WANTED.cases)
    shelf.forget()
    after = shelf.shared(WANTED.cases)
    assert len(store.kept) == 2
    assert before.place != after.place


def test_a_task_is_sent_without_cases_and_a_process_reads_them_once(
    store: Store, shelf: CaseShelf
) -> None:
    chosen = [part.case for part in PARTS]
    task = Task.of(WANTED.cases, WANTED.designs, PARTS, WANTED.provenance)
    shared = shelf.shared(WANTED.cases[:])
    carried = sent(task, chosen, shared)
    assert carried.task.cases == ()
    ray: Any = SimpleNamespace(get=store.get)
    with patch.dict("sys.modules", ray=ray):
        first, second = run_sent(carried), run_sent(carried)
    assert store.get.call_count == 1
    assert isinstance(first, Answer) and isinstance(second, Answer)
    assert first.outcomes is not None and second.outcomes is not None
    assert bits(first.outcomes) == bits(second.outcomes)
    whole = walked_at_once(WANTED)
    for part, outcome in zip(PARTS, first.outcomes, strict=True):
        rows = whole[part.case].objectives[part.start : part.stop]
        assert outcome.objectives.tobytes() == rows.tobytes()


def test_a_walk_is_interrupted_though_its_process_was_started_to_ignore_that() -> None:
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    interrupted = SimpleNamespace(receive=lambda: signal.raise_signal(signal.SIGINT))
    try:
        with pytest.raises(KeyboardInterrupt):
            run_sent(cast(Any, SimpleNamespace(shared=interrupted)))
    finally:
        signal.signal(signal.SIGINT, before)


@pytest.mark.parametrize(
    ("error", "ends"),
    [
        (AttributeError("module 'numpy' has no attribute 'matrix'"), True),
        (AttributeError("partially initialized module 'scipy' has no attribute 'linalg'"), True),
        (ImportError("cannot import name 'x' from partially initialized module 'y'"), True),
        (AttributeError("'Walk' object has no attribute 'x'"), False),
        (ValueError("module 'numpy' has no attribute 'matrix'"), False),
    ],
)
def test_a_worker_ends_whose_modules_a_cancellation_has_left_half_imported(
    error: Exception, ends: bool
) -> None:
    shared = SimpleNamespace(receive=lambda: WANTED.cases)
    walks = Task.of(WANTED.cases, WANTED.designs, PARTS, WANTED.provenance)
    task = SimpleNamespace(shared=shared, chosen=(0,), task=walks)
    with (
        patch(
            "gaitswarm.services.worker.cluster.shared_cases.run_in_worker",
            return_value=Failure(error),
        ),
        patch("os._exit", side_effect=SystemExit) as left,
        suppress(SystemExit),
    ):
        assert run_sent(cast(Any, task)) == Failure(error)
    assert left.called is ends
