"""Handling of chunks' results, wherever they run."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

from gaitswarm.services.optimizer.errors import KilledWorker, ProvenanceChanged
from gaitswarm.services.optimizer.jobs.priority import weight
from gaitswarm.services.optimizer.run.evaluator import EvaluationRequest
from gaitswarm.services.worker.cutting import Part
from gaitswarm.services.worker.dispatch import Dispatcher, Work
from gaitswarm.services.worker.tasks import Answer, Task
from gaitswarm.sim.case import Case, Walk
from gaitswarm.sim.kernel.walk import Precision
from gaitswarm.sim.outcome import N_OBJECTIVES, Outcome, Status
from gaitswarm.sim.provenance import provenance_of
from tests.examples.processes import eventually
from tests.worker.requests import SCENARIOS, request, walked_at_once

LANES = 4
COUNT = 8 * LANES
PATIENCE = 30.0

Results = tuple[Outcome, ...]

HERE = provenance_of("szabadka2")
NO_COMPILER = HERE.model_copy(update={"backend": "reference"})


@pytest.fixture
def dispatcher() -> Iterator[Dispatcher]:
    opened = Dispatcher(slots=64, lanes=lambda _: LANES)
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


def results_of(work: Work) -> tuple[Outcome, ...]:
    """Those that tell the parts of all chunks from each other."""
    return tuple(
        Outcome(
            np.full((part.stop - part.start, N_OBJECTIVES), 100.0 * part.case + part.start),
            np.full(part.stop - part.start, Status.STALLED, dtype=np.uint8),
        )
        for part in work.chunk.parts
    )


def answer_of(work: Work) -> Answer:
    return Answer(HERE, results_of(work), "node-7")


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
        for part, expected in zip(work.chunk.parts, results_of(work), strict=True):
            rows = outcomes[part.case].objectives[part.start : part.stop]
            np.testing.assert_array_equal(rows, expected.objectives)
            assert (outcomes[part.case].statuses == Status.STALLED).all()


def test_a_chunk_that_was_sent_again_after_its_result_came_is_not_run_again(
    dispatcher: Dispatcher, results: Future[Results]
) -> None:
    work, *_ = taken(dispatcher)
    dispatcher.complete(work, answer_of(work))
    dispatcher.again(work)
    assert dispatcher.take(0.0) is None


def test_a_chunk_that_three_workers_died_of_fails_the_request_and_names_its_walks(
    dispatcher: Dispatcher, results: Future[Results]
) -> None:
    first, *others = taken(dispatcher)
    for other in others:
        dispatcher.complete(other, answer_of(other))
    work: Work | None = first
    for _ in range(3):
        assert work is not None and work.chunk == first.chunk
        dispatcher.again(work)
        work = dispatcher.take(0.0)
    assert work is None
    (part,) = first.chunk.parts
    name = first.batch.request.cases[part.case].name
    with pytest.raises(
        KilledWorker, match=f"3 worker.*designs {part.start} to {part.stop - 1} .*'{name}'"
    ):
        results.result(PATIENCE)


def test_a_chunk_is_to_avoid_the_nodes_on_which_workers_died_of_it(
    dispatcher: Dispatcher, results: Future[Results]
) -> None:
    work, *_ = taken(dispatcher)
    avoided = []
    for node, suspect in (("a", True), ("gone", False), ("b", True)):
        work.node = node
        dispatcher.again(work, suspect=suspect)
        again = dispatcher.take(0.0)
        assert again is not None and again.chunk == work.chunk
        avoided.append(again.avoid)
        work = again
    assert avoided == [{"a"}, {"a"}, {"a", "b"}]


def test_a_chunk_whose_nodes_go_is_run_again_for_ever(
    dispatcher: Dispatcher, results: Future[Results]
) -> None:
    work, *others = taken(dispatcher)
    for _ in range(20):
        dispatcher.again(work, suspect=False)
        again = dispatcher.take(0.0)
        assert again is not None and again.chunk == work.chunk
        work = again
    for each in (work, *others):
        dispatcher.complete(each, answer_of(each))
    assert len(results.result(PATIENCE)) == 2


class Late:
    """A request of which one chunk takes long, once its pace is known."""

    def __init__(self) -> None:
        self.now = 100.0
        self.dispatcher = Dispatcher(slots=4, lanes=lambda _: LANES, clock=lambda: self.now)
        self.pool = ThreadPoolExecutor(1)
        wanted = request(COUNT)
        learned = self.pool.submit(self.dispatcher.evaluate, wanted, lambda: False)
        for work in taken(self.dispatcher):
            self.end(work)
        learned.result(PATIENCE)
        self.results = self.pool.submit(self.dispatcher.evaluate, wanted, lambda: False)
        self.late, *self.others = taken(self.dispatcher)
        assert len(self.others) >= self.dispatcher.slots

    def end(self, work: Work) -> None:
        # A second for each simulated one.
        self.dispatcher.complete(work, replace(answer_of(work), seconds=work.chunk.cost))

    def close(self) -> None:
        self.dispatcher.close("the test has ended")
        self.pool.shutdown()


@pytest.fixture
def late() -> Iterator[Late]:
    opened = Late()
    yield opened
    opened.close()


def test_a_chunk_that_takes_far_too_long_is_copied_once_and_the_first_answer_wins(
    late: Late,
) -> None:
    for work in late.others:
        late.end(work)
    assert late.dispatcher.copy() is None
    late.now += 4.0 * late.late.chunk.cost
    copy = late.dispatcher.copy()
    assert copy is not None and copy is not late.late and copy.chunk == late.late.chunk
    late.now += 100.0 * late.late.chunk.cost
    assert late.dispatcher.copy() is None
    late.end(copy)
    outcomes = late.results.result(PATIENCE)
    assert not late.late.batch.awaits(late.late.chunk)
    late.dispatcher.again(late.late)
    assert late.dispatcher.take(0.0) is None
    for part, expected in zip(copy.chunk.parts, results_of(copy), strict=True):
        rows = outcomes[part.case].objectives[part.start : part.stop]
        np.testing.assert_array_equal(rows, expected.objectives)


def test_a_copy_is_to_avoid_the_node_on_which_its_chunk_takes_too_long(late: Late) -> None:
    late.late.node = "a"
    for work in late.others:
        work.node = "b"
        late.end(work)
    late.now += 4.0 * late.late.chunk.cost
    copy = late.dispatcher.copy()
    assert copy is not None and copy.avoid == {"a"}


def test_no_chunk_is_copied_while_no_slot_is_free(late: Late) -> None:
    slots = late.dispatcher.slots
    for work in late.others[slots - 1 :]:
        late.end(work)
    late.now += 100.0 * late.late.chunk.cost
    assert late.dispatcher.copy() is None
    late.end(late.others[0])
    assert late.dispatcher.copy() is not None


def test_the_time_that_a_chunk_lay_at_hand_does_not_make_it_late(late: Late) -> None:
    late.now += 100.0 * late.late.chunk.cost
    for work in late.others:
        late.end(work)
    assert late.dispatcher.copy() is None


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
    dispatcher.complete(work, Answer(HERE, (outcome,), "node-7"))
    with pytest.raises(RuntimeError, match="other code"):
        results.result(PATIENCE)


@pytest.mark.parametrize("declined", [True, False])
def test_a_worker_without_a_compiler_fails_the_request_and_is_named(
    dispatcher: Dispatcher, results: Future[Results], declined: bool
) -> None:
    work, *_ = taken(dispatcher)
    outcomes = None if declined else results_of(work)
    dispatcher.complete(work, Answer(NO_COMPILER, outcomes, "node-7"))
    with pytest.raises(ProvenanceChanged, match=r"node-7 .*: no C compiler: backend reference"):
        results.result(PATIENCE)


def test_a_task_is_not_run_by_a_process_that_computes_something_else() -> None:
    wanted = request(2)
    task = Task.of(wanted.cases, wanted.designs, [Part(0, 0, 2), Part(1, 0, 2)], HERE)
    assert task.run().outcomes is not None
    declined = replace(task, provenance=NO_COMPILER).run()
    assert (declined.outcomes, declined.provenance) == (None, HERE)


def test_a_task_carries_only_the_designs_and_cases_of_its_parts() -> None:
    wanted = request(9)
    task = Task.of(wanted.cases, wanted.designs, [Part(1, 4, 6), Part(0, 5, 7)], HERE)
    assert task.cases == (wanted.cases[1], wanted.cases[0])
    np.testing.assert_array_equal(task.designs, wanted.designs[4:7])
    outcomes = task.run().outcomes
    assert outcomes is not None
    whole = walked_at_once(wanted)
    for found, case, rows in zip(outcomes, (1, 0), (slice(4, 6), slice(5, 7)), strict=True):
        assert found.objectives.tobytes() == whole[case].objectives[rows].tobytes()


class OneLook(Exception):
    """The request has been cut."""


def chunks_of(dispatcher: Dispatcher, wanted: EvaluationRequest) -> list[Work]:
    """Its chunks, of which none is run."""

    def look() -> bool:
        raise OneLook

    with pytest.raises(OneLook):
        dispatcher.evaluate(wanted, look)
    works = []
    while work := dispatcher.take(0.0):
        works.append(work)
    return works


def test_with_fewer_slots_than_cases_a_task_holds_walks_of_all_cases() -> None:
    (work,) = chunks_of(Dispatcher(slots=1, lanes=lambda _: LANES), request(3))
    assert work.chunk.parts == (Part(0, 0, 3), Part(1, 0, 3))


def test_with_as_many_slots_as_cases_a_task_is_of_one_case() -> None:
    works = chunks_of(Dispatcher(slots=2, lanes=lambda _: LANES), request(3))
    assert {work.chunk.parts for work in works} == {(Part(0, 0, 3),), (Part(1, 0, 3),)}


def test_of_two_jobs_one_that_is_a_step_higher_has_twice_the_share_of_the_slots(
    dispatcher: Dispatcher,
) -> None:
    usual = request(16 * COUNT, job_id="usual", scenarios=SCENARIOS[:1])
    with ThreadPoolExecutor(2) as pool:
        try:
            pool.submit(dispatcher.evaluate, usual, lambda: False)
            eventually(lambda: dispatcher.load.waiting > 0)
            chunks = dispatcher.load.waiting
            urgent = replace(usual, job_id="urgent", weight=weight(1))
            pool.submit(dispatcher.evaluate, urgent, lambda: False)
            eventually(lambda: dispatcher.load.waiting == 2 * chunks)
            works = [dispatcher.take(0.0) for _ in range(12)]
        finally:
            dispatcher.close("the test has ended")
    taken = Counter(work.batch.request.job_id for work in works if work is not None)
    assert taken == {"urgent": 8, "usual": 4}


def test_cases_without_walks_to_share_have_tasks_of_their_own() -> None:
    class Alone:
        def __init__(self, case: Case) -> None:
            self.name, self.duration, self.robots = case.name, case.duration, case.robots
            self.objectives, self.run = case.objectives, case.run
            self.precision = case.precision

    wanted = request(3)
    alone = replace(wanted, cases=tuple(Alone(case) for case in wanted.cases))
    works = chunks_of(Dispatcher(slots=1, lanes=lambda _: LANES), alone)
    assert {work.chunk.parts for work in works} == {(Part(0, 0, 3),), (Part(1, 0, 3),)}


def test_twice_as_many_lanes_are_filled_in_single_precision() -> None:
    def lanes(precision: Precision) -> int:
        return LANES if precision == "double" else 2 * LANES

    wanted = request(3 * LANES)
    case = wanted.cases[0]
    assert isinstance(case, Walk)
    single = replace(wanted, cases=(replace(case, precision="single"),))
    works = chunks_of(Dispatcher(slots=4, lanes=lanes), single)
    assert [work.chunk.parts for work in works] == [
        (Part(0, 0, 2 * LANES),),
        (Part(0, 2 * LANES, 3 * LANES),),
    ]


def test_the_interpreter_which_walks_alone_is_not_given_lanes_to_fill() -> None:
    slow = replace(request(5), provenance=NO_COMPILER)
    (work,) = chunks_of(Dispatcher(slots=1, lanes=lambda _: 64), slow)
    assert work.chunk.cost == pytest.approx(5 * sum(case.duration for case in slow.cases))


def test_the_next_iteration_of_a_job_is_cut_by_the_pace_of_the_last() -> None:
    dispatcher = Dispatcher(slots=1, lanes=lambda _: LANES)
    wanted = request(40)
    with ThreadPoolExecutor(1) as pool:
        under_way = pool.submit(dispatcher.evaluate, wanted, lambda: False)
        seconds = 0.0
        while not under_way.done():
            work = dispatcher.take(0.05)
            if work is None:
                continue
            # Half a minute for each simulated second: nothing larger than a lane's walk ends soon.
            seconds += 30.0 * work.chunk.cost
            answer = replace(answer_of(work), seconds=30.0 * work.chunk.cost)
            dispatcher.complete(work, answer)
        under_way.result()
    first = chunks_of(dispatcher, replace(wanted, job_id="another"))
    second = chunks_of(dispatcher, wanted)
    longest = LANES * max(case.duration for case in wanted.cases)
    assert max(work.chunk.cost for work in first) > 10.0 * longest
    assert max(work.chunk.cost for work in second) < 3.0 * longest
