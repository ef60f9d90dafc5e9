"""A short fault campaign: histories keep their bits without intervention"""

from __future__ import annotations

import sqlite3
from collections import Counter
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks.faults.campaign import remembered, run, specs, undisturbed
from benchmarks.faults.deployment import DatabaseKind, Deployment
from benchmarks.faults.kinds import KINDS
from benchmarks.faults.plan import plan
from gaitswarm.services.optimizer.store import open_store
from gaitswarm.services.runtime import run_embedded
from gaitswarm.services.worker.dispatch import InProcessEvaluator
from tests.store.postgres_server import server_binaries


def test_a_plan_is_drawn_from_its_seed_and_gives_every_kind_its_turn() -> None:
    kinds = {"a": None, "b": None, "c": None, "d": 1}
    drawn = plan(1, 12, kinds)
    assert plan(1, 12, kinds) == drawn != plan(2, 12, kinds)
    times = Counter(fault.kind for fault in drawn)
    assert sorted(times.values()) == [1, 3, 4, 4]
    assert times["d"] == 1


@pytest.mark.slow
def test_the_campaign_sees_a_single_bit_that_differs(tmp_path: Path) -> None:
    (spec, *_) = specs(2)
    (alone,) = undisturbed([spec])
    path = tmp_path / "jobs.db"
    with (
        closing(open_store(str(path))) as store,
        closing(InProcessEvaluator(1)) as evaluator,
    ):
        job, _ = store.create_job(spec)
        run_embedded(store, evaluator, job.id)
        assert remembered(store, job.id) == alone
        with closing(sqlite3.connect(path)) as connection, connection:
            (fitness,) = connection.execute("SELECT fitness FROM evaluations LIMIT 1").fetchone()
            changed = fitness * (1.0 + 2.0**-52)
            connection.execute("UPDATE evaluations SET fitness = ? WHERE rowid = 1", [changed])
        assert remembered(store, job.id) != alone


KINDS_OF: dict[DatabaseKind, list[str]] = {
    "sqlite": [
        *("kill-runner", "kill-api", "stop-runner", "database-locked", "disk-full", "clock-step"),
        *("fork-refused", "out-of-memory", "clock-step-kill", "disk-error", "file-replaced"),
        "slow-receiver",
    ],
    "postgresql": ["kill-postgresql", "partition", "disk-error"],
}
"""Tried with each database."""


@pytest.mark.thorough(
    "all kinds of faults with all processes of a deployment",
    "test_resumed_job_equals_one_never_killed",
    "test_a_crash_of_the_server_in_mid_run_changes_no_bit_of_a_history",
)
@pytest.mark.slow
@pytest.mark.parametrize("database", KINDS_OF)
def test_failing_processes_and_services_change_no_bit(
    database: DatabaseKind,
) -> None:
    if database == "postgresql":
        server_binaries()
    kinds = KINDS_OF[database]
    with Deployment(database) as deployment:
        possible = [kind for kind in kinds if KINDS[kind].possible(deployment)]
        planned = plan(1, len(possible), dict.fromkeys(possible), pause=0.2)
        # The first runner, the whole server, the cable to the API; as short as it may be.
        shortest = [replace(fault, draw=0.0, length=0.0) for fault in planned]
        result = run(deployment, shortest, iterations=12, patience=60.0)
    assert sorted(kind for kind, _, _ in result.faults) == sorted(possible)
    assert result.jobs > 0
    assert (result.lost, result.different, result.manual) == (0, [], [])
    victims = {"sqlite": ["api", "runner-0"], "postgresql": ["postgresql"]}[database]
    assert all(result.restarts[victim] > 0 for victim in victims)
