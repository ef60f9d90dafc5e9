"""Robustness of designs as tables and pictures."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from gaitswarm.cli.tables import MISSING, SHORT, Table, number

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from gaitswarm.services.optimizer.analysis.preferences import IndexView
    from gaitswarm.views.robustness import RobustnessView


def scenarios_table(view: RobustnessView) -> Table:
    """Return a table with one row per scenario: index, interval, and shares of objectives."""
    table = Table(title="Robustness index", title_justify="left", box=None, padding=(0, 1, 0, 0))
    table.add_column("scenario", no_wrap=True)
    for head in ("index", "95 %", *(SHORT[o.name] for o in view.objectives), "failed"):
        table.add_column(head, justify="right")
    for name, part in view.scenarios.items():
        table.add_row(
            name,
            *_cells(part.index),
            *(number(value, 3) for value in part.by_objective.values()),
            str(part.failed),
        )
    table.add_row(
        "all",
        *_cells(view.index),
        *(number(value, 3) for value in view.by_objective.values()),
        str(sum(part.failed for part in view.scenarios.values())),
        style="bold",
    )
    return table


def variables_table(view: RobustnessView) -> Table:
    """Return a table with one row per variable: index over all scenarios and in each."""
    table = Table(title="By variable", title_justify="left", box=None, padding=(0, 1, 0, 0))
    table.add_column("variable", no_wrap=True)
    for head in ("sampled", "all", *view.scenarios):
        table.add_column(head.replace("-", "-\n"), justify="right")
    rows = sorted(view.variables, key=lambda v: view.by_variable[v.name] or 0.0, reverse=True)
    for variable in rows:
        table.add_row(
            variable.name,
            f"{number(variable.least)} – {number(variable.most)}",
            number(view.by_variable[variable.name], 3),
            *(number(part.by_variable[variable.name], 3) for part in view.scenarios.values()),
        )
    return table


def summary(view: RobustnessView) -> Iterator[str]:
    """Yield sentences about the estimate."""
    yield (
        f"{view.samples} designs within {100.0 * view.radius:g} % of each variable's bounds;"
        " values are relative changes of objectives over the whole bounds; smaller is more robust"
    )
    unexplained = ", ".join(
        f"{SHORT[name]} {number(100.0 * value, 2)} %" for name, value in _unexplained(view).items()
    )
    yield f"unexplained by the linear model, largest of all scenarios: {unexplained}"
    if view.held:
        yield f"fixed: {', '.join(view.held)}"


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


def _unexplained(view: RobustnessView) -> dict[str, float]:
    """Return the largest value of all scenarios by objective."""
    return {
        objective.name: max(
            part.unexplained[objective.name] or 0.0 for part in view.scenarios.values()
        )
        for objective in view.objectives
    }


def _cells(index: IndexView | None) -> tuple[str, str]:
    if index is None:
        return MISSING, MISSING
    return number(index.value, 3), f"{number(index.low, 3)} – {number(index.high, 3)}"
