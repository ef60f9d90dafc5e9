"""Pictures of jobs, controllers, robots and measured walks, drawn without a display."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from gaitswarm.cli.output import note, replacing
from gaitswarm.cli.tables import SHORT
from gaitswarm.services.optimizer.errors import InvalidRequest
from gaitswarm.sim.controllers.fixed_point import CONTROL_PERIOD
from gaitswarm.sim.measurement.measured_log import Quantity
from gaitswarm.sim.robot.description import JOINTS_PER_LEG
from gaitswarm.sim.validation import (
    Tolerance,
    amplitude_spectrum,
    channels_of_link,
    columns_of,
    phase_means,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from mpl_toolkits.mplot3d.axes3d import Axes3D

    from gaitswarm.robots import RobotCheckView
    from gaitswarm.services.optimizer.analysis.front import FrontView, NormalisedDesignView
    from gaitswarm.services.optimizer.analysis.identifiability import (
        IdentifiabilityView,
        ParameterView,
    )
    from gaitswarm.sim.controllers.surface import Surface
    from gaitswarm.sim.measurement.measured_log import MeasuredLog, Synchronised
    from gaitswarm.sim.validation import Comparison

_STYLE: Final[dict[Any, Any]] = {
    "axes.axisbelow": True,
    "axes.grid": True,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlelocation": "left",
    "axes.titleweight": "bold",
    "figure.constrained_layout.use": True,
    "grid.color": "0.9",
    "grid.linewidth": 0.6,
    "legend.frameon": False,
}

_FORMATS: Final = ("png", "svg", "pdf")
_INK: Final = "#1f3a5f"
_ACCENT: Final = "#d1495b"
_BAND: Final = "#9db8d9"

_HIGHEST: Final = 20.0
"""Highest frequency of drawn spectra [Hz]; walking is below."""

_PHASES: Final = 100
"""Parts of the walking cycle in maps."""

_LARGEST: Final = 1.0
"""RMAE at which bars are truncated."""

_COLOURS: Final = {
    Tolerance.GREEN: "#3a9d5d",
    Tolerance.YELLOW: "#e3b505",
    Tolerance.ORANGE: "#ef7b2d",
    Tolerance.RED: "#cc2936",
    Tolerance.PURPLE: "#7b2d8b",
}


@contextmanager
def _styled() -> Iterator[None]:
    """Draw in our style, and leave that of other figures in the process."""
    import matplotlib as mpl

    with mpl.rc_context(_STYLE):
        yield


def _figure(width: float, height: float) -> Figure:
    """Return a figure of a size [inch]."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height))


@_styled()
def draw_surface(surface: Surface, *, title: str) -> Figure:
    """Draw the output over angle error and motor current, from the robot's lookup table."""
    from matplotlib.ticker import MaxNLocator

    error, current = (surface.inputs[name].values for name in ("error", "current"))
    highest = abs(surface.table).max()
    figure = _figure(8.0, 5.0)
    axes: Axes3D = figure.add_subplot(projection="3d")
    drawn = axes.plot_surface(
        error[:, None] / 1000.0,
        current[None, :] / 1000.0,
        surface.table,
        cmap="coolwarm",
        vmin=-highest,
        vmax=highest,
        rcount=len(error),
        ccount=len(current),
        linewidth=0.0,
        antialiased=False,
    )
    axes.set_xlabel("angle error  [1000 counts]", labelpad=10.0)
    axes.set_ylabel("motor current  [1000 counts]", labelpad=10.0)
    axes.yaxis.set_major_locator(MaxNLocator(5, integer=True))
    axes.view_init(elev=26.0, azim=-124.0)
    axes.set_box_aspect((1.3, 1.1, 0.8), zoom=0.92)
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.set_pane_color((0.97, 0.97, 0.98))
    figure.suptitle(title, x=0.04, ha="left", weight="bold")
    unit = surface.output.universe.unit
    figure.colorbar(drawn, ax=axes, shrink=0.6, pad=0.06, label=f"output  [{unit}]")
    return figure


