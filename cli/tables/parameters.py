"""Fitted parameters and how far they can be trusted, as a table and as a picture."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Final

from gaitswarm.services.optimizer.errors import InvalidRequest

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from gaitswarm.cli.tables.fitted import Table
    from gaitswarm.views.identification import IdentifiabilityView, ParameterView

_SHOWN: Final = (0.2, 0.1, 0.05, 0.02)
"""Of the twelve thresholds, those that a table has room for; JSON and the picture have all."""

_STYLES: Final = {"trusted": "green", "rough": "yellow", "unknown": "red"}


def read_truth(path: Path | None) -> dict[str, float]:
    """True values by name; none without a file. Raises InvalidRequest."""
    from gaitswarm.cli.inputs.spec_file import read_json_object

    values = {} if path is None else read_json_object(path, "truth")
    for name, value in values.items():
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise InvalidRequest("must be a number", field=f"truth.{name}")
    return values


def show_parameters(
    found: IdentifiabilityView, truth: Mapping[str, float], *, as_json: bool
) -> None:
    """The command's result."""
    from gaitswarm.cli.output import note, print_json, stdout_console

    if as_json:
        print_json(found)
        return
    console = stdout_console()
    console.print(parameters_table(found, truth))
    for job, fitness in zip(found.jobs, found.fitness, strict=True):
        console.print(f"job {job}: mean error of currents {1000 * fitness:.2f} mA", markup=False)
    if len(found.jobs) == 1:
        note("note: one run always narrows down; run others with other seeds to see what to trust")


def parameters_table(found: IdentifiabilityView, truth: Mapping[str, float]) -> Table:
    """Parameters as rows: best value, true one, and widths of the intervals in percent."""
    from rich.text import Text

    from gaitswarm.cli.tables.fitted import Table
    from gaitswarm.cli.tables.views import number

    title = "Fitted parameters; widths of their intervals in % of the range searched"
    table = Table(title=title, title_justify="left", box=None, padding=(0, 1, 0, 0))
    table.add_column("parameter", no_wrap=True)
    table.add_column("unit")
    table.add_column("best", justify="right")
    if truth:
        table.add_column("true", justify="right")
    for threshold in _SHOWN:
        table.add_column(f"{threshold:.0%}", justify="right")
    table.add_column("trust")
    for p in found.parameters:
        table.add_row(
            p.name,
            p.unit,
            number(p.best),
            *([number(truth.get(p.name))] if truth else []),
            *(f"{100 * _width(found, p, threshold):.0f}" for threshold in _SHOWN),
            Text(p.trust or "one run", style=_STYLES.get(p.trust or "", "")),
        )
    return table


def draw_parameters(found: IdentifiabilityView, truth: Mapping[str, float]) -> Figure:
    """A small panel a parameter: its interval against the threshold (fig. 2.14)."""
    from matplotlib.figure import Figure

    columns = min(len(found.parameters), 6)
    rows = -(-len(found.parameters) // columns)
    figure = Figure(figsize=(2.2 * columns, 1.6 * rows + 0.6), layout="constrained")
    panels = figure.subplots(rows, columns, squeeze=False, sharex=True).ravel()
    across = [100.0 * threshold for threshold in found.thresholds]
    for axes, p in zip(panels, found.parameters, strict=False):
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
    for axes in panels[len(found.parameters) :]:
        axes.set_visible(False)
    figure.supxlabel("fitness within so many percent of its run's best", fontsize=8)
    return figure


def _height(p: ParameterView, value: float | str) -> float:
    """Where a value lies in its panel: a choice at its index, one that is none below the panel."""
    if not isinstance(value, str):
        return value
    names = [choice.name for choice in p.choices]
    return float(names.index(value)) if value in names else -1.0


def _width(found: IdentifiabilityView, p: ParameterView, threshold: float) -> float:
    """Share of the range that was searched."""
    interval = p.intervals[found.thresholds.index(threshold)]
    return (interval.high - interval.low) / (p.high - p.low)
