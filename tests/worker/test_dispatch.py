"""Dispatch of requests, on an engine that runs nothing by itself."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from gaitswarm.services.optimizer.errors import KilledWorker, ProvenanceChanged
from gaitswarm.services.optimizer.jobs.job import weight
from gaitswarm.services.optimizer.run.evaluator import (
    EvaluationRequest,
    EvaluationStopped,
    TaskReport,
)
from gaitswarm.services.worker.dispatch import Chunk, Dispatcher, TaskLost, WorkerDied
from gaitswarm.services.worker.tasks import Answer, run_task
from gaitswarm.sim.case import Case
from gaitswarm.sim.outcome import N_OBJECTIVES, Outcome, Status
from gaitswarm.sim.provenance import provenance_of
from tests.examples.processes import eventually
from tests.worker.requests import SCENARIOS, never, request

COUNT = 64
HERE = provenance_of("szabadka2")


@dataclass
class Sent:
    """A submitted task."""

    request: EvaluationRequest
    chunk: Chunk

    def __hash__(self) -> int:
        return id(self)

    def outcomes(self) -> tuple[Outcome, ...]:
        """Outcomes that tell all parts of all chunks apart."""
        count = self.chunk.stop - self.chunk.start
        return tuple(
            Outcome(
                np.arange(self.chunk.start, self.chunk.stop)[:, None]
                + np.full((count, N_OBJECTIVES), 100.0 * case),
                np.full(count, Status.STALLED, dtype=np.uint8),
            )
            for case in self.chunk.cases
        )

    def answer(self) -> Answer:
        return Answer(self.outcomes(), HERE, "node-7", seconds=self.chunk.cost)


@dataclass
class MadeUpEngine:
    """Finishes every task at once; `result` decides how."""

    result: Callable[[Sent], Answer] = Sent.answer
    slots: int = 8
    paused: bool = False
    sent: list[Sent] = field(default_factory=list)
    abandoned: list[Sent] = field(default_factory=list)

    def submit(self, request: EvaluationRequest, chunk: Chunk, /) -> Sent:
        self.sent.append(Sent(request, chunk))
        return self.sent[-1]

    def wait(self, handles: Sequence[Sent], seconds: float) -> Sequence[Sent]:
        return [] if self.paused else handles

    def answer(self, handle: Sent) -> Answer:
        return self.result(handle)

    def abandon(self, handles: Sequence[Sent]) -> None:
        self.abandoned += handles

    def check(self) -> None:
        pass


def evaluated(result: Callable[[Sent], Answer], wanted: EvaluationRequest) -> MadeUpEngine:
    engine = MadeUpEngine(result)
    for case, outcome in enumerate(Dispatcher().evaluate(engine, wanted, never)):
        expected = np.arange(len(wanted.designs)) + 100.0 * case
        np.testing.assert_array_equal(outcome.objectives[:, 0], expected)
    return engine


def test_lost_tasks_are_submitted_again_for_ever() -> None:
    losses = Counter[Chunk]()

    def lose_twenty_times(task: Sent) -> Answer:
        losses[task.chunk] += 1
        if losses[task.chunk] <= 20:
            raise TaskLost("its node")
        return task.answer()

    evaluated(lose_twenty_times, request(COUNT))
    assert set(losses.values()) == {21}


def test_a_task_that_kills_workers_is_named() -> None:
    def kill(task: Sent) -> Answer:
        if 1 in task.chunk.cases and task.chunk.start <= 5 < task.chunk.stop:
            raise WorkerDied
        return task.answer()

    name = request(1).cases[1].name
    words = f"^3 worker .* same task: designs [0-5] to .* in '{name}'"
    with pytest.raises(KilledWorker, match=words):
        Dispatcher().evaluate(MadeUpEngine(kill), request(COUNT), never)


def test_a_worker_that_computes_something_else_is_named() -> None:
    def refuse(task: Sent) -> Answer:
        return Answer(None, HERE, "node-7", refusal="no C compiler: backend reference")

    with pytest.raises(ProvenanceChanged, match=r"node-7 .*: no C compiler: backend reference"):
        Dispatcher().evaluate(MadeUpEngine(refuse), request(COUNT), never)


@pytest.mark.parametrize("shape", [(1, N_OBJECTIVES), (COUNT, 1)], ids=str)
def test_a_result_of_another_shape_fails_the_request_instead_of_filling_it(
    shape: tuple[int, int],
) -> None:
    def misshapen(task: Sent) -> Answer:
        outcome = Outcome(np.zeros(shape), np.zeros(shape[0], dtype=np.uint8))
        return Answer((outcome,) * len(task.chunk.cases), HERE, "node-7")

    with pytest.raises(RuntimeError, match="returned objectives of shape"):
        Dispatcher().evaluate(MadeUpEngine(misshapen), request(COUNT), never)


def test_tasks_of_a_request_that_ends_early_are_abandoned() -> None:
    engine = MadeUpEngine(paused=True)
    looks = iter([False, False, True])
    with pytest.raises(EvaluationStopped):
        Dispatcher().evaluate(engine, request(COUNT), lambda: next(looks))
    assert engine.abandoned == engine.sent != []


def test_every_end_of_a_task_is_reported() -> None:
    ends = iter([TaskLost("its node"), ZeroDivisionError("of the test")])

    def fail(_task: Sent) -> Answer:
        raise next(ends)

    reports: list[TaskReport] = []
    with pytest.raises(ZeroDivisionError):
        Dispatcher().evaluate(
            MadeUpEngine(fail, slots=1), replace(request(2), on_task=reports.append), never
        )
    assert [report.error for report in reports] == [
        "lost: its node",
        "ZeroDivisionError: of the test",
    ]
    assert all(report.walks > 0 and report.seconds >= 0.0 for report in reports)


def test_two_jobs_share_the_submitted_tasks_by_their_weights() -> None:
    engine, dispatcher = MadeUpEngine(paused=True, slots=6), Dispatcher()
    usual = request(100 * COUNT, job_id="usual", scenarios=SCENARIOS[:1])
    urgent = replace(usual, job_id="urgent", weight=weight(1))
    stopped = False
    with ThreadPoolExecutor(2) as pool:
        for wanted in (urgent, usual):
            sent = len(engine.sent)
            pool.submit(dispatcher.evaluate, engine, wanted, lambda: stopped)
            eventually(lambda: len(engine.sent) > sent)  # noqa: B023 - called at once
        assert dispatcher.most_submitted(usual, 6) == 4
        assert dispatcher.most_submitted(urgent, 6) == 8
        assert dispatcher.load(6).used == 6
        stopped = True
    assert dispatcher.most_submitted(usual, 6) == 12
    assert dispatcher.load(6).used == 0


def test_the_next_iteration_of_a_job_is_cut_by_the_pace_of_the_last() -> None:
    def slow(task: Sent) -> Answer:
        return replace(task.answer(), seconds=30.0 * task.chunk.cost)

    engine, dispatcher, wanted = MadeUpEngine(slow), Dispatcher(), request(5000)
    first = len(dispatcher.evaluate(engine, wanted, never)) and len(engine.sent)
    dispatcher.evaluate(engine, wanted, never)
    assert len(engine.sent) - first > 10 * first


class Alone:
    """A case that cannot share a task with others."""

    def __init__(self, case: Case) -> None:
        self.name, self.duration, self.robots = case.name, case.duration, case.robots
        self.objectives, self.run, self.precision = case.objectives, case.run, case.precision


def test_cases_without_walks_to_share_have_tasks_of_their_own() -> None:
    wanted = request(3)
    engine = MadeUpEngine(slots=1)
    Dispatcher().evaluate(engine, wanted, never)
    assert [task.chunk.cases for task in engine.sent] == [(0, 1)]
    alone = replace(wanted, cases=tuple(Alone(case) for case in wanted.cases))
    Dispatcher().evaluate(engine, alone, never)
    assert {task.chunk.cases for task in engine.sent[1:]} == {(0,), (1,)}


def test_a_task_is_not_run_by_a_process_that_computes_something_else() -> None:
    wanted = request(2)
    assert run_task(wanted.cases, wanted.designs, HERE).outcomes is not None
    refused = run_task(
        wanted.cases, wanted.designs, HERE.model_copy(update={"backend": "reference"})
    )
    assert (refused.outcomes, refused.provenance) == (None, HERE)
    assert refused.refusal == "backend native instead of reference"
