"""`gaitswarm.optimize` runs a job here and now, and can be gone on with."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gaitswarm
from gaitswarm.services.optimizer.jobs.provenance import JobProvenance, job_provenance
from gaitswarm.services.optimizer.jobs.spec import Spec
from gaitswarm.services.optimizer.run.evaluator import EvaluationRequest, Evaluator
from gaitswarm.services.optimizer.run.runner import Runner
from gaitswarm.services.optimizer.service import JobService
from gaitswarm.services.runtime import open_evaluator, open_store
from gaitswarm.sim.outcome import MEASUREMENT_NAMES
from tests.examples.walks import SHORT_WALK
from tests.library.conftest import SMALL, Finished

pytestmark = pytest.mark.slow

WALK: dict[str, Any] = {"controller": "pi", "scenarios": SHORT_WALK}


@pytest.fixture(autouse=True)
def ctrl_c_as_in_the_foreground() -> Iterator[None]:
    """A shell lets what it starts in the background ignore SIGINT, tests included."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def same_history(db: Path, job_id: str, other: Finished) -> bool:
    """Whether two jobs have the same designs and results, to the last bit."""
    with gaitswarm.open(db) as here, gaitswarm.open(other.db) as there:
        return here.evaluations(job_id).to_arrow().equals(there.evaluations(other.id).to_arrow())


def test_the_finished_job_comes_with_its_best_design_and_history(finished: Finished) -> None:
    result = finished.result
    assert (result.job.state, result.job.name) == ("succeeded", "small")
    assert set(result.best.design) == {"P", "I"}
    assert [iteration.index for iteration in result.iterations] == [0, 1]
    assert result.iterations[-1].best_so_far == result.best.fitness
    again = gaitswarm.simulate(result.best.design, controller="pi", scenarios=SMALL["scenarios"])
    assert again.fitness.tolist() == [result.best.fitness]


def test_every_evaluation_has_the_measurements_of_its_simulation(finished: Finished) -> None:
    with gaitswarm.open(finished.db) as jobs:
        table = jobs.evaluations(finished.id)
    designs = [dict(zip(table.variables, row, strict=True)) for row in table.designs.tolist()]
    again = gaitswarm.simulate(designs, controller="pi", scenarios=SMALL["scenarios"])
    assert np.array_equal(table.measurements, again.measurements, equal_nan=True)
    best = finished.result.best.scenarios
    for k, scenario in enumerate(best.values()):
        row = again.measurements[int(np.nanargmin(table.fitness)), k].tolist()
        assert scenario.measurements == dict(zip(MEASUREMENT_NAMES, row, strict=True))


def test_a_job_runs_on_the_identified_robot(tmp_path: Path) -> None:
    robot = "szabadka2-identified"
    result = gaitswarm.optimize(
        **WALK,
        robot=robot,
        particles=2,
        iterations=1,
        db=tmp_path / "jobs.db",
    )
    assert result.job.spec.robot == robot
    again = gaitswarm.simulate(result.best.design, **WALK, robot=robot)
    assert again.fitness.tolist() == [result.best.fitness]
    datasheet = gaitswarm.simulate(result.best.design, **WALK)
    assert datasheet.fitness.tolist() != [result.best.fitness]


def test_convergence_and_evaluations_are_tables(finished: Finished) -> None:
    result = finished.result
    convergence = result.convergence()
    assert convergence["index"].tolist() == [0, 1]
    assert convergence["best_so_far"].tolist() == [i.best_so_far for i in result.iterations]
    evaluations = result.evaluations()
    assert np.nanmin(evaluations.fitness) == result.best.fitness
    assert len(evaluations) == 6


def test_the_verdict_is_that_of_the_jobs(finished: Finished) -> None:
    verdict = finished.result.verdict()
    assert verdict.sentences[0].startswith("Compared with published ")
    with gaitswarm.open(finished.result.db) as jobs:
        assert jobs.verdict(finished.result.job.id) == verdict


def test_progress_is_reported_after_each_iteration_is_stored(db: Path) -> None:
    received: list[tuple[int, int]] = []

    def progress(iteration: gaitswarm.IterationView) -> None:
        with gaitswarm.open(db) as jobs:
            received.append((iteration.index, next(iter(jobs.jobs())).iterations))

    result = gaitswarm.optimize(db=db, on_iteration=progress, **SMALL)
    assert received == [(0, 1), (1, 2)]
    assert result.job.iterations == 2


def test_without_a_place_the_job_is_in_the_users_own_database(user_data: Path) -> None:
    result = gaitswarm.optimize(**{**SMALL, "iterations": 1})
    assert result.db == str(user_data / "gaitswarm" / "gaitswarm.db")
    with gaitswarm.open() as jobs:
        assert jobs.job(result.job.id) == result.job


def stop_after_one(error: type[BaseException]) -> Any:
    def stop(iteration: gaitswarm.IterationView) -> None:
        if iteration.index == 0:
            raise error("enough")

    return stop


