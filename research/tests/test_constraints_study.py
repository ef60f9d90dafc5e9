"""Tests of the comparison of constrained searches."""

from __future__ import annotations

import json
from importlib.util import find_spec
from typing import Any

import pytest
from typer.testing import CliRunner

from gaitswarm import CONTROLLERS, simulate
from gaitswarm_research.main import app
from gaitswarm_research.studies.constraints import problem


def test_the_problem_searches_the_gait_and_allows_nothing_worse_than_the_published_design() -> None:
    spec: Any = problem(50, seed=3)
    assert {"stride", "duty_factor"} <= set(spec.design_space().names)
    (constraint,) = spec.constraints
    assert (constraint.quantity, constraint.relative_to, constraint.max) == ("*", "published:A", 1)
    assert (spec.budget, spec.seed) == (50, 3)


@pytest.mark.slow
@pytest.mark.skipif(find_spec("optuna") is None, reason="needs optuna")
def test_both_searches_report_their_best_feasible_design_or_none() -> None:
    command = ["study", "constraints", "--evaluations", "25", "--seeds", "1", "--json"]
    result = CliRunner().invoke(app, command)
    assert result.exit_code == 0, result.output
    report = json.loads(result.stdout)
    assert set(report["fitness"]) == {"gaitswarm", "optuna-tpe"}
    # Both begin with the published design, which keeps its own limits.
    published = float(simulate(dict(CONTROLLERS["fuzzy-pi"].published["A"])).fitness[0])
    for values in report["fitness"].values():
        assert all(value is None or 1.0 < value < published + 1e-6 for value in values)
