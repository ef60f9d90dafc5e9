"""Jobs whose robot takes too much: the job fails with the reason, and the runner goes on."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from gaitswarm.services.optimizer.jobs.job import JobState
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.run.runner import Runner
from gaitswarm.services.optimizer.store import Store
from gaitswarm.services.worker.dispatch import InProcessEvaluator
from gaitswarm.sim.errors import ProcessEnded
from gaitswarm.sim.kernel.emitted import source
from gaitswarm.sim.robot import RobotFiles
from tests.examples.hostile import TOML, URDF
from tests.examples.processes import eventually

pytestmark = pytest.mark.slow


def spec(robot: RobotFiles | str) -> JobSpec:
    return JobSpec.model_validate(
        {
            "robot": robot,
            "controller": "pi",
            "scenarios": ["1"],
            "optimizer": {"name": "pso", "particles": 2},
            "iterations": 1,
        }
    )


def test_a_robot_without_a_kernel_fails_its_job_and_the_runner_takes_the_next(
    store: Store, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def ended(_: object) -> dict[str, object]:
        raise ProcessEnded("took more than 4096 MiB of memory")

    monkeypatch.setattr(source.PROCESSES, "ask", ended)
    # An axis that no robot had before: there is no kernel in the cache.
    tilted = f'<axis xyz="-1 0 {time.time_ns() % 10**9 * 1e-12:.12f}"/>'
    hostile = RobotFiles(toml=TOML, urdf=URDF.replace('<axis xyz="-1 0 0"/>', tilted))
    first, _ = store.create_job(spec(hostile))
    second, _ = store.create_job(spec("szabadka2"))
    evaluator = InProcessEvaluator(1)
    runner = Runner(store, evaluator, concurrency=1, poll_seconds=0.05)
    runner.start()
    try:
        eventually(lambda: store.job(second.id).state.terminal, seconds=120.0)
    finally:
        runner.stop()
        evaluator.close()
    failed = store.job(first.id)
    assert failed.state is JobState.FAILED
    assert failed.error is not None
    assert "its derivation took more than 4096 MiB of memory" in failed.error
    assert store.job(second.id).state is JobState.SUCCEEDED
