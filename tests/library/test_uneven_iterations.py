"""A method may ask for fewer designs than an iteration may have: the budget counts designs."""

from __future__ import annotations

import itertools
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

import gaitswarm
from gaitswarm.services.runtime import open_store
from gaitswarm.views.job import IterationView, JobSummaryView, Spent
from tests.examples.jobs import history
from tests.examples.uneven import SIZES, run_uneven, uneven_iterations
from tests.library.conftest import Reach

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> gaitswarm.OptimizationResult:
    return run_uneven(tmp_path_factory.mktemp("uneven") / "jobs.db")


def test_it_ends_when_all_designs_of_the_budget_are_judged(
    result: gaitswarm.OptimizationResult,
) -> None:
    job = result.job
    assert (job.iterations, job.iterations_planned) == (6, 4)
    assert (job.evaluations, job.evaluations_planned) == (12, 12)
    assert job.eta_seconds == 0.0
    assert [iteration.designs for iteration in result.iterations] == SIZES
    assert result.convergence()["designs"].tolist() == SIZES
    expected = [(k, p) for k, size in enumerate(SIZES) for p in range(size)]
    table = result.evaluations()
    assert list(zip(table["iteration"], table["particle"], strict=True)) == expected


def test_its_progress_is_reported_in_designs(result: gaitswarm.OptimizationResult) -> None:
    assert str(result.job.spent) == "12 of 12 designs"


@pytest.mark.parametrize(
    ("iterations", "evaluations", "said"),
    [
        (0, 0, Spent(0, 4, "iterations")),
        (3, 9, Spent(3, 4, "iterations")),
        (4, 12, Spent(4, 4, "iterations")),
        (1, 1, Spent(1, 12, "designs")),
        (6, 12, Spent(12, 12, "designs")),
    ],
)
def test_progress_is_reported_in_iterations_while_all_are_whole(
    iterations: int, evaluations: int, said: Spent
) -> None:
    job = JobSummaryView.model_construct(  # type: ignore[call-arg]
        iterations=iterations,
        evaluations=evaluations,
        particles=3,
        iterations_planned=4,
        evaluations_planned=12,
    )
    assert job.spent == said


def test_it_is_interrupted_and_gone_on_with_to_the_same_bits(
    result: gaitswarm.OptimizationResult, tmp_path: Path
) -> None:
    db = tmp_path / "broken.db"
    count = itertools.count(1)

    def stop(_: IterationView) -> None:
        if next(count) == 4:
            raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        run_uneven(db, on_iteration=stop)
    with gaitswarm.open(db) as jobs:
        (job,) = jobs.jobs()
        assert str(job.spent) == "7 of 12 designs"
    with uneven_iterations():
        resumed = gaitswarm.optimize(resume=job.id, db=db)
    with closing(open_store(result.db)) as whole, closing(open_store(str(db))) as broken:
        assert history(broken, resumed.job.id) == history(whole, result.job.id)


def test_an_extension_counts_what_is_spent_of_the_budget_not_iterations(
    reach: Reach, db: Path
) -> None:
    job_id = run_uneven(db).job.id
    jobs = reach(db)
    with pytest.raises(gaitswarm.InvalidRequest, match="must exceed the 4 committed"):
        jobs.extend(job_id, 4)
    assert jobs.extend(job_id, 5).evaluations_planned == 15
    with uneven_iterations():
        extended = gaitswarm.optimize(resume=job_id, db=db)
    assert [i.designs for i in extended.iterations] == [*SIZES, 1, 2]


def test_every_evaluation_is_in_its_columns_and_in_its_history(
    reach: Reach, db: Path, result: gaitswarm.OptimizationResult
) -> None:
    own = run_uneven(db)
    jobs = reach(db)
    table = jobs.evaluations(own.job.id)
    np.testing.assert_array_equal(table["fitness"], result.evaluations()["fitness"])
    found = list(jobs.history(own.job.id))
    assert [len(iteration.evaluations) for iteration in found] == SIZES
    assert [iteration.designs for iteration in found] == SIZES
    assert [event.designs for event in jobs.follow(own.job.id) if isinstance(event, IterationView)]