def save(figure: Figure, path: Path, option: str = "output") -> None:
    """Write a figure in the format of the file's suffix; option: the one that named the path."""
    kind = path.suffix.removeprefix(".").lower()
    if kind not in _FORMATS:
        raise InvalidRequest(f"{path} must end in .{', .'.join(_FORMATS)}", field=option)
    # Without a date, equal pictures are equal files.
    metadata = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}.get(kind)
    with replacing(path, option) as file:
        figure.savefig(file, format=kind, dpi=150, metadata=metadata)
    note(f"picture written to {path}")


_ACROSS: Final = {"from the side": (0, 2), "from above": (0, 1)}
"""Coordinates of the body's frame by panel: x forward, y left, z up."""


@_styled()
def draw_robot(view: RobotCheckView) -> Figure:
    """Draw legs, feet, centre of mass, ground, and the support polygon."""
    figure = _figure(9.0, 4.5)
    points = np.array([leg.points for leg in view.legs])
    for axes, (name, (across, up)) in zip(figure.subplots(1, 2), _ACROSS.items(), strict=True):
        hips, feet = points[:, 0], points[:, -1]
        outline = hips[_around(hips[:, :2])]
        axes.fill(outline[:, across], outline[:, up], color=_INK, alpha=0.15, ec=_INK, lw=2.0)
        if name == "from above":
            support = feet[_around(feet[:, :2])]
            label = "support polygon"
            axes.fill(support[:, 0], support[:, 1], color=_BAND, alpha=0.25, ec=_BAND, label=label)
        else:
            axes.axhline(feet[:, 2].min(), color=_BAND, lw=1.5, label="ground, less the sole")
        for leg, of_leg in zip(view.legs, points, strict=True):
            axes.plot(of_leg[:, across], of_leg[:, up], color=_INK, lw=1.6, marker="o", ms=3.0)
            axes.plot(of_leg[-1, across], of_leg[-1, up], "o", color=_INK, ms=7.0)
            if name == "from above":
                _name(axes, leg.name, of_leg[-1, across], of_leg[-1, up])
        mass = view.centre_of_mass
        axes.plot(
            mass[across], mass[up], "P", color=_ACCENT, ms=9.0, label="centre of mass", ls="none"
        )
        axes.set_aspect("equal", adjustable="datalim")
        axes.set_title(name)
        axes.set_xlabel("x, forward  [m]")
        axes.set_ylabel("z, up  [m]" if up == 2 else "y, left  [m]")
        axes.legend(fontsize=8, loc="best")
    figure.suptitle(f"{view.name}: {len(view.legs)} legs, {view.mass:.3g} kg")
    return figure


def _name(axes: Axes, name: str, x: float, y: float) -> None:
    # Names come from URDFs, and `$` would start a formula.
    axes.annotate(name, (x, y), (4, -10), textcoords="offset points", fontsize=8, parse_math=False)


