"""Synchronisation of two logs of one walk, trimmed to whole walking cycles (thesis 2.3)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.controllers.fixed_point import CONTROL_PERIOD
from gaitswarm.sim.errors import MeasuredLogError
from gaitswarm.sim.measurement.measured_log import MeasuredLog
from gaitswarm.sim.memory import require_room_for_scipy

Floats = NDArray[np.float64]

_TIE: Final = 1e-6
"""Relative difference of correlations up to which lags count as equally good."""


@dataclass(frozen=True, slots=True, eq=False)
class Synchronised:
    """The same whole cycles of a walk, measured and simulated, with the same rows."""

    measured: MeasuredLog
    simulated: MeasuredLog
    lag: int  # rows by which the walk begins later in the measured log than in the simulated one
    # number of whole walking cycles, the last of the common part, as a walk starts at rest
    cycles: int
    cycle_time: float  # [s]
    correlation: float  # of the desired angles over the common part, 1 for equal gaits

    @property
    def lag_seconds(self) -> float:
        """`lag` as time [s]."""
        return self.lag * CONTROL_PERIOD


def synchronise(measured: MeasuredLog, simulated: MeasuredLog, cycle_time: float) -> Synchronised:
    """Find the lag between two logs and trim both to their common whole cycles."""
    if measured.joints != simulated.joints:
        raise MeasuredLogError("the two logs have different joints")
    cycle = round(cycle_time / CONTROL_PERIOD)
    shortest = min(len(measured.time), len(simulated.time))
    if shortest < cycle:
        raise MeasuredLogError(
            f"{shortest * CONTROL_PERIOD:g} s are shorter than a walking cycle of {cycle_time:g} s"
        )
    lag, correlation = find_lag(measured.desired_angle, simulated.desired_angle, cycle)
    first, common = _common(lag, len(measured.time), len(simulated.time))
    # A cycle need not be a whole number of rows.
    cycles = int((common + 0.5) * CONTROL_PERIOD / cycle_time + 1e-9)
    kept = min(common, round(cycles * cycle_time / CONTROL_PERIOD))
    end = first + common
    return Synchronised(
        measured=measured.rows(end - kept, end),
        simulated=simulated.rows(end - kept - lag, end - lag),
        lag=lag,
        cycles=cycles,
        cycle_time=cycle_time,
        correlation=correlation,
    )


def find_lag(measured: Floats, simulated: Floats, cycle: int) -> tuple[int, float]:
    """Return the lag k [rows] with measured[t + k] = simulated[t], and the correlation there.

    Desired angles are (T1, J) and (T2, J). The cross-correlation over the overlap identifies the
    cycle, but it favours long overlaps and is off by some rows. Within a quarter of a cycle, the
    mean square difference determines the exact row.
    """
    mean = simulated.mean(axis=0)
    x, y = measured - mean, simulated - mean
    if not (np.ptp(x, axis=0).any() and np.ptp(y, axis=0).any()):
        raise MeasuredLogError("the desired angles are constant and cannot be aligned")
    lags = np.arange(-(len(y) - 1), len(x))
    # Rows of x in the overlap are [start, stop), those of y [start - k, stop - k).
    start, stop = np.maximum(lags, 0), np.minimum(len(x), len(y) + lags)
    long_enough = stop - start >= cycle
    lags, start, stop = lags[long_enough], start[long_enough], stop[long_enough]
    product = _cross_correlation(x, y)[lags + len(y) - 1]
    energy_x, energy_y = _cumulated_energy(x), _cumulated_energy(y)
    of_x = energy_x[stop] - energy_x[start]
    of_y = energy_y[stop - lags] - energy_y[start - lags]
    best = np.flatnonzero(product >= product.max() - _TIE * abs(product.max()))
    coarse = lags[best[np.argmin(np.abs(lags[best]))]]
    near = np.flatnonzero(np.abs(lags - coarse) <= cycle // 4)
    difference = (of_x + of_y - 2.0 * product)[near] / (stop - start)[near]
    chosen = near[np.argmin(difference)]
    scale = float(np.sqrt(of_x[chosen] * of_y[chosen]))
    return int(lags[chosen]), float(product[chosen]) / scale if scale > 0.0 else 0.0


def _cross_correlation(x: Floats, y: Floats) -> Floats:
    """sum over rows and columns of x[t + k] y[t], for k from -(len(y) - 1) to len(x) - 1."""
    # Slow to import, and not needed to show recordings.
    require_room_for_scipy()
    from scipy.signal import fftconvolve  # noqa: PLC0415

    product: Floats = fftconvolve(x, y[::-1], axes=0).sum(axis=1)
    return product


def _cumulated_energy(x: Floats) -> Floats:
    return np.concatenate([[0.0], np.cumsum((x**2).sum(axis=1))])


def _common(lag: int, measured: int, simulated: int) -> tuple[int, int]:
    """First row of the overlap in the measured log, and its length."""
    first = max(lag, 0)
    return first, min(measured, simulated + lag) - first
