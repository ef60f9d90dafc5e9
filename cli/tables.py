"""Views as tables for people."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Final

from rich.console import Console, ConsoleOptions, RenderableType, RenderResult
from rich.measure import Measurement
from rich.table import Column
from rich.table import Table as RichTable
from rich.text import Text

from gaitswarm.cli.output import stdout_console
from gaitswarm.settings import place_of

if TYPE_CHECKING:
    from gaitswarm.services.optimizer.jobs.fork import Lineage
    from gaitswarm.services.optimizer.jobs.provenance import JobProvenance
    from gaitswarm.services.optimizer.jobs.spec import Spec
    from gaitswarm.sim.outcome import Objective
    from gaitswarm.sim.variables import Variable
    from gaitswarm.views import (
        BestView,
        EvaluationView,
        IterationView,
        JobSummaryView,
        JobView,
        ObjectiveView,
        OptimizerView,
        PlannedGaitView,
        RankingView,
        ScenarioResultView,
        SimulatedScenarioView,
        SimulationView,
    )
    from gaitswarm.views.identification import RecordingEntryView


class Table(RichTable):
    """Rich table that never cuts ids and numbers, at any console width.

    Cells break only between words. If rows still do not fit, every row becomes a block of lines
    with a heading and a cell each, without empty cells. A first cell without a heading, or alone
    in its row, is the heading of its block or of the following ones. Rows of tables without
    headings become lines that the terminal wraps. Brackets in cells are not markup.
    """

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """Render the table, or its rows as blocks; called by Rich."""
        options = options.update(markup=False)
        for column in self.columns:
            column.min_width = _longest_word(console, options, column)
        if self._narrowest() <= options.max_width:
            yield from super().__rich_console__(console, options)
        elif self.show_header:
            yield from self._blocks()
        else:
            yield from self._lines()

    def _narrowest(self) -> int:
        """Return the width with all columns as narrow as their longest words."""
        _, right, _, left = self.padding
        edges = 0 if self.pad_edge else left + right
        return sum((c.min_width or 0) + left + right for c in self.columns) - edges

    def _blocks(self) -> Iterator[Text | RichTable]:
        """Yield one block per row, separated by empty lines."""
        if self.title:
            yield Text(str(self.title), style="italic")
        for number, row in enumerate(self._rows()):
            if number:
                yield Text()
            cells = [pair for pair in zip(self.columns, row, strict=True) if str(pair[1])]
            if cells and (len(cells) == 1 or not str(cells[0][0].header)):
                yield Text(str(cells.pop(0)[1]), style="bold")
            block = RichTable(box=None, show_header=False, padding=(0, 2, 0, 0))
            block.add_column(overflow="fold", no_wrap=True)
            block.add_column(overflow="fold")
            for column, cell in cells:
                block.add_row(_on_one_line(column.header), _text(cell))
            if cells:
                yield block

    def _lines(self) -> Iterator[Text]:
        """Yield one line per row, with aligned cells except the last."""
        rows = [[_text(cell) for cell in row] for row in self._rows()]
        widths = [max(cell.cell_len for cell in column) for column in zip(*rows, strict=True)]
        for row in rows:
            for cell, width in zip(row[:-1], widths, strict=False):
                cell.pad_right(width - cell.cell_len + 2)
            yield Text(" ").join([Text(), Text.assemble(*row)])

    def _rows(self) -> list[tuple[RenderableType, ...]]:
        return list(zip(*(column.cells for column in self.columns), strict=True))


def _text(cell: RenderableType) -> Text:
    return cell.copy() if isinstance(cell, Text) else Text(str(cell))


def _longest_word(console: Console, options: ConsoleOptions, column: Column) -> int:
    """Return the longest word of a column; cells that must not wrap are one word."""
    head = Measurement.get(console, options, column.header).minimum
    cells = [Measurement.get(console, options, cell) for cell in column.cells]
    return max([head, *(cell.maximum if column.no_wrap else cell.minimum for cell in cells)])


def _on_one_line(heading: RenderableType) -> RenderableType:
    return Text(" ".join(str(heading).split())) if isinstance(heading, str | Text) else heading


MISSING: Final = "–"

_STYLES: Final = {
    "running": "cyan",
    "succeeded": "green",
    "failed": "red",
    "cancelled": "yellow",
    "paused": "yellow",
}


SHORT: Final = {
    "torque": "torque",
    "acceleration": "accel.",
    "angular_acceleration": "ang.acc.",
    "energy": "energy",
    "reciprocal_speed": "1/speed",
    "height_loss": "h. loss",
}
"""Headings short enough for six objectives on 80 characters."""


def jobs_table(jobs: Iterable[JobSummaryView]) -> Table:
    """Return a table of jobs, with columns of priorities and gains only if there are any."""
    rows = list(jobs)
    has_priority = any(job.priority for job in rows)
    has_gain = any(job.gain is not None for job in rows)
    table = Table("id", "name", "state", *(["priority"] if has_priority else []), box=None)
    gains = ["gain"] if has_gain else []
    for heading in ("iterations", "best fitness", *gains, "submitted (UTC)"):
        table.add_column(heading)
    for job in rows:
        table.add_row(
            job.id,
            _name(job),
            Text(job.state.value, style=_STYLES.get(job.state.value, "")),
            *([str(job.priority)] if has_priority else []),
            _spent(job),
            number(job.best_fitness),
            *([_gain(job)] if has_gain else []),
            f"{job.created_at:%Y-%m-%d %H:%M}",
        )
    return table


def _gain(job: JobSummaryView) -> str:
    if job.gain is None:
        return MISSING
    of_start = job.reference is not None and job.reference.kind == "start"
    return f"{job.gain:.1%}{' over start' if of_start else ''}"


def _name(job: JobSummaryView) -> Text:
    """Return the name, with tags, the archived mark and a fork's parent."""
    fork = [] if job.lineage is None else ["fork of", job.lineage.parent]
    marks = [*(f"#{tag}" for tag in job.tags), *(["archived"] if job.archived else [])]
    return Text("\n".join(filter(None, [job.name, *fork, " ".join(marks)])) or MISSING)


