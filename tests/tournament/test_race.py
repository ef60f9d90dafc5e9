"""One run: its curve, its counts, its end; and that every method keeps to its terms."""

from __future__ import annotations

import math
from itertools import product

import numpy as np
import pytest

from gaitswarm.services.optimizer.search.method import missing_of
from gaitswarm.services.optimizer.search.space import Axis, Space
from gaitswarm.services.optimizer.tournament.methods import (
    drawn_settings,
    libraries_of,
    method_names,
    named_settings,
    random_ranges,
    search_of,
    settings_models,
)
from gaitswarm.services.optimizer.tournament.race import (
    Run,
    RunAbandoned,
    Terms,
    default_checkpoints,
    race,
)
from gaitswarm.services.optimizer.tournament.rivals import RIVALS
from gaitswarm.sim.variables import Variable
from tests.tournament.problems import MIXED, Bowl, script

LINE = Space([Axis(-1.0, 3.0)])

INSTALLED = [n for n in method_names() if not missing_of(libraries_of(named_settings(n)))]

METHOD = pytest.mark.parametrize("name", INSTALLED)


def terms(evaluations: int, target: float | None = None, *, stops: bool = False) -> Terms:
    return Terms(evaluations, tuple(range(1, evaluations + 1)), target, stops)


def run_of(name: str, *, evaluations: int = 70, seed: int = 5, problem: Bowl | None = None) -> Run:
    return race(search_of(named_settings(name)), problem or Bowl(), terms(evaluations), seed)


def test_a_curve_is_the_least_fitness_so_far_whatever_the_batches() -> None:
    # In units of the axis: 0.5, 0.25 (the minimum), failed, 0.75.
    positions = [[1.0], [0.0], [2.95], [2.0]]
    for batches in ([positions], [[p] for p in positions]):
        run = race(script(*batches), Bowl(LINE), terms(4), 1)
        assert run.best.tolist() == [0.0625, 0.0, 0.0, 0.0]
        assert run.to_best == 2.0


def test_what_failed_is_no_best() -> None:
    run = race(script([[2.95], [2.0]]), Bowl(LINE), terms(2), 1)
    assert math.isnan(run.best[0]) and run.best[1] == 0.25
    failed = race(script([[2.95]]), Bowl(LINE), terms(1), 1)
    assert np.isnan(failed.best).all() and math.isnan(failed.to_best)


def test_the_target_is_reached_at_the_first_evaluation_that_is_as_good() -> None:
    positions = [[2.0], [1.0], [0.0]]
    for target, reached in ((0.0625, 2.0), (0.25, 1.0)):
        run = race(script(positions), Bowl(LINE), terms(3, target), 1)
        assert run.to_target == reached
    assert math.isnan(race(script(positions[:2]), Bowl(LINE), terms(2, 0.01), 1).to_target)


def test_a_run_that_ends_at_its_target_keeps_its_best_and_asks_no_more() -> None:
    problem = Bowl(LINE)
    search = script([[2.0]], [[0.0], [1.0]], [[1.5]])
    run = race(search, problem, terms(10, 1e-3, stops=True), 1)
    assert sum(map(len, problem.asked)) == 3
    assert run.to_target == 2.0
    assert run.best.tolist() == [0.25] + 9 * [0.0]


def test_what_was_found_is_judged_anew_for_the_report() -> None:
    problem = Bowl(LINE, bias=0.5)
    run = race(script([[1.0], [0.0]]), problem, terms(2, 0.5), 1)
    assert run.best.tolist() == [0.0625, 0.0]
    assert run.to_target == 2.0  # by what the search was told


def test_a_run_that_nobody_waits_for_is_abandoned_before_its_next_batch() -> None:
    problem = Bowl(LINE)
    with pytest.raises(RunAbandoned):
        race(
            script([[1.0]], [[0.0]], [[0.5]]),
            problem,
            terms(3),
            1,
            should_stop=lambda: len(problem.asked) == 2,
        )
    assert len(problem.asked) == 2


