"""Ray: processes that die, their memory, and leftovers."""

from __future__ import annotations

import logging
import os
import pickle
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from unittest.mock import Mock

import pytest

from gaitswarm.services.optimizer.errors import EvaluatorUnavailable
from gaitswarm.services.optimizer.jobs.job import JobState
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.run.evaluator import EvaluationRequest, EvaluationStopped
from gaitswarm.services.optimizer.run.runner import Runner
from gaitswarm.services.optimizer.store import Store
from gaitswarm.services.worker.ray_evaluator import RayEvaluator
from gaitswarm.services.worker.tasks import transportable
from gaitswarm.sim.case import Walk
from gaitswarm.sim.errors import SimulationError, SimulationInputError, UnreachablePose
from gaitswarm.sim.outcome import Outcome
from tests.examples.jobs import SMALL_SPEC
from tests.examples.paths import ROOT
from tests.examples.processes import eventually, output, within
from tests.worker.cases import Deadly, Sleep
from tests.worker.conftest import LocalRay
from tests.worker.processes import Process, descendants, walkers
from tests.worker.requests import bits, never, request, walked_at_once


@pytest.mark.slow
def test_walks_whose_worker_is_killed_are_walked_again_to_the_same_bits(
    ray_evaluator: RayEvaluator,
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    caplog: pytest.LogCaptureFixture,
) -> None:
    """What Ray prints of it is logged, and not written among the answers of a command."""
    caplog.set_level(logging.INFO, logger="gaitswarm.services.worker.ray_evaluator")
    wanted = request(4)
    first, second = wanted.cases
    assert isinstance(first, Walk)
    deadly = replace(wanted, cases=(Deadly(first, tmp_path / "deaths", times=1), second))
    assert bits(ray_evaluator.evaluate(deadly, never)) == bits(walked_at_once(wanted))
    assert len((tmp_path / "deaths").read_text().split()) == 1
    assert within(20.0, lambda: "raylet: A worker died" in caplog.text)
    assert capfd.readouterr().out == ""


@pytest.mark.slow
def test_a_job_whose_simulation_crashes_its_process_fails_and_its_runner_continues(
    ray_evaluator: RayEvaluator, store: Store, tmp_path: Path
) -> None:
    wanted = request(1)
    walk = wanted.cases[0]
    assert isinstance(walk, Walk)
    wanted = replace(wanted, cases=(Deadly(walk, tmp_path / "deaths", times=9),))

    class Crashing:
        """The evaluator of a runner, with another request for the first job."""

        slots = 2

        def evaluate(
            self, request: EvaluationRequest, should_stop: Callable[[], bool]
        ) -> tuple[Outcome, ...]:
            if request.job_id == first.id:
                request = replace(wanted, job_id=first.id)
            return ray_evaluator.evaluate(request, should_stop)

        def close(self) -> None: ...

    spec = JobSpec.model_validate(SMALL_SPEC)
    first, second = (store.create_job(spec)[0] for _ in range(2))
    runner = Runner(store, Crashing(), concurrency=1, poll_seconds=0.05)
    runner.start()
    try:
        eventually(lambda: store.job(second.id).state.terminal, seconds=120.0)
    finally:
        runner.stop()
    failed = store.job(first.id)
    assert failed.state is JobState.FAILED
    assert "3 worker processes died" in (failed.error or "")
    assert "design 0 of the iteration in 'deadly'" in (failed.error or "")
    assert store.job(second.id).state is JobState.SUCCEEDED
    died = (tmp_path / "deaths").read_text().split()
    assert len(died) == len(set(died)) == 3


@pytest.mark.thorough("test_work_is_dropped_when_it_is_stopped")
@pytest.mark.slow
def test_tasks_that_are_not_awaited_any_more_leave_their_slots(
    ray_evaluator: RayEvaluator,
) -> None:
    sound = request(2)
    walk = sound.cases[0]
    assert isinstance(walk, Walk)
    endless = replace(sound, job_id="endless", cases=(Sleep(walk),))

    def begun() -> bool:
        return any("simulate sleep" in worker.title for worker in walkers(os.getpid()))

    with pytest.raises(EvaluationStopped):
        ray_evaluator.evaluate(endless, begun)
    assert within(20.0, lambda: not begun())
    assert bits(ray_evaluator.evaluate(sound, never)) == bits(walked_at_once(sound))