def optimizers_table(optimizers: Iterable[OptimizerView]) -> Table:
    """Return a table of search methods with default settings."""
    table = Table("name", "description", "settings", box=None)
    for optimizer in optimizers:
        settings = optimizer.settings.model_dump(exclude={"name"})
        needs = "" if optimizer.needs is None else f"; needs {optimizer.needs}"
        table.add_row(
            optimizer.name,
            Text(f"{optimizer.description}{needs}"),
            Text("\n".join(f"{name} {json.dumps(value)}" for name, value in settings.items())),
        )
    return table


def iterations_table(iterations: Iterable[IterationView]) -> Table:
    """Return a table of iterations; fitness is minimized."""
    table = Table(box=None)
    columns = ("iteration", "best so far", "best", "mean", "median", "worst", "failed", "seconds")
    for column in columns:
        table.add_column(column, justify="right")
    for i in iterations:
        fitnesses = (i.best_so_far, i.best, i.mean, i.median, i.worst)
        table.add_row(
            str(i.index), *map(number, fitnesses), str(i.failed), f"{i.evaluate_seconds:.2f}"
        )
    return table


def design_table(spec: Spec, designs: Mapping[str, Mapping[str, float | str]]) -> Table:
    """Return a table of variables with the values of designs, bounds and units."""
    table = Table(title="Design", title_justify="left", box=None, padding=(0, 2, 0, 0))
    table.add_column("variable")
    for name in designs:
        table.add_column(name, justify="right")
    table.add_column("bounds", justify="right")
    table.add_column("unit")
    space = spec.design_space()
    searched = {variable.name: variable for variable in space.variables}
    for name in space.names:
        variable = searched.get(name)
        table.add_row(
            name,
            *(number(design.get(name)) for design in designs.values()),
            _range(variable),
            "" if variable is None else variable.unit,
        )
    return table


def _range(variable: Variable | None) -> str:
    """Format bounds or choices of a variable; None for a fixed one."""
    if variable is None:
        return "fixed"
    if variable.kind == "categorical":
        return ", ".join(variable.choices)
    return f"{variable.low:g} – {variable.high:g}"


