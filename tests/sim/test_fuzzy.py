"""Fuzzy inference against scikit-fuzzy, and the integers that the robot runs."""

from __future__ import annotations

import numpy as np
import pytest
import skfuzzy
from hypothesis import given, settings
from hypothesis import strategies as st

from sim.controllers import CONTROLLERS
from sim.controllers.base import LookupTable
from sim.controllers.fuzzy_pi import CURRENT, ERROR, inference_system, quantised_table
from sim.controllers.fuzzy_pi_3 import integral_system
from sim.controllers.fuzzy_sets import MembershipSets
from sim.controllers.mamdani import FuzzySet, Mamdani, Rule, Shape
from sim.controllers.native_inference import infer
from sim.controllers.quantisation import Axis, quantised, table_bytes
from tests.examples.walks import PUBLISHED_A

WEIGHTS = st.floats(0.1, 1.0)

SETS = MembershipSets(
    large_begins=0.3, small_ends=0.8, positive_peak=0.6, universe=1.5, extreme_peak=1.4
)


def scikit_fuzzy_union(e: float, c: float, w: tuple[float, ...], shape: Shape) -> np.ndarray:
    """Table 4.3 written once more, with scikit-fuzzy's own functions."""
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


@settings(max_examples=60, deadline=None)
@given(
    st.floats(-1, 1),
    st.floats(0, 1),
    st.tuples(WEIGHTS, WEIGHTS, WEIGHTS, WEIGHTS),
    st.sampled_from(Shape),
)
def test_inference_agrees_with_scikit_fuzzy(
    e: float, c: float, weights: tuple[float, float, float, float], shape: Shape
) -> None:
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


@pytest.mark.parametrize("shape", Shape)
def test_compiled_inference_has_the_same_bits(shape: Shape) -> None:
    grid = {"error": ERROR.grid(), "current": CURRENT.grid()}
    system = inference_system(0.187, 0.961, 0.789, 0.927, shape)
    np.testing.assert_array_equal(infer(system, grid), system.infer(grid))


def test_a_system_of_more_sets_than_the_compiled_inference_holds_is_inferred_all_the_same() -> None:
    peaks = np.linspace(-1.0, 1.0, 100)
    outputs = {f"{k}": FuzzySet(float(peak), 0.1) for k, peak in enumerate(peaks)}
    inputs = {name: {"near": FuzzySet(0.0, 1.0)} for name in ("error", "current")}
    rules = [Rule({"error": "near", "current": "near"}, name, 1.0) for name in outputs]
    system = Mamdani(inputs, outputs, rules)
    grid = {name: Axis(8, centred=True).grid() for name in inputs}
    np.testing.assert_array_equal(infer(system, grid), system.infer(grid))


def test_table_is_odd_in_the_error_and_follows_it() -> None:
    table = quantised_table(0.187, 0.961, 0.789, 0.927, Shape.GAUSS).values.astype(int)
    assert table.shape == (1024, 64)
    assert not table[512].any()
    np.testing.assert_array_equal(table[1:512], -table[:512:-1])
    assert (table[513:, 0] >= 0).all()
    assert table[-1, 0] == table.max() > 50


def test_high_current_reverses_the_motor() -> None:
    table = quantised_table(0.2, 0.3, 0.2, 1.0, Shape.TRIANGLE).values.astype(int)
    assert table[-1, 0] > 0 > table[-1, 63]


def test_quantisation_error_is_half_a_step() -> None:
    exact = inference_system(0.187, 0.961, 0.789, 0.927, Shape.GAUSS).infer(
        {"error": ERROR.grid(), "current": CURRENT.grid()}
    )
    table = quantised_table(0.187, 0.961, 0.789, 0.927, Shape.GAUSS)
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
    largest = quantised_table(0.187, 0.961, 0.789, 0.927, Shape.GAUSS).largest
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


def test_chapter_3s_rules_follow_error_and_velocity_and_yield_to_current() -> None:
    law = CONTROLLERS["fuzzy-pi-3"].compile(CONTROLLERS["fuzzy-pi-3"].published["fuzzy-pso-ps"])
    assert isinstance(law.direct, LookupTable) and isinstance(law.integrated, LookupTable)
    voltage, rate = law.direct.values[:, :, 0].astype(int), law.integrated.values.astype(int)
    assert voltage[900, 0] > 0 > voltage[120, 0]
    assert voltage[900, 63] < 0 < voltage[120, 63]
    assert rate[32, 0, 60] > 0 > rate[32, 0, 4]
    # The velocity's full range, reached within one tick of 2 ms, is the table's last layer.
    assert (round(11682 * 0.002) * law.integrated.velocity_gain + (1 << 15)) >> 16 == 31
