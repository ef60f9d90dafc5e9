"""Comparisons of measured and simulated walks as tables, pictures and reports."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from gaitswarm.cli.files import replacing
from gaitswarm.cli.pictures import save
from gaitswarm.cli.tables import table
from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.sim.controllers.fixed_point import CONTROL_PERIOD
from gaitswarm.sim.measurement.measured_log import Quantity
from gaitswarm.sim.robot.description import JOINTS_PER_LEG
from gaitswarm.sim.validation import Tolerance, amplitude_spectrum, channels_of_link, columns_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from gaitswarm.cli.rich_table import Table
    from gaitswarm.sim.measurement.measured_log import MeasuredLog
    from gaitswarm.sim.measurement.synchronise import Synchronised
    from gaitswarm.sim.validation import Agreement, Comparison, QuantityComparison

REPORT: Final = "report.md"


def write_report(
    folder: Path, comparison: Comparison, pair: Synchronised, facts: Mapping[str, str]
) -> Path:
    """Write `report.md` and its pictures, and return the report's path.

    facts: rows of its first table, by heading.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InvalidRequest(f"cannot create {folder}: {error.strerror}", field="report") from error
    save(draw_errors(comparison), folder / "rmae.png")
    save(draw_leg(pair, Quantity.JOINT_ANGLE), folder / "angles.png")
    save(draw_leg(pair, Quantity.CURRENT), folder / "currents.png")
    save(draw_spectra(pair, Quantity.CURRENT), folder / "spectra.png")
    text = "\n".join(_lines(comparison, facts, leg=pair.measured.legs[0]))
    with replacing(folder / REPORT, "report") as file:
        file.write(f"{text}\n".encode())
    return folder / REPORT


def _lines(comparison: Comparison, facts: Mapping[str, str], *, leg: str) -> Iterable[str]:
    def picture(heading: str, text: str, file: str) -> list[str]:
        return [f"## {heading}", "", f"![{text}]({file}.png)", ""]

    yield from ("# Validation", "")
    for remark in remarks(comparison):
        yield from (f"**Note:** {remark}.", "")
    common = {
        "compared": f"{alignment(comparison)}; {comparison.samples} rows",
        "desired angles": f"correlation {comparison.correlation:.6f}",
        "repeats": str(comparison.repeats),
    }
    yield from _table(["", ""], [[k, v] for k, v in {**facts, **common}.items()])
    yield from ("", "X is measured, Y simulated; formulas are in docs/validation.md of gaitswarm.")
    yield from ("", "![RMAE by quantity and link](rmae.png)", "")
    yield from ("## Tolerance classes of RMAE", "")
    classes = [[tolerance.value, _range(tolerance), tolerance.phrase] for tolerance in Tolerance]
    yield from _table(["class", "RMAE", "meaning"], classes)
    yield from ("", "## By quantity and link", "")
    yield from _agreements(
        (judged, agreement)
        for judged in comparison.quantities
        for agreement in (*judged.links, judged.whole)
    )
    yield ""
    yield from picture(f"Joint angles of {leg}", "Joint angles over time", "angles")
    yield from picture(f"Motor currents of {leg}", "Motor currents over time", "currents")
    yield from ("## Spectra of the motor currents", "")
    spectra = comparison.quantity(Quantity.CURRENT).spectra
    yield from _table(
        ["link", "spectral error"], [[s.name, percent(s.spectral_error)] for s in spectra]
    )
    yield from ("", "![Amplitude spectra of the motor currents](spectra.png)")
    for judged in comparison.quantities:
        yield from ("", f"## {judged.quantity}: {judged.meaning}", "")
        yield from _agreements((judged, agreement) for agreement in judged.channels)


def _agreements(rows: Iterable[tuple[QuantityComparison, Agreement]]) -> Iterable[str]:
    columns = ["quantity", "of", "mean X", "mean Y", "MSE", "MAE", "RMAE", "class", "DAM", "RAM"]
    yield from _table(
        [*columns, "intensity X", "intensity Y", "CONF"],
        [
            [
                f"{judged.quantity} [{judged.unit}]",
                a.name,
                *(f"{x:.4g}" for x in (a.mean_absolute_measured, a.mean_absolute_simulated)),
                *(f"{x:.3g}" for x in (a.mse, a.mae)),
                percent(a.rmae),
                a.tolerance.value,
                f"{a.dam:.3g}",
                percent(a.ram),
                *(f"{x:.3g}" for x in (a.intensity_measured, a.intensity_simulated)),
                confidence(a),
            ]
            for judged, a in rows
        ],
    )


def _range(tolerance: Tolerance) -> str:
    classes = list(Tolerance)
    low = 0.0 if tolerance is classes[0] else classes[classes.index(tolerance) - 1].limit
    if tolerance is classes[-1]:
        return f"above {low * 100:.0f} %"
    return f"{low * 100:.0f} to {tolerance.limit * 100:.0f} %"


