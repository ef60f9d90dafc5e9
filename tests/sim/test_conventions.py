"""Conventions that the thesis leaves open, with defaults."""

from __future__ import annotations

import numpy as np
import pytest

from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
from gaitswarm.services.optimizer.search.pso import PsoSettings
from gaitswarm.sim.controllers import CONTROLLERS, ControllerName
from gaitswarm.sim.controllers.base import LookupTable
from gaitswarm.sim.controllers.mamdani import Shape
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.outcome import Status
from gaitswarm.sim.scenario import SCENARIOS
from gaitswarm.sim.simulate import simulate
from tests.examples.walks import PUBLISHED_A

FUZZY = CONTROLLERS["fuzzy-pi"]
PI_DESIGN = {"P": 0.454, "I": 0.147}


def integral_gain(controller: ControllerName, design: dict[str, float]) -> int:
    return CONTROLLERS[controller].compile(design).integral_gain


@pytest.mark.parametrize("name", CONTROLLERS)
def test_every_convention_has_a_default_inside_its_bounds(name: ControllerName) -> None:
    for convention in CONTROLLERS[name].conventions:
        assert convention.default is not None
        assert convention.low <= convention.default <= convention.high


@pytest.mark.parametrize("name", ["fuzzy-pi", "fuzzy-pi-3"])
def test_a_design_without_conventions_has_their_defaults(name: ControllerName) -> None:
    controller = CONTROLLERS[name]
    design = next(iter(controller.published.values()))
    defaults = {c.name: c.default for c in controller.conventions if c.default is not None}
    bare, spelt_out = (controller.inferences(d) for d in (design, {**design, **defaults}))
    for one, other in zip(bare, spelt_out, strict=True):
        assert one.system == other.system
        np.testing.assert_array_equal(one.table.values, other.table.values)
        assert one.table.output_gain == other.table.output_gain


def test_large_and_small_begin_and_end_where_the_design_says() -> None:
    (source,) = FUZZY.inferences({**PUBLISHED_A, "large_begins": 0.5, "small_ends": 0.4})
    current = source.system.inputs["current"]
    shares = np.array([0.0, 0.2, 0.4, 0.5, 0.75, 1.0])
    np.testing.assert_allclose(current["small"].membership(shares), [1, 0.5, 0, 0, 0, 0])
    np.testing.assert_allclose(current["large"].membership(shares), [0, 0, 0, 0, 0.5, 1])


def test_outputs_peak_where_the_design_says_on_as_wide_a_universe() -> None:
    places = {"positive_peak": 1.0, "extreme_peak": 2.5, "universe": 4.0}
    (source,) = FUZZY.inferences({**PUBLISHED_A, **places})
    points = source.system.output_points()
    assert (points[0], points[50], points[-1]) == (-4.0, 0.0, 4.0)
    peaks = {name: s.peak for name, s in source.system.outputs.items()}
    assert peaks == {
        "null": 0.0,
        "positive": 1.0,
        "negative": -1.0,
        "positive-extreme": 2.5,
        "negative-extreme": -2.5,
    }
    assert {s.half_width for s in source.system.outputs.values()} == {1.0}


def test_an_extreme_output_counts_in_full_once_the_universe_holds_it_whole() -> None:
    def at_full_current(universe: float) -> float:
        places = {**PUBLISHED_A, "positive_peak": 1.0, "extreme_peak": 2.0, "universe": universe}
        weights = {"FW1": 1.0, "FW23": 1.0, "FW4": 1.0, "FW56": 1.0, "FOMF": 1.0}
        (source,) = FUZZY.inferences({**places, **weights})
        full = {"error": np.array([1.0]), "current": np.array([1.0])}
        return float(source.system.infer(full)[0, 0])

    # Triangles of area 1 about 1 and of area 1/2, with their centre at -5/3, or of area 1 about -2.
    assert at_full_current(2.0) == pytest.approx((1.0 - 0.5 * 5.0 / 3.0) / 1.5, abs=0.03)
    assert at_full_current(3.0) == pytest.approx((1.0 - 2.0) / 2.0, abs=0.01)
    assert at_full_current(4.0) == pytest.approx((1.0 - 2.0) / 2.0, abs=0.01)


def test_a_table_covers_outputs_beyond_the_range_of_the_output() -> None:
    beyond = {**PUBLISHED_A, "FW23": 0.0, "positive_peak": 1.0, "extreme_peak": 2.0}
    design = {**beyond, "universe": 3.0}
    (source,) = FUZZY.inferences(design)
    table = FUZZY.compile(design).direct
    assert isinstance(table, LookupTable)
    assert table.values.max() == -table.values.min() == 127
    largest = 127 * table.output_gain / 65536
    assert largest == pytest.approx(2.0 * design["FOR"], rel=0.02)
    counts = [np.array([round(x)]) for x in (-design["FI1R"], design["FI2R"], 0.0)]
    (answer,) = table.respond(*counts) / 65536
    full = {"error": np.array([-1.0]), "current": np.array([1.0])}
    exact = source.system.infer(full)[0, 0] * design["FOR"]
    assert answer == pytest.approx(exact, abs=largest / 127)


