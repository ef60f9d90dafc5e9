"""`gaitswarm runner`, the process that runs queued jobs."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from cli.exit_codes import ExitCode
from gaitswarm.jobs.open import open_jobs
from services.optimizer.jobs.job import JobState
from services.optimizer.jobs.tuning import JobSpec
from services.runtime import open_store

pytestmark = pytest.mark.slow

ROOT = Path(__file__).resolve().parents[2]


def spec(iterations: int) -> JobSpec:
    return JobSpec.model_validate(
        {
            "controller": "pi",
            "scenarios": [
                {
                    "name": "short",
                    "cycle_time": 1.0,
                    "radius": 0.16,
                    "hip_height": 0.15,
                    "cycles": 1,
                }
            ],
            "optimizer": {"name": "pso", "particles": 4},
            "iterations": iterations,
        }
    )


@contextmanager
def runner(**settings: str) -> Iterator[subprocess.Popen[str]]:
    environment = os.environ | {"PYTHONPATH": str(ROOT), "GAITSWARM_EVALUATOR": "in-process"}
    environment |= {f"GAITSWARM_{name}": value for name, value in settings.items()}
    with subprocess.Popen(
        [sys.executable, "-c", "from cli.main import main; main()", "runner"],
        env=environment,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as started:
        try:
            yield started
        finally:
            if started.poll() is None:
                os.killpg(started.pid, signal.SIGKILL)


def eventually(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 60.0
    while not condition():
        assert time.monotonic() < deadline, "it did not happen within a minute"
        time.sleep(0.05)


@pytest.mark.parametrize("ending", [signal.SIGTERM, signal.SIGINT])
def test_runs_what_is_queued_and_gives_back_what_it_has_not_finished(
    tmp_path: Path, ending: signal.Signals
) -> None:
    url = f"sqlite:///{tmp_path}/jobs.db"
    store = open_store(url)
    short, _ = store.create_job(spec(2))
    endless, _ = store.create_job(spec(1_000_000))
    with runner(DB=url, CPUS="1") as started:
        eventually(lambda: store.job(short.id).state is JobState.SUCCEEDED)
        eventually(lambda: store.job(endless.id).progress.iterations > 0)
        started.send_signal(ending)
        assert started.wait(timeout=20) == 0
    assert store.job(endless.id).state is JobState.QUEUED
    store.close()


def test_without_settings_it_runs_the_jobs_of_the_users_own_database() -> None:
    with open_jobs(None, None, create=True) as jobs:
        job = jobs.submit(spec(1))
        with runner(CPUS="1"):
            eventually(lambda: jobs.job(job.id).state is JobState.SUCCEEDED)


@pytest.mark.parametrize(
    ("name", "value"), [("CPUS", "none"), ("LEASE_SECONDS", "0"), ("EVALUATOR", "abacus")]
)
def test_a_setting_that_makes_no_sense_is_named(name: str, value: str) -> None:
    with runner(**{name: value}) as started:
        _, said = started.communicate(timeout=60)
    assert started.returncode == ExitCode.BAD_INPUT
    assert f"GAITSWARM_{name}" in said


def test_a_database_out_of_reach_is_reported_without_a_traceback(tmp_path: Path) -> None:
    with runner(DB=f"sqlite:///{tmp_path}/no/such/folder/jobs.db") as started:
        _, said = started.communicate(timeout=60)
    assert started.returncode == ExitCode.UNAVAILABLE
    assert "Traceback" not in said and "no/such/folder" in said
