"""Validation: deviation of a simulated walk from a measured one (thesis 2.3).

Signals are X (measured) and Y (simulated), (T,) or (T, C).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import StrEnum
from typing import Final, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from gaitswarm.sim.arrays import Floats
from gaitswarm.sim.controllers.fixed_point import CONTROL_PERIOD
from gaitswarm.sim.errors import SimulationInputError
from gaitswarm.sim.measurement.measured_log import MeasuredLog, Quantity, Synchronised
from gaitswarm.sim.robot.description import JOINTS_PER_LEG


def root_mean_square_error(measured: Floats, simulated: Floats) -> float:
    """MSE, eq. 2.15: sqrt(mean (X - Y)^2)."""
    return math.sqrt(float(np.mean(_error(measured, simulated) ** 2)))


def mean_absolute_error(measured: Floats, simulated: Floats) -> float:
    """MAE, eq. 2.16: mean |X - Y|."""
    return mean_absolute(_error(measured, simulated))


def relative_mean_absolute_error(measured: Floats, simulated: Floats) -> float:
    """RMAE, eq. 2.17: MAE / mean |X| [1]. (The thesis prints RAM on its left side.)"""
    return _relative(mean_absolute_error(measured, simulated), measured)


def difference_of_absolute_means(measured: Floats, simulated: Floats) -> float:
    """DAM, eq. 2.18: | mean |X| - mean |Y| |, independent of timing."""
    _error(measured, simulated)
    return abs(mean_absolute(measured) - mean_absolute(simulated))


def relative_difference_of_absolute_means(measured: Floats, simulated: Floats) -> float:
    """RAM, eq. 2.19: DAM / mean |X| [1]."""
    return _relative(difference_of_absolute_means(measured, simulated), measured)


def confidence_interval(repeats: Sequence[Floats]) -> tuple[float, float]:
    """CONF, eq. 2.20: least and largest mean |X| of M measurements."""
    if not repeats:
        raise SimulationInputError("a confidence interval needs at least one measurement")
    means = [mean_absolute(repeat) for repeat in repeats]
    return min(means), max(means)


def intensity(signal: Floats, timestep: float) -> float:
    """Eq. 2.22: sqrt(mean |X| std X (max X - min X) mean |dX/dt|), a signal's liveliness."""
    columns = _samples(signal).reshape(len(signal), -1)
    if len(columns) < 2:
        raise SimulationInputError("the intensity of a signal needs at least two samples")
    rate = np.abs(np.diff(columns, axis=0)).mean(axis=0) / timestep
    spread = columns.max(axis=0) - columns.min(axis=0)
    product = np.abs(columns).mean(axis=0) * columns.std(axis=0) * spread * rate
    return float(np.sqrt(product).mean())


def mean_absolute(signal: Floats) -> float:
    return float(np.mean(np.abs(_samples(signal))))


def amplitude_spectrum(signal: Floats, timestep: float) -> tuple[Floats, Floats]:
    """Return frequencies (F,) [Hz] and one-sided amplitudes (F,) or (F, C), F = T // 2 + 1."""
    rows = len(_samples(signal))
    amplitude = np.abs(np.fft.rfft(signal, axis=0)) * (2.0 / rows)
    amplitude[0] /= 2.0
    if rows % 2 == 0:
        amplitude[-1] /= 2.0
    return np.asarray(np.fft.rfftfreq(rows, timestep), dtype=np.float64), amplitude


def spectral_error(measured: Floats, simulated: Floats, timestep: float) -> float:
    """|| A - B || / || A || [1] of the amplitude spectra A, B: 0 for a pure delay."""
    _error(measured, simulated)
    of_measured, of_simulated = (
        amplitude_spectrum(signal, timestep)[1][1:] for signal in (measured, simulated)
    )
    error = float(np.linalg.norm(of_measured - of_simulated))
    scale = float(np.linalg.norm(of_measured))
    return _ratio(error, scale)


