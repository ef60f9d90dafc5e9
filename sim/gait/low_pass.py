"""The low-pass FIR filter that smooths desired angles (thesis section 5.4, table 3.2)."""

from __future__ import annotations

from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.controllers.fixed_point import CONTROL_PERIOD
from gaitswarm.sim.memory import require_room_for_scipy

Floats = NDArray[np.float64]

_BLOCK: Final = 2048
"""Ticks that are filtered together: their sums stay in the processor's cache, however long a walk
is."""

FirWindow = Literal["moving_average", "hamming"]
"""`hamming` is the default of Matlab's fir1: a windowed sinc."""


def fir_gains(fir_ms: int, window: FirWindow) -> Floats:
    """Coefficients of the filter at the control rate; their sum, the gain at 0 Hz, is 1.

    Args:
        fir_ms: Length of the filter [ms].
        window: `moving_average`: equal coefficients, one a control period. `hamming`: as
            fir1(order, cut-off), order being the number of control periods, so that the delay is
            half of the length. The cut-off is one over the number of coefficients times the
            control period: the main lobe of the ideal low-pass then just fills the filter.

    Returns:
        (n,), oldest angle first.
    """
    order = round(fir_ms * 1e-3 / CONTROL_PERIOD)
    taps = max(1, order) if window == "moving_average" else order + 1
    # One or two coefficients that are symmetric are equal, and have no cut-off below Nyquist's.
    if window == "moving_average" or taps < 3:
        return np.full(taps, 1.0 / taps)
    # Slow to import, and only for this window.
    require_room_for_scipy()
    from scipy.signal import firwin  # noqa: PLC0415

    return np.asarray(firwin(taps, 2.0 / taps, window="hamming"))


def low_pass(angles: Floats, fir_ms: int, window: FirWindow = "moving_average") -> Floats:
    """Filtered angles, at rest before t = 0.

    Args:
        angles: At the control rate, (T, J).
        fir_ms: Length of the filter [ms].

    Returns:
        (T, J).
    """
    gains = fir_gains(fir_ms, window)
    taps, ticks = len(gains), len(angles)
    padded = np.concatenate([np.repeat(angles[:1], taps - 1, axis=0), angles])
    sums = np.zeros_like(angles) if window == "hamming" else padded[:ticks].copy()
    for begin in range(0, ticks, _BLOCK):
        end = min(begin + _BLOCK, ticks)
        block = sums[begin:end]
        if window == "hamming":
            for delay, gain in enumerate(gains):
                block += padded[begin + delay : end + delay] * gain
        else:
            # Tick by tick from the oldest on: a running sum would be faster still, but rounds
            # otherwise.
            for delay in range(1, taps):
                block += padded[begin + delay : end + delay]
    if window == "moving_average":
        sums /= taps
    return sums
