"""How far a simulated signal is from a measured one: eq. 2.15 to 2.22 and table 2.3 of the thesis.

X is measured, Y simulated, both in the same unit and of the same shape: (T,) one signal, or (T, C)
several that are judged together; means run over all T C samples. Rows are equally spaced in time.
A relative error of a signal that is zero throughout is 0 if there is no error, else infinite.

Every function raises SimulationInputError for shapes that do not fit or have no samples.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import StrEnum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gaitswarm.sim.errors import SimulationInputError

Floats = NDArray[np.float64]


def root_mean_square_error(measured: Floats, simulated: Floats) -> float:
    """MSE, eq. 2.15: sqrt(mean (X - Y)^2).

    Args:
        measured: X, (T,) or (T, C).
    """
    return math.sqrt(float(np.mean(_error(measured, simulated) ** 2)))


def mean_absolute_error(measured: Floats, simulated: Floats) -> float:
    """MAE, eq. 2.16: mean |X - Y|.

    Args:
        measured: X, (T,) or (T, C).
    """
    return mean_absolute(_error(measured, simulated))


def relative_mean_absolute_error(measured: Floats, simulated: Floats) -> float:
    """RMAE, eq. 2.17: MAE / mean |X|. (The thesis prints RAM on its left side.)

    Args:
        measured: X, (T,) or (T, C).

    Returns:
        [1].
    """
    return _relative(mean_absolute_error(measured, simulated), measured)


def difference_of_absolute_means(measured: Floats, simulated: Floats) -> float:
    """DAM, eq. 2.18: | mean |X| - mean |Y| |; blind to time.

    Args:
        measured: X, (T,) or (T, C).
    """
    _error(measured, simulated)
    return abs(mean_absolute(measured) - mean_absolute(simulated))


def relative_difference_of_absolute_means(measured: Floats, simulated: Floats) -> float:
    """RAM, eq. 2.19: DAM / mean |X|.

    Args:
        measured: X, (T,) or (T, C).

    Returns:
        [1].
    """
    return _relative(difference_of_absolute_means(measured, simulated), measured)


def confidence_interval(repeats: Sequence[Floats]) -> tuple[float, float]:
    """CONF, eq. 2.20: least and largest mean |X| of M measurements."""
    if not repeats:
        raise SimulationInputError("a confidence interval needs at least one measurement")
    means = [mean_absolute(repeat) for repeat in repeats]
    return min(means), max(means)


def intensity(signal: Floats, timestep: float) -> float:
    """Eq. 2.22: sqrt(mean |X| std X (max X - min X) mean |dX/dt|), how lively a signal is.

    dX/dt is the difference of neighbouring rows over the timestep.

    Args:
        signal: X, (T,) or (T, C).
        timestep: Between rows [s].
    """
    columns = _samples(signal).reshape(len(signal), -1)
    if len(columns) < 2:
        raise SimulationInputError("the intensity of a signal needs at least two samples")
    rate = np.abs(np.diff(columns, axis=0)).mean(axis=0) / timestep
    spread = columns.max(axis=0) - columns.min(axis=0)
    product = np.abs(columns).mean(axis=0) * columns.std(axis=0) * spread * rate
    return float(np.sqrt(product).mean())


def mean_absolute(signal: Floats) -> float:
    """Mean |X| over all samples.

    Args:
        signal: X, (T,) or (T, C).
    """
    return float(np.mean(np.abs(_samples(signal))))


def amplitude_spectrum(signal: Floats, timestep: float) -> tuple[Floats, Floats]:
    """One-sided amplitudes.

    A sine of amplitude A that fits the T rows a whole number of times shows as A in its own bin
    and nowhere else, hence signals must span whole walking cycles; bin 0 is the absolute mean.

    Args:
        signal: (T,) or (T, C).
        timestep: Between rows [s].

    Returns:
        Frequencies (F,) [Hz] and amplitudes (F,) or (F, C), in the signal's unit; F = T // 2 + 1.
    """
    rows = len(_samples(signal))
    amplitude = np.abs(np.fft.rfft(signal, axis=0)) * (2.0 / rows)
    amplitude[0] /= 2.0
    if rows % 2 == 0:
        amplitude[-1] /= 2.0
    return np.asarray(np.fft.rfftfreq(rows, timestep), dtype=np.float64), amplitude


def spectral_error(measured: Floats, simulated: Floats, timestep: float) -> float:
    """|| A - B || / || A || of the amplitude spectra A, B: blind to phase, 0 for a pure delay.

    Norms run over frequencies and signals, so that strong oscillations weigh more than the many
    bins of noise. The mean value (bin 0) is left out: it is no oscillation, and MAE tells it.

    Args:
        measured: (T,) or (T, C), whose spectrum is A.
        timestep: Between rows [s].

    Returns:
        [1].
    """
    _error(measured, simulated)
    of_measured, of_simulated = (
        amplitude_spectrum(signal, timestep)[1][1:] for signal in (measured, simulated)
    )
    error = float(np.linalg.norm(of_measured - of_simulated))
    scale = float(np.linalg.norm(of_measured))
    return _ratio(error, scale)


def _relative(error: float, measured: Floats) -> float:
    return _ratio(error, mean_absolute(measured))


def _ratio(error: float, scale: float) -> float:
    if scale == 0.0:
        return 0.0 if error == 0.0 else math.inf
    return error / scale


def _error(measured: Floats, simulated: Floats) -> Floats:
    if measured.shape != simulated.shape:
        raise SimulationInputError(
            f"signals of shapes {measured.shape} and {simulated.shape} cannot be compared"
        )
    return _samples(measured) - simulated


def _samples(signal: Floats) -> Floats:
    if signal.size == 0:
        raise SimulationInputError("a signal without samples cannot be judged")
    return signal


class Tolerance(StrEnum):
    """What an RMAE means, by the colour that the thesis gives it; from good to bad."""

    GREEN = "green"
    YELLOW = "yellow"
    ORANGE = "orange"
    RED = "red"
    PURPLE = "purple"

    @property
    def limit(self) -> float:
        """Largest RMAE [1] that still belongs to the class."""
        return _LIMITS[self]

    @property
    def phrase(self) -> str:
        """What to think of it."""
        return _PHRASES[self]

    @classmethod
    def of(cls, rmae: float) -> Tolerance:
        """Class of a relative mean absolute error.

        >>> [Tolerance.of(x).value for x in (0.02, 0.021, 0.31)]
        ['green', 'yellow', 'red']

        Args:
            rmae: [1]; NaN is as bad as can be.
        """
        return next((known for known in cls if rmae <= known.limit), cls.PURPLE)


_LIMITS: Final = {
    Tolerance.GREEN: 0.02,
    Tolerance.YELLOW: 0.10,
    Tolerance.ORANGE: 0.30,
    Tolerance.RED: 0.50,
    Tolerance.PURPLE: math.inf,
}

_PHRASES: Final = {
    Tolerance.GREEN: "as exact as a digital measurement",
    Tolerance.YELLOW: "as exact as an analog measurement",
    Tolerance.ORANGE: "moderate, acceptable under conditions",
    Tolerance.RED: "unacceptable",
    Tolerance.PURPLE: "a serious error",
}
