"""Fuzzy inference against scikit-fuzzy, and the robot's integers."""

from __future__ import annotations

import threading
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gaitswarm.sim.compiler.compilation import Target, load_library, target
from gaitswarm.sim.controllers import CONTROLLERS, control_law
from gaitswarm.sim.controllers.base import LookupTable
from gaitswarm.sim.controllers.fuzzy_pi import CURRENT, ERROR, MembershipSets, inference_system
from gaitswarm.sim.controllers.fuzzy_pi_3 import integral_system, voltage_system
from gaitswarm.sim.controllers.mamdani import FuzzySet, Mamdani, Rule, Shape
from gaitswarm.sim.controllers.quantisation import (
    Axis,
    Quantised,
    compiled_table,
    inference_source,
    quantised,
    reference_table,
    table_bytes,
    timing_tables,
)
from tests.examples.walks import PUBLISHED_A

WEIGHTS = st.floats(0.1, 1.0)

SETS = MembershipSets(
    large_begins=0.3, small_ends=0.8, positive_peak=0.6, universe=1.5, extreme_peak=1.4
)


def fuzzy_p_table(fw1: float, fw23: float, fw4: float, fw56: float, shape: Shape) -> Quantised:
    system = inference_system(fw1, fw23, fw4, fw56, shape)
    return quantised(system, {"error": ERROR, "current": CURRENT})


def scikit_fuzzy_union(e: float, c: float, w: tuple[float, ...], shape: Shape) -> np.ndarray:
    """Table 4.3 implemented with scikit-fuzzy."""
    import skfuzzy  # slow to import

    y = np.arange(-50, 51) / 50 * 1.5
    sigma = 0.3 / np.sqrt(2 * np.log(2))

    def output(peak: float) -> np.ndarray:
        if shape is Shape.TRIANGLE:
            return skfuzzy.trimf(y, [peak - 0.6, peak, peak + 0.6])
        if shape is Shape.GAUSS:
            return skfuzzy.gaussmf(y, peak, sigma)
        return skfuzzy.pimf(y, peak - 0.6, peak, peak, peak + 0.6)

    def holds(x: float, peak: float, width: float = 1.0) -> float:
        return float(skfuzzy.trimf(np.array([x]), [peak - width, peak, peak + width])[0])

    zero, positive, negative = holds(e, 0.0), holds(e, 1.0), holds(e, -1.0)
    small, large = holds(c, 0.0, 0.8), holds(c, 1.0, 0.7)
    fw1, fw23, fw4, fw56 = w
    fired = [
        (fw1 * zero, 0.0),
        (fw23 * positive, 0.6),
        (fw23 * negative, -0.6),
        (fw4 * min(zero, small), 0.0),
        (fw56 * min(negative, large), 1.4),
        (fw56 * min(positive, large), -1.4),
    ]
    return np.max([np.minimum(level, output(peak)) for level, peak in fired], axis=0)


@given(
    st.floats(-1, 1),
    st.floats(0, 1),
    st.tuples(WEIGHTS, WEIGHTS, WEIGHTS, WEIGHTS),
    st.sampled_from(Shape),
)
def test_inference_agrees_with_scikit_fuzzy(
    e: float, c: float, weights: tuple[float, float, float, float], shape: Shape
) -> None:
    import skfuzzy

    system = inference_system(*weights, shape, SETS)
    ours = system.infer({"error": np.array([e]), "current": np.array([c])})[0, 0]
    y = system.output_points()
    union = scikit_fuzzy_union(e, c, weights, shape)
    assert ours == pytest.approx(float(y @ union / union.sum()), abs=1e-12)
    # scikit-fuzzy integrates between the points where we sum over them, as Matlab does.
    assert ours == pytest.approx(float(skfuzzy.defuzz(y, union, "centroid")), abs=0.045)