def results_table(
    designs: Mapping[str, Mapping[str, ScenarioResultView]],
    objectives: Sequence[Objective | ObjectiveView],
) -> Table:
    """Return a table of results by scenario, with one row per design.

    Utility and objectives are minimized.
    """
    table = Table(title="By scenario", title_justify="left", box=None, padding=(0, 1, 0, 0))
    table.add_column("scenario", no_wrap=True)
    table.add_column("status")
    table.add_column("utility", justify="right")
    for objective in objectives:
        heading = SHORT.get(objective.name, objective.name.replace("_", " "))
        table.add_column(f"{heading}\n{objective.unit}", justify="right")
    for scenario in next(iter(designs.values())):
        if len(designs) > 1:
            table.add_row(Text(scenario, style="bold"))
        for design, results in designs.items():
            result = results[scenario]
            table.add_row(
                f"  {design}" if len(designs) > 1 else scenario,
                Text(result.status, style="" if result.status == "ok" else "red"),
                number(result.utility),
                *(_objective(name, value) for name, value in result.objectives.items()),
            )
    return table


def measurements_table(results: Mapping[str, SimulatedScenarioView]) -> Table:
    """Return a table of measurements by scenario."""
    from gaitswarm.sim.outcome import MEASUREMENTS

    table = Table(title="Measured", title_justify="left", box=None, padding=(0, 1, 0, 0))
    table.add_column("scenario", no_wrap=True)
    for measurement in MEASUREMENTS:
        heading = measurement.name.replace("_", " ")
        table.add_column(f"{heading}\n{measurement.unit}", justify="right")
    for scenario, result in results.items():
        values = (getattr(result.measurements, m.name) for m in MEASUREMENTS)
        table.add_row(scenario, *map(number, values))
    return table


def gait_in_words(gait: PlannedGaitView) -> str:
    """Describe a planned gait: duty factor, supporting feet, static stability."""
    if gait.margin is None:
        return f"duty {gait.duty_factor:.2f}, at times without support: not statically stable"
    # Adding zero removes the sign of -0.0.
    margin = round(1000.0 * gait.margin, 1) + 0.0
    return (
        f"duty {gait.duty_factor:.2f}, at least {gait.fewest_feet} supporting feet, stability"
        f" margin {margin:.1f} mm: {'' if gait.stable else 'not '}statically stable"
    )


def _objective(name: str, value: float | None) -> str:
    # Losses of height are millimetres: show four decimals instead of four digits.
    return f"{value:.4f}" if name == "height_loss" and value is not None else number(value)


def worth(view: EvaluationView | SimulationView, *, digits: int = 4) -> str:
    """Format the minimized fitness, and the maximized figure of merit if there is one."""
    fitness = number(view.fitness, digits)
    if view.figure_of_merit is None:
        return fitness
    return f"{fitness} (F of eq. 3.1, maximized: {number(view.figure_of_merit)})"


def search_line(best: BestView) -> str | None:
    """Describe the best's fitness in the search's precision; None if that is double, too."""
    if best.search is None:
        return None
    fitness = number(best.search.fitness, 6)
    return (
        f"evaluated in double precision; in {best.search.precision} precision of the search, its"
        f" fitness is {fitness} ({100.0 * best.search.difference:+.2g} %)"
    )


def ranking_table(ranking: RankingView) -> Table:
    """Return a table of the best designs by another preference, with their ranks before."""
    table = Table(box=None)
    columns = ["rank", "before", "design", "fitness", "before"]
    maximized = any(design.figure_of_merit is not None for design in ranking.top)
    for column in columns + (["F (eq. 3.1)"] if maximized else []):
        table.add_column(column, justify="right")
    for design in ranking.top:
        table.add_row(
            str(design.rank),
            MISSING if design.rank_before is None else str(design.rank_before),
            place_of(design.iteration, design.particle),
            number(design.fitness),
            number(design.fitness_before),
            *([number(design.figure_of_merit)] if maximized else []),
        )
    return table


