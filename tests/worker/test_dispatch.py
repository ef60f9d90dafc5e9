"""What becomes of chunks' results, whoever runs them."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

from services.optimizer.errors import ProvenanceChanged
from services.worker.dispatch import Dispatcher, Work
from services.worker.tasks import Answer, Task
from sim.outcome import N_OBJECTIVES, Outcome, Status
from sim.provenance import provenance_of
from tests.worker.requests import request

LANES = 4
COUNT = 8 * LANES
PATIENCE = 30.0

Results = tuple[Outcome, ...]

HERE = provenance_of("szabadka2")
NO_COMPILER = HERE.model_copy(update={"backend": "reference"})


@pytest.fixture
def dispatcher() -> Iterator[Dispatcher]:
    opened = Dispatcher(slots=64, lanes=lambda: LANES)
    yield opened
    opened.close("the test has ended")


@pytest.fixture
def results(dispatcher: Dispatcher) -> Iterator[Future[Results]]:
    """Of a request of several chunks, none of which has been run yet."""
    with ThreadPoolExecutor(1) as pool:
        yield pool.submit(dispatcher.evaluate, request(COUNT), lambda: False)
        dispatcher.close("the test has ended")


def taken(dispatcher: Dispatcher) -> list[Work]:
    """All chunks of the request."""
    first = dispatcher.take(PATIENCE)
    assert first is not None
    works = [first]
    while work := dispatcher.take(0.0):
        works.append(work)
    assert len(works) > 2
    return works


def result_of(work: Work) -> Outcome:
    """One that tells the chunks from each other."""
    size = work.chunk.stop - work.chunk.start
    value = 100.0 * work.chunk.case + work.chunk.start
    return Outcome(
        np.full((size, N_OBJECTIVES), value), np.full(size, Status.STALLED, dtype=np.uint8)
    )


def answer_of(work: Work) -> Answer:
    return Answer(HERE, result_of(work), "node-7")


def test_a_chunk_that_comes_twice_counts_once(
    dispatcher: Dispatcher, results: Future[Results]
) -> None:
    works = taken(dispatcher)
    for _ in works:
        dispatcher.complete(works[0], answer_of(works[0]))
    for work in works[1:]:
        dispatcher.complete(work, answer_of(work))

    outcomes = results.result(PATIENCE)

    for work in works:
        chunk = work.chunk
        rows = outcomes[chunk.case].objectives[chunk.start : chunk.stop]
        np.testing.assert_array_equal(rows, result_of(work).objectives)
        assert (outcomes[chunk.case].statuses == Status.STALLED).all()


def test_a_chunk_that_was_sent_again_after_its_result_came_is_not_run_again(
    dispatcher: Dispatcher, results: Future[Results]
) -> None:
    work, *_ = taken(dispatcher)
    dispatcher.complete(work, answer_of(work))
    dispatcher.again(work)
    assert dispatcher.take(0.0) is None


def test_an_error_of_a_chunk_whose_result_has_come_fails_nothing(
    dispatcher: Dispatcher, results: Future[Results]
) -> None:
    works = taken(dispatcher)
    for work in works:
        dispatcher.complete(work, answer_of(work))
        dispatcher.fail(work, RuntimeError("its other attempt"))
    assert len(results.result(PATIENCE)) == 2


def test_what_has_no_result_yet_cannot_be_read_as_any_status(
    dispatcher: Dispatcher, results: Future[Results]
) -> None:
    work, *_ = taken(dispatcher)
    for outcome in work.batch.outcomes:
        assert not set(outcome.statuses.tolist()) & set(Status)
        with pytest.raises(ValueError, match="not a valid Status"):
            Status(int(outcome.statuses[0]))


@pytest.mark.parametrize("shape", [(1, N_OBJECTIVES), (LANES, 1)], ids=str)
def test_a_result_of_another_shape_fails_the_request_instead_of_filling_it(
    dispatcher: Dispatcher, results: Future[Results], shape: tuple[int, int]
) -> None:
    work, *_ = taken(dispatcher)
    outcome = Outcome(np.zeros(shape), np.zeros(shape[0], dtype=np.uint8))
    dispatcher.complete(work, Answer(HERE, outcome, "node-7"))
    with pytest.raises(RuntimeError, match="other code"):
        results.result(PATIENCE)


@pytest.mark.parametrize("declined", [True, False])
def test_a_worker_without_a_compiler_fails_the_request_and_is_named(
    dispatcher: Dispatcher, results: Future[Results], declined: bool
) -> None:
    work, *_ = taken(dispatcher)
    outcome = None if declined else result_of(work)
    dispatcher.complete(work, Answer(NO_COMPILER, outcome, "node-7"))
    with pytest.raises(ProvenanceChanged, match=r"node-7 .*: no C compiler: backend reference"):
        results.result(PATIENCE)


def test_a_worker_that_does_not_say_what_it_computes_fails_the_request(
    dispatcher: Dispatcher, results: Future[Results]
) -> None:
    work, *_ = taken(dispatcher)
    dispatcher.complete(work, result_of(work))
    with pytest.raises(ProvenanceChanged, match="does not say what it computes"):
        results.result(PATIENCE)


def test_a_task_is_not_run_by_a_process_that_computes_something_else() -> None:
    task = Task(request(2).cases[0], request(2).designs, HERE)
    assert task.run().outcome is not None
    declined = replace(task, provenance=NO_COMPILER).run()
    assert (declined.outcome, declined.provenance) == (None, HERE)