def test_an_exception_of_the_callback_gives_the_job_back_and_is_passed_on(
    db: Path, finished: Finished
) -> None:
    with pytest.raises(ArithmeticError, match="enough"):
        gaitswarm.optimize(db=db, on_iteration=stop_after_one(ArithmeticError), **SMALL)
    with gaitswarm.open(db) as jobs:
        (job,) = jobs.jobs()
    assert (job.state, job.iterations) == ("queued", 1)
    resumed = gaitswarm.optimize(resume=job.id, db=db)
    assert resumed.best.design == finished.result.best.design
    assert same_history(db, job.id, finished)


@pytest.mark.parametrize("how", ["signal", "exception"])
def test_ctrl_c_gives_the_job_back_and_says_how_to_go_on(
    db: Path, finished: Finished, how: str
) -> None:
    def press(iteration: gaitswarm.IterationView) -> None:
        if iteration.index:
            return
        if how == "exception":
            raise KeyboardInterrupt
        signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt) as raised:
        gaitswarm.optimize(db=db, on_iteration=press, **SMALL)
    assert isinstance(raised.value, gaitswarm.Interrupted)
    job = raised.value.job
    assert (job.state, job.iterations) == ("queued", 1)
    assert f"gaitswarm.optimize(resume={job.id!r}, db={str(db)!r})" in str(raised.value)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    gaitswarm.optimize(resume=job.id, db=db)
    assert same_history(db, job.id, finished)


class Deaf:
    """Workers that hear of no stop."""

    slots = 1

    def evaluate(self, request: EvaluationRequest, should_stop: object) -> Any:
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGINT)
        raise AssertionError("the second Ctrl-C does not wait")

    def close(self) -> None:
        """Nothing was started."""


def test_a_second_ctrl_c_waits_for_nothing(db: Path) -> None:
    with pytest.raises(gaitswarm.Interrupted) as raised:
        gaitswarm.optimize(db=db, evaluator=Deaf(), **SMALL)
    assert raised.value.job.state == "queued"


def test_a_handler_of_the_programs_own_stays_in_place(db: Path) -> None:
    pressed = threading.Event()
    before = signal.signal(signal.SIGINT, lambda *_: pressed.set())
    try:
        result = gaitswarm.optimize(
            db=db, on_iteration=lambda _: signal.raise_signal(signal.SIGINT), **SMALL
        )
    finally:
        signal.signal(signal.SIGINT, before)
    assert pressed.is_set()
    assert result.job.state == "succeeded"


def test_it_runs_in_any_thread(db: Path, finished: Finished) -> None:
    results: list[gaitswarm.OptimizationResult] = []
    thread = threading.Thread(target=lambda: results.append(gaitswarm.optimize(db=db, **SMALL)))
    thread.start()
    thread.join(timeout=60.0)
    assert results[0].best.design == finished.result.best.design


def test_resuming_a_finished_job_returns_it_again(finished: Finished) -> None:
    again = gaitswarm.optimize(resume=finished.id, db=finished.db)
    assert again.job == finished.result.job
    assert again.iterations == finished.result.iterations


def test_resuming_takes_the_same_options_but_no_other(finished: Finished) -> None:
    assert gaitswarm.optimize(resume=finished.id, db=finished.db, **SMALL).job.id == finished.id
    with pytest.raises(gaitswarm.Conflict, match="another iterations, seed"):
        gaitswarm.optimize(
            resume=finished.id, db=finished.db, **{**SMALL, "seed": 8, "iterations": 5}
        )


def test_an_extended_job_is_gone_on_with(finished: Finished) -> None:
    with gaitswarm.open(finished.db) as jobs:
        jobs.extend(finished.id, 3)
    assert gaitswarm.optimize(resume=finished.id, db=finished.db).job.iterations == 3


def test_a_paused_job_is_resumed_and_a_cancelled_one_is_refused(db: Path) -> None:
    with gaitswarm.open(db) as jobs:
        paused, cancelled = (jobs.submit(**SMALL).id for _ in range(2))
        jobs.pause(paused)
        jobs.cancel(cancelled)
    assert gaitswarm.optimize(resume=paused, db=db).job.state == "succeeded"
    with pytest.raises(gaitswarm.Conflict, match="cancelled"):
        gaitswarm.optimize(resume=cancelled, db=db)


def test_a_job_that_is_cancelled_meanwhile_is_an_error_that_has_the_job(db: Path) -> None:
    def cancel(_: gaitswarm.IterationView) -> None:
        with gaitswarm.open(db) as jobs:
            jobs.cancel(next(iter(jobs.jobs())).id)

    with pytest.raises(gaitswarm.JobEnded, match="is cancelled") as raised:
        gaitswarm.optimize(db=db, on_iteration=cancel, **SMALL)
    assert raised.value.job.state == "cancelled"


@pytest.fixture
def changed(db: Path) -> str:
    """A job that was submitted where its numbers depend on other code."""

    def elsewhere(spec: Spec) -> JobProvenance:
        return job_provenance(spec).model_copy(update={"optimizer_digest": "0" * 32})

    with closing(open_store(str(db))) as store:
        job, _ = JobService(store, provenance=elsewhere).submit(gaitswarm.job_spec(**SMALL))
    return job.id


