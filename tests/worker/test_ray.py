"""Ray: processes that die, their memory, and leftovers."""

from __future__ import annotations

import importlib
import logging
import os
import pickle
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from gaitswarm.services.optimizer.errors import EvaluatorUnavailable, KilledWorker
from gaitswarm.services.optimizer.run.evaluator import EvaluationStopped
from gaitswarm.services.worker.ray_evaluator import RayEvaluator
from gaitswarm.services.worker.tasks import transportable
from gaitswarm.sim.case import Case
from gaitswarm.sim.errors import SimulationError, SimulationInputError, UnreachablePose
from gaitswarm.sim.outcome import Outcome
from tests.examples.paths import ROOT
from tests.examples.processes import output, within
from tests.worker.processes import Process, descendants, walkers
from tests.worker.requests import bits, never, request, walked_at_once


@pytest.mark.slow
def test_walks_whose_worker_is_killed_are_walked_again_to_the_same_bits(
    ray_evaluator: RayEvaluator,
) -> None:
    wanted = request(300)
    expected = bits(ray_evaluator.evaluate(wanted, never))
    killed: list[int] = []

    def kill_one_at_work() -> None:
        while not killed:
            for worker in walkers(os.getpid()):
                if "run_in_worker" in worker.title:
                    os.kill(worker.pid, signal.SIGKILL)
                    killed.append(worker.pid)
                    return

    killer = threading.Thread(target=kill_one_at_work)
    killer.start()
    found = ray_evaluator.evaluate(wanted, never)
    killer.join()
    assert len(killed) == 1
    assert bits(found) == expected


class Deadly:
    """A case that ends its process."""

    def __init__(self, like: Case, deaths: Path) -> None:
        self.name, self.duration, self.robots = "deadly", like.duration, like.robots
        self.objectives, self.precision = like.objectives, like.precision
        self.deaths = deaths

    def run(self, designs: NDArray[np.float64]) -> Outcome:
        with self.deaths.open("a") as file:
            file.write(f"{os.getpid()}\n")
        os.kill(os.getpid(), signal.SIGKILL)
        raise AssertionError(designs)


@pytest.mark.slow
def test_walks_that_kill_their_workers_are_tried_on_three_and_then_given_up(
    ray_evaluator: RayEvaluator, tmp_path: Path
) -> None:
    sound = request(2)
    deadly = Deadly(sound.cases[0], tmp_path / "deaths")
    with pytest.raises(KilledWorker, match=r"3 worker .* designs 0 to 1 .* in 'deadly'"):
        ray_evaluator.evaluate(replace(sound, cases=(deadly,)), never)
    died = deadly.deaths.read_text().split()
    assert len(died) == len(set(died)) == 3
    assert not ray_evaluator.lost
    assert bits(ray_evaluator.evaluate(sound, never)) == bits(walked_at_once(sound))


@pytest.mark.slow
def test_what_ray_tells_of_its_workers_is_logged_and_not_written_among_a_commands_answers(
    ray_evaluator: RayEvaluator,
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    caplog: pytest.LogCaptureFixture,
) -> None:
    caplog.set_level(logging.INFO, logger="gaitswarm.services.worker.ray_session")
    sound = request(2)
    deadly = Deadly(sound.cases[0], tmp_path / "deaths")
    with pytest.raises(KilledWorker):
        ray_evaluator.evaluate(replace(sound, cases=(deadly,)), never)
    assert within(20.0, lambda: "raylet: A worker died" in caplog.text)
    assert capfd.readouterr().out == ""


class Importing:
    """A case that imports a module, whose import takes long."""

    def __init__(self, like: Case, folder: Path) -> None:
        self.name, self.duration, self.robots = "importing", like.duration, like.robots
        self.objectives, self.precision = like.objectives, like.precision
        self.folder = folder
        (folder / "gaitswarm_slow_module.py").write_text(
            "import pathlib, time\n"
            f"log = pathlib.Path({str(folder / 'imported')!r}).open('a', buffering=1)\n"
            "print('begun', file=log)\n"
            "until = time.monotonic() + 4.0\n"
            "while time.monotonic() < until:\n"
            "    time.sleep(0.01)\n"
            "print('ended', file=log)\n"
        )

    @property
    def imported(self) -> list[str]:
        """What became of each import."""
        log = self.folder / "imported"
        return log.read_text().split() if log.exists() else []

    def run(self, designs: NDArray[np.float64]) -> Outcome:
        sys.path.append(str(self.folder))
        importlib.import_module("gaitswarm_slow_module")
        until = time.monotonic() + 60.0
        while time.monotonic() < until:
            time.sleep(0.01)
        raise AssertionError(designs)


@pytest.mark.slow
def test_a_task_that_is_cancelled_in_an_import_ends_the_import_first_and_its_slot_walks_on(
    ray_evaluator: RayEvaluator, tmp_path: Path
) -> None:
    sound = request(2)
    ray_evaluator.evaluate(sound, never)
    importing = Importing(sound.cases[0], tmp_path)
    # A second after it is let go it is cancelled.
    with pytest.raises(EvaluationStopped):
        ray_evaluator.evaluate(
            replace(sound, job_id="importing", cases=(importing,), designs=sound.designs[:1]),
            lambda: bool(importing.imported),
        )
    assert within(30.0, lambda: importing.imported == ["begun", "ended"]), importing.imported
    assert within(30.0, lambda: ray_evaluator.loads["ray"].used == 0)
    assert bits(ray_evaluator.evaluate(sound, never)) == bits(walked_at_once(sound))


