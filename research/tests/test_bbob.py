"""The comparison on COCO's suites: problems, score and the command."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from gaitswarm import InvalidRequest
from gaitswarm_research.compare.bbob import shares, tasks
from gaitswarm_research.compare.coco import TARGETS
from gaitswarm_research.compare.problems import problem
from gaitswarm_research.compare.runs import Task
from gaitswarm_research.main import app


def mean_share(suite: str, method: str, *, budget: int, instances: str, every: int = 1) -> float:
    """Share of targets at the end of the budget [evaluations per variable], with five variables."""
    plan = tasks(suite, "5", method, instances=instances, budget=budget, seed=1)  # type: ignore[arg-type]
    return float(np.mean([shares(task)[1] for task in plan[::every]]))


def test_a_problem_has_the_bounds_integers_and_minimum_of_its_suite() -> None:
    mixed = problem("bbob-mixint_f001_i01_d05")
    assert mixed.space.high.tolist() == [1.0, 3.0, 7.0, 15.0, 5.0]
    assert mixed.space.integer.tolist() == [True] * 4 + [False]
    assert mixed.target is not None
    designs = mixed.space.designs(mixed.space.from_unit(np.full((2, 5), 0.5)))
    values = mixed.fitness(designs, seed=1, first=0)
    distances = mixed.final(designs, values)
    assert (distances > 0.0).all()
    np.testing.assert_allclose(values - distances, mixed.target - TARGETS[-1])


def test_the_score_counts_targets_after_half_of_the_budget_and_at_its_end() -> None:
    # The linear slope, whose minimum is at a corner.
    half, end = shares(Task("bbob_f005_i01_d05", "cma-es", "", 250, 0, 1))
    assert 0.0 <= half <= end == 1.0
    assert shares(Task("bbob_f005_i01_d05", "random", "", 2, 0, 1)) <= (0.2, 0.2)


@pytest.mark.slow
@pytest.mark.parametrize("suite", ["bbob", "bbob-mixint"])
def test_auto_reaches_no_fewer_targets_than_its_rivals(suite: str) -> None:
    names = ("auto", "catcmawm", "cma")
    shares = {name: mean_share(suite, name, budget=25, instances="1", every=2) for name in names}
    assert shares["auto"] == max(shares.values()), shares


def test_centred_integers_reach_more_targets_where_most_variables_are_integers() -> None:
    # Beyond the budget at which `auto` begins with a Gaussian process.
    auto, widened = (
        mean_share("bbob-mixint", name, budget=51, instances="1-2") for name in ("auto", "cma-es")
    )
    assert auto > 1.05 * widened


def test_the_command_prints_shares_by_method_and_dimension(tmp_path: Path) -> None:
    path = tmp_path / "runs.csv"
    arguments = ["--dimensions", "2,3", "--budget", "4", "--methods", "random", "--instances", "1"]
    result = CliRunner().invoke(
        app, ["bbob", *arguments, "--processes", "1", "-o", str(path), "--json"]
    )
    assert result.exit_code == 0, result.output
    assert set(json.loads(result.output)["random"]) == {"2", "3"}
    assert len(path.read_text().splitlines()) == 49


@pytest.mark.parametrize(
    ("dimensions", "methods", "instances", "message"),
    [
        ("5,7", "de", "1", "'7' is not one of 5, 10"),
        ("5", "psoo", "1", "unknown method 'psoo'"),
        ("5", "de", "3-1", "must be from 1 to 15"),
        ("5", "de", "all", "must be from 1 to 15"),
    ],
)
def test_wrong_arguments_are_refused(
    dimensions: str, methods: str, instances: str, message: str
) -> None:
    with pytest.raises(InvalidRequest, match=message):
        tasks("bbob-mixint", dimensions, methods, instances=instances, budget=50, seed=1)
