"""Pictures of a comparison of a measured and a simulated walk."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from gaitswarm.sim.controllers.fixed_point import CONTROL_PERIOD
from gaitswarm.sim.measurement.measured_log import Quantity
from gaitswarm.sim.robot.description import JOINTS_PER_LEG
from gaitswarm.sim.validation import Tolerance, amplitude_spectrum, channels_of_link, columns_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from gaitswarm.sim.measurement.measured_log import MeasuredLog
    from gaitswarm.sim.measurement.synchronise import Synchronised
    from gaitswarm.sim.validation import Comparison

_MEASURED: Final = "#1f3a5f"
_SIMULATED: Final = "#d1495b"
_COLOURS: Final = {
    Tolerance.GREEN: "#3a9d5d",
    Tolerance.YELLOW: "#e3b505",
    Tolerance.ORANGE: "#ef7b2d",
    Tolerance.RED: "#cc2936",
    Tolerance.PURPLE: "#7b2d8b",
}
_HIGHEST: Final = 20.0
"""Frequency up to which spectra are drawn [Hz]; walking is below."""

_LARGEST: Final = 1.0
"""RMAE at which bars are cut off."""


def draw_leg(pair: Synchronised, quantity: Quantity) -> Figure:
    """Time series of the first leg's three joints, measured and simulated."""
    from matplotlib.figure import Figure

    joints = pair.measured.joints[:JOINTS_PER_LEG]
    figure = Figure(figsize=(9.0, 6.5), layout="constrained")
    drawn = figure.subplots(len(joints), 1, sharex=True)
    time = np.arange(len(pair.measured.time)) * CONTROL_PERIOD
    for axes, joint in zip(drawn, joints, strict=True):
        for log, colour, label in _both(pair):
            axes.plot(time, columns_of(log, quantity, [joint]), color=colour, lw=1.0, label=label)
        axes.set_ylabel(f"{joint}\n[{quantity.unit}]")
        _plain(axes)
    drawn[0].legend(frameon=False, ncols=2, loc="lower right", bbox_to_anchor=(1.0, 1.0))
    drawn[0].set_title(f"{quantity}: {quantity.meaning}", loc="left", weight="bold")
    drawn[-1].set_xlabel("time since the first row compared  [s]")
    drawn[-1].set_xlim(time[0], time[-1])
    return figure


def draw_spectra(pair: Synchronised, quantity: Quantity) -> Figure:
    """Amplitudes over frequency by link, averaged over its joints; without the mean value."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 6.5), layout="constrained")
    drawn = figure.subplots(JOINTS_PER_LEG, 1, sharex=True)
    for link, axes in enumerate(drawn, start=1):
        joints = channels_of_link(pair.measured, quantity, link)
        for log, colour, label in _both(pair):
            columns = columns_of(log, quantity, joints)
            frequency, amplitude = amplitude_spectrum(columns, CONTROL_PERIOD)
            shown = (frequency > 0.0) & (frequency <= _HIGHEST)
            height = amplitude[shown].mean(axis=1)
            axes.plot(frequency[shown], height, color=colour, lw=1.2, label=label)
        axes.set_ylabel(f"link {link}\n[{quantity.unit}]")
        axes.set_ylim(bottom=0.0)
        _plain(axes)
    drawn[0].legend(frameon=False, ncols=2, loc="lower right", bbox_to_anchor=(1.0, 1.0))
    drawn[0].set_title(f"Amplitude spectra of {quantity}", loc="left", weight="bold")
    drawn[-1].set_xlabel("frequency  [Hz]")
    drawn[-1].set_xlim(0.0, _HIGHEST)
    return figure


def draw_errors(comparison: Comparison) -> Figure:
    """RMAE of every quantity and link as bars in the colours of the tolerance classes."""
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

    rows = [
        (f"{judged.quantity}  {agreement.name}", agreement)
        for judged in comparison.quantities
        for agreement in (judged.links or (judged.whole,))
    ]
    figure = Figure(figsize=(9.0, 1.4 + 0.3 * len(rows)), layout="constrained")
    axes = figure.add_subplot()
    lengths = [min(agreement.rmae, _LARGEST) for _, agreement in rows]
    colours = [_COLOURS[agreement.tolerance] for _, agreement in rows]
    axes.barh(range(len(rows)), lengths, color=colours, height=0.7)
    for row, (_, agreement) in enumerate(rows):
        over = "> " if agreement.rmae > _LARGEST else ""
        text = f" {over}{min(agreement.rmae, _LARGEST) * 100:.1f} %"
        axes.text(lengths[row], row, text, va="center", size="small")
    for known in Tolerance:
        if known.limit <= _LARGEST:
            axes.axvline(known.limit, color="0.6", lw=0.8, ls=":")
    axes.set_yticks(range(len(rows)), [name for name, _ in rows])
    axes.invert_yaxis()
    axes.set_xlim(0.0, min(_LARGEST * 1.1, max(0.55, *(x + 0.08 for x in lengths))))
    axes.xaxis.set_major_formatter(lambda x, _: f"{x * 100:.0f} %")
    axes.set_xlabel("RMAE")
    axes.set_title("RMAE by link", loc="left", weight="bold")
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(
        handles=[Patch(color=_COLOURS[known], label=known.value) for known in Tolerance],
        frameon=False,
        ncols=len(Tolerance),
        loc="lower right",
        bbox_to_anchor=(1.0, 1.0),
    )
    return figure


def _both(pair: Synchronised) -> tuple[tuple[MeasuredLog, str, str], ...]:
    label = "measured (synthetic)" if pair.measured.synthetic else "measured"
    return (pair.measured, _MEASURED, label), (pair.simulated, _SIMULATED, "simulated")


def _plain(axes: Axes) -> None:
    axes.grid(visible=True, color="0.92", lw=0.6)
    axes.spines[["top", "right"]].set_visible(False)
