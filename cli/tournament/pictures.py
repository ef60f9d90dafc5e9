"""Pictures of a tournament: convergence, performance clouds, data profiles, ranks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from gaitswarm.services.optimizer.analysis.interval import Interval
from gaitswarm.services.optimizer.analysis.tournaments.standings import Profile
from gaitswarm.services.optimizer.analysis.tournaments.tournament import Runs

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_LEAST: Final = 1e-9
"""Values below are drawn here, as a logarithm has no place for 0."""

_NEAR: Final = 5.0
"""A range of fitness so narrow, as a quotient, is drawn with plain numbers."""


def draw_problem(name: str, by_method: Mapping[str, Runs]) -> Figure:
    """Median and quartiles of the best so far; and the cloud of figs. 3.1 to 3.3."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.0, 4.2), layout="constrained")
    left, right = figure.subplots(1, 2, sharex=True, sharey=True)
    for (label, runs), color in zip(by_method.items(), _colors(len(by_method)), strict=True):
        low, median, high = (_shown(row) for row in runs.quartiles())
        left.fill_between(runs.checkpoints, low, high, color=color, alpha=0.1, lw=0)
        left.plot(runs.checkpoints, median, color=color, lw=1.6, label=label)
        right.plot(
            runs.to_best, _shown(runs.final), "o", ms=3, alpha=0.5, color=color, rasterized=True
        )
    target = next(iter(by_method.values())).target
    for axes in (left, right):
        _log_x(axes)
        _scale(axes, by_method)
        if target is not None:
            axes.axhline(target, color="0.3", lw=1.0, ls="--")
        _finish(axes)
    left.set_title(f"{name}: best so far, median and quartiles", loc="left")
    left.set_xlabel("function calls")
    left.set_ylabel("fitness  [1]")
    right.set_title("best of each run", loc="left")
    right.set_xlabel("function calls until it was found")
    figure.legend(
        *left.get_legend_handles_labels(), loc="outside right center", frameon=False, fontsize=8
    )
    return figure


def draw_profiles(profiles: Sequence[Profile]) -> Figure:
    """Data profiles: share of runs that are solved, over the budget in simplex gradients."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.0, 4.0), layout="constrained")
    panels = figure.subplots(1, len(profiles), sharey=True)
    for axes, profile in zip(panels, profiles, strict=True):
        for (label, shares), color in zip(
            profile.shares.items(), _colors(len(profile.shares)), strict=True
        ):
            axes.step(
                profile.budgets, 100.0 * shares, where="post", color=color, lw=1.6, label=label
            )
        _log_x(axes)
        axes.set_title(f"tau = {profile.precision:g}", loc="left")
        axes.set_xlabel("function calls / (variables + 1)")
        _finish(axes)
    panels[0].set_ylabel("runs that have solved their problem  [%]")
    panels[0].set_ylim(-2.0, 102.0)
    figure.legend(
        *panels[0].get_legend_handles_labels(),
        loc="outside right center",
        frameon=False,
        fontsize=8,
    )
    return figure


def draw_ranks(ranks: Mapping[str, Interval]) -> Figure:
    """Mean ranks with their intervals, best on top."""
    from matplotlib.figure import Figure

    ordered = sorted(ranks.items(), key=lambda item: item[1].value)
    figure = Figure(figsize=(7.0, 0.3 * len(ordered) + 1.0), layout="constrained")
    axes = figure.add_subplot()
    places = np.arange(len(ordered))[::-1]
    for place, (_, rank) in zip(places, ordered, strict=True):
        axes.plot([rank.low, rank.high], [place, place], color="#1f3a5f", lw=1.6)
        axes.plot([rank.value], [place], "o", ms=6, color="#d1495b")
    axes.set_yticks(places, [label for label, _ in ordered])
    axes.set_xlabel("mean rank over problems; bars hold 95 % of resampled runs")
    _finish(axes)
    return figure


def _colors(count: int) -> list[tuple[float, ...]]:
    from matplotlib import colormaps

    palette = colormaps["tab10" if count <= 10 else "tab20"]
    return [palette(k % palette.N) for k in range(count)]


def _shown(values: np.ndarray) -> np.ndarray:
    """Values as a logarithmic axis takes them; a failure has no place."""
    return np.where(np.isfinite(values), np.maximum(values, _LEAST), np.nan)


def _log_x(axes: Axes) -> None:
    from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

    axes.set_xscale("log")
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0), numticks=12))
    axes.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())


def _scale(axes: Axes, by_method: Mapping[str, Runs]) -> None:
    """Logarithmic up to the median at the first checkpoint; with plain numbers if narrow."""
    from matplotlib.ticker import MaxNLocator, NullFormatter, StrMethodFormatter

    final = np.concatenate([_shown(runs.final) for runs in by_method.values()])
    first = np.concatenate([_shown(runs.best[:, 0]) for runs in by_method.values()])
    if np.isnan(final).all() or np.isnan(first).all():
        return
    low, high = float(np.nanmin(final)), float(np.nanmedian(first))
    axes.set_yscale("log")
    if not low < high:
        return
    margin = (high / low) ** 0.05
    axes.set_ylim(low / margin, high * margin)
    if high / low < _NEAR:
        axes.yaxis.set_major_locator(MaxNLocator(6))
        axes.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axes.yaxis.set_minor_formatter(NullFormatter())


def _finish(axes: Axes) -> None:
    axes.grid(visible=True, color="0.9", lw=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
