"""Pictures of jobs, controllers and robots, drawn without a display."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from gaitswarm.cli.files import replacing
from gaitswarm.services.optimizer.errors import InvalidRequest

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from mpl_toolkits.mplot3d.axes3d import Axes3D

    from gaitswarm.sim.controllers.surface import Surface
    from gaitswarm.sim.drives import WalkFigures
    from gaitswarm.views import IterationView
    from gaitswarm.views.robots import RobotCheckView

_FORMATS: Final = ("png", "svg", "pdf")
_INK: Final = "#1f3a5f"
_ACCENT: Final = "#d1495b"


def draw_convergence(iterations: Sequence[IterationView], *, title: str) -> Figure:
    """Draw fitness (minimized) over iterations: best so far, median, and the best-worst band."""
    from matplotlib.figure import Figure
    from matplotlib.ticker import MaxNLocator

    if not iterations:
        raise InvalidRequest("the job has no committed iteration to draw yet")
    figure = Figure(figsize=(8.0, 4.5), layout="constrained")
    axes = figure.add_subplot()
    index = [i.index for i in iterations]
    best, median, worst = (
        _floats([getattr(i, name) for i in iterations]) for name in ("best", "median", "worst")
    )
    axes.fill_between(index, best, worst, color=_INK, alpha=0.12, lw=0, label="designs")
    axes.plot(index, median, color=_INK, alpha=0.6, lw=1.2, label="median of the iteration")
    so_far = _floats([i.best_so_far for i in iterations])
    label = f"best so far, finally {so_far[-1]:.4g}"
    axes.step(index, so_far, where="post", color=_ACCENT, lw=2.2, label=label)
    axes.set_yscale("log")
    _plain_log_labels(axes)
    axes.set_xlim(index[0], max(index[-1], index[0] + 1))
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlabel("iteration")
    axes.set_ylabel("fitness, minimized  [1]")
    axes.set_title(title, loc="left", weight="bold")
    axes.grid(visible=True, which="both", color="0.9", lw=0.6)
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, loc="upper right")
    return figure


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


def _plain_log_labels(axes: Axes) -> None:
    """Label 25 instead of 2.5 x 10^1: a fitness varies by less than a decade."""
    from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0), numticks=12))
    axes.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axes.yaxis.set_minor_formatter(NullFormatter())


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
