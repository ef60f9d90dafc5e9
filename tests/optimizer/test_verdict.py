"""The verdict on a best design: its words say what its numbers say."""

from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gaitswarm.services.optimizer.analysis.bounds import LimitView, WidenedView
from gaitswarm.services.optimizer.analysis.verdict import (
    QUANTITIES,
    QuantityView,
    bounds_in_words,
    bounds_reached,
    compared,
    comparison_in_words,
    limits_in_words,
    limits_reached,
    percentage,
    relaxed,
)
from gaitswarm.services.optimizer.jobs.job import Reference
from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.sim.outcome import RESULTS

SCENARIOS = ("normal-fast", "slope-fast", "loaded-slow")
PUBLISHED = np.array([[9.0, 1.2, 12.0, 70.0, 20.0, 0.004, 12.0]]).repeat(len(SCENARIOS), axis=0)
"""Objectives and peak current of a reference in every scenario."""

_COLUMNS = [result.name for result in RESULTS]

COMPARED = [0, 1, 2, 3, 4, 6]
"""Columns of these."""


def tuning(**changes: object) -> JobSpec:
    return JobSpec.model_validate({"scenarios": SCENARIOS, **changes})


def reference(objectives: np.ndarray = PUBLISHED) -> Reference:
    return Reference("A", 20.0, "published", objectives.astype("<f8").tobytes())


def views(ratios: np.ndarray, spec: JobSpec | None = None) -> list[QuantityView]:
    """Compare a design whose f1 to f5 and peak current (K, 6) are multiples of the reference's."""
    objectives = PUBLISHED.copy()
    objectives[:, COMPARED] *= ratios
    return compared(spec or tuning(), objectives, reference())


def words(ratios: np.ndarray, gain: float | None = 0.2) -> list[str]:
    return list(comparison_in_words(views(ratios), reference(), gain))


def test_a_design_that_is_better_in_every_objective() -> None:
    ratios = np.tile([0.9, 0.52, 0.6, 0.61, 1 / 1.11, 1.2], (3, 1))
    overall, loss, counted = words(ratios)
    assert overall == (
        "Compared with published A, 20 % better by fitness: 11 % faster, 39 % less energy per"
        " metre, 48 % less acceleration, 40 % less angular acceleration and 10 % less torque, but"
        " 20 % more peak current."
    )
    # Figures are objectives in scenarios, and the peak current is none.
    assert (loss, counted) == (
        "More peak current in every scenario, most in normal-fast: 14.4 instead of 12 A.",
        "Better in all 15 figures.",
    )


def test_a_fitness_that_is_paid_with_speed_says_so() -> None:
    ratios = np.tile([0.8, 1.001, 0.9, 0.7, 1.25, 1.0], (3, 1))
    ratios[1, 3], ratios[1, 4] = 1.1, 2.0
    overall, *rest = words(ratios)
    assert overall == (
        "Compared with published A, 20 % better by fitness: 19 % less energy per metre, 10 % less"
        " angular acceleration, 20 % less torque, the same acceleration and the same peak"
        " current, but 32 % slower."
    )
    assert rest == [
        "Slower in every scenario, most in slope-fast: 0.025 instead of 0.05 m/s.",
        "More energy per metre in slope-fast: 77 instead of 70 J/m.",
        "Better in 8, the same in 3 and worse in 4 of 15 figures.",
    ]


RATIOS = st.floats(0.2, 5.0) | st.floats(0.99, 1.01) | st.just(1.0)


@given(st.lists(RATIOS, min_size=18, max_size=18), st.none() | st.floats(-3.0, 0.99))
def test_words_hold_for_their_numbers(drawn: list[float], gain: float | None) -> None:
    ratios = np.reshape(drawn, (3, 6))
    first, *rest, last = words(ratios, gain)
    overall = np.exp(np.log(ratios).mean(axis=0))
    for quantity in QUANTITIES:
        column = COMPARED.index(_COLUMNS.index(quantity.column))
        mean, by_scenario = overall[column], ratios[:, column]
        change = 1.0 / mean if quantity.reciprocal else mean
        terms = (quantity.better, quantity.worse)
        says = {word: re.search(rf"(\S+ %) {word}\b", first) for word in terms}
        assert (says[quantity.better] is not None) == (mean < 0.995), first
        assert (says[quantity.worse] is not None) == (mean > 1.005), first
        for found in filter(None, says.values()):
            assert found[1] == percentage(change - 1.0)
        (loss, *more) = [s for s in rest if s.startswith(quantity.worse.capitalize())] or [""]
        assert bool(loss) == bool((by_scenario > 1.005).any())
        assert not more
        if loss:
            worst = SCENARIOS[by_scenario.argmax()]
            assert f"in {worst}: " in loss
            assert ("in every scenario" in loss) == bool((by_scenario > 1.005).all())
    if gain is not None:
        better = "% better by fitness" in first
        assert better == (gain > 0.005) or abs(abs(gain) - 0.005) < 1e-9
        assert ("% worse by fitness" in first) == (gain < -0.005)
    figures = ratios[:, :5]
    if (figures < 0.995).all():
        assert last == "Better in all 15 figures."
    else:
        assert "all" not in last
        for word, count in (
            ("better", (figures < 0.995).sum()),
            ("worse", (figures > 1.005).sum()),
        ):
            counted = re.search(rf"{word} in (\d+)", last, re.IGNORECASE)
            assert int(counted[1] if counted else 0) == count