def test_checkpoints_are_ten_in_a_decade_and_end_with_the_budget() -> None:
    assert default_checkpoints(130) == (10, 13, 16, 20, 25, 32, 40, 50, 63, 80, 100, 130)
    assert default_checkpoints(7) == (7,)
    assert default_checkpoints(10) == (10,)


@pytest.mark.variants(without="bayesian")
@METHOD
def test_every_method_spends_its_budget_to_the_last_evaluation_inside_the_box(name: str) -> None:
    problem = Bowl()
    run_of(name, evaluations=71, problem=problem)
    designs = np.concatenate(problem.asked)
    assert designs.shape == (71, MIXED.dimension)
    assert ((designs >= MIXED.low) & (designs <= MIXED.high)).all()
    assert (designs == MIXED.designs(MIXED.positions(designs))).all()


@pytest.mark.variants(without=("bayesian", "optuna-tpe"))
@METHOD
def test_every_method_depends_on_its_seed_alone(name: str) -> None:
    first = run_of(name)
    # What else a process draws must not matter: runs share it.
    np.random.seed(99)  # noqa: NPY002 - the one that libraries share
    assert run_of(name).best.tobytes() == first.best.tobytes()
    assert run_of(name, seed=6).best.tobytes() != first.best.tobytes()


@pytest.mark.variants(without="optuna-tpe")
@pytest.mark.parametrize("name", [n for n in RIVALS if n in INSTALLED])
def test_every_rival_finds_more_than_chance_does(name: str) -> None:
    best = np.median([run_of(name, evaluations=120, seed=s).best[-1] for s in (1, 2, 3)])
    random = np.median([run_of("random", evaluations=120, seed=s).best[-1] for s in (1, 2, 3)])
    assert best < random


@pytest.mark.variants(without="pso-ps")
@pytest.mark.parametrize("name", settings_models())
def test_a_method_takes_what_is_drawn_at_whichever_ends_of_the_ranges(name: str) -> None:
    """Any two settings at the ends that fit each other least, the rest at either."""
    settings = settings_models()[name].model_validate({"name": name})
    ranges = random_ranges(name)
    assert ranges
    ends = {variable.name: (variable.low, variable.high) for variable in ranges}
    for rest, high, low in product((0, 1), ends, ends):
        drawn = {n: bounds[rest] for n, bounds in ends.items()}
        drawn |= {high: ends[high][1], low: ends[low][0]}
        taken = drawn_settings(settings, drawn).model_dump()
        assert {n: v for n, v in taken.items() if n not in drawn} == {
            n: v for n, v in settings.model_dump().items() if n not in drawn
        }


def test_what_is_drawn_becomes_a_setting_of_its_own_kind() -> None:
    swarm = drawn_settings(named_settings("pso"), {"particles": 7.0, "bounds": 0.0, "social": 1.25})
    assert swarm.model_dump(include={"particles", "bounds", "social"}) == {
        "particles": 7,
        "bounds": "absorb",
        "social": 1.25,
    }
    sampler = drawn_settings(named_settings("optuna-tpe"), {"multivariate": 1.0})
    assert sampler.model_dump()["multivariate"] is True


def test_of_settings_that_do_not_fit_each_other_it_is_said_in_plain_words() -> None:
    with pytest.raises(ValueError, match=r"^inertia_end must not exceed inertia_start"):
        drawn_settings(named_settings("pso-ps"), {"inertia_start": 0.5})


def test_numbers_are_drawn_from_half_to_twice_their_default_inside_their_bounds() -> None:
    ranges = {v.name: v for v in random_ranges("scipy-de")}
    assert isinstance(ranges["recombination"], Variable)
    bounds = {name: (v.low, v.high) for name, v in ranges.items()}
    assert bounds["particles"] == (12.0, 50.0)
    assert bounds["recombination"] == (0.35, 1.0)
    assert ranges["strategy"].choices[0] == "best1bin"