def print_job(job: JobView) -> None:
    """Print the result of `status`."""
    console = stdout_console()
    rows = {
        "job": job.id,
        "name": job.name or MISSING,
        "state": job.state.value,
        "waiting": job.waiting,
        "priority": str(job.priority) if job.priority else None,
        "error": job.error,
        "lineage": None if job.lineage is None else lineage_line(job.lineage),
        "iterations": _iterations(job),
        "evaluations": f"{job.evaluations} of {job.evaluations_planned}",
        "evaluations saved": str(job.evaluations_saved),
        "speed": None
        if job.evaluations_per_second is None
        else f"{job.evaluations_per_second:.1f} designs/s",
        "time left": _time_left(job),
        "precision": job.precision,
        "best fitness": number(job.best_fitness),
    }
    for record in job.provenance:
        since = f" from iteration {record.from_iteration}" if record.from_iteration else ""
        rows[f"computed by{since}"] = provenance_line(record.provenance)
    rows["head"] = job.head
    table = Table(box=None, show_header=False)
    for name, value in rows.items():
        if value is not None:
            table.add_row(name, Text(value))
    console.print(table)
    if job.best is not None:
        print_best(job.best, job)


def lineage_line(lineage: Lineage) -> str:
    """Describe a fork's parent and how it continues."""
    parent = f"fork of {lineage.parent}, "
    changed = f" with another {', '.join(lineage.changed)}" if lineage.changed else ""
    if lineage.carried == "search":
        return f"{parent}continues from its iteration {lineage.from_iteration}{changed}"
    return (
        f"{parent}a new search{changed} from the best designs before iteration"
        f" {lineage.from_iteration}: {lineage.reason}"
    )


def _time_left(job: JobSummaryView) -> str | None:
    if job.state.terminal:
        return None
    return job.eta_basis if job.eta_seconds is None else duration(job.eta_seconds)


def _spent(job: JobSummaryView) -> str:
    spent = job.spent
    unit = "" if spent.unit == "iterations" else f" {spent.unit}"
    return f"{spent.done}/{spent.planned}{unit}"


def _iterations(job: JobView) -> str:
    if job.spent.unit == "iterations":
        return f"{job.iterations} of {job.iterations_planned}"
    return f"{job.iterations}, of up to {job.particles} designs"


def print_best(best: BestView, job: JobView) -> None:
    """Print a job's best design and its results."""
    console = stdout_console()
    console.print(design_table(job.spec, {"best": best.design}))
    console.print(results_table({"best": best.scenarios}, job.objectives))
    searched = search_line(best)
    if searched is not None:
        console.print(searched, markup=False)


def provenance_line(provenance: JobProvenance) -> str:
    """Describe provenance, with shortened digests."""
    simulation = provenance.simulation
    return (
        f"gaitswarm {provenance.gaitswarm}, {simulation.backend} backend in"
        f" {simulation.precision} precision, code {simulation.code_digest[:8]} and"
        f" {provenance.optimizer_digest[:8]}, robot {simulation.robot}"
        f" {simulation.robot_digest[:8]}"
    )


def number(value: float | str | None, digits: int = 4) -> str:
    """Format a number with significant digits, at least all integer ones; names do not change."""
    if isinstance(value, str):
        return value
    if value is None:
        return MISSING
    return f"{value:.0f}" if 10.0**digits <= abs(value) < 1e9 else f"{value:.{digits}g}"


def duration(seconds: float) -> str:
    """Format seconds, as `42 s`, `3 min 05 s` or `2 h 07 min`."""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60:02d} s"
    return f"{whole // 3600} h {whole % 3600 // 60:02d} min"


def recordings_table(recordings: Iterable[RecordingEntryView]) -> Table:
    """Return a table of recordings; unreadable ones have only an id and a time."""
    table = Table(box=None)
    table.add_column("id", no_wrap=True)
    for heading in ("walk", "currents", "recorded (UTC)"):
        table.add_column(heading)
    for entry in recordings:
        walk = Text(" ".join(filter(None, (entry.scenario, entry.controller))) or MISSING)
        if entry.synthetic:
            walk.append(" SYNTHETIC")
        readable = entry.joints is not None and entry.seconds is not None
        table.add_row(
            entry.id,
            walk,
            f"{entry.joints} over {number(entry.seconds)} s" if readable else MISSING,
            f"{entry.created_at:%Y-%m-%d %H:%M}",
        )
    return table