def test_a_job_whose_numbers_would_be_others_is_refused_until_that_is_accepted(
    db: Path, changed: str
) -> None:
    with pytest.raises(gaitswarm.ProvenanceChanged, match="other code of search") as raised:
        gaitswarm.optimize(resume=changed, db=db)
    assert "accept_changes=True" in str(raised.value)
    accepted = gaitswarm.optimize(resume=changed, db=db, accept_changes=True).job
    assert (accepted.state, len(accepted.provenance)) == ("succeeded", 2)


class Broken:
    """Workers on which every simulation fails."""

    slots = 1

    def evaluate(self, request: EvaluationRequest, should_stop: object) -> Any:
        raise ZeroDivisionError("a bug")

    def close(self) -> None:
        raise AssertionError("workers that were open already stay open")


def test_a_job_that_fails_is_an_error_that_says_why(db: Path) -> None:
    with pytest.raises(gaitswarm.JobEnded, match="a bug") as raised:
        gaitswarm.optimize(db=db, evaluator=Broken(), **SMALL)
    assert raised.value.job.state == "failed"
    assert gaitswarm.optimize(resume=raised.value.job.id, db=db).job.state == "succeeded"


@pytest.fixture
def workers() -> Iterator[Evaluator]:
    with closing(open_evaluator("in-process", cpus=1)) as evaluator:
        yield evaluator


def test_open_workers_serve_several_jobs(db: Path, workers: Evaluator) -> None:
    first, second = (gaitswarm.optimize(db=db, evaluator=workers, **SMALL) for _ in range(2))
    assert first.best == second.best


MISTAKES: dict[str, tuple[dict[str, Any], str]] = {
    "unknown scenario": ({"scenarios": "moon"}, "scenarios.0"),
    "gait out of reach": (
        {"scenarios": {"name": "giant", "cycle_time": 1.5, "radius": 0.9, "hip_height": 0.15}},
        "scenarios.0",
    ),
    "unknown workers": ({"evaluator": "abacus"}, "evaluator"),
    "no processor": ({"cpus": 0}, "cpus"),
    "misspelt option": ({"sed": 3}, "sed"),
    "changes of a new job": ({"accept_changes": True}, "accept_changes"),
}


@pytest.mark.parametrize(("change", "field"), MISTAKES.values(), ids=MISTAKES)
def test_a_mistake_names_the_argument_and_leaves_nothing(
    tmp_path: Path, change: dict[str, Any], field: str
) -> None:
    db = tmp_path / "none.db"
    with pytest.raises(gaitswarm.InvalidRequest) as raised:
        gaitswarm.optimize(db=db, **{**SMALL, **change})
    assert raised.value.field == field
    assert not db.exists()


class Greedy:
    """Workers of another process, which fail whatever they are given."""

    slots = 1

    def evaluate(self, request: EvaluationRequest, should_stop: object) -> Any:
        raise AssertionError("this job is another process's")

    def close(self) -> None:
        """Nothing was started."""


def test_a_job_is_taken_by_no_runner_that_waits_for_one(db: Path, finished: Finished) -> None:
    with closing(open_store(str(db))) as store:
        another = Runner(store, Greedy(), poll_seconds=0.001)
        another.start()
        result = gaitswarm.optimize(db=db, **SMALL)
        another.stop()
    assert result.job.state == "succeeded"
    assert same_history(db, result.job.id, finished)


def test_resuming_makes_no_database(tmp_path: Path) -> None:
    db = tmp_path / "none.db"
    with pytest.raises(gaitswarm.NotFound, match=r"none\.db"):
        gaitswarm.optimize(resume="k2q7zr5dm9xw", db=db)
    assert not db.exists()


def test_a_queued_job_is_run_by_any_process_with_the_database_open(
    db: Path, finished: Finished
) -> None:
    with gaitswarm.open(db) as jobs:
        job = jobs.submit(**SMALL)
        seen: list[int] = []
        ended = jobs.run(job.id, on_iteration=lambda iteration: seen.append(iteration.index))
        assert seen == [0, 1]
        assert ended == jobs.job(job.id)
    assert same_history(db, job.id, finished)


def test_a_run_that_is_stopped_returns_the_job_as_it_gave_it_back(db: Path) -> None:
    stop = threading.Event()
    with gaitswarm.open(db) as jobs:
        job = jobs.submit(**SMALL)
        stopped = jobs.run(job.id, on_iteration=lambda _: stop.set(), stop=stop)
    assert (stopped.state, stopped.iterations) == ("queued", 1)


def test_a_missing_database_is_noticed_on_entering(tmp_path: Path) -> None:
    with pytest.raises(gaitswarm.NotFound):
        gaitswarm.open(tmp_path / "none.db", create=False)
    assert list(tmp_path.glob("*.db")) == []
