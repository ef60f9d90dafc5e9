"""A process killed in the middle of a long iteration loses only the tasks in progress"""

from __future__ import annotations

import sqlite3
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import Engine, event

from gaitswarm.services.optimizer.jobs.job import Claim, JobState
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.run.execution import RunContext, run_claim
from gaitswarm.services.optimizer.store import Store, open_store
from tests.examples.forked import PROCESSES
from tests.examples.jobs import history
from tests.examples.processes import eventually
from tests.examples.walks import SHORT_WALK, UPHILL_WALK
from tests.resume.job_process import LEASE, LongEvaluator, run_endlessly

SPEC = JobSpec.model_validate(
    {
        "controller": "pi",
        "scenarios": [SHORT_WALK | {"name": "level"}, UPHILL_WALK],
        "optimizer": {"name": "pso", "particles": 5},
        "iterations": 2,
        "seed": 4,
    }
)
TASKS = 10
"""Of an iteration."""

FINISHED = 7
"""Of the first iteration, when the process is killed."""


def run(store: Store, claim: Claim, log: Path) -> str:
    with closing(LongEvaluator(log)) as evaluator:
        done = run_claim(claim, RunContext(store, evaluator, lease_seconds=LEASE))
    assert done.state is JobState.SUCCEEDED
    return done.id


def journaled(database: Path) -> int:
    """Return how many designs' outcomes are in the journal."""
    with closing(sqlite3.connect(database)) as connection:
        (count,) = connection.execute("SELECT sum(length(statuses)) FROM journal").fetchone()
    return count or 0


def lines(log: Path) -> list[str]:
    return log.read_text(encoding="utf-8").splitlines()


@pytest.mark.slow
def test_a_job_killed_in_an_iteration_resumes_with_what_was_not_finished(tmp_path: Path) -> None:
    url, before, after = f"sqlite:///{tmp_path}/jobs.db", tmp_path / "before", tmp_path / "after"
    with closing(open_store(url)) as store:
        queued, _ = store.create_job(SPEC)
        process = PROCESSES.Process(target=run_endlessly, args=(url, FINISHED, before))
        process.start()
        eventually(lambda: journaled(tmp_path / "jobs.db") == FINISHED)
        process.kill()
        process.join()
        while (claim := store.claim("next", lease_seconds=LEASE)) is None:
            time.sleep(0.05)
        run(store, claim, after)
        assert len(lines(after)) == SPEC.iterations * TASKS - FINISHED
        assert not journaled(tmp_path / "jobs.db")
        claim = store.create_claimed_job(SPEC, "runner", lease_seconds=LEASE)
        alone = run(store, claim, after)
        assert history(store, queued.id) == history(store, alone)


@contextmanager
def statements() -> Iterator[list[str]]:
    seen = list[str]()

    def note(_connection: Any, _cursor: Any, statement: str, *_: Any) -> None:
        seen.append(statement)

    event.listen(Engine, "before_cursor_execute", note)
    yield seen
    event.remove(Engine, "before_cursor_execute", note)


def test_a_job_of_short_iterations_has_no_statement_more(tmp_path: Path) -> None:
    with closing(open_store(str(tmp_path / "jobs.db"))) as store, statements() as seen:
        run(store, store.create_claimed_job(SPEC, "runner", lease_seconds=LEASE), tmp_path / "log")
    assert seen and not [statement for statement in seen if "journal" in statement]