def phase_means(signal: Floats, cycle_rows: float, bins: int) -> Floats:
    """Return the means (bins, C) of a signal (T, C) over equal parts of the walking cycle."""
    place = (np.arange(len(signal)) % cycle_rows * (bins / cycle_rows)).astype(np.int64)
    total = np.zeros((bins, signal.shape[1]))
    np.add.at(total, place, signal)
    return total / np.bincount(place, minlength=bins)[:, None]


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
        raise SimulationInputError("a signal needs at least one sample")
    return signal


class Tolerance(StrEnum):
    """Classes of RMAE by their colours in the thesis, from good to bad."""

    limit: float  # largest relative mean absolute error of the class [1]
    phrase: str

    GREEN = "green", 0.02, "as exact as a digital measurement"
    YELLOW = "yellow", 0.10, "as exact as an analog measurement"
    ORANGE = "orange", 0.30, "moderate, acceptable under conditions"
    RED = "red", 0.50, "unacceptable"
    PURPLE = "purple", math.inf, "a serious error"

    def __new__(cls, colour: str, limit: float, phrase: str) -> Self:
        tolerance = str.__new__(cls, colour)
        tolerance._value_ = colour
        tolerance.limit, tolerance.phrase = limit, phrase
        return tolerance

    @classmethod
    def of(cls, rmae: float) -> Tolerance:
        """Classify a relative mean absolute error [1]; NaN belongs to the worst class.

        >>> [Tolerance.of(x).value for x in (0.02, 0.021, 0.31)]
        ['green', 'yellow', 'red']
        """
        return next((known for known in cls if rmae <= known.limit), cls.PURPLE)


SPECTRAL_QUANTITIES: Final = (Quantity.CURRENT,)
"""Quantities whose spectra are compared."""

N_HARMONICS: Final = 20
"""Multiples of the walking frequency that a comparison lists."""