@pytest.mark.parametrize("shape", Shape)
def test_membership_functions_share_their_half_height_points(shape: Shape) -> None:
    member = FuzzySet(0.3, 0.4)
    x = np.array([0.1, 0.3, 0.5])
    np.testing.assert_allclose(member.membership(x, shape), [0.5, 1.0, 0.5], atol=1e-12)


def test_where_no_rule_fires_the_output_is_the_middle_of_its_range() -> None:
    system = inference_system(0.0, 0.0, 0.0, 0.0, Shape.TRIANGLE)
    assert system.infer({"error": np.array([0.4]), "current": np.array([0.2])})[0, 0] == 0.0


def assert_both_tables_agree(system: Mamdani, axes: dict[str, Axis]) -> None:
    grid = {name: axis.grid() for name, axis in axes.items()}
    compiled = compiled_table(system, grid)
    assert compiled is not None
    values, largest = reference_table(system, grid)
    np.testing.assert_array_equal(compiled[0], values)
    assert compiled[1] == largest


ANY_WEIGHT = st.one_of(st.sampled_from([0.0, 1e-290, 1e-9, 0.5, 1.0]), st.floats(1e-290, 1.0))
WIDTHS = st.one_of(st.sampled_from([0.01, 0.5, 1.0, 2.0, 10.0]), st.floats(0.01, 4.0))


@given(
    st.tuples(ANY_WEIGHT, ANY_WEIGHT, ANY_WEIGHT, ANY_WEIGHT),
    st.sampled_from(Shape),
    st.builds(
        MembershipSets,
        large_begins=st.floats(0.0, 0.99),
        small_ends=WIDTHS,
        positive_peak=WIDTHS,
        universe=WIDTHS.filter(lambda width: width >= 0.1),
        extreme_peak=WIDTHS,
    ),
)
def test_the_compiled_table_has_the_same_bits_for_any_weights_and_sets(
    weights: tuple[float, float, float, float], shape: Shape, sets: MembershipSets
) -> None:
    axes = {"error": Axis(7, True), "current": CURRENT}
    assert_both_tables_agree(inference_system(*weights, shape, sets), axes)
    assert_both_tables_agree(voltage_system(*weights[:3], shape, sets), axes)
    three = {"error": Axis(4, True), "current": Axis(3, False), "velocity": Axis(6, True)}
    assert_both_tables_agree(integral_system(*weights[:3], shape, sets), three)


@pytest.mark.parametrize("shape", Shape)
def test_the_compiled_table_of_a_published_design_has_the_same_bits(shape: Shape) -> None:
    system = inference_system(0.187, 0.961, 0.789, 0.927, shape)
    assert_both_tables_agree(system, {"error": ERROR, "current": CURRENT})


@pytest.mark.parametrize("wanted", [Target(4, "x86-64-v3"), Target(2, "")], ids=str)
def test_narrower_vectors_give_the_same_table(wanted: Target) -> None:
    source = inference_source()
    narrow = wanted if wanted.lanes <= target().lanes else target()
    library = load_library("inference", source.encode(), lambda: source, compile_for=narrow)
    system = inference_system(0.187, 0.961, 0.789, 0.927, Shape.GAUSS)
    grid = {"error": ERROR.grid(), "current": CURRENT.grid()}
    usual, other = compiled_table(system, grid), compiled_table(system, grid, library=library)
    assert usual is not None and other is not None
    np.testing.assert_array_equal(usual[0], other[0])
    assert usual[1] == other[1]


def test_values_in_the_middle_between_two_are_rounded_alike() -> None:
    """Where one set alone fires, its peak, 1, is the centroid: 63.5 of 127ths of the largest, 2."""
    outputs = {"one": FuzzySet(1.0, 0.5), "two": FuzzySet(2.0, 0.5)}
    inputs = {
        "error": {"one": FuzzySet(-1.0, 1.0), "two": FuzzySet(1.0, 1.0)},
        "current": {"any": FuzzySet(0.0, 1e9)},
    }
    rules = [Rule({"error": name}, name, 1.0) for name in outputs]
    system = Mamdani(inputs, outputs, rules, universe=2.5)
    axes = {"error": Axis(8, True), "current": CURRENT}
    assert_both_tables_agree(system, axes)
    values = quantised(system, axes).values
    assert set(values[:128].ravel().tolist()) <= {63, 64}
    assert set(values[129:].ravel().tolist()) == {127}


