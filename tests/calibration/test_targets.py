"""Results of several calibrations: target by target, choice by choice."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gaitswarm.services.optimizer.analysis.identifiability import (
    IdentifiabilityView,
    Trust,
    identifiability,
)
from gaitswarm.services.optimizer.analysis.targets import LeaveOut, TargetsView, target_results
from gaitswarm.services.optimizer.jobs.iteration import Evaluation, EvaluationColumns, Reevaluation
from gaitswarm.services.optimizer.jobs.kinds.calibration import CalibrationSpec
from gaitswarm.sim.outcome import RESULTS
from gaitswarm.sim.variables import Variable
from tests.calibration.conftest import spec
from tests.optimizer.columns import columns_of

LAW = Variable(name="law", kind="categorical", choices=("linear", "stick", "jump"))


def made_up(wanted: CalibrationSpec, *designs: tuple[float, float, float]) -> EvaluationColumns:
    """Designs of which each comes to a torque and an energy of `stiff` and a torque of `fuzzy`."""
    rows = np.full((len(designs), 2, len(RESULTS)), 1.0)
    for row, (torque, energy, other) in zip(rows, designs, strict=True):
        row[0, [0, 3]], row[1, 0] = (torque, energy), other
    columns = columns_of(rows, designs=np.zeros((len(designs), 2)))
    return replace(columns, fitness=wanted.judge(rows, columns.failed).fitness)


WANTED = spec(
    targets=[
        {"walk": "stiff", "quantity": "torque", "value": 10.0, "tolerance": 0.1},
        {"walk": "stiff", "quantity": "energy", "value": 50.0, "tolerance": 0.1},
        {"walk": "fuzzy", "quantity": "torque", "value": 20.0, "tolerance": 0.1},
        {"walk": "fuzzy", "quantity": "speed", "value": 2.0, "tolerance": 0.1, "use": "predict"},
    ]
)
# The first is fair in all; each of the others meets two targets exactly and misses the third.
FAIR, ALL_BUT_TORQUE = (11.0, 55.0, 22.0), (13.0, 50.0, 20.0)
ALL_BUT_ENERGY, ALL_BUT_FUZZY = (10.0, 70.0, 20.0), (10.0, 50.0, 29.0)


def results(
    wanted: CalibrationSpec,
    runs: list[EvaluationColumns],
    leave_out: LeaveOut | None = None,
    bests: list[Evaluation] | None = None,
) -> TargetsView:
    """Runs are named by number."""
    return target_results([str(k) for k in range(len(runs))], wanted, runs, leave_out, bests=bests)


def test_the_best_design_of_all_runs_is_compared_with_every_target() -> None:
    runs = [made_up(WANTED, ALL_BUT_TORQUE), made_up(WANTED, ALL_BUT_ENERGY, FAIR)]
    found = results(WANTED, runs)
    assert (found.job, found.iteration) == ("1", 1)
    assert [t.simulated for t in found.targets] == [11.0, 55.0, 22.0, 1.0]
    assert [t.difference for t in found.targets[:3]] == pytest.approx([1.0] * 3)
    assert found.fitness == pytest.approx(1.0)
    assert all(t.left_out is None for t in found.targets)


def test_runs_in_single_precision_are_compared_by_their_bests_in_double() -> None:
    runs = [made_up(WANTED, FAIR), made_up(WANTED, ALL_BUT_TORQUE)]
    bests = [
        Evaluation(
            iteration=0,
            particle=0,
            design=run.designs[0],
            objectives=run.objectives[0],
            statuses=run.statuses[0],
            fitness=float(run.fitness[0]),
            reevaluation=Reevaluation(0, share * run.objectives[0], run.statuses[0], fitness),
        )
        for run, share, fitness in zip(runs, (1.01, 1.0), (2.5, 2.4), strict=True)
    ]
    assert results(WANTED, runs).job == "0"
    found = results(WANTED, runs, bests=bests)
    assert (found.job, found.fitness) == ("1", 2.4)
    assert [t.simulated for t in found.targets] == [13.0, 50.0, 20.0, 1.0]
    alone = results(WANTED, runs[:1], bests=bests[:1])
    assert alone.fitness == 2.5
    assert alone.targets[0].simulated == pytest.approx(1.01 * 11.0)


def test_a_target_that_is_left_out_is_predicted_by_what_is_best_without_it() -> None:
    runs = [
        made_up(WANTED, FAIR, ALL_BUT_TORQUE),
        made_up(WANTED, ALL_BUT_ENERGY, ALL_BUT_FUZZY),
    ]
    found = results(WANTED, runs, "target")
    predicted = [None if t.left_out is None else t.left_out.simulated for t in found.targets]
    assert predicted == [13.0, 70.0, 29.0, None]


def test_a_walk_is_left_out_with_all_of_its_targets() -> None:
    runs = [made_up(WANTED, FAIR, ALL_BUT_FUZZY, (30.0, 90.0, 20.0))]
    found = results(WANTED, runs, "walk")
    predicted = [None if t.left_out is None else t.left_out.simulated for t in found.targets]
    assert predicted == [30.0, 90.0, 29.0, None]


def test_nothing_is_predicted_where_nothing_is_left_to_fit() -> None:
    only = spec()
    found = results(only, [made_up(only, FAIR)], "target")
    assert found.targets[0].left_out is None


def choices(runs: list[EvaluationColumns]) -> IdentifiabilityView:
    """Runs whose designs count as good as the best within 5 %."""
    return identifiability([str(k) for k in range(len(runs))], [LAW], runs, lambda f: 1.05 * f)


def run_of(**least: float) -> EvaluationColumns:
    """A run in which each law that is named has this least fitness."""
    rows = [(LAW.number(name), fitness + k) for name, fitness in least.items() for k in (0.0, 1.0)]
    columns = columns_of(np.ones((len(rows), 1, 6)), designs=np.array(rows)[:, :1])
    return replace(columns, fitness=np.array(rows)[:, 1])


@pytest.mark.parametrize(
    ("runs", "trust", "remaining"),
    [
        ([run_of(linear=2.0, stick=1.0), run_of(stick=1.1, jump=9.0)], Trust.TRUSTED, ["stick"]),
        (
            [run_of(linear=2.0, stick=1.0), run_of(linear=9.0, jump=1.1)],
            Trust.ROUGH,
            ["stick", "jump"],
        ),
        (
            [run_of(linear=1.02, stick=1.0), run_of(stick=1.0, jump=1.0)],
            Trust.UNKNOWN,
            ["linear", "stick", "jump"],
        ),
    ],
)
def test_evidence_decides_for_choices_that_any_run_has_near_its_best(
    runs: list[EvaluationColumns], trust: Trust, remaining: list[str]
) -> None:
    (law,) = choices(runs).parameters
    assert law.trust is trust
    assert [choice.name for choice in law.choices if choice.remains] == remaining
    assert law.explanation is not None


def test_the_smallest_misfit_of_each_choice_is_reported_by_run() -> None:
    (law,) = choices([run_of(linear=2.0, stick=1.0), run_of(stick=1.5)]).parameters
    assert [choice.by_run for choice in law.choices] == [[2.0, None], [1.0, 1.5], [None, None]]
    assert [choice.fitness for choice in law.choices] == [2.0, 1.0, None]
    assert law.best == "stick"
