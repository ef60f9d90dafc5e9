"""Pareto fronts as tables, files and pictures."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from gaitswarm.cli.tables import SHORT, Table, number
from gaitswarm.settings import place_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from gaitswarm.services.optimizer.analysis.front import (
        FrontView,
        FrontWinnerView,
        NormalisedDesignView,
    )
    from gaitswarm.services.optimizer.analysis.preferences import (
        PreferenceFitView,
        PreferenceForView,
    )
    from gaitswarm.views import SimulationView

_INK: Final = "#1f3a5f"
_ACCENT: Final = "#d1495b"


def marked_table(view: FrontView) -> Table:
    """Return a table of knees, the best in each objective, and winners of preferences."""
    table = Table(box=None, padding=(0, 1, 0, 0))
    table.add_column("", no_wrap=True)
    for head in ("design", *(f"{SHORT[o.name]}\n{o.unit}" for o in view.objectives), "fitness"):
        table.add_column(head, justify="right", no_wrap=True)
    for label, design in _marked(view).items():
        table.add_row(
            label,
            place_of(design.iteration, design.particle),
            *(number(value) for value in design.objectives.values()),
            number(design.fitness),
        )
    return table


def _marked(view: FrontView) -> Mapping[str, NormalisedDesignView]:
    """Return notable designs by label."""
    marked: dict[str, NormalisedDesignView] = {}
    for place, knee in enumerate(view.knees, start=1):
        marked[f"knee {place} ({knee.distance:.2f})"] = knee
    for extreme in view.extremes:
        marked[f"least {extreme.objective.replace('_', ' ')}"] = extreme
    for winner in view.winners:
        dominated = "" if winner.on_front else ", dominated"
        marked[f"best under {_whose(winner)}{dominated}"] = winner
    return marked


def summary(view: FrontView) -> Iterator[str]:
    """Yield sentences about the front."""
    error = f" ± {view.hypervolume_error:.4f}" if view.hypervolume_error else ""
    yield (
        f"{view.size} of {view.designs_judged} designs are not dominated; hypervolume"
        f" {view.hypervolume:.4f}{error}; fitness uses the job's preference; all values are"
        " minimized"
    )
    for winner in view.winners:
        if not winner.on_front:
            yield (
                f"the best under {_whose(winner)} is dominated by {winner.dominated_by} designs,"
                f" and behind one in every objective by {100.0 * winner.behind:.2g} %"
            )


def _whose(winner: FrontWinnerView) -> str:
    return "the job's own" if winner.preference == "job" else winner.preference


@dataclass(frozen=True, slots=True)
class Placed:
    """Position of another design relative to a front.

    Attributes:
        objectives: over all scenarios, by name; None if it fails in one.
        fitness: by the job's preference.
        dominated_by: number of designs of the front that dominate it.
        dominates: number of designs of the front that it dominates.
        of: number of designs of the front.
    """

    objectives: dict[str, float] | None
    fitness: float | None
    dominated_by: int
    dominates: int
    of: int


def placed(walk: SimulationView, view: FrontView) -> Placed:
    """Place a design, simulated in the job's scenarios, relative to the front."""
    import numpy as np

    names = [objective.name for objective in view.objectives]
    walks = [
        [result.objectives[name] for name in names] for result in walk.scenarios.values()
        if result.status == "ok"
    ]  # fmt: skip
    if len(walks) < len(walk.scenarios):
        return Placed(None, None, 0, 0, len(view.designs))
    means = np.exp(np.log(np.array(walks, dtype=np.float64)).mean(axis=0))
    front = np.array([list(design.objectives.values()) for design in view.designs])
    return Placed(
        dict(zip(names, means.tolist(), strict=True)),
        walk.fitness,
        int(((front <= means).all(axis=1) & (front < means).any(axis=1)).sum()),
        int(((means <= front).all(axis=1) & (means < front).any(axis=1)).sum()),
        len(front),
    )


def placed_lines(published: Mapping[str, Placed]) -> Iterator[str]:
    """Yield one sentence per published design."""
    for name, design in published.items():
        if design.objectives is None:
            yield f"published {name} fails in a scenario"
            continue
        values = [f"{SHORT[key]} {number(value)}" for key, value in design.objectives.items()]
        yield (
            f"published {name} is dominated by {design.dominated_by} of {design.of} designs of the"
            f" front, and dominates {design.dominates}: {', '.join(values)}, fitness"
            f" {number(design.fitness)}"
        )


def front_csv(view: FrontView) -> bytes:
    """Return a CSV with one row per design: position, marks, fitness, objectives, variables."""
    text = io.StringIO()
    names = [objective.name for objective in view.objectives]
    variables = list(view.designs[0].design) if view.designs else []
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(
        [
            *("iteration", "particle", "marks", "fitness"),
            *names,
            *(f"normalised.{name}" for name in names),
            *(f"design.{name}" for name in variables),
        ]
    )
    for design in view.designs:
        cells: list[Any] = [design.iteration, design.particle, "; ".join(design.marks)]
        cells += [design.fitness, *design.objectives.values(), *design.normalised.values()]
        writer.writerow([*cells, *design.design.values()])
    return text.getvalue().encode()


def fits_table(view: PreferenceForView) -> Table:
    """Return a table of preferences that suit a design, one per set of biases, best first."""
    table = Table(box=None, padding=(0, 2, 0, 0))
    for head in ("biases of", "rank", "margin %", "rival", "bias", "exponent"):
        table.add_column(head, no_wrap=head not in ("bias", "exponent"))
    for fit in view.fits:
        rival = fit.rival
        table.add_row(
            ", ".join("the job" if owner == "job" else owner for owner in fit.biases_of),
            str(fit.rank),
            number(None if fit.margin is None else 100.0 * fit.margin, 3),
            number(None) if rival is None else place_of(rival.iteration, rival.particle),
            " ".join(number(value, 3) for value in fit.preference.bias),
            " ".join(number(value, 4) for value in fit.preference.exponent),
        )
    return table


def verdict(view: PreferenceForView) -> str:
    """State in a sentence whether a design wins under any preference."""
    place, best = place_of(view.chosen.iteration, view.chosen.particle), view.fits[0]
    if view.wins:
        return f"design {place} wins{_by(best)} under {best.preference.model_dump_json()}"
    tried = "" if view.certain else " that were tried"
    dominated = "" if view.on_front else ", which is dominated"
    rival = "another" if best.rival is None else place_of(best.rival.iteration, best.rival.particle)
    return (
        f"no exponents{tried} with these biases make design {place} win{dominated}; under"
        f" {best.preference.model_dump_json()} it has rank {best.rank}, and {rival} is better"
        f"{_by(best)}"
    )


def _by(fit: PreferenceFitView) -> str:
    return "" if fit.margin is None else f" by {100.0 * abs(fit.margin):.3g} %"


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
