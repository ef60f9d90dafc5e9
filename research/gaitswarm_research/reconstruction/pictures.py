"""Figures of the reconstruction's report."""

from __future__ import annotations

from typing import Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gaitswarm_research.reconstruction.evidence import PRINTED, Evidence

_INK: Final = "#1f3a5f"
_ACCENT: Final = "#d1495b"


def draw_targets(evidence: Evidence) -> Figure:
    """Difference of every target in tolerances, under the default and the best choice."""
    targets = evidence.spec.targets
    figure = Figure(figsize=(8.0, 0.28 * len(targets) + 1.2), layout="constrained")
    axes = figure.add_subplot()
    places = np.arange(len(targets))[::-1]
    axes.axvspan(-1.0, 1.0, color=_INK, alpha=0.08, lw=0)
    for one, color, shift in ((evidence.default, _INK, 0.12), (evidence.winner, _ACCENT, -0.12)):
        off = evidence.spec.differences(one.simulated[None, :])[0]
        shown = np.where(np.isfinite(off), off, np.nan)
        axes.plot(shown, places + shift, "o", ms=5, color=color, label=one.label)
    axes.set_yticks(places, [t.label + ("" if t.use == "fit" else " *") for t in targets])
    axes.set_xlabel("difference from the printed value  [tolerances]; * not fitted")
    _finish(axes)
    return figure


def draw_choices(evidence: Evidence) -> Figure:
    """Least misfit by choice of every categorical convention, a point for each calibration."""
    rows = [
        (f"{p.name}: {choice.name}", choice, choice.name in evidence.remaining(column))
        for column, p in enumerate(evidence.parameters.parameters)
        for choice in p.choices
    ]
    figure = Figure(figsize=(8.0, 0.26 * len(rows) + 1.2), layout="constrained")
    axes = figure.add_subplot()
    places = np.arange(len(rows))[::-1]
    for place, (_, choice, remains) in zip(places, rows, strict=True):
        least = [fitness for fitness in choice.by_run if fitness is not None]
        color = _INK if remains else _ACCENT
        axes.plot(least, [place] * len(least), "o", ms=5, color=color)
    for color, label in ((_INK, "remains"), (_ACCENT, "is worse")):
        axes.plot([], [], "o", ms=5, color=color, label=label)
    axes.set_yticks(places, [label for label, *_ in rows])
    axes.set_xlabel("least misfit with it, by calibration  [tolerances]")
    _finish(axes)
    return figure


def draw_exclusion(evidence: Evidence) -> Figure:
    """C's value against the share of random designs that beat it, a point for each choice."""
    figure = Figure(figsize=(8.0, 4.5), layout="constrained")
    axes = figure.add_subplot()
    axes.axhspan(PRINTED["C"] / 2.0, PRINTED["C"] * 2.0, color=_INK, alpha=0.08, lw=0)
    groups = (
        ("one convention changed", [one for _, one in evidence.changed], "0.6"),
        ("best of calibrations", list(evidence.best), _ACCENT),
        ("default", [evidence.default], _INK),
    )
    for label, choices, color in groups:
        points = [
            (100.0 * one.designs.optimality.beaten["C"], value)
            for one in choices
            if (value := one.designs.optimality.fitness["C"]["C"]) is not None
        ]
        axes.plot(*zip(*points, strict=True) if points else ([], []), "o", color=color, label=label)
    axes.axvline(5.0, color="0.5", lw=0.8, ls="--")
    axes.set_yscale("log")
    axes.set_xlim(-2.0, 102.0)
    axes.set_xlabel("random designs that beat C under its own preference  [%]")
    axes.set_ylabel("f_G of C  [1]; band: within a factor of two")
    _finish(axes)
    return figure


def _finish(axes: Axes) -> None:
    axes.grid(visible=True, color="0.9", lw=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, loc="lower left", ncols=3, bbox_to_anchor=(0.0, 1.0))
