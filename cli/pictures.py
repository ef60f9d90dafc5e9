"""Pictures of jobs, controllers and robots, drawn without a display."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from gaitswarm.cli.files import replacing
from gaitswarm.cli.tables import SHORT
from gaitswarm.services.optimizer.errors import InvalidRequest

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from mpl_toolkits.mplot3d.axes3d import Axes3D

    from gaitswarm.robustness_index import RobustnessView
    from gaitswarm.services.optimizer.analysis.front import FrontView, NormalisedDesignView
    from gaitswarm.services.optimizer.analysis.identifiability import (
        IdentifiabilityView,
        ParameterView,
    )
    from gaitswarm.sim.controllers.surface import Surface
    from gaitswarm.sim.drives import WalkFigures
    from gaitswarm.views.robots import RobotCheckView

_FORMATS: Final = ("png", "svg", "pdf")
_INK: Final = "#1f3a5f"
_ACCENT: Final = "#d1495b"


def draw_surface(surface: Surface, *, title: str) -> Figure:
    """Draw the output over angle error and motor current, from the robot's lookup table."""
    from matplotlib.figure import Figure
    from matplotlib.ticker import MaxNLocator

    error, current = (surface.inputs[name].values for name in ("error", "current"))
    highest = abs(surface.table).max()
    figure = Figure(figsize=(8.0, 5.0), layout="constrained")
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


def draw_comparison(figures: Sequence[WalkFigures]) -> Figure:
    """Draw speed, power and effectivity of every drive, grouped by scenario."""
    from matplotlib.figure import Figure

    scenarios = list(dict.fromkeys(f.scenario for f in figures))
    drives = list(dict.fromkeys(f.drive for f in figures))
    by_walk = {(f.scenario, f.drive): f for f in figures}
    figure = Figure(figsize=(8.0, 7.0), layout="constrained")
    panels = figure.subplots(3, 1, sharex=True)
    quantities = (("speed", "m/s"), ("power", "W"), ("effectivity", "m/J"))
    width = 0.8 / len(drives)
    for axes, (name, unit) in zip(panels, quantities, strict=True):
        for k, drive in enumerate(drives):
            heights = [getattr(by_walk[scenario, drive], name) for scenario in scenarios]
            # A drive that failed has no bar.
            axes.bar(
                [n + (k - (len(drives) - 1) / 2) * width for n in range(len(scenarios))],
                [math.nan if height is None else height for height in heights],
                width,
                label=drive,
            )
        axes.set_ylabel(f"{name}  [{unit}]")
        axes.grid(visible=True, axis="y", color="0.9", lw=0.6)
        axes.set_axisbelow(True)
        axes.spines[["top", "right"]].set_visible(False)
    panels[-1].set_xticks(range(len(scenarios)), scenarios, rotation=20, ha="right")
    panels[0].legend(frameon=False, ncols=len(drives), loc="lower left", bbox_to_anchor=(0, 1))
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


def _floats(values: Sequence[float | None]) -> list[float]:
    return [math.nan if value is None else value for value in values]


_GROUND: Final = "#9db8d9"

_ACROSS: Final = {"from the side": (0, 2), "from above": (0, 1)}
"""Coordinates of the body's frame by panel: x forward, y left, z up."""


