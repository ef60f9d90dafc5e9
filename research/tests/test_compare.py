"""The comparison of search methods: runs, resuming, statistics and the command."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from typer.testing import CliRunner

from gaitswarm import InvalidRequest
from gaitswarm.plugins import Axis, Space
from gaitswarm_research.compare import runs as running
from gaitswarm_research.compare.command import PLANS
from gaitswarm_research.compare.problems import NAMES, problem
from gaitswarm_research.compare.rivals import RIVALS
from gaitswarm_research.compare.runs import CHECKPOINTS, Run, Task, execute, seeds, tasks
from gaitswarm_research.compare.statistics import (
    grouped,
    mann_whitney,
    mean_ranks,
    median,
    rank_correlation,
    summarize,
)
from gaitswarm_research.main import app

Floats = NDArray[np.float64]

FUNCTION = "D7C0R0I1"


def run(problem: str, method: str, k: int, *best: float, to_target: float = math.nan) -> Run:
    task = Task(problem, method, "", CHECKPOINTS[len(best) - 1], k, k)
    curve = (*best, *[math.nan] * (len(CHECKPOINTS) - len(best)))
    return Run(task, curve, 20.0, to_target, 0.1)


def compare(*arguments: object) -> tuple[int, str]:
    result = CliRunner().invoke(app, ["compare", *map(str, arguments)])
    return result.exit_code, result.output


def test_a_run_repeats_a_recorded_one_to_all_recorded_digits() -> None:
    """The first run of the recorded comparison on f_D7C0R0I1."""
    assert seeds(2) == [1366869416, 1330254692]
    found = execute(Task(FUNCTION, "de", "", 5000, 0, 1366869416))
    assert [f"{value:.9g}" for value in found.best[:5]] == [
        *("2.27312981", "1.59234216", "1.09572395", "0.555194714", "0.0554890516"),
    ]
    assert (found.to_best, found.to_target) == (1507.0, 1507.0)


@pytest.mark.parametrize("method", ["cma-es", "pso-ps", "scipy-de", "cma", "pymoo-pso"])
def test_a_run_depends_on_its_seed_alone(method: str) -> None:
    first = execute(Task(FUNCTION, method, "", 100, 0, 5))
    np.random.seed(99)  # noqa: NPY002 - the generator that libraries share
    assert execute(Task(FUNCTION, method, "", 100, 0, 5)).best[:3] == first.best[:3]
    assert execute(Task(FUNCTION, method, "", 100, 0, 6)).best[:3] != first.best[:3]


NOT_LOCKED = "optuna-gp"
"""Needs PyTorch, which is not among the locked dependencies."""


@pytest.mark.slow
def test_rivals_are_better_than_random_search() -> None:
    def middle(method: str) -> float:
        return float(
            np.median([execute(Task(FUNCTION, method, "", 250, 0, s)).final for s in (1, 2, 3)])
        )

    for rival in set(RIVALS) - {NOT_LOCKED}:
        assert middle(rival) < middle("random"), rival


def test_a_walking_job_is_searched_in_single_and_reported_in_double_precision() -> None:
    case = problem("chapter-3.fuzzy-pi-fixed-gait")
    designs = case.space.designs(case.space.from_unit(np.full((2, case.space.dimension), 0.5)))
    searched = case.fitness(designs, seed=1, first=0)
    reported = case.final(designs, searched)
    np.testing.assert_allclose(searched, reported, rtol=0.02)
    assert (searched != reported).any()


def test_a_stopped_comparison_resumes_with_what_is_missing(tmp_path: Path) -> None:
    path, done = tmp_path / "runs.csv", list[Run]()
    wanted = tasks(["random", "pso"], [FUNCTION], repetitions=2, evaluations=50)
    running.append(path, execute(wanted[0]))
    found = running.execute_missing(wanted, path, processes=1, progress=done.append)
    assert [one.task for one in found] == wanted
    assert {one.task for one in done} == set(wanted[1:])
    again = running.execute_missing(wanted, path, processes=1, progress=done.append)
    assert len(done) == 3
    assert [(one.best[1], one.to_best) for one in again] == [
        (one.best[1], one.to_best) for one in found
    ]


@pytest.mark.parametrize(
    ("methods", "problems", "evaluations", "message"),
    [
        (["psoo"], [FUNCTION], 50, "unknown method 'psoo'"),
        (["hype"], [FUNCTION], 50, "unknown method 'hype'"),
        (["pso"], ["D9"], 50, "unknown 'D9'"),
        (["pso"], [FUNCTION], 51, "must be one of 25, 50"),
    ],
)
def test_wrong_arguments_are_refused(
    methods: list[str], problems: list[str], evaluations: int, message: str
) -> None:
    with pytest.raises(InvalidRequest, match=message):
        tasks(methods, problems, repetitions=1, evaluations=evaluations)


def test_a_rival_without_its_library_says_which_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(running, "_version", lambda name: "" if name == "torch" else "1")
    with pytest.raises(InvalidRequest, match=r"optuna-gp needs torch, .*\[rivals\]"):
        running.check_method("optuna-gp")


class Bowl:
    """A bowl whose first variable must be 0.8 or more, evaluated 60 times."""

    def __init__(self) -> None:
        self.excess: Floats | None = None
        self.positions = np.empty((0, 3))

    def __call__(self, positions: Floats, /) -> Floats:
        if len(self.positions) >= 60:
            raise EOFError
        self.positions = np.vstack([self.positions, positions])
        self.excess = 0.8 - positions[:, :1]
        fitness: Floats = np.square(positions - 0.5).sum(axis=1)
        return fitness


@pytest.mark.parametrize("name", sorted(set(RIVALS) - {NOT_LOCKED, "optuna-cma-es"}))
def test_rivals_evaluate_the_start_first_and_use_it_if_they_can(name: str) -> None:
    bowl, start = Bowl(), np.array([[0.9, 0.5, 3.0]])
    space = Space([Axis(0.0, 1.0), Axis(0.0, 1.0), Axis(0.0, 5.0, "integer")])
    with pytest.raises(EOFError):
        RIVALS[name][0](space, 1, bowl, start)
    np.testing.assert_allclose(bowl.positions[0], start[0])
    if name in ("catcmawm", "cma"):
        assert 0.7 < float(bowl.positions[1:8, 0].mean()) < 1.0
    if name == "optuna-tpe":
        assert (bowl.positions[40:, 0] >= 0.8).mean() > 0.5


def test_infeasible_designs_come_after_feasible_ones_by_their_violation() -> None:
    case = problem("constrained.A-gait")
    far = np.where(np.arange(case.space.dimension) == 9, case.space.high, case.start)  # stride
    designs = case.space.designs(np.vstack([case.start, far]))
    less, more = case.fitness(designs, seed=1, first=0)
    assert 1e3 < less < more
    assert case.excess is not None
    assert case.excess.shape == (2, 5)
    assert (case.excess.max(axis=1) > 0.0).all()
    assert case.final(case.start, np.array([less])) == np.inf
    assert case.final(case.start, np.array([20.0])) == 20.0


def test_methods_and_problems_of_all_presets_exist() -> None:
    for plan in PLANS.values():
        assert set(plan.problems) <= set(NAMES)
        for method in set(plan.methods) - {NOT_LOCKED}:
            running.check_method(method)


@pytest.mark.parametrize("method", [m for m in PLANS["thesis"].methods if m != "ga"])
def test_random_settings_are_accepted_by_their_method(method: str) -> None:
    for seed in range(20):
        settings = json.dumps(running.drawn_settings(method, seed))
        assert execute(Task("D4C1R0I0", method, settings, 25, 0, seed)).final < math.inf


RUNS = [
    *(run("D4C0R0I0", "a", k, 3.0, 1e-4 * (k + 1), to_target=30.0 + k) for k in range(4)),
    *(run("D4C0R0I0", "b", k, 2.0, 0.5 + k) for k in range(4)),
    *(run("D4C0R0I0", "c", k, 4.0, 7.0 + k) for k in range(4)),
    *(run("chapter-4.A", "a", k, 20.0, 17.0 + k) for k in range(4)),
    *(run("chapter-4.A", "b", k, 30.0, 27.0 + k) for k in range(4)),
    *(run("chapter-4.A", "c", k, math.nan, math.nan) for k in range(4)),
    run("chapter-4.A", "d", 0, 1.0, 1.0),
]


def test_methods_are_ranked_by_solved_runs_and_then_by_their_best() -> None:
    groups = grouped(RUNS)
    assert set(groups["chapter-4.A"]) == {"a", "b", "c"}  # d misses a problem
    assert [(row.method, row.value) for row in mean_ranks(groups)] == [
        *(("a", 1.0), ("b", 2.0), ("c", 3.0)),
    ]
    summary = summarize(groups)
    first, second, _ = summary.problems["D4C0R0I0"]
    assert (first.method, first.solved, first.running_time) == ("a", 4, 31.5)
    assert (second.solved, second.running_time) == (0, math.inf)
    assert (first.p, first.medians) == (None, (3.0, 2e-4))
    # Four runs against four that are all greater: one of the seventy orders on either side.
    assert second.p == pytest.approx(2.0 / 70.0)
    assert summary.checkpoints["D4C0R0I0"] == (25, 50)
    assert summary.problems["chapter-4.A"][2].medians == (math.inf, math.inf)
    assert rank_correlation(groups) == pytest.approx(1.0)


def test_equal_runs_are_not_distinguished() -> None:
    ones = [run("D4C0R0I0", "a", k, 2.0) for k in range(5)]
    assert mann_whitney(ones, ones) == pytest.approx(1.0)
    assert median(ones, 25) == 2.0


def test_the_command_prints_a_table_and_writes_csv_json_and_a_picture(tmp_path: Path) -> None:
    given = ("--methods", "random,pso", "--problems", FUNCTION, "--repetitions", 2)
    code, text = compare("small", *given, "--evaluations", 50, "-o", tmp_path, "--processes", 1)
    assert code == 0, text
    assert "pso" in text and FUNCTION in text
    assert (tmp_path / "convergence.svg").read_text().startswith("<?xml")
    recorded = (tmp_path / "runs.csv").read_text()
    assert len(recorded.splitlines()) == 5
    code, text = compare("--read", tmp_path / "runs.csv", "-o", tmp_path / "again", "--json")
    assert code == 0, text
    assert json.loads(text) == json.loads((tmp_path / "summary.json").read_text())


def test_the_command_names_a_wrong_method(tmp_path: Path) -> None:
    result = CliRunner().invoke(app, ["compare", "--methods", "psoo", "-o", str(tmp_path)])
    assert isinstance(result.exception, InvalidRequest)
    assert "unknown method 'psoo'" in str(result.exception)