@pytest.mark.parametrize("changed", range(6))
def test_a_system_that_is_odd_but_for_one_rule_has_the_same_bits(changed: int) -> None:
    odd = inference_system(0.187, 0.961, 0.789, 0.927, Shape.GAUSS)
    rules = [
        rule._replace(weight=0.9 * rule.weight) if k == changed else rule
        for k, rule in enumerate(odd.rules)
    ]
    axes = {"error": Axis(7, True), "current": CURRENT}
    assert_both_tables_agree(replace(odd, rules=rules), axes)


@pytest.mark.parametrize("count", [5, 6, 32])
def test_a_table_of_many_sets_has_the_same_bits(count: int) -> None:
    peaks = np.linspace(-1.0, 1.0, count).tolist()
    outputs = {f"{peak}": FuzzySet(peak, 0.5) for peak in peaks}
    inputs = {
        "error": {f"{peak}": FuzzySet(peak, 0.7) for peak in peaks[:16]},
        "current": {f"{peak}": FuzzySet(0.5 + peak, 0.7) for peak in peaks[:16]},
    }
    rules = [
        Rule({"error": f"{peak}", "current": f"{other}"}, consequent, 0.8)
        for peak, other, consequent in zip(peaks[:16], peaks[15::-1], outputs, strict=False)
    ]
    assert_both_tables_agree(
        Mamdani(inputs, outputs, rules, Shape.GAUSS), {"error": Axis(5, True), "current": CURRENT}
    )


@pytest.mark.parametrize(("sets", "rules"), [(33, 16), (16, 17)])
def test_a_system_too_large_for_the_compiled_code_is_still_inferred(sets: int, rules: int) -> None:
    outputs = {f"{k}": FuzzySet(0.01 * k, 0.1) for k in range(sets)}
    inputs = {name: {"near": FuzzySet(0.0, 1.0)} for name in ("error", "current")}
    system = Mamdani(
        inputs, outputs, [Rule({"error": "near"}, f"{k % sets}", 0.9) for k in range(rules)]
    )
    axes = {name: Axis(6, centred=True) for name in inputs}
    grid = {name: axis.grid() for name, axis in axes.items()}
    assert compiled_table(system, grid) is None
    np.testing.assert_array_equal(quantised(system, axes).values, reference_table(system, grid)[0])


def test_table_is_odd_in_the_error_and_follows_it() -> None:
    table = fuzzy_p_table(0.187, 0.961, 0.789, 0.927, Shape.GAUSS).values.astype(int)
    assert table.shape == (1024, 64)
    assert not table[512].any()
    np.testing.assert_array_equal(table[1:512], -table[:512:-1])
    assert (table[513:, 0] >= 0).all()
    assert table[-1, 0] == table.max() > 50


def test_high_current_reverses_the_motor() -> None:
    table = fuzzy_p_table(0.2, 0.3, 0.2, 1.0, Shape.TRIANGLE).values.astype(int)
    assert table[-1, 0] > 0 > table[-1, 63]


def test_quantisation_error_is_half_a_step() -> None:
    exact = inference_system(0.187, 0.961, 0.789, 0.927, Shape.GAUSS).infer(
        {"error": ERROR.grid(), "current": CURRENT.grid()}
    )
    table = fuzzy_p_table(0.187, 0.961, 0.789, 0.927, Shape.GAUSS)
    assert table.largest == np.abs(exact).max()
    assert np.abs(exact - table.values * table.step).max() <= 0.5 * table.step + 1e-12


