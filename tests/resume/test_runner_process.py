"""`gaitswarm runner`, the process that runs queued jobs."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path

import pytest

from gaitswarm.cli.exit_codes import ExitCode
from gaitswarm.jobs.open import open_jobs
from gaitswarm.services.optimizer.jobs.job import JobState
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.store import Store
from tests.examples.forked import ForkedCommand
from tests.examples.jobs import LONG_SPEC, SMALL_SPEC
from tests.examples.processes import eventually, line_with

pytestmark = pytest.mark.slow


LONG = JobSpec.model_validate(LONG_SPEC)


def spec(iterations: int) -> JobSpec:
    return JobSpec.model_validate(SMALL_SPEC | {"controller": "pi", "iterations": iterations})


@contextmanager
def runner(**settings: str) -> Iterator[ForkedCommand]:
    environment = {"GAITSWARM_EVALUATOR": "in-process"}
    environment |= {f"GAITSWARM_{name}": value for name, value in settings.items()}
    with ForkedCommand(
        "runner", environment=environment, stdout=None, start_new_session=True
    ) as started:
        try:
            yield started
        finally:
            if started.poll() is None:
                os.killpg(started.pid, signal.SIGKILL)


def test_a_signal_lets_the_iteration_under_way_be_committed_and_a_second_one_drops_it(
    store: Store, database: Path
) -> None:
    job, _ = store.create_job(LONG)

    def progress() -> tuple[JobState, int]:
        found = store.job(job.id)
        return found.state, found.progress.iterations

    with runner(DB=str(database), CPUS="1") as started:
        eventually(lambda: progress() == (JobState.RUNNING, 1))
        signalled_at = datetime.now(UTC)
        started.send_signal(signal.SIGINT)
        assert started.wait(timeout=60) == 0
    assert progress() == (JobState.QUEUED, 2)
    (last,) = store.iterations(job.id, after=0).items
    assert last.committed_at > signalled_at
    # It does not wait for a lease.
    claim = store.claim("another", lease_seconds=60.0, job_id=job.id)
    assert claim is not None and claim.ask is not None
    assert claim.ask.iteration == 2
    store.release(claim, JobState.QUEUED)

    with runner(DB=str(database), CPUS="1") as started:
        eventually(lambda: progress() == (JobState.RUNNING, 2))
        started.send_signal(signal.SIGTERM)
        line_with(started.stderr, "stopping: jobs commit")
        started.send_signal(signal.SIGTERM)
        assert started.wait(timeout=60) == 0
    assert progress() == (JobState.QUEUED, 2)


def test_without_settings_it_runs_the_jobs_of_the_users_own_database() -> None:
    with open_jobs(None, None, create=True) as jobs:
        job = jobs.submit(spec(1))
        with runner(CPUS="1"):
            eventually(lambda: jobs.job(job.id).state is JobState.SUCCEEDED)


@pytest.mark.variants
@pytest.mark.parametrize(
    ("name", "value"), [("CPUS", "none"), ("LEASE_SECONDS", "0"), ("EVALUATOR", "abacus")]
)
def test_an_invalid_setting_is_named(name: str, value: str) -> None:
    with runner(**{name: value}) as started:
        _, said = started.communicate(timeout=60)
    assert started.returncode == ExitCode.BAD_INPUT
    assert f"GAITSWARM_{name}" in said


def test_a_database_out_of_reach_is_reported_without_a_traceback(tmp_path: Path) -> None:
    with runner(DB=f"sqlite:///{tmp_path}/no/such/folder/jobs.db") as started:
        _, said = started.communicate(timeout=60)
    assert started.returncode == ExitCode.UNAVAILABLE
    assert "Traceback" not in said and "no/such/folder" in said