@pytest.mark.parametrize(
    ("design", "name"),
    [
        ({"large_begins": 1.0}, "large_begins"),
        ({"small_ends": 0.0}, "small_ends"),
        ({"universe": 0.0}, "universe"),
        ({"integrator_unit": 3.0}, "integrator_unit"),
        ({"integrator_unit": 0.5}, "integrator_unit"),
    ],
)
def test_a_convention_that_cannot_be_computed_with_is_refused_by_name(
    design: dict[str, float], name: str
) -> None:
    with pytest.raises(SimulationInputError, match=f"^{name}: "):
        FUZZY.compile({**PUBLISHED_A, **design})


@pytest.mark.parametrize("controller", ["fuzzy-pi", "pi"])
def test_an_integrator_counts_in_its_units(controller: ControllerName) -> None:
    design = {**(PUBLISHED_A if controller == "fuzzy-pi" else PI_DESIGN), "I": 0.171}
    counts, volts, volts_per_second = (
        # Per tick of 2 ms with 32 fractional bits, in PWM counts per (count x second).
        integral_gain(controller, {**design, "integrator_unit": unit}) / 2**32 * 500.0
        for unit in (0.0, 1.0, 2.0)
    )
    assert counts == pytest.approx(0.171, rel=1e-5)
    # 511 counts are 11.3 V, 10430 counts a radian; the sum grows 500 times a second.
    assert volts == pytest.approx(0.371, abs=5e-4)
    assert volts / counts == pytest.approx(2.17, abs=5e-3)
    assert volts_per_second == pytest.approx(0.00074, abs=5e-6)
    assert counts / volts_per_second == pytest.approx(231.0, abs=0.5)


def test_the_smallest_gain_in_the_smallest_unit_keeps_three_digits() -> None:
    least = integral_gain("pi", {**PI_DESIGN, "I": 0.1, "integrator_unit": 2.0})
    exact = 0.1 * (511 / 11.3) / 10430 / 500 * 2**32
    assert least == pytest.approx(exact, rel=5e-4)


def test_a_walk_takes_conventions_as_columns_of_its_designs() -> None:
    names = ["P", "I", "integrator_unit"]
    designs = np.array([[0.454, 0.147, 0.0], [0.454, 0.147, 1.0], [0.454, 0.147, 0.0]])
    brief = SCENARIOS[0].model_copy(update={"cycles": 1.0, "cycle_time": 0.5})
    outcome = simulate(brief, "pi", names, designs).outcome
    assert outcome.statuses.tolist() == [Status.OK] * 3
    np.testing.assert_array_equal(outcome.objectives[0], outcome.objectives[2])
    assert (outcome.objectives[0] != outcome.objectives[1]).any()


def test_a_job_may_search_or_fix_conventions_and_else_leaves_them_to_their_defaults() -> None:
    few = PsoSettings(particles=4)
    plain = JobSpec(controller="pi", optimizer=few, iterations=1, seed=1)
    assert plain.design_space().names == ("P", "I")
    asked = JobSpec(
        controller="pi",
        optimizer=few,
        iterations=1,
        seed=1,
        variables=("P", "integrator_unit"),
        fixed={"I": 0.147},
    )
    assert asked.design_space().names == ("P", "integrator_unit", "I")
    held = JobSpec(
        controller="pi", fixed={"integrator_unit": "volt_per_radian_second"}, iterations=1, seed=1
    )
    assert held.design_space().fixed == (("integrator_unit", 2.0),)
    asked.check_can_be_simulated()
    with pytest.raises(ValueError, match="unknown variable 'universe'"):
        JobSpec(controller="pi", fixed={"universe": 2.0}, iterations=1, seed=1)


@pytest.mark.parametrize("shape", Shape)
def test_sets_and_universe_of_twice_the_size_give_twice_the_output(shape: Shape) -> None:
    (small,) = FUZZY.inferences(
        {**PUBLISHED_A, "positive_peak": 0.5, "extreme_peak": 1.0, "universe": 1.0, "FOMF": shape}
    )
    (large,) = FUZZY.inferences(
        {**PUBLISHED_A, "positive_peak": 1.0, "extreme_peak": 2.0, "universe": 2.0, "FOMF": shape}
    )
    grid = {"error": np.linspace(-1, 1, 21), "current": np.linspace(0, 1, 11)}
    np.testing.assert_allclose(2.0 * small.system.infer(grid), large.system.infer(grid), atol=1e-12)