def test_table_memory_follows_equation_5_1() -> None:
    assert table_bytes((10, 6), 8) == 64 * 1024
    assert table_bytes((8, 8), 8) == 64 * 1024
    assert table_bytes((6, 6, 6), 8, outputs=2) == 512 * 1024
    law = CONTROLLERS["fuzzy-pi"].compile(PUBLISHED_A)
    assert isinstance(law.direct, LookupTable)
    assert law.direct.values.nbytes == table_bytes((10, 6), 8)


def test_the_laws_scales_are_those_of_the_ranges() -> None:
    law = CONTROLLERS["fuzzy-pi"].compile(PUBLISHED_A)
    table = law.direct
    assert isinstance(table, LookupTable)
    assert (5837 * table.error_gain + (1 << 15)) >> 16 == 511
    assert (20111 * table.current_gain + (1 << 15)) >> 16 == 63
    largest = fuzzy_p_table(0.187, 0.961, 0.789, 0.927, Shape.GAUSS).largest
    assert (127 * table.output_gain + (1 << 15)) >> 16 == round(781 * largest)
    # 0.171 PWM counts per count and second, at 500 Hz, in 32 fractional bits.
    assert law.integral_gain == round(0.171 * 0.002 * 2**32)


def test_a_table_of_three_inputs_is_its_inference() -> None:
    """Chapter 3's integral part, every 17th cell inferred alone."""
    system = integral_system(0.066, 0.996, 0.783, Shape.TRIANGLE)
    axes = {"error": Axis(6, True), "current": Axis(4, False), "velocity": Axis(6, True)}
    table = quantised(system, axes)
    assert table.values.shape == (64, 16, 64)
    cells = list(np.ndindex(table.values.shape))[::1717]
    for cell in cells:
        grid = {
            name: axis.grid()[[index]]
            for (name, axis), index in zip(axes.items(), cell, strict=True)
        }
        exact = system.infer(grid)[0, 0, 0]
        assert table.values[cell] == np.rint(127 / table.largest * exact)


def test_a_design_is_compiled_once_for_all_that_it_walks_through() -> None:
    gains = tuple(PUBLISHED_A.items())
    law = control_law("fuzzy-pi", gains)
    assert control_law("fuzzy-pi", gains) is law
    stronger = control_law("fuzzy-pi", (*gains[:-1], (gains[-1][0], 0.5)))
    assert isinstance(law.direct, LookupTable) and isinstance(stronger.direct, LookupTable)
    assert (law.direct.values != stronger.direct.values).any()


def test_tables_are_timed_in_the_thread_that_asks_and_once_each() -> None:
    system = inference_system(0.3, 0.4, 0.5, 0.6, Shape.PI)
    axes = {"error": ERROR, "current": CURRENT}
    with timing_tables() as spent:
        quantised(system, axes)
        elsewhere = threading.Thread(target=quantised, args=(system, axes))
        elsewhere.start()
        elsewhere.join()
    once = spent.seconds
    quantised(system, axes)
    assert spent.made == 1
    assert spent.seconds == once > 0.0


def test_chapter_3s_rules_follow_error_and_velocity_and_yield_to_current() -> None:
    law = CONTROLLERS["fuzzy-pi-3"].compile(CONTROLLERS["fuzzy-pi-3"].published["fuzzy-pso-ps"])
    assert isinstance(law.direct, LookupTable) and isinstance(law.integrated, LookupTable)
    voltage, rate = law.direct.values[:, :, 0].astype(int), law.integrated.values.astype(int)
    assert voltage[900, 0] > 0 > voltage[120, 0]
    assert voltage[900, 63] < 0 < voltage[120, 63]
    assert rate[32, 0, 60] > 0 > rate[32, 0, 4]
    # The velocity's full range, reached within one tick of 2 ms, is the table's last layer.
    assert (round(11682 * 0.002) * law.integrated.velocity_gain + (1 << 15)) >> 16 == 31
