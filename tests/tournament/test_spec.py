"""A method's part in a tournament as a job: what it says, what it refuses, what it is worth."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.services.optimizer.jobs.documents import SPECS
from gaitswarm.services.optimizer.jobs.kinds.problem import TuningProblem
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.jobs.spec import create_optimizer
from gaitswarm.services.optimizer.tournament.rivals import RIVALS, Rival
from tests.examples.walks import SHORT_WALK
from tests.tournament.problems import tournament

TUNING: dict[str, Any] = {
    "name": "walk",
    "job": {"controller": "pi", "scenarios": [SHORT_WALK], "precision": "single"},
}


def drawn(**changes: Any) -> dict[str, set[float]]:
    """Values of every variable over all runs of a job."""
    spec = tournament(**changes)
    optimizer, space = create_optimizer(spec), spec.design_space()
    rows = []
    while optimizer.evaluations < spec.budget:
        positions = optimizer.ask()
        rows.append(space.designs(positions))
        optimizer.tell(np.zeros(len(positions)))
    return {
        name: set(column)
        for name, column in zip(space.names, np.concatenate(rows).T.tolist(), strict=True)
    }


def test_a_run_is_a_seed_and_what_else_is_drawn() -> None:
    assert tournament().resolved().design_space().names == ("seed",)
    values = drawn(
        method="pso",
        variables=["seed", {"name": "social", "low": 1.0, "high": 2.0}, "bounds"],
        iterations=30,
    )
    assert len(values["seed"]) == 30 and all(s.is_integer() for s in values["seed"])
    assert min(values["social"]) >= 1.0 and max(values["social"]) <= 2.0
    assert values["bounds"] == {0.0, 1.0}


def test_methods_with_the_same_settings_drawn_have_the_same_seeds() -> None:
    assert drawn(method="pso", iterations=5) == drawn(method="ps", iterations=5)


def test_a_stored_spec_is_read_as_it_was() -> None:
    spec = tournament(
        method={"name": "pso", "particles": 7},
        problems=[{"function": "D4C1R0I1", "target": None}, TUNING],
        variables=["seed", {"name": "social", "low": 1.0, "high": 2.0}],
    ).resolved()
    document = spec.model_dump(mode="json")
    assert SPECS.validate_python(document) == spec
    # What a later default of a job's optimizer may be does not matter to its problem.
    assert not {"optimizer", "iterations", "seed"} & document["problems"][1]["job"].keys()


def test_problems_are_searched_in_their_own_precision_and_reported_in_double() -> None:
    spec = tournament(problems=[TUNING])
    (problem,) = spec.problems
    assert isinstance(problem, TuningProblem) and isinstance(problem.job, JobSpec)
    designs = problem.space.designs(np.array([[0.3, 0.2], [0.2, 0.1]]))
    single = problem.fitness(designs, seed=1, first=0)
    double = problem.final(designs, single)
    assert single == pytest.approx(double, rel=1e-2)
    assert (single != double).any()
    exact = TuningProblem(name="exact", job=problem.job.in_double())
    assert exact.fitness(designs, seed=1, first=0).tobytes() == double.tobytes()
    assert spec.precision == "double"


def test_noise_of_a_function_belongs_to_the_run_and_the_evaluation() -> None:
    problem = tournament().problems[1]
    design = np.tile(problem.space.low, (3, 1))

    def values(seed: int, first: int) -> list[float]:
        return problem.fitness(design, seed=seed, first=first).tolist()

    assert len(set(values(1, 0))) == 3
    assert values(1, 0)[2] == values(1, 2)[0]
    assert values(1, 0) != values(2, 0)


def test_a_budget_that_is_written_otherwise_has_checkpoints_too() -> None:
    document = {k: v for k, v in tournament().model_dump().items() if k != "checkpoints"}
    for budget in (625.0, "625"):
        spec = SPECS.validate_python(document | {"evaluations": budget})
        assert spec == SPECS.validate_python(document | {"evaluations": 625})


def test_fitness_is_the_mean_of_the_best_of_all_problems() -> None:
    spec = tournament(checkpoints=[20, 40])
    # best_20, best_40, evaluations_to_best, evaluations_to_target
    rows = np.array(
        [
            [[9.0, 0.0, 40.0, 12.0], [9.0, 3.0, 1.0, math.nan]],
            [[9.0, 1.0, 40.0, 12.0], [math.nan, math.nan, math.nan, math.nan]],
        ]
    )
    judged = spec.judge(rows, np.zeros((2, 2), dtype=np.bool_))
    assert judged.fitness.tolist() == [1.5, math.inf]
    assert judged.utilities == pytest.approx(np.array([[0.0, 3.0], [1.0, math.inf]]))


@pytest.mark.parametrize(
    ("changes", "place", "words"),
    [
        ({"method": "annealing"}, "method", "unknown method 'annealing'; known are"),
        ({"method": {"name": "annealing"}}, "method", "unknown method 'annealing'"),
        ({"method": {"name": "pso", "speed": 3}}, "method.speed", "Extra inputs"),
        ({"problems": [{"function": "D5"}]}, "problems.0.function", "D7C0R0I1"),
        ({"problems": [3]}, "problems.0", "must be an object"),
        ({"problems": [TUNING, TUNING]}, "", "problems: 'walk' is named twice"),
        (
            {"problems": [{**TUNING, "job": {"seed": 4}}]},
            "problems.0",
            "job.seed: is the tournament's to say",
        ),
        ({"evaluations": 0}, "evaluations", "greater than or equal to 1"),
        ({"checkpoints": [20, 10, 40]}, "", "checkpoints: must ascend"),
        ({"checkpoints": [10, 20]}, "", "checkpoints: must ascend"),
        ({"precision": "single"}, "", "precision: that of a search is given in its problem"),
        ({"optimizer": "pso"}, "", "optimizer: runs are drawn by random"),
        ({"variables": ["seed", "social"]}, "", "unknown variable 'social'; known are seed"),
        ({"variables": ["particles"]}, "", "variables: seed neither searched nor fixed"),
    ],
)
def test_bad_input_names_the_field(changes: dict[str, Any], place: str, words: str) -> None:
    with pytest.raises(ValidationError) as caught:
        tournament(**changes)
    first = caught.value.errors()[0]
    location = [str(part) for part in first["loc"] if not str(part).startswith("<")]
    assert ".".join(location) == place
    assert words in first["msg"]


def test_settings_that_the_method_refuses_are_found_before_anything_runs() -> None:
    swapped = [
        "seed",
        {"name": "inertia_start", "low": 0.3, "high": 0.4},
        {"name": "inertia_end", "low": 0.5, "high": 0.6},
    ]
    with pytest.raises(InvalidRequest, match="inertia_end must not exceed") as caught:
        tournament(method="pso", variables=swapped).check_can_be_simulated()
    assert caught.value.field == "variables"


def test_a_problem_that_nothing_can_walk_is_found_before_anything_runs() -> None:
    far = {**SHORT_WALK, "radius": 0.9}
    spec = tournament(problems=[{"name": "far", "job": {"scenarios": [far]}}])
    with pytest.raises(InvalidRequest) as caught:
        spec.check_can_be_simulated()
    assert caught.value.field.startswith("problems.0.job.")
    assert str(caught.value).count("problems.0.job.") == 1


def test_a_rival_without_its_library_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    absent = Rival(RIVALS["cma"].settings, ("no_such_library",), RIVALS["cma"].search)
    monkeypatch.setitem(RIVALS, "cma", absent)
    with pytest.raises(InvalidRequest, match=r"pip install 'gaitswarm\[rivals\]'") as caught:
        tournament(method="cma").check_can_be_simulated()
    assert caught.value.field == "method"
