"""A picture of how a robot stands: its legs from the side and from above."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from gaitswarm.views.robots import RobotCheckView

_INK: Final = "#1f3a5f"
_ACCENT: Final = "#d1495b"
_GROUND: Final = "#9db8d9"

_ACROSS: Final = {"from the side": (0, 2), "from above": (0, 1)}
"""Coordinates of the body's frame that a panel shows: x forward, y left, z up."""


def draw_robot(view: RobotCheckView) -> Figure:
    """Legs, feet, centre of mass, ground, and the polygon of the feet that supports the robot.

    view: what `robot check` found.
    """
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
    # A leg's name is anybody's, and `$` would begin a formula.
    axes.annotate(name, (x, y), (4, -10), textcoords="offset points", fontsize=8, parse_math=False)


def _around(points: np.ndarray) -> list[int]:
    """Indices of the points' convex hull, one after the other around it."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        return [int(index) for index in ConvexHull(points).vertices]
    except QhullError:
        # All on one line, as those of two legs.
        return [int(points[:, 0].argmin()), int(points[:, 0].argmax())]