@pytest.mark.slow
def test_walks_of_a_worker_that_hangs_are_walked_by_another_to_the_same_bits(
    ray_evaluator: RayEvaluator,
) -> None:
    wanted = request(300, job_id="hangs")
    expected = bits(ray_evaluator.evaluate(wanted, never))
    stopped: list[int] = []

    def stop_one_at_work() -> None:
        while not stopped:
            for worker in walkers(os.getpid()):
                if "run_in_worker" in worker.title:
                    os.kill(worker.pid, signal.SIGSTOP)
                    stopped.append(worker.pid)
                    return

    stopper = threading.Thread(target=stop_one_at_work)
    stopper.start()
    try:
        found = ray_evaluator.evaluate(wanted, never)
    finally:
        stopper.join()
        for pid in stopped:
            os.kill(pid, signal.SIGCONT)
    assert len(stopped) == 1
    assert bits(found) == expected


@pytest.mark.slow
def test_a_worker_takes_at_most_500_megabytes_and_has_loaded_only_what_walks_need(
    ray_evaluator: RayEvaluator,
) -> None:
    ray_evaluator.evaluate(request(200), never)
    at_work = walkers(os.getpid())
    assert len(at_work) >= 2
    assert max(worker.resident for worker in at_work) <= 500e6
    for library in ("casadi", "pinocchio", "sqlalchemy"):
        assert not any(worker.has_loaded(library) for worker in at_work)


@pytest.mark.slow
def test_a_second_ray_in_the_same_process_is_refused(ray_evaluator: RayEvaluator) -> None:
    ray_evaluator.wait_until_open(never)
    with pytest.raises(EvaluatorUnavailable, match="already"):
        RayEvaluator(cpus=1).wait_until_open(never)


@contextmanager
def driver(ending: str, home: Path) -> Iterator[subprocess.Popen[str]]:
    environment = os.environ | {"PYTHONPATH": str(ROOT), "HOME": str(home)}
    # Kernels are those of this home, not compiled again.
    environment.setdefault("XDG_CACHE_HOME", str(Path.home() / ".cache"))
    for name in [name for name in environment if name.startswith("RAY_")]:
        del environment[name]
    with subprocess.Popen(
        [sys.executable, str(ROOT / "tests/worker/driver.py"), ending],
        env=environment,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as started:
        try:
            line = output(started.stdout).readline()
            assert line == "walked\n", output(started.stderr).read()
            yield started
        finally:
            if started.poll() is None:
                os.killpg(started.pid, signal.SIGKILL)


def traces(pid: int) -> list[Path]:
    return list(Path(tempfile.gettempdir()).glob(f"gaitswarm-ray-{pid}-*"))


@pytest.mark.slow
def test_after_closing_nothing_runs_nothing_lies_about_and_nothing_was_said(
    tmp_path: Path,
) -> None:
    with driver("close", tmp_path) as started:
        below = descendants(started.pid)
        # As Ray itself has them; those of other tests are hardly nice (tests/conftest.py).
        niceness = {os.getpriority(os.PRIO_PROCESS, p.pid) for p in walkers(started.pid)}
        assert min(niceness) > 4
        assert traces(started.pid)
        _, said = started.communicate("now\n", timeout=60)
        assert started.returncode == 0
        assert said == ""
        assert within(10.0, lambda: not any(p.alive for p in below))
        assert not traces(started.pid)
    assert not (tmp_path / ".ray").exists()


@pytest.mark.slow
def test_a_cluster_that_was_lost_is_noticed_and_opened_again_with_the_same_bits(
    tmp_path: Path,
) -> None:
    """And the one that was opened again is gone within seconds after its driver is killed."""
    with driver("lose", tmp_path) as started:
        lost, stopped, terminated = (output(started.stdout).readline() for _ in range(3))
        assert "Ray was lost" in lost
        # A stop need not wait until Ray is open again, and its signals are ours.
        assert (stopped, terminated) == ("stopped\n", "heard\n")
        vital = [p for p in descendants(started.pid) if p in walkers(started.pid) or is_daemon(p)]
        assert len(vital) >= 3
        os.kill(started.pid, signal.SIGKILL)
        gone = within(5.0, lambda: not any(p.alive for p in vital))
        survivors = [p.title for p in vital if p.alive]
        assert gone, survivors
        for directory in traces(started.pid):
            shutil.rmtree(directory, ignore_errors=True)


def is_daemon(candidate: Process) -> bool:
    return any(name in candidate.title for name in ("gcs_server", "raylet/raylet"))


def test_an_error_that_cannot_be_pickled_keeps_its_family_and_its_words() -> None:
    carried = transportable(UnreachablePose("slope-fast", "left front", 0.0123))
    assert isinstance(carried, SimulationError)
    again = pickle.loads(pickle.dumps(carried))  # noqa: S301
    assert "12.3 mm" in str(again)


def test_an_error_that_can_be_pickled_is_carried_as_itself() -> None:
    error = SimulationInputError("FOMF: 7")
    assert transportable(error) is error