def _around(points: np.ndarray) -> list[int]:
    """Return indices of the points' convex hull in order."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        return [int(index) for index in ConvexHull(points).vertices]
    except QhullError:
        # All points are collinear, as those of two legs.
        return [int(points[:, 0].argmin()), int(points[:, 0].argmax())]


@_styled()
def draw_front(view: FrontView, *, title: str) -> Figure:
    """Draw the front in every pair of objectives, with knees and winners under A, B and C."""
    names = [objective.name for objective in view.objectives]
    units = {objective.name: objective.unit for objective in view.objectives}
    last = len(names) - 1
    figure = _figure(10.0, 9.0)
    panels = figure.subplots(last, last, sharex="col", sharey="row", squeeze=False)
    for row, vertical in enumerate(names[1:]):
        for column, horizontal in enumerate(names[:-1]):
            axes = panels[row, column]
            if column > row:
                axes.set_axis_off()
                continue
            _draw_pair(axes, view, horizontal, vertical)
            if row == last - 1:
                axes.set_xlabel(f"{SHORT[horizontal]}  [{units[horizontal]}]")
            if column == 0:
                axes.set_ylabel(f"{SHORT[vertical]}  [{units[vertical]}]")
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="upper right", bbox_to_anchor=(0.97, 0.93))
    figure.suptitle(title, x=0.02, ha="left", weight="bold")
    return figure


def _draw_pair(axes: Axes, view: FrontView, horizontal: str, vertical: str) -> None:
    from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

    def scattered(designs: Sequence[NormalisedDesignView], **style: Any) -> None:
        across = [design.objectives[horizontal] for design in designs]
        axes.scatter(across, [design.objectives[vertical] for design in designs], **style)

    scattered(view.designs, s=9, color=_INK, alpha=0.3, lw=0, label="front")
    scattered(view.knees, s=60, facecolor="none", edgecolor=_INK, label="knees")
    winners = [winner for winner in view.winners if winner.preference != "job"]
    scattered(winners, s=16, color=_ACCENT, label="best under A, B, C")
    for winner in winners:
        place = winner.objectives[horizontal], winner.objectives[vertical]
        axes.annotate(winner.preference, place, (4, 4), textcoords="offset points", color=_ACCENT)
    for axis, scale in ((axes.xaxis, axes.set_xscale), (axes.yaxis, axes.set_yscale)):
        scale("log")
        axis.set_major_locator(LogLocator(subs=(1.0, 1.5, 2.0, 3.0, 5.0, 7.0), numticks=5))
        axis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axis.set_minor_formatter(NullFormatter())


@_styled()
def draw_parameters(view: IdentifiabilityView, truth: Mapping[str, float]) -> Figure:
    """Draw one panel per parameter: its interval against the threshold (fig. 2.14)."""
    columns = min(len(view.parameters), 6)
    rows = -(-len(view.parameters) // columns)
    figure = _figure(2.2 * columns, 1.6 * rows + 0.6)
    panels = figure.subplots(rows, columns, squeeze=False, sharex=True).ravel()
    across = [100.0 * threshold for threshold in view.thresholds]
    for axes, p in zip(panels, view.parameters, strict=False):
        axes.fill_between(
            across,
            [interval.low for interval in p.intervals],
            [interval.high for interval in p.intervals],
            color=_BAND,
            lw=0,
        )
        for choice, name in enumerate(c.name for c in p.choices):
            axes.text(100.0, choice, name, fontsize=5, va="center", ha="right")
        axes.axhline(_height(p, p.best), color=_INK, lw=1.0)
        if p.name in truth:
            axes.axhline(truth[p.name], color=_ACCENT, lw=1.0, ls="--")
        axes.set_ylim(p.low, p.high)
        axes.set_xscale("log")
        axes.set_title(f"{p.name} [{p.unit}]", fontsize=6, weight="normal")
        axes.tick_params(labelsize=6)
    for axes in panels[len(view.parameters) :]:
        axes.set_visible(False)
    figure.supxlabel("fitness above its run's best  [%]", fontsize=8)
    return figure


def _height(p: ParameterView, value: float | str) -> float:
    """Return a value's height in its panel: a choice's index; below the panel if unknown."""
    if not isinstance(value, str):
        return value
    names = [choice.name for choice in p.choices]
    return float(names.index(value)) if value in names else -1.0


@_styled()
def draw_joints(pair: Synchronised, quantity: Quantity) -> Figure:
    """Draw time series of every joint, measured and simulated, one row per leg (fig. 2.22)."""
    legs = pair.measured.legs
    figure = _figure(12.0, 1.7 * len(legs) + 0.8)
    drawn = figure.subplots(len(legs), JOINTS_PER_LEG, sharex=True, sharey="col", squeeze=False)
    time = np.arange(len(pair.measured.time)) * CONTROL_PERIOD
    for axes, joint in zip(drawn.flat, pair.measured.joints, strict=True):
        for log, colour, label in _both(pair):
            axes.plot(time, columns_of(log, quantity, [joint]), color=colour, lw=0.8, label=label)
        axes.set_title(joint, size="small", parse_math=False)
    for axes in drawn[-1]:
        axes.set_xlabel("time since the first row compared  [s]")
        axes.set_xlim(time[0], time[-1])
    handles, labels = drawn[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, ncols=2, loc="upper right")
    figure.suptitle(f"{quantity}: {quantity.meaning} [{quantity.unit}]", x=0.01, ha="left")
    return figure


@_styled()
def draw_current_maps(pair: Synchronised) -> Figure:
    """Draw mean currents over phase of the cycle and joint, by link (after figs. 2.17 to 2.21)."""
    by_link = sorted(pair.measured.joints, key=pair.measured.link_of)
    maps = {
        label: phase_means(
            columns_of(log, Quantity.CURRENT, by_link), pair.cycle_time / CONTROL_PERIOD, _PHASES
        ).T
        for log, _, label in _both(pair)
    }
    measured, simulated = maps.values()
    highest = max(measured.max(), simulated.max())
    figure = _figure(12.0, 1.6 + 0.2 * len(by_link))
    panels = figure.subplots(1, 3, sharey=True)
    shown = [(label, currents, "viridis", 0.0, highest) for label, currents in maps.items()]
    shown.append(("simulated - measured", simulated - measured, "coolwarm", -highest, highest))
    for axes, (label, values, colours, low, high) in zip(panels, shown, strict=True):
        extent = (0.0, 1.0, len(by_link) - 0.5, -0.5)
        style: dict[str, Any] = {"cmap": colours, "vmin": low, "vmax": high, "extent": extent}
        image = axes.imshow(values, aspect="auto", interpolation="nearest", **style)
        axes.set_title(label)
        axes.set_xlabel("phase of the cycle")
        axes.grid(visible=False)
        figure.colorbar(image, ax=axes, label="mean current  [A]")
    panels[0].set_yticks(range(len(by_link)), by_link, size="small", parse_math=False)
    return figure


@_styled()
def draw_battery(pair: Synchronised) -> Figure:
    """Draw the sum of the motors' currents and the battery's current over time (fig. 2.16)."""
    figure = _figure(9.0, 4.0)
    axes = figure.add_subplot()
    time = np.arange(len(pair.measured.time)) * CONTROL_PERIOD
    for log, colour, label in _both(pair):
        axes.plot(time, log.current.sum(axis=1), color=colour, lw=1.0, label=f"motors, {label}")
        if log.battery_current is not None:
            battery, name = log.battery_current[:, 0], f"battery, {label}"
            axes.plot(time, battery, color=colour, lw=1.0, ls=":", label=name)
    axes.set_xlabel("time since the first row compared  [s]")
    axes.set_ylabel("current  [A]")
    axes.set_xlim(time[0], time[-1])
    axes.legend(ncols=2, loc="lower right", bbox_to_anchor=(1.0, 1.0))
    return figure


@_styled()
def draw_spectra(pair: Synchronised, quantity: Quantity) -> Figure:
    """Draw amplitude spectra by link, averaged over its joints, without the mean value."""
    figure = _figure(9.0, 6.5)
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
    drawn[0].legend(ncols=2, loc="lower right", bbox_to_anchor=(1.0, 1.0))
    drawn[0].set_title(f"Amplitude spectra of {quantity}")
    drawn[-1].set_xlabel("frequency  [Hz]")
    drawn[-1].set_xlim(0.0, _HIGHEST)
    return figure


@_styled()
def draw_errors(comparison: Comparison) -> Figure:
    """Draw the RMAE of every quantity and link in the colours of the tolerance classes."""
    from matplotlib.patches import Patch

    rows = [
        (f"{judged.quantity}  {agreement.name}", agreement)
        for judged in comparison.quantities
        for agreement in (judged.links or (judged.whole,))
    ]
    figure = _figure(9.0, 1.4 + 0.3 * len(rows))
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
    axes.set_title("RMAE by link")
    axes.legend(
        handles=[Patch(color=_COLOURS[t], label=t.value) for t in Tolerance],
        ncols=len(Tolerance),
        loc="lower right",
        bbox_to_anchor=(1.0, 1.0),
    )
    return figure


def _both(pair: Synchronised) -> tuple[tuple[MeasuredLog, str, str], ...]:
    label = "measured (synthetic)" if pair.measured.synthetic else "measured"
    return (pair.measured, _INK, label), (pair.simulated, _ACCENT, "simulated")