def draw_robot(view: RobotCheckView) -> Figure:
    """Draw legs, feet, centre of mass, ground, and the support polygon."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 4.5), layout="constrained")
    points = np.array([leg.points for leg in view.legs])
    for axes, (name, (across, up)) in zip(figure.subplots(1, 2), _ACROSS.items(), strict=True):
        hips, feet = points[:, 0], points[:, -1]
        outline = hips[_around(hips[:, :2])]
        axes.fill(outline[:, across], outline[:, up], color=_INK, alpha=0.15, ec=_INK, lw=2.0)
        if name == "from above":
            support = feet[_around(feet[:, :2])]
            label = "support polygon"
            axes.fill(
                support[:, 0], support[:, 1], color=_GROUND, alpha=0.25, ec=_GROUND, label=label
            )
        else:
            axes.axhline(feet[:, 2].min(), color=_GROUND, lw=1.5, label="ground, less the sole")
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
        axes.set_title(name, loc="left", weight="bold")
        axes.set_xlabel("x, forward  [m]")
        axes.set_ylabel("z, up  [m]" if up == 2 else "y, left  [m]")
        axes.grid(visible=True, color="0.9", lw=0.6)
        axes.spines[["top", "right"]].set_visible(False)
        axes.legend(frameon=False, fontsize=8, loc="best")
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


def draw_front(view: FrontView, *, title: str) -> Figure:
    """Draw the front in every pair of objectives, with knees and winners under A, B and C."""
    from matplotlib.figure import Figure

    names = [objective.name for objective in view.objectives]
    units = {objective.name: objective.unit for objective in view.objectives}
    last = len(names) - 1
    figure = Figure(figsize=(10.0, 9.0), layout="constrained")
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
    figure.legend(handles, labels, frameon=False, loc="upper right", bbox_to_anchor=(0.97, 0.93))
    figure.suptitle(title, x=0.02, ha="left", weight="bold")
    return figure


def _draw_pair(axes: Axes, view: FrontView, horizontal: str, vertical: str) -> None:
    from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

    def scattered(designs: Sequence[NormalisedDesignView], **style: Any) -> None:
        across = [design.objectives[horizontal] for design in designs]
        axes.scatter(across, [design.objectives[vertical] for design in designs], **style)

    scattered(view.designs, s=9, color=_INK, alpha=0.3, lw=0, label="front")
    scattered(view.knees, s=60, facecolor="none", edgecolor=_INK, label="knees")
    for winner in view.winners:
        if winner.preference != "job":
            place = winner.objectives[horizontal], winner.objectives[vertical]
            axes.plot(*place, "o", ms=4, color=_ACCENT, label=_once(axes, "best under A, B, C"))
            axes.annotate(
                winner.preference, place, (4, 4), textcoords="offset points", color=_ACCENT
            )
    for axis, scale in ((axes.xaxis, axes.set_xscale), (axes.yaxis, axes.set_yscale)):
        scale("log")
        axis.set_major_locator(LogLocator(subs=(1.0, 1.5, 2.0, 3.0, 5.0, 7.0), numticks=5))
        axis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axis.set_minor_formatter(NullFormatter())
    axes.grid(visible=True, color="0.9", lw=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)


def _once(axes: Axes, label: str) -> str:
    """Return the label unless the legend has it."""
    return "" if label in axes.get_legend_handles_labels()[1] else label


def draw_robustness(views: Mapping[str, RobustnessView], *, title: str) -> Figure:
    """Draw the index with its interval by scenario, designs side by side (after fig. 4.8).

    views: of the same scenarios, by label.
    """
    from matplotlib.figure import Figure

    scenarios = [*next(iter(views.values())).scenarios, "all"]
    figure = Figure(figsize=(8.0, 3.8), layout="constrained")
    axes = figure.add_subplot()
    width = 0.8 / len(views)
    for k, (name, view) in enumerate(views.items()):
        places, indices = [], []
        for n, scenario in enumerate(scenarios):
            index = view.index if scenario == "all" else view.scenarios[scenario].index
            # A missing index has no bar.
            if index is not None:
                places.append(n + (k - (len(views) - 1) / 2) * width)
                indices.append(index)
        errors = [[i.value - i.low for i in indices], [i.high - i.value for i in indices]]
        axes.bar(
            places,
            [index.value for index in indices],
            width,
            yerr=errors,
            error_kw={"elinewidth": 1.0, "capsize": 2.0},
            label=name,
        )
    axes.set_xticks(range(len(scenarios)), scenarios, rotation=20, ha="right")
    axes.set_ylabel("robustness index  [1]")
    figure.suptitle(title, x=0.02, ha="left", weight="bold")
    axes.grid(visible=True, axis="y", color="0.9", lw=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, ncols=len(views), loc="lower left", bbox_to_anchor=(0.0, 1.0))
    return figure


def draw_parameters(view: IdentifiabilityView, truth: Mapping[str, float]) -> Figure:
    """Draw one panel per parameter: its interval against the threshold (fig. 2.14)."""
    from matplotlib.figure import Figure

    columns = min(len(view.parameters), 6)
    rows = -(-len(view.parameters) // columns)
    figure = Figure(figsize=(2.2 * columns, 1.6 * rows + 0.6), layout="constrained")
    panels = figure.subplots(rows, columns, squeeze=False, sharex=True).ravel()
    across = [100.0 * threshold for threshold in view.thresholds]
    for axes, p in zip(panels, view.parameters, strict=False):
        axes.fill_between(
            across,
            [interval.low for interval in p.intervals],
            [interval.high for interval in p.intervals],
            color="#9db8d9",
            lw=0,
        )
        for choice, name in enumerate(c.name for c in p.choices):
            axes.text(100.0, choice, name, fontsize=5, va="center", ha="right")
        axes.axhline(_height(p, p.best), color="#1f3a5f", lw=1.0)
        if p.name in truth:
            axes.axhline(truth[p.name], color="#d1495b", lw=1.0, ls="--")
        axes.set_ylim(p.low, p.high)
        axes.set_xscale("log")
        axes.set_title(f"{p.name} [{p.unit}]", fontsize=6, loc="left")
        axes.tick_params(labelsize=6)
        axes.spines[["top", "right"]].set_visible(False)
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
