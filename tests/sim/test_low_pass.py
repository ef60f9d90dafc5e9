"""The filter of the desired angles."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from gaitswarm.sim.gait.trajectory import FirWindow, desired_angles, fir_gains, low_pass
from gaitswarm.sim.robot.robot import Robot
from gaitswarm.sim.scenario import SCENARIOS


@pytest.mark.parametrize("taps", [1, 6, 50])
def test_the_filter_is_a_moving_average_from_rest(taps: int) -> None:
    signal = np.random.default_rng(0).normal(size=(200, 2))
    smooth = low_pass(signal, 2 * taps)
    padded = np.concatenate([np.repeat(signal[:1], taps - 1, axis=0), signal])
    expected = [padded[k : k + taps].mean(axis=0) for k in range(len(signal))]
    np.testing.assert_allclose(smooth, expected, atol=1e-12)
    np.testing.assert_allclose(smooth[0], signal[0])


@pytest.mark.parametrize("fir_ms", [4, 12, 93, 300])
def test_a_hamming_filter_is_a_windowed_sinc_with_unit_gain_at_zero_frequency(fir_ms: int) -> None:
    gains = fir_gains(fir_ms, "hamming")
    order = round(fir_ms / 2)
    n = np.arange(order + 1)
    sinc = np.sinc(2.0 * (n - order / 2) / (order + 1))
    expected = sinc * (0.54 - 0.46 * np.cos(2.0 * np.pi * n / order))
    np.testing.assert_allclose(gains, expected / expected.sum(), atol=1e-15)
    assert gains.sum() == pytest.approx(1.0, abs=1e-15)
    assert (gains > 0.0).all()


@pytest.mark.parametrize("fir_ms", [12, 93, 300])
def test_a_hamming_filter_falls_to_0_6_at_its_cut_off_and_to_nothing_beyond(fir_ms: int) -> None:
    gains = fir_gains(fir_ms, "hamming")
    cut_off = 1.0 / len(gains)
    frequency = np.concatenate([[cut_off], np.linspace(3.0 * cut_off, 0.5, 500)])
    passed = abs(np.exp(-2j * np.pi * np.outer(frequency, np.arange(len(gains)))) @ gains)
    assert passed[0] == pytest.approx(0.62, abs=0.03)
    assert (passed[1:] < 0.02).all()


@pytest.mark.parametrize("fir_ms", [0, 1, 2, 3])
@pytest.mark.parametrize("window", ["moving_average", "hamming"])
def test_a_filter_of_a_few_milliseconds_still_passes_what_is_constant(
    window: FirWindow, fir_ms: int
) -> None:
    assert fir_gains(fir_ms, window).sum() == pytest.approx(1.0)
    still = np.full((5, 2), 0.3)
    np.testing.assert_allclose(low_pass(still, fir_ms, window), still)


def test_a_hamming_filter_convolves_the_angles_from_rest_and_delays_by_half_its_length(
    robot: Robot,
) -> None:
    signal = np.random.default_rng(0).normal(size=(200, 2))
    smooth = low_pass(signal, 100, "hamming")
    padded = np.concatenate([np.repeat(signal[:1], 50, axis=0), signal])
    expected = [np.convolve(padded[:, k], fir_gains(100, "hamming"), "valid") for k in (0, 1)]
    np.testing.assert_allclose(smooth, np.stack(expected, axis=1), atol=1e-14)
    ramp = np.arange(200.0)[:, np.newaxis]
    np.testing.assert_allclose(low_pass(ramp, 100, "hamming")[60:], ramp[35:-25], atol=1e-12)

    rough = SCENARIOS[0].model_copy(update={"fir_ms": 100, "trajectory_rate": 25.0})
    windows = ("moving_average", "hamming")
    averaged, hamming = (
        desired_angles(robot, rough.model_copy(update={"fir_window": window})).angles
        for window in windows
    )
    unfiltered = desired_angles(robot, rough.model_copy(update={"fir_ms": 0})).angles
    np.testing.assert_allclose(averaged, low_pass(unfiltered, 100), rtol=0, atol=2e-12)
    np.testing.assert_allclose(hamming, low_pass(unfiltered, 100, "hamming"), rtol=0, atol=2e-12)


@pytest.mark.parametrize("ticks", [1, 7, 2047, 2048, 2049, 4100])
@pytest.mark.parametrize("window", ["moving_average", "hamming"])
def test_a_long_signal_is_filtered_as_a_short_one_to_the_last_bit(
    window: FirWindow, ticks: int
) -> None:
    signal = np.random.default_rng(ticks).normal(size=(ticks, 3))
    gains = fir_gains(100, window)
    # Fewer ticks than the filter works on at once, each from its own past alone.
    past = np.concatenate([np.repeat(signal[:1], len(gains) - 1, axis=0), signal])
    smooth = low_pass(signal, 100, window)
    for tick in {0, 1, ticks // 2, 2047, 2048, ticks - 1} & set(range(ticks)):
        alone = low_pass(past[tick : tick + len(gains)], 100, window)
        assert smooth[tick].tobytes() == alone[-1].tobytes()


@pytest.mark.parametrize("window", ["moving_average", "hamming"])
def test_filtering_a_long_walk_takes_twice_the_memory_of_its_angles(window: FirWindow) -> None:
    angles = np.zeros((200_000, 6))
    low_pass(angles[:10], 12, window)
    tracemalloc.start()
    try:
        low_pass(angles, 12, window)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 2.2 * angles.nbytes
