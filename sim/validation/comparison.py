"""All measures of a measured against a simulated walk, by quantity, link and channel."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from gaitswarm.sim.controllers.fixed_point import CONTROL_PERIOD
from gaitswarm.sim.measurement.measured_log import MeasuredLog, Quantity
from gaitswarm.sim.measurement.synchronise import Synchronised, synchronise
from gaitswarm.sim.robot.description import JOINTS_PER_LEG
from gaitswarm.sim.validation import measures
from gaitswarm.sim.validation.measures import Tolerance

Floats = NDArray[np.float64]

SPECTRAL_QUANTITIES: Final = (Quantity.CURRENT,)
"""Quantities whose spectra are compared."""

N_HARMONICS: Final = 20
"""Multiples of the walking frequency that a comparison lists."""


class _Data(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class Agreement(_Data):
    """The measures of one signal, or of several judged together; units are the quantity's."""

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
        """Whether the simulated mean |Y| lies among the measured ones; None without repeats."""
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
    whole: Agreement = Field(description="all channels judged together")
    links: tuple[Agreement, ...] = Field(description="by link; empty if it is not by joint")
    channels: tuple[Agreement, ...] = Field(description="by joint, leg or axis")
    spectra: tuple[Harmonics, ...] = Field(default=(), description="of currents, by link")


class Comparison(_Data):
    """A measured against a simulated walk, over the same whole walking cycles."""

    lag: float = Field(description="by which the walk begins later in the measured log [s]")
    correlation: float = Field(description="of the desired angles at this lag [1]")
    cycles: int = Field(description="walking cycles compared")
    cycle_time: float = Field(description="[s]")
    samples: int = Field(description="rows compared, 500 a second")
    repeats: int = Field(description="measurements beside the first, for CONF")
    synthetic: bool = Field(description="whether the measured log says that it was computed")
    quantities: tuple[QuantityComparison, ...]

    def quantity(self, quantity: Quantity) -> QuantityComparison:
        """The comparison of one quantity."""
        for known in self.quantities:
            if known.quantity is quantity:
                return known
        raise KeyError(quantity)


def compare(
    measured: MeasuredLog,
    simulated: MeasuredLog,
    cycle_time: float,
    *,
    repeats: Sequence[MeasuredLog] = (),
) -> Comparison:
    """Synchronise two logs and judge all quantities that were measured.

    Args:
        cycle_time: Of a walking cycle [s].
    """
    pair = synchronise(measured, simulated, cycle_time)
    others = [synchronise(repeat, simulated, cycle_time).measured for repeat in repeats]
    return compare_synchronised(pair, others)


def compare_synchronised(pair: Synchronised, repeats: Sequence[MeasuredLog] = ()) -> Comparison:
    """Judge logs that have been synchronised."""
    return Comparison(
        lag=pair.lag_seconds,
        correlation=pair.correlation,
        cycles=pair.cycles,
        cycle_time=pair.cycle_time,
        samples=len(pair.measured.time),
        repeats=len(repeats),
        synthetic=pair.measured.synthetic,
        quantities=tuple(
            _judge(quantity, pair, repeats)
            for quantity in Quantity
            if pair.measured.channels(quantity)
        ),
    )


def columns_of(log: MeasuredLog, quantity: Quantity, channels: Sequence[str]) -> Floats:
    """Some columns of a log.

    Returns:
        (T, channels).
    """
    there = log.channels(quantity)
    return log.values(quantity)[:, [there.index(channel) for channel in channels]]


def channels_of_link(log: MeasuredLog, quantity: Quantity, link: int) -> tuple[str, ...]:
    """Joints at which a quantity of one link was measured."""
    return tuple(joint for joint in log.channels(quantity) if log.link_of(joint) == link)


def _judge(
    quantity: Quantity, pair: Synchronised, repeats: Sequence[MeasuredLog]
) -> QuantityComparison:
    channels = pair.measured.channels(quantity)

    def agreement(name: str, chosen: Sequence[str]) -> Agreement:
        # A repeat need not have the supplementary channels of the first.
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
    rmae = measures.relative_mean_absolute_error(measured, simulated)
    return Agreement(
        name=name,
        mean_absolute_measured=measures.mean_absolute(measured),
        mean_absolute_simulated=measures.mean_absolute(simulated),
        mse=measures.root_mean_square_error(measured, simulated),
        mae=measures.mean_absolute_error(measured, simulated),
        rmae=rmae,
        dam=measures.difference_of_absolute_means(measured, simulated),
        ram=measures.relative_difference_of_absolute_means(measured, simulated),
        intensity_measured=measures.intensity(measured, CONTROL_PERIOD),
        intensity_simulated=measures.intensity(simulated, CONTROL_PERIOD),
        tolerance=Tolerance.of(rmae),
        confidence=measures.confidence_interval([measured, *repeats]) if repeats else None,
    )


def _harmonics(
    name: str, quantity: Quantity, joints: Sequence[str], pair: Synchronised
) -> Harmonics:
    measured, simulated = (
        columns_of(log, quantity, joints) for log in (pair.measured, pair.simulated)
    )
    frequency, of_measured = measures.amplitude_spectrum(measured, CONTROL_PERIOD)
    _, of_simulated = measures.amplitude_spectrum(simulated, CONTROL_PERIOD)
    # Over n whole cycles every n-th bin is a multiple of the walking frequency.
    bins = [k * pair.cycles for k in range(N_HARMONICS + 1) if k * pair.cycles < len(frequency)]
    return Harmonics(
        name=name,
        frequency=tuple(frequency[bins].tolist()),
        measured=tuple(of_measured[bins].mean(axis=1).tolist()),
        simulated=tuple(of_simulated[bins].mean(axis=1).tolist()),
        spectral_error=measures.spectral_error(measured, simulated, CONTROL_PERIOD),
    )
