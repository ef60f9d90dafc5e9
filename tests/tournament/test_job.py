"""Tournament jobs under the runner: cut, stopped, killed, resumed, extended."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import suppress
from dataclasses import replace
from multiprocessing import get_context

import numpy as np
import pytest

from gaitswarm.services.optimizer.errors import EvaluatorUnavailable
from gaitswarm.services.optimizer.jobs.job import JobState
from gaitswarm.services.optimizer.jobs.kinds.race_case import RaceCase
from gaitswarm.services.optimizer.jobs.kinds.tournament import TournamentSpec
from gaitswarm.services.optimizer.run.evaluator import (
    EvaluationRequest,
    EvaluationStopped,
    Evaluator,
)
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.optimizer.store.port.base import Store
from gaitswarm.services.runtime import open_evaluator, run_embedded
from gaitswarm.services.worker.dispatch import Dispatcher
from gaitswarm.sim.case import LongCase
from gaitswarm.sim.errors import SimulationError
from gaitswarm.sim.provenance import provenance_of
from tests.examples.jobs import history
from tests.examples.walks import SHORT_WALK
from tests.tournament.problems import tournament

PATIENCE = 120.0


@pytest.fixture(scope="module")
def evaluator() -> Iterator[Evaluator]:
    opened = open_evaluator("in-process", cpus=2)
    yield opened
    opened.close()


def run(store: Store, evaluator: Evaluator, spec: TournamentSpec) -> str:
    job, _ = JobService(store).submit(spec)
    ended = run_embedded(store, evaluator, job.id)
    assert ended.state is JobState.SUCCEEDED, ended.error
    return job.id


def request(spec: TournamentSpec, runs: int) -> EvaluationRequest:
    designs = np.arange(float(runs)).reshape(-1, 1)
    return EvaluationRequest("job", spec.cases({}), designs, provenance_of())


def test_every_run_keeps_its_curve_and_its_counts(store: Store, evaluator: Evaluator) -> None:
    spec = tournament(method="pso", iterations=3, evaluations=300)
    job = store.job(run(store, evaluator, spec))
    columns = JobService(store).columns(job)
    curves, counts = columns.objectives[:, :, :-2], columns.objectives[:, :, -2:]
    assert curves.shape == (3, 2, len(spec.checkpoints))
    assert (np.diff(curves, axis=2) <= 0.0).all()
    assert ((counts[:, :, 0] >= 1) & (counts[:, :, 0] <= 300)).all()
    assert (np.isnan(counts[:, :, 1]) == (curves[:, :, -1] > 1e-3)).all()
    assert not columns.failed.any()
    assert columns.fitness == pytest.approx(curves[:, :, -1].mean(axis=1))


def test_runs_do_not_depend_on_how_many_an_iteration_has(
    store: Store, evaluator: Evaluator
) -> None:
    one = tournament(method="pso", iterations=6)
    three = tournament(method="pso", iterations=2, optimizer={"name": "random", "particles": 3})
    rows = [
        [row[2:] for row in history(store, run(store, evaluator, spec))] for spec in (one, three)
    ]
    assert rows[0] == rows[1]


def test_an_extended_job_equals_one_that_was_planned_so(store: Store, evaluator: Evaluator) -> None:
    short = run(store, evaluator, tournament(method="pso", iterations=2))
    JobService(store).extend(short, 5)
    run_embedded(store, evaluator, short)
    whole = run(store, evaluator, tournament(method="pso", iterations=5))
    assert history(store, short) == history(store, whole)


def test_each_run_is_a_task_of_its_own_where_walks_make_it_long() -> None:
    walking = {"name": "A", "job": {"precision": "single"}}
    spec = tournament(problems=[walking, {"function": "D4C1R0I1"}], evaluations=625)
    assert all(isinstance(case, LongCase) for case in spec.cases({}))
    dispatcher = Dispatcher(slots=2, lanes=lambda _: 8)
    asked = replace(request(spec, 3), provenance=provenance_of(*spec.described))

    def evaluate() -> None:
        with suppress(EvaluatorUnavailable):
            dispatcher.evaluate(asked, lambda: False)

    waiting = threading.Thread(target=evaluate, daemon=True)
    waiting.start()
    parts: list[list[tuple[int, int]]] = []
    while len(parts) < 4:
        work = dispatcher.take(10.0)
        assert work is not None
        parts.append([(p.case, p.stop - p.start) for p in work.chunk.parts])
    dispatcher.close("the test has ended")
    waiting.join(10.0)
    assert parts[:3] == [[(0, 1)]] * 3
    assert parts[3][0][0] == 1


def test_a_run_is_broken_off_when_nobody_waits_for_it() -> None:
    # Minutes, if it were run to its end.
    spec = tournament(method="pso", problems=[{"function": "D7C0R1I1"}], evaluations=100_000)
    evaluator = open_evaluator("in-process", cpus=1)
    begun = time.monotonic()
    with pytest.raises(EvaluationStopped):
        evaluator.evaluate(request(spec, 1), lambda: time.monotonic() > begun + 0.5)
    evaluator.close()
    assert time.monotonic() < begun + 10.0


@pytest.mark.variants("pso")
@pytest.mark.parametrize("method", ["pso", "cma", "auto"])
def test_a_run_in_another_process_has_the_same_bits(method: str) -> None:
    walking = {"name": "walk", "job": {"controller": "pi", "scenarios": [SHORT_WALK]}}
    spec = tournament(method=method, problems=[{"function": "D7C0R1I1"}, walking], evaluations=30)
    with ProcessPoolExecutor(1, get_context("spawn")) as other:
        for case in spec.cases({}):
            design = np.array([[7.0]])
            sent = other.submit(case.run, design).result(PATIENCE)
            assert sent.objectives.tobytes() == case.run(design).objectives.tobytes()


def test_a_worker_with_other_search_code_runs_nothing() -> None:
    (case, _) = tournament().cases({})
    assert isinstance(case, RaceCase)
    with pytest.raises(SimulationError, match="give all workers the same gaitswarm"):
        replace(case, digest="0" * 32).run(np.zeros((1, 1)))


def test_a_run_that_breaks_fails_the_job_with_its_reason(
    store: Store, evaluator: Evaluator, monkeypatch: pytest.MonkeyPatch
) -> None:
    from gaitswarm.services.optimizer.jobs.kinds import race_case as module

    def broken(*_: object) -> None:
        raise ZeroDivisionError("the simplex is flat")

    job, _ = JobService(store).submit(tournament())
    monkeypatch.setattr(module, "search_of", lambda _: broken)
    ended = run_embedded(store, evaluator, job.id)
    assert ended.state is JobState.FAILED
    assert "the simplex is flat" in (ended.error or "")