@pytest.mark.slow
def test_cases_of_all_iterations_of_a_job_are_sent_once(
    ray_evaluator: RayEvaluator, monkeypatch: pytest.MonkeyPatch
) -> None:
    import ray

    put = Mock(side_effect=ray.put)
    monkeypatch.setattr(ray, "put", put)
    for seed in (1, 2):
        ray_evaluator.evaluate(request(5, job_id="shared", seed=seed), never)
    assert put.call_count == 1


@pytest.mark.slow
def test_a_worker_takes_at_most_500_megabytes_and_has_loaded_only_what_walks_need(
    ray_evaluator: RayEvaluator,
) -> None:
    ray_evaluator.evaluate(request(20), never)
    at_work = walkers(os.getpid())
    assert at_work
    assert max(worker.resident for worker in at_work) <= 500e6
    for library in ("casadi", "pinocchio", "sqlalchemy"):
        assert not any(worker.has_loaded(library) for worker in at_work)


@pytest.mark.slow
def test_a_second_ray_in_the_same_process_is_refused(ray_evaluator: RayEvaluator) -> None:
    ray_evaluator.wait_until_open(never)
    with pytest.raises(EvaluatorUnavailable, match="already"):
        RayEvaluator(cpus=1).wait_until_open(never)


@contextmanager
def driver(folder: Path) -> Iterator[subprocess.Popen[str]]:
    """A process of its own that simulates in threads, on Ray, and loses it."""
    environment = os.environ | {"PYTHONPATH": str(ROOT), "HOME": str(folder)}
    # Kernels are those of this home, not compiled again.
    environment.setdefault("XDG_CACHE_HOME", str(Path.home() / ".cache"))
    for name in [name for name in environment if name.startswith("RAY_")]:
        del environment[name]
    with subprocess.Popen(
        [sys.executable, "-m", "tests.worker.driver"],
        cwd=ROOT,
        env=environment,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as started:
        try:
            yield started
        finally:
            if started.poll() is None:
                os.killpg(started.pid, signal.SIGKILL)


@pytest.mark.thorough("test_ray_takes_over_from_threads_to_the_same_bits")
@pytest.mark.slow
def test_a_local_ray_whose_raylet_dies_is_opened_again_and_ends_with_its_process(
    tmp_path: Path,
) -> None:
    with driver(tmp_path) as started:
        steps = [output(started.stdout).readline().strip() for _ in range(4)]
        assert steps == ["threads", "ray", "threads", "ray"]
        # Ray's own default; workers of other tests run at a higher priority.
        niceness = {os.getpriority(os.PRIO_PROCESS, p.pid) for p in walkers(started.pid)}
        assert min(niceness) > 4
        vital = processes_of_ray(started.pid)
        assert len(vital) >= 3
        os.kill(started.pid, signal.SIGKILL)
        assert within(5.0, lambda: not any(p.alive for p in vital))
        assert not (tmp_path / ".ray").exists()
        for directory in traces(started.pid):
            shutil.rmtree(directory, ignore_errors=True)


@pytest.mark.slow
def test_a_closed_ray_leaves_nothing(local_ray: LocalRay) -> None:
    local_ray.opened().wait_until_open(never)
    below = processes_of_ray(os.getpid())
    assert len(below) >= 3
    assert traces(os.getpid())
    local_ray.close()
    assert within(10.0, lambda: not any(p.alive for p in below))
    assert not traces(os.getpid())


def processes_of_ray(pid: int) -> list[Process]:
    titles = ("gcs_server", "raylet/raylet", "ray::")
    return [p for p in descendants(pid) if any(title in p.title for title in titles)]


def traces(pid: int) -> list[Path]:
    return list(Path(tempfile.gettempdir()).glob(f"gaitswarm-ray-{pid}-*"))


def test_an_error_that_cannot_be_pickled_keeps_its_family_and_its_words() -> None:
    carried = transportable(UnreachablePose("slope-fast", "left front", 0.0123))
    assert isinstance(carried, SimulationError)
    again = pickle.loads(pickle.dumps(carried))  # noqa: S301
    assert "12.3 mm" in str(again)


def test_an_error_that_can_be_pickled_is_carried_as_itself() -> None:
    error = SimulationInputError("FOMF: 7")
    assert transportable(error) is error