def test_values_are_in_users_units() -> None:
    speed, energy, *_ = views(np.tile([1.0, 1.0, 1.0, 0.5, 0.8, 1.0], (3, 1)))
    assert (speed.name, speed.unit, energy.name, energy.unit) == ("speed", "m/s", "energy", "J/m")
    figure = speed.scenarios["slope-fast"]
    assert (figure.value, figure.reference) == pytest.approx((0.0625, 0.05))
    assert figure.change == pytest.approx(0.25)
    assert figure.judgement == "better"
    assert energy.change == pytest.approx(-0.5)


def test_a_scenario_in_which_the_reference_falls_is_left_out() -> None:
    other = PUBLISHED.copy()
    other[1] = np.nan
    quantities = compared(tuning(), PUBLISHED, reference(other))
    assert [list(view.scenarios) for view in quantities] == 6 * [["normal-fast", "loaded-slow"]]
    other[:] = np.nan
    assert compared(tuning(), PUBLISHED, reference(other)) == []
    assert compared(tuning(), PUBLISHED, Reference("A", 20.0)) == []


def test_over_worlds_a_figure_is_the_geometric_mean_of_worlds_in_which_both_walk() -> None:
    spec = tuning(scenarios=["normal-fast"], worlds={"count": 3})
    ratios = np.array([[1.0, 1.0, 1.0, 0.25, 1.0, 1.0], 6 * [1.0], 6 * [np.nan]])
    (energy,) = (view for view in views(ratios, spec) if view.name == "energy")
    assert energy.scenarios["normal-fast"].value == pytest.approx(35.0)
    assert energy.scenarios["normal-fast"].reference == pytest.approx(70.0)


def test_overall_changes_weigh_scenarios_as_the_job_does() -> None:
    ratios = np.ones((3, 6))
    ratios[1, 3] = 0.5
    for weights, change in (({}, 0.5 ** (1 / 3)), ({"slope-fast": 4.0}, 0.5 ** (4 / 6))):
        found = views(ratios, tuning(scenario_weights=weights))
        (energy,) = (view for view in found if view.name == "energy")
        assert energy.change == pytest.approx(change - 1.0)


def violated(*limits: tuple[str, str, float, float]) -> list[LimitView]:
    return [
        LimitView(
            constraint=constraint, case="slope-fast", quantity="speed", unit="m/s",
            value=value, relation=relation, limit=limit, excess=abs(value / limit - 1.0),
        )
        for constraint, relation, value, limit in limits
    ]  # fmt: skip


def test_constraints_are_relaxed_until_the_closest_design_keeps_them() -> None:
    band = {"quantity": "torque", "min": 4, "max": 9}
    spec = tuning(constraints=["speed>=0.05", "*<=published:A", "energy<=80", band])
    limits = violated(
        ("speed>=0.05", ">=", 0.045, 0.05),
        ("speed>=0.05", ">=", 0.04, 0.05),
        ("*<=published:A", "<=", 8.4, 7.0),
        (str(spec.constraints[3]), "<=", 10.0, 9.0),
    )
    texts = relaxed(spec.constraints, limits)
    assert texts == [
        *("speed>=0.03996", "*<=1.201*published:A", "energy<=80", "torque>=4", "torque<=10.01")
    ]
    assert tuning(constraints=texts).constraints[0].min == 0.03996


@pytest.mark.parametrize(
    ("constraint", "value"),
    [
        ("speed>=0.05", np.nan),
        ("speed>=0.05", -0.1),
        ({"quantity": "speed", "min": 1.0, "relative_to": {"P": 0.4, "I": 0.1}}, 0.04),
    ],
)
def test_a_limit_that_no_text_can_relax_has_no_command(constraint: object, value: float) -> None:
    constraints = tuning(constraints=[constraint]).constraints
    assert relaxed(constraints, violated((str(constraints[0]), ">=", value, 0.05))) is None


def test_constraints_at_their_limit_are_named_with_their_closest_place() -> None:
    spec = tuning(constraints=["torque<=9.05", "slope-fast:speed>=0.0499", "energy<=80"])
    results = np.ones((3, len(RESULTS)))
    results[:, : PUBLISHED.shape[1]] = PUBLISHED
    results[:, _COLUMNS.index("speed")] = 0.05
    results[0, 0] = 8.99
    limits = limits_reached(spec, results)
    assert [(limit.quantity, limit.case) for limit in limits] == [
        ("speed", "slope-fast"),
        ("torque", "slope-fast"),
        ("torque", "loaded-slow"),
        ("torque", "normal-fast"),
    ]
    (sentence,) = limits_in_words(limits)
    assert sentence == (
        "At the limit of a constraint: slope-fast:speed>=0.0499 (speed in slope-fast: 0.05 m/s)"
        " and torque<=9.05 (torque in slope-fast: 9 N m, and 2 more)."
    )
    assert limits_reached(tuning(), results) == []
    assert list(limits_in_words([])) == []


def test_bounds_of_a_design_are_named_and_those_that_can_be_widened_all_at_once() -> None:
    spec = tuning().resolved()
    space = spec.design_space()
    middle = (space.box.low + space.box.high) / 2.0
    assert bounds_reached(spec, middle) == []
    assert list(bounds_in_words([], 9)) == []

    design = np.where([v.name in ("FI1R", "FOMF") for v in space.variables], space.box.high, middle)
    bounds = bounds_reached(spec, design)
    assert [(bound.name, bound.at) for bound in bounds] == [("FI1R", "high"), ("FOMF", "high")]
    assert list(bounds_in_words(bounds, 9)) == [
        "At a bound of the search: 2 of 9 variables, FI1R at 6000 counts and FOMF at 3."
    ]
    # The controller accepts no FOMF above 3.
    widened = {bound.name: bound.widened for bound in bounds}
    assert widened == {"FI1R": WidenedView(low=1500.0, high=8250.0), "FOMF": None}
