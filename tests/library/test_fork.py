"""A job is forked alike in a database and behind a server."""

from __future__ import annotations

from pathlib import Path
from typing import Any, cast

import pytest

import gaitswarm
from tests.library.conftest import SMALL, Finished, Reach

pytestmark = pytest.mark.slow


def test_a_fork_is_queued_with_the_iterations_before_the_one_that_is_named(
    reach: Reach, finished: Finished
) -> None:
    jobs = reach(finished.db)
    fork = jobs.fork(finished.id, 1, name="again", idempotency_key="k")
    assert (fork.state, fork.name, fork.iterations, fork.evaluations) == ("queued", "again", 1, 3)
    assert fork.lineage is not None
    assert (fork.lineage.parent, fork.lineage.from_iteration) == (finished.id, 1)
    assert fork.lineage.carried == "search"
    assert [job.id for job in jobs.jobs(parent=finished.id)] == [fork.id]
    assert jobs.fork(finished.id, 1, name="again", idempotency_key="k").id == fork.id
    with pytest.raises(gaitswarm.IdempotencyConflict):
        jobs.fork(finished.id, 2, iterations=4, idempotency_key="k")
    taken, whole = (list(jobs.history(job)) for job in (fork.id, finished.id))
    assert [i.evaluations for i in taken] == [i.evaluations for i in whole[:1]]


def test_a_fork_that_is_run_ends_as_its_parent(finished: Finished) -> None:
    with gaitswarm.open(finished.db) as jobs:
        fork = jobs.run(jobs.fork(finished.id, 1).id)
        assert fork.best == finished.result.job.best
        assert list(jobs.evaluations(fork.id).fitness) == list(
            jobs.evaluations(finished.id).fitness
        )


def test_a_fork_in_another_scenario_of_another_method_starts_from_the_best_design(
    reach: Reach, finished: Finished
) -> None:
    jobs = reach(finished.db)
    fork = jobs.fork(
        finished.id, 2, scenarios="normal-slow", optimizer="random", particles=4, start_count=1
    )
    assert (fork.scenarios, fork.optimizer, fork.particles) == (["normal-slow"], "random", 4)
    assert fork.lineage is not None
    assert (fork.lineage.carried, fork.lineage.changed) == ("designs", ("optimizer", "scenarios"))
    assert finished.result.best.design == {**fork.spec.start[0]}  # type: ignore[index]


def test_a_fork_that_makes_no_sense_is_refused_by_name(reach: Reach, finished: Finished) -> None:
    jobs = reach(finished.db)
    for given, field in (
        ({"from_iteration": 0}, "from_iteration"),
        ({"from_iteration": 3}, "from_iteration"),
        ({"from_iteration": 1, "preference": cast(Any, "Z")}, "preference"),
        ({"from_iteration": 1, "robot": "spot"}, "robot"),
        ({"from_iteration": 1, "iterations": 1}, "iterations"),
    ):
        with pytest.raises(gaitswarm.InvalidRequest) as refused:
            jobs.fork(finished.id, **cast(Any, given))
        assert refused.value.field == field
    with pytest.raises(gaitswarm.NotFound):
        jobs.fork("nosuchjob", 1)


def test_a_job_that_has_not_begun_cannot_be_forked(reach: Reach, db: Path) -> None:
    jobs = reach(db)
    job = jobs.submit(**SMALL)
    assert "fork" not in job.links
    with pytest.raises(gaitswarm.InvalidRequest, match="no iteration yet"):
        jobs.fork(job.id, 1)
