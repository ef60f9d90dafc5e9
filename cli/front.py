"""Pareto fronts as tables, files and pictures."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from gaitswarm.cli.tables import SHORT, number
from gaitswarm.settings import place_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from gaitswarm.cli.tables import Table
    from gaitswarm.views import SimulationView
    from gaitswarm.views.trade_offs import (
        FrontView,
        FrontWinnerView,
        NormalisedDesignView,
        PreferenceFitView,
        PreferenceForView,
    )

_INK: Final = "#1f3a5f"
_ACCENT: Final = "#d1495b"


def marked_table(view: FrontView) -> Table:
    """Knees, the best in each objective, and the winners of preferences."""
    from gaitswarm.cli.tables import Table

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
    """Designs with a mark, by what there is to say of them."""
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
    """What the table leaves open."""
    error = f" ± {view.hypervolume_error:.4f}" if view.hypervolume_error else ""
    yield (
        f"{view.size} of {view.designs_judged} designs are dominated by no other; hypervolume"
        f" {view.hypervolume:.4f}{error}; fitness is by the job's own preference, and all is"
        " minimized"
    )
    for winner in view.winners:
        if not winner.on_front:
            yield (
                f"the best under {_whose(winner)} is dominated by {winner.dominated_by} designs, by"
                f" one in every objective by {100.0 * winner.behind:.2g} %"
            )


def _whose(winner: FrontWinnerView) -> str:
    return "the job's own" if winner.preference == "job" else winner.preference


@dataclass(frozen=True, slots=True)
class Placed:
    """A design from elsewhere beside a front.

    Attributes:
        objectives: over all scenarios, by name; None if it fails in one.
        fitness: by the job's own preference.
        dominated_by: designs of the front that dominate it.
        dominates: designs of the front that it dominates.
        of: designs that it was compared with.
    """

    objectives: dict[str, float] | None
    fitness: float | None
    dominated_by: int
    dominates: int
    of: int


def placed(walk: SimulationView, view: FrontView) -> Placed:
    """Where a design that walked in the job's scenarios lies with respect to the front."""
    import numpy as np

    names = [objective.name for objective in view.objectives]
    walks = [
        [result.objectives[name] for name in names] for result in walk.scenarios.values()
        if result.status == "ok"
    ]  # fmt: skip
    if len(walks) < len(walk.scenarios):
        return Placed(None, None, 0, 0, len(view.designs))
    own = np.exp(np.log(np.array(walks, dtype=np.float64)).mean(axis=0))
    front = np.array([list(design.objectives.values()) for design in view.designs])
    return Placed(
        dict(zip(names, own.tolist(), strict=True)),
        walk.fitness,
        int(((front <= own).all(axis=1) & (front < own).any(axis=1)).sum()),
        int(((own <= front).all(axis=1) & (own < front).any(axis=1)).sum()),
        len(front),
    )


def placed_lines(published: Mapping[str, Placed]) -> Iterator[str]:
    """One sentence for each design."""
    for name, own in published.items():
        if own.objectives is None:
            yield f"published {name} fails in a scenario"
            continue
        told = [f"{SHORT[key]} {number(value)}" for key, value in own.objectives.items()]
        yield (
            f"published {name} is dominated by {own.dominated_by} of {own.of} designs of the front,"
            f" and dominates {own.dominates}: {', '.join(told)}, fitness {number(own.fitness)}"
        )


def front_csv(view: FrontView) -> bytes:
    """One row for each design of the front: where it is, marks, fitness, objectives, variables."""
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
    """Preferences that suit a design, one for each set of biases, the best first."""
    from gaitswarm.cli.tables import Table

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
    """Whether a design wins under any preference, in a sentence."""
    own, best = place_of(view.chosen.iteration, view.chosen.particle), view.fits[0]
    if view.wins:
        return f"design {own} wins{_by(best)} under {best.preference.model_dump_json()}"
    tried = "" if view.certain else " that were tried"
    dominated = "" if view.on_front else ", which is dominated"
    rival = "another" if best.rival is None else place_of(best.rival.iteration, best.rival.particle)
    return (
        f"no exponents{tried} with these biases make design {own} win{dominated}; under"
        f" {best.preference.model_dump_json()} it has rank {best.rank}, and {rival} is better"
        f"{_by(best)}"
    )


def _by(fit: PreferenceFitView) -> str:
    return "" if fit.margin is None else f" by {100.0 * abs(fit.margin):.3g} %"


def draw_front(view: FrontView, *, title: str) -> Figure:
    """The front in every pair of objectives, with the winners under A, B and C and the knees."""
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
    """A label that the legend has not yet."""
    return "" if label in axes.get_legend_handles_labels()[1] else label
