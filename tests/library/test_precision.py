"""Precision in the Python library: of a walk, and of a job whose best is judged in double."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gaitswarm
from tests.library.conftest import SMALL, Finished, Reach

pytestmark = pytest.mark.slow

GAINS = {"P": [0.3, 0.45], "I": [0.05, 0.1]}
WALK: dict[str, Any] = {"controller": "pi", "scenarios": "1"}


@pytest.fixture(scope="module")
def single(tmp_path_factory: pytest.TempPathFactory) -> gaitswarm.OptimizationResult:
    db = tmp_path_factory.mktemp("precision") / "jobs.db"
    return gaitswarm.optimize(db=db, precision="single", **SMALL)


def test_a_walk_in_single_is_nearly_that_in_double_and_says_so() -> None:
    double = gaitswarm.simulate(GAINS, **WALK)
    single = gaitswarm.simulate(GAINS, precision="single", **WALK)
    assert (double.precision, single.precision) == ("double", "single")
    assert (single.fitness != double.fitness).all()
    np.testing.assert_allclose(single.fitness, double.fitness, rtol=1e-3)


def test_many_walks_at_once_have_the_bits_of_one_alone() -> None:
    together = gaitswarm.simulate(GAINS, precision="single", **WALK)
    alone = gaitswarm.simulate({"P": 0.45, "I": 0.1}, precision="single", **WALK)
    assert together.objectives[1].tobytes() == alone.objectives[0].tobytes()


def test_the_best_of_a_search_in_single_is_what_it_is_worth_in_double(
    single: gaitswarm.OptimizationResult,
) -> None:
    best = single.best
    assert (single.job.precision, single.job.spec.precision) == ("single", "single")
    assert [r.provenance.simulation.precision for r in single.job.provenance] == ["single"]
    scenarios = SMALL["scenarios"]
    double = gaitswarm.simulate(best.design, controller="pi", scenarios=scenarios)
    found = gaitswarm.simulate(
        best.design, controller="pi", scenarios=scenarios, precision="single"
    )
    assert best.search is not None
    assert double.fitness.tolist() == [best.fitness]
    assert found.fitness.tolist() == [best.search.fitness] != [best.fitness]
    assert best.search.difference == best.search.fitness / best.fitness - 1.0
    assert single.job.best_fitness == single.iterations[-1].best_so_far == best.fitness
    assert best.search.fitness in single.evaluations().fitness


def test_a_job_in_single_is_read_alike_from_database_and_server(
    single: gaitswarm.OptimizationResult, reach: Reach
) -> None:
    jobs = reach(Path(single.db))
    assert jobs.best(single.job.id) == single.best
    assert jobs.job(single.job.id).precision == "single"
    assert [job.precision for job in jobs.jobs()] == ["single"]


def test_a_search_in_double_says_nothing_of_another_precision(finished: Finished) -> None:
    assert finished.result.best.search is None
    assert finished.result.job.precision == "double"


def test_runs_of_different_precision_are_not_compared(finished: Finished) -> None:
    other = gaitswarm.optimize(db=finished.db, precision="single", **{**SMALL, "seed": 8})
    with (
        gaitswarm.open(finished.db) as jobs,
        pytest.raises(gaitswarm.InvalidRequest, match="another problem"),
    ):
        jobs.parameters([finished.id, other.job.id])


def test_another_word_is_refused_with_those_that_exist() -> None:
    with pytest.raises(gaitswarm.InvalidRequest, match=r"precision.*'single' or 'double'"):
        gaitswarm.optimize(precision="half", **SMALL)  # type: ignore[arg-type]
    with pytest.raises(gaitswarm.InvalidRequest, match=r"precision.*'single' or 'double'"):
        gaitswarm.simulate(GAINS, precision="half", **WALK)  # type: ignore[arg-type]
