"""Equations 2.15 to 2.22 and table 2.3."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from gaitswarm.sim import validation as measures
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.validation import Tolerance

X = np.array([1.0, -2.0, 3.0, -2.0])
Y = np.array([2.0, -2.0, 1.0, -1.0])

signals = arrays(np.float64, st.integers(2, 40), elements=st.floats(-100.0, 100.0, width=32))
factors = st.floats(0.01, 100.0)


@st.composite
def pairs(draw: Any) -> tuple[np.ndarray, np.ndarray]:
    shape = draw(st.tuples(st.integers(2, 20), st.integers(1, 4)))
    elements = st.floats(-100.0, 100.0, width=32)
    return draw(arrays(np.float64, shape, elements=elements)), draw(
        arrays(np.float64, shape, elements=elements)
    )


def test_measures_computed_by_hand() -> None:
    # X - Y = -1, 0, 2, -1; mean |X| = 2; mean |Y| = 1.5
    assert measures.root_mean_square_error(X, Y) == pytest.approx(math.sqrt(6.0 / 4.0))
    assert measures.mean_absolute_error(X, Y) == 1.0
    assert measures.relative_mean_absolute_error(X, Y) == 0.5
    assert measures.difference_of_absolute_means(X, Y) == 0.5
    assert measures.relative_difference_of_absolute_means(X, Y) == 0.25


def test_relative_measures_divide_by_the_measured_signal() -> None:
    assert measures.relative_mean_absolute_error(Y, X) == pytest.approx(1.0 / 1.5)
    assert measures.relative_difference_of_absolute_means(Y, X) == pytest.approx(0.5 / 1.5)


def test_the_confidence_interval_spans_the_means_of_repeats() -> None:
    assert measures.confidence_interval([X, Y, np.array([-1.75, 1.75])]) == (1.5, 2.0)


def test_intensity_computed_by_hand() -> None:
    # 0 1 0 1: mean 0.5, standard deviation 0.5, range 1, mean |dX/dt| = 1 / 0.25 s = 4
    square = np.array([0.0, 1.0, 0.0, 1.0])
    assert measures.intensity(square, 0.25) == pytest.approx(math.sqrt(0.5 * 0.5 * 1.0 * 4.0))


def test_intensity_of_several_signals_is_their_mean() -> None:
    both = measures.intensity(np.stack([X, Y], axis=1), 0.1)
    assert both == pytest.approx((measures.intensity(X, 0.1) + measures.intensity(Y, 0.1)) / 2.0)


@given(pairs(), factors)
def test_measures_scale_with_the_unit_and_relative_ones_do_not(
    pair: tuple[np.ndarray, np.ndarray], factor: float
) -> None:
    x, y = pair
    close: Any = {"rel": 1e-9, "abs": 1e-9}
    for measure in (
        measures.root_mean_square_error,
        measures.mean_absolute_error,
        measures.difference_of_absolute_means,
    ):
        assert measure(x * factor, y * factor) == pytest.approx(factor * measure(x, y), **close)
        assert measure(x, y) == pytest.approx(measure(y, x), **close)
        assert measure(x, x) == 0.0
    if np.abs(x).mean() > 1e-3:
        for relative in (
            measures.relative_mean_absolute_error,
            measures.relative_difference_of_absolute_means,
        ):
            assert relative(x * factor, y * factor) == pytest.approx(relative(x, y), **close)


@given(pairs())
def test_dam_never_exceeds_mae_nor_mae_the_root_mean_square(
    pair: tuple[np.ndarray, np.ndarray],
) -> None:
    dam, mae, mse = (
        measure(*pair)
        for measure in (
            measures.difference_of_absolute_means,
            measures.mean_absolute_error,
            measures.root_mean_square_error,
        )
    )
    assert dam <= mae + 1e-9
    assert mae <= mse + 1e-9


@given(signals, factors)
def test_intensity_grows_with_the_square_of_the_signal_and_the_root_of_its_speed(
    signal: np.ndarray, factor: float
) -> None:
    intensity = measures.intensity(signal, 0.002)
    close: Any = {"rel": 1e-6, "abs": 1e-6}
    assert measures.intensity(signal * factor, 0.002) == pytest.approx(
        factor**2 * intensity, **close
    )
    assert measures.intensity(signal, 0.002 * 4.0) == pytest.approx(intensity / 2.0, **close)
    assert measures.intensity(np.full(5, 3.0), 0.002) == 0.0


def test_a_sine_of_whole_cycles_is_one_line_of_its_amplitude() -> None:
    time = np.arange(1000) * 0.002
    signal = 0.5 + 3.0 * np.sin(2.0 * np.pi * 4.0 * time + 0.3)
    frequency, amplitude = measures.amplitude_spectrum(signal, 0.002)
    assert frequency[:2] == pytest.approx([0.0, 0.5])
    assert frequency[-1] == pytest.approx(250.0)
    assert amplitude[8] == pytest.approx(3.0)
    assert amplitude[0] == pytest.approx(0.5)
    assert np.delete(amplitude, [0, 8]).max() < 1e-12


@given(signals)
def test_the_spectrum_holds_the_signals_whole_energy(signal: np.ndarray) -> None:
    _, amplitude = measures.amplitude_spectrum(signal, 0.002)
    power = amplitude**2 / 2.0
    power[0] *= 2.0
    if len(signal) % 2 == 0:
        power[-1] *= 2.0
    assert power.sum() == pytest.approx(np.mean(signal**2), rel=1e-9, abs=1e-9)


def test_the_spectral_error_is_blind_to_delay_but_not_to_size() -> None:
    time = np.arange(500) * 0.002
    signal = np.sin(2 * np.pi * 2 * time) + 0.3 * np.cos(2 * np.pi * 6 * time)
    assert measures.spectral_error(signal, np.roll(signal, 40) + 5.0, 0.002) < 1e-9
    assert measures.spectral_error(signal, 1.25 * signal, 0.002) == pytest.approx(0.25)


def test_the_relative_error_of_a_signal_that_is_zero_is_none_or_infinite() -> None:
    zero, one = np.zeros(4), np.ones(4)
    for relative in (
        measures.relative_mean_absolute_error,
        measures.relative_difference_of_absolute_means,
    ):
        assert relative(zero, zero) == 0.0
        assert relative(zero, one) == math.inf


def test_signals_that_do_not_fit_are_refused() -> None:
    with pytest.raises(SimulationInputError, match="shapes"):
        measures.mean_absolute_error(X, X[:3])
    with pytest.raises(SimulationInputError, match="at least one sample"):
        measures.mean_absolute(np.empty(0))
    with pytest.raises(SimulationInputError, match="two samples"):
        measures.intensity(X[:1], 0.002)
    with pytest.raises(SimulationInputError, match="at least one"):
        measures.confidence_interval([])


@pytest.mark.parametrize(
    ("rmae", "expected"),
    [
        (0.0, Tolerance.GREEN),
        (0.02, Tolerance.GREEN),
        (0.0201, Tolerance.YELLOW),
        (0.10, Tolerance.YELLOW),
        (0.11, Tolerance.ORANGE),
        (0.30, Tolerance.ORANGE),
        (0.31, Tolerance.RED),
        (0.50, Tolerance.RED),
        (0.51, Tolerance.PURPLE),
        (math.inf, Tolerance.PURPLE),
        (math.nan, Tolerance.PURPLE),
    ],
)
def test_tolerance_classes_are_those_of_table_2_3(rmae: float, expected: Tolerance) -> None:
    assert Tolerance.of(rmae) is expected


def test_every_tolerance_class_has_a_phrase() -> None:
    assert len({known.phrase for known in Tolerance}) == 5