class _Data(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", defer_build=True)


class Agreement(_Data):
    """Measures of one signal, or of several together; units are the quantity's."""

    name: str = Field(description="Joint, leg or axis; `link 1` to `link 3`; or `all`.")
    mean_absolute_measured: float = Field(description="mean |X|")
    mean_absolute_simulated: float = Field(description="mean |Y|")
    mse: float = Field(description="MSE, the root of the mean square error, eq. 2.15")
    mae: float = Field(description="MAE, mean absolute error, eq. 2.16")
    rmae: float = Field(description="RMAE, relative mean absolute error, eq. 2.17 [1]")
    dam: float = Field(description="DAM, difference of the absolute means, eq. 2.18")
    ram: float = Field(description="RAM, relative difference of the absolute means, eq. 2.19 [1]")
    intensity_measured: float = Field(description="eq. 2.22 [unit^2 / sqrt(s)]")
    intensity_simulated: float = Field(description="eq. 2.22 [unit^2 / sqrt(s)]")
    tolerance: Tolerance = Field(description="class of RMAE, table 2.3")
    confidence: tuple[float, float] | None = Field(
        default=None, description="CONF of repeated measurements, eq. 2.20"
    )

    @property
    def within_confidence(self) -> bool | None:
        """Whether the simulated mean |Y| lies within the measured ones; None without repeats."""
        if self.confidence is None:
            return None
        low, high = self.confidence
        return low <= self.mean_absolute_simulated <= high


class Harmonics(_Data):
    """Amplitudes at multiples of the walking frequency, averaged over the joints of a link."""

    name: str = Field(description="`link 1` to `link 3`.")
    frequency: tuple[float, ...] = Field(description="[Hz]")
    measured: tuple[float, ...] = Field(description="amplitude, in the quantity's unit")
    simulated: tuple[float, ...] = Field(description="amplitude, in the quantity's unit")
    spectral_error: float = Field(
        description="norm of the spectra's difference over the measured one's [1]"
    )


class QuantityComparison(_Data):
    """One row of table 2.2."""

    quantity: Quantity
    unit: str
    meaning: str
    whole: Agreement = Field(description="all channels together")
    links: tuple[Agreement, ...] = Field(description="by link; empty if not measured at joints")
    channels: tuple[Agreement, ...] = Field(description="by joint, leg or axis")
    spectra: tuple[Harmonics, ...] = Field(default=(), description="of currents, by link")


class BatteryComparison(_Data):
    """The sum of the absolute motor currents, and the battery's current (fig. 2.16)."""

    motors: Agreement = Field(description="The measured and the simulated sum.")
    measured: Agreement | None = Field(
        description="The battery's current and the motors' sum, both measured; null without `I_B`."
    )
    simulated: Agreement | None = Field(
        description="The battery's current and the motors' sum, both simulated."
    )


class Gate(_Data):
    """A quantity's part in the verdict."""

    quantity: Quantity = Field(description="Its symbol in table 2.2.")
    passed: bool = Field(description="Whether each of its links is within the tolerance.")
    reason: str = Field(description="Links that fail and their classes; empty if it passed.")


class Verdict(_Data):
    """Whether the model is validated for a walk (thesis 2.3).

    Digital signals come first, and one that is not as exact as a digital measurement ends the
    procedure. Then every link of the analog signals must be green or yellow, or orange with the
    simulated mean inside CONF. Supplementary quantities have no part.
    """

    validated: bool = Field(description="Whether every gate was passed.")
    gates: tuple[Gate, ...] = Field(description="In their order, up to a failed digital one.")


class Comparison(_Data):
    """Comparison of a measured with a simulated walk over the same whole walking cycles."""

    lag: float = Field(description="delay of the walk in the measured log [s]")
    correlation: float = Field(description="of the desired angles at this lag [1]")
    cycles: int = Field(description="walking cycles compared")
    cycle_time: float = Field(description="[s]")
    samples: int = Field(description="rows compared, 500 per second")
    repeats: int = Field(description="further measurements, for CONF")
    synthetic: bool = Field(description="whether the measured log was computed, as it says")
    quantities: tuple[QuantityComparison, ...]
    battery: BatteryComparison
    verdict: Verdict

    def quantity(self, quantity: Quantity) -> QuantityComparison:
        for known in self.quantities:
            if known.quantity is quantity:
                return known
        raise KeyError(quantity)


def compare_synchronised(pair: Synchronised, repeats: Sequence[MeasuredLog] = ()) -> Comparison:
    quantities = tuple(
        _judge(quantity, pair, repeats) for quantity in Quantity if pair.measured.channels(quantity)
    )
    return Comparison(
        lag=pair.lag_seconds,
        correlation=pair.correlation,
        cycles=pair.cycles,
        cycle_time=pair.cycle_time,
        samples=len(pair.measured.time),
        repeats=len(repeats),
        synthetic=pair.measured.synthetic,
        quantities=quantities,
        battery=_battery(pair),
        verdict=_verdict(quantities),
    )


def _battery(pair: Synchronised) -> BatteryComparison:
    def against_battery(log: MeasuredLog) -> Agreement | None:
        if log.battery_current is None:
            return None
        return _agreement("battery", log.battery_current[:, 0], log.current.sum(axis=1), [])

    measured, simulated = (log.current.sum(axis=1) for log in (pair.measured, pair.simulated))
    return BatteryComparison(
        motors=_agreement("motors", measured, simulated, []),
        measured=against_battery(pair.measured),
        simulated=against_battery(pair.simulated),
    )


def _verdict(quantities: Sequence[QuantityComparison]) -> Verdict:
    gates = list[Gate]()
    # In the order of table 2.2, in which digital signals are first.
    for judged in quantities:
        if judged.quantity.optional:
            continue
        failures = [
            f"{agreement.name} {failure}"
            for agreement in judged.links or (judged.whole,)
            if (failure := _failure(judged.quantity, agreement))
        ]
        gates.append(
            Gate(quantity=judged.quantity, passed=not failures, reason="; ".join(failures))
        )
        if failures and judged.quantity.digital:
            break
    return Verdict(validated=all(gate.passed for gate in gates), gates=tuple(gates))


def _failure(quantity: Quantity, agreement: Agreement) -> str:
    """Why a signal is not validated; empty if it is."""
    match agreement.tolerance, quantity.digital, agreement.within_confidence:
        case (Tolerance.GREEN, _, _) | (Tolerance.YELLOW, False, _):
            return ""
        case Tolerance.ORANGE, False, True:
            return ""
        case Tolerance.ORANGE, False, None:
            return "orange, without repeated measurements for CONF"
        case Tolerance.ORANGE, False, False:
            return "orange, outside CONF"
        case tolerance, True, _:
            return f"{tolerance}, where a digital signal must be green"
        case tolerance, _, _:
            return f"{tolerance}, {tolerance.phrase}"


def columns_of(log: MeasuredLog, quantity: Quantity, channels: Sequence[str]) -> Floats:
    there = log.channels(quantity)
    return log.values(quantity)[:, [there.index(channel) for channel in channels]]


def channels_of_link(log: MeasuredLog, quantity: Quantity, link: int) -> tuple[str, ...]:
    return tuple(joint for joint in log.channels(quantity) if log.link_of(joint) == link)


def _judge(
    quantity: Quantity, pair: Synchronised, repeats: Sequence[MeasuredLog]
) -> QuantityComparison:
    channels = pair.measured.channels(quantity)

    def agreement(name: str, chosen: Sequence[str]) -> Agreement:
        # Repeats may lack supplementary channels of the first measurement.
        there = [r for r in repeats if set(chosen) <= set(r.channels(quantity))]
        return _agreement(
            name,
            columns_of(pair.measured, quantity, chosen),
            columns_of(pair.simulated, quantity, chosen),
            [columns_of(repeat, quantity, chosen) for repeat in there],
        )

    links = {}
    if quantity.per == "joint":
        numbers = range(1, JOINTS_PER_LEG + 1)
        links = {link: channels_of_link(pair.measured, quantity, link) for link in numbers}
    return QuantityComparison(
        quantity=quantity,
        unit=quantity.unit,
        meaning=quantity.meaning,
        whole=agreement("all", channels),
        links=tuple(agreement(f"link {n}", chosen) for n, chosen in links.items() if chosen),
        channels=tuple(agreement(channel, [channel]) for channel in channels),
        spectra=tuple(
            _harmonics(f"link {n}", quantity, chosen, pair)
            for n, chosen in links.items()
            if chosen and quantity in SPECTRAL_QUANTITIES
        ),
    )


def _agreement(
    name: str, measured: Floats, simulated: Floats, repeats: Sequence[Floats]
) -> Agreement:
    rmae = relative_mean_absolute_error(measured, simulated)
    return Agreement(
        name=name,
        mean_absolute_measured=mean_absolute(measured),
        mean_absolute_simulated=mean_absolute(simulated),
        mse=root_mean_square_error(measured, simulated),
        mae=mean_absolute_error(measured, simulated),
        rmae=rmae,
        dam=difference_of_absolute_means(measured, simulated),
        ram=relative_difference_of_absolute_means(measured, simulated),
        intensity_measured=intensity(measured, CONTROL_PERIOD),
        intensity_simulated=intensity(simulated, CONTROL_PERIOD),
        tolerance=Tolerance.of(rmae),
        confidence=confidence_interval([measured, *repeats]) if repeats else None,
    )


def _harmonics(
    name: str, quantity: Quantity, joints: Sequence[str], pair: Synchronised
) -> Harmonics:
    measured, simulated = (
        columns_of(log, quantity, joints) for log in (pair.measured, pair.simulated)
    )
    frequency, of_measured = amplitude_spectrum(measured, CONTROL_PERIOD)
    _, of_simulated = amplitude_spectrum(simulated, CONTROL_PERIOD)
    # Over n whole cycles every n-th bin is a multiple of the walking frequency.
    bins = [k * pair.cycles for k in range(N_HARMONICS + 1) if k * pair.cycles < len(frequency)]
    return Harmonics(
        name=name,
        frequency=tuple(frequency[bins].tolist()),
        measured=tuple(of_measured[bins].mean(axis=1).tolist()),
        simulated=tuple(of_simulated[bins].mean(axis=1).tolist()),
        spectral_error=spectral_error(measured, simulated, CONTROL_PERIOD),
    )
