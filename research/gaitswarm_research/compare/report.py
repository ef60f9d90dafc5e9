"""Report of a comparison: a table in the terminal, JSON, and a picture."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from gaitswarm_research.compare.runs import CHECKPOINTS, Run
from gaitswarm_research.compare.statistics import Runs, Summary


def print_table(summary: Summary, console: Console) -> None:
    """Print mean ranks, and the median at the end of the budget by problem."""
    table = Table(box=None, header_style="bold", pad_edge=False)
    for heading in ("method", "mean rank", "95 %", *summary.problems):
        table.add_column(heading, justify="left" if heading == "method" else "right", no_wrap=True)
    medians = {
        (name, row.method): row.medians[-1]
        for name, rows in summary.problems.items()
        for row in rows
    }
    for rank in summary.mean_ranks:
        table.add_row(
            rank.method,
            f"{rank.value:.1f}",
            f"{rank.low:.1f} to {rank.high:.1f}",
            *(_text(medians[name, rank.method]) for name in summary.problems),
        )
    console.print(table)
    if summary.friedman_p is not None:
        console.print(f"Friedman's test of equal ranks: p = {summary.friedman_p:.2g}")
    if summary.correlation is not None:
        console.print(f"Spearman's correlation, functions and robot: {summary.correlation:.2f}")


def document(summary: Summary) -> dict[str, Any]:
    """Return the summary as JSON-compatible values; what is infinite or missing is null."""
    found: dict[str, Any] = _finite(asdict(summary))
    return found


def write(summary: Summary, runs: Runs, folder: Path) -> tuple[Path, Path]:
    """Write `summary.json` and `convergence.svg` into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    text = json.dumps(document(summary), indent=2, allow_nan=False)
    (folder / "summary.json").write_text(text + "\n", encoding="utf-8")
    _draw(runs, [rank.method for rank in summary.mean_ranks], folder / "convergence.svg")
    return folder / "summary.json", folder / "convergence.svg"


def _draw(runs: Runs, methods: Sequence[str], path: Path) -> None:
    """Draw the median of the best so far over evaluations, a panel for each problem."""
    from matplotlib import colormaps, rc_context
    from matplotlib.figure import Figure

    rows = math.ceil(len(runs) / 2)
    figure = Figure(figsize=(11.0, 3.6 * rows), layout="constrained")
    panels = figure.subplots(rows, min(len(runs), 2), squeeze=False).ravel()
    palette = colormaps["tab10" if len(methods) <= 10 else "tab20"]
    for axes, (name, by_method) in zip(panels, runs.items(), strict=False):
        for k, method in enumerate(methods):
            counts, values = _curve(by_method, method)
            axes.plot(counts, values, color=palette(k % palette.N), lw=1.6, label=method)
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_title(name, loc="left")
        axes.set_xlabel("evaluations")
        axes.grid(visible=True, color="0.9", lw=0.6)
    panels[0].set_ylabel("median of the best fitness")
    for axes in panels[len(runs) :]:
        axes.remove()
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside right center", frameon=False, fontsize=8)
    with rc_context({"svg.hashsalt": "gaitswarm"}):
        figure.savefig(path, format="svg", metadata={"Date": None})


def _curve(by_method: Mapping[str, Sequence[Run]], method: str) -> tuple[list[int], list[float]]:
    """Return checkpoints and medians where most runs have a value."""
    runs = by_method[method]
    budget = min(run.task.evaluations for run in runs)
    counts = [count for count in CHECKPOINTS if count <= budget]
    medians = [
        float(np.median([math.inf if math.isnan(v) else v for v in (r.best[k] for r in runs)]))
        for k in range(len(counts))
    ]
    shown = [(c, m) for c, m in zip(counts, medians, strict=True) if math.isfinite(m) and m > 0.0]
    return [c for c, _ in shown], [m for _, m in shown]


def _finite(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _text(value: float) -> str:
    return f"{value:.4g}" if math.isfinite(value) else "-"