def _table(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> Iterable[str]:
    yield f"| {' | '.join(headings)} |"
    yield f"|{' --- |' * len(headings)}"
    for row in rows:
        yield f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in row)} |"


STYLES: Final = {
    Tolerance.GREEN: "green",
    Tolerance.YELLOW: "yellow",
    Tolerance.ORANGE: "dark_orange",
    Tolerance.RED: "red",
    Tolerance.PURPLE: "magenta",
}


def _by_link(comparison: Comparison) -> Iterator[tuple[str, Agreement]]:
    """Yield agreements by link, or of the whole robot, and the quantity with each first one."""
    for judged in comparison.quantities:
        for row, agreement in enumerate(judged.links or (judged.whole,)):
            yield "" if row else f"{judged.quantity} [{judged.unit}]", agreement


def comparison_table(comparison: Comparison) -> Table:
    """Return a table with one row per quantity and link; one for supply and acceleration."""
    heads = ("quantity", "<of", "mean |X|", "mean |Y|", "MSE", "MAE", "RMAE", "<class", "RAM")
    rows = (
        (
            *(quantity, a.name),
            *(f"{x:.4g}" for x in (a.mean_absolute_measured, a.mean_absolute_simulated)),
            *(f"{x:.3g}" for x in (a.mse, a.mae)),
            *((text, STYLES[a.tolerance]) for text in (percent(a.rmae), a.tolerance.value)),
            percent(a.ram),
        )
        for quantity, a in _by_link(comparison)
    )
    return table(heads, rows, gap=1)


def confidence_table(comparison: Comparison) -> Table:
    """Return a table of simulated means within repeated measurements (eq. 2.20)."""
    within = {None: "", True: "inside", False: "outside"}
    rows = (
        (
            *(quantity, a.name, confidence(a), f"{a.mean_absolute_simulated:.5g}"),
            within[a.within_confidence],
        )
        for quantity, a in _by_link(comparison)
    )
    heads = ("quantity", "<of", "<CONF of mean |X|", "<mean |Y|", "<")
    return table(heads, rows, gap=1)


def confidence(agreement: Agreement) -> str:
    """Format CONF, the smallest and largest mean of the measurements."""
    if agreement.confidence is None:
        return ""
    low, high = agreement.confidence
    return f"{low:.5g} – {high:.5g}"


def percent(share: float) -> str:
    """Format a share; `∞` for the error of a signal measured as zero."""
    return f"{share * 100:.1f} %" if math.isfinite(share) else "∞"


def alignment(comparison: Comparison) -> str:
    """Describe the compared cycles and the alignment of the logs."""
    order = "later" if comparison.lag >= 0.0 else "earlier"
    return (
        f"{comparison.cycles} cycle{'s' if comparison.cycles > 1 else ''} of"
        f" {comparison.cycle_time:g} s; the walk begins {abs(comparison.lag):g} s {order} in the"
        " measured log"
    )


def remarks(comparison: Comparison) -> list[str]:
    """Return caveats of a comparison."""
    notes = []
    if comparison.synthetic:
        notes.append("the measured log is SYNTHETIC: this tests the toolkit, not the model")
    desired = comparison.quantity(Quantity.DESIRED_ANGLE).whole
    if desired.tolerance is not Tolerance.GREEN:
        notes.append(
            f"the desired angles differ by {percent(desired.rmae)}: scenario, design or cycle time"
            " are probably not those of the measured walk"
        )
    return notes


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
"""Highest frequency of drawn spectra [Hz]; walking is below."""

_LARGEST: Final = 1.0
"""RMAE at which bars are truncated."""


def draw_leg(pair: Synchronised, quantity: Quantity) -> Figure:
    """Draw time series of the first leg's joints, measured and simulated."""
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
    """Draw amplitude spectra by link, averaged over its joints, without the mean value."""
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
    """Draw the RMAE of every quantity and link in the colours of the tolerance classes."""
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
    for tolerance in Tolerance:
        if tolerance.limit <= _LARGEST:
            axes.axvline(tolerance.limit, color="0.6", lw=0.8, ls=":")
    axes.set_yticks(range(len(rows)), [name for name, _ in rows])
    axes.invert_yaxis()
    axes.set_xlim(0.0, min(_LARGEST * 1.1, max(0.55, *(x + 0.08 for x in lengths))))
    axes.xaxis.set_major_formatter(lambda x, _: f"{x * 100:.0f} %")
    axes.set_xlabel("RMAE")
    axes.set_title("RMAE by link", loc="left", weight="bold")
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(
        handles=[Patch(color=_COLOURS[t], label=t.value) for t in Tolerance],
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
