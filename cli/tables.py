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
    """As Rich's, but ids and numbers stay whole on a console of any width.

    Cells break between words only. Where even so a row does not fit on a line, every row becomes a
    block of lines, each with a heading and a cell; empty cells have none. A first cell without a
    heading, or with nothing beside it, is the heading of its block or of those below. Of a table
    without headings every row is a line that the terminal breaks. Brackets in a cell are no markup.
    """

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """The table, or its rows as blocks. Called by Rich."""
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
        """Characters that the table takes when all columns are as narrow as their words."""
        _, right, _, left = self.padding
        edges = 0 if self.pad_edge else left + right
        return sum((c.min_width or 0) + left + right for c in self.columns) - edges

    def _blocks(self) -> Iterator[Text | RichTable]:
        """One block a row, with an empty line between two."""
        if self.title:
            yield Text(str(self.title), style="italic")
        for number, row in enumerate(self._rows()):
            if number:
                yield Text()
            said = [pair for pair in zip(self.columns, row, strict=True) if str(pair[1])]
            if said and (len(said) == 1 or not str(said[0][0].header)):
                yield Text(str(said.pop(0)[1]), style="bold")
            block = RichTable(box=None, show_header=False, padding=(0, 2, 0, 0))
            block.add_column(overflow="fold", no_wrap=True)
            block.add_column(overflow="fold")
            for column, cell in said:
                block.add_row(_on_one_line(column.header), _text(cell))
            if said:
                yield block

    def _lines(self) -> Iterator[Text]:
        """One line a row, cells below each other but for the last."""
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
    """Of a column's heading and cells; a cell that must not be wrapped is one word."""
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
"""Headings that leave room for six objectives on a line of 80 characters."""


def jobs_table(jobs: Iterable[JobSummaryView]) -> Table:
    """One row a job; priorities and gains only where there is one."""
    rows = list(jobs)
    urgent = any(job.priority for job in rows)
    compared = any(job.gain is not None for job in rows)
    table = Table("id", "name", "state", *(["priority"] if urgent else []), box=None)
    gains = ["gain"] if compared else []
    for heading in ("iterations", "best fitness", *gains, "submitted (UTC)"):
        table.add_column(heading)
    for job in rows:
        table.add_row(
            job.id,
            _name(job),
            Text(job.state.value, style=_STYLES.get(job.state.value, "")),
            *([str(job.priority)] if urgent else []),
            _spent(job),
            number(job.best_fitness),
            *([_gain(job)] if compared else []),
            f"{job.created_at:%Y-%m-%d %H:%M}",
        )
    return table


def _gain(job: JobSummaryView) -> str:
    if job.gain is None:
        return MISSING
    of_start = job.reference is not None and job.reference.kind == "start"
    return f"{job.gain:.1%}{' over start' if of_start else ''}"


def _name(job: JobSummaryView) -> Text:
    """With tags, what is archived, and of a fork where it comes from."""
    fork = [] if job.lineage is None else ["fork of", job.lineage.parent]
    marks = [*(f"#{tag}" for tag in job.tags), *(["archived"] if job.archived else [])]
    return Text("\n".join(filter(None, [job.name, *fork, " ".join(marks)])) or MISSING)


def optimizers_table(optimizers: Iterable[OptimizerView]) -> Table:
    """One row a name; settings as they are by default."""
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
    """One row an iteration; fitness is minimized."""
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
    """Variables as rows, designs as columns, with unit and bounds."""
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
    """Bounds of the search, or the choices; None for what is fixed."""
    if variable is None:
        return "fixed"
    if variable.kind == "categorical":
        return ", ".join(variable.choices)
    return f"{variable.low:g} – {variable.high:g}"


def results_table(
    designs: Mapping[str, Mapping[str, ScenarioResultView]],
    objectives: Sequence[Objective | ObjectiveView],
) -> Table:
    """Scenarios as rows; with several designs, one row for each under the scenario's name.

    objectives: columns of the results. Utility and objectives are minimized.
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
    """Scenarios as rows, what their walks tell beside the objectives as columns."""
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
    """What a gait plans: duty factor, feet that stand, static stability."""
    if gait.margin is None:
        return f"duty {gait.duty_factor:.2f}, at moments no foot stands: not statically stable"
    # Zero has a sign that nobody wants to see.
    margin = round(1000.0 * gait.margin, 1) + 0.0
    return (
        f"duty {gait.duty_factor:.2f}, {gait.fewest_feet} feet or more stand, stability margin"
        f" {margin:.1f} mm: {'' if gait.stable else 'not '}statically stable"
    )


def _objective(name: str, value: float | None) -> str:
    # A height is lost by millimetres: four decimals say more than four digits.
    return f"{value:.4f}" if name == "height_loss" and value is not None else number(value)


def worth(view: EvaluationView | SimulationView, *, digits: int = 4) -> str:
    """Fitness, which is minimized, and beside it the figure that is maximized, if there is one.

    digits: significant ones of the fitness.
    """
    fitness = number(view.fitness, digits)
    if view.figure_of_merit is None:
        return fitness
    return f"{fitness} (F of eq. 3.1, maximized: {number(view.figure_of_merit)})"


def search_line(best: BestView) -> str | None:
    """What a search in single precision made of its best; None if it is in double, too."""
    if best.search is None:
        return None
    found = number(best.search.fitness, 6)
    return (
        f"judged in double precision; in {best.search.precision}, in which it was found, its"
        f" fitness is {found} ({100.0 * best.search.difference:+.2g} %)"
    )


def ranking_table(ranking: RankingView) -> Table:
    """The best designs by another preference, best first, beside their ranks before."""
    from gaitswarm.settings import place_of

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
    """What `status` shows."""
    from gaitswarm.cli.output import stdout_console

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
    """What a fork took over of which job, and why no more."""
    first = f"fork of {lineage.parent}, "
    changed = f" with another {', '.join(lineage.changed)}" if lineage.changed else ""
    if lineage.carried == "search":
        begins = lineage.from_iteration
        return f"{first}goes on from its iteration {begins}{changed}"
    return (
        f"{first}a new search{changed} from the best designs of its iterations before"
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
    return f"{job.iterations}, of {job.particles} designs at most"


def print_best(best: BestView, job: JobView) -> None:
    """The best design of a job, its results by case, and what a search in single made of it."""
    from gaitswarm.cli.output import stdout_console

    console = stdout_console()
    console.print(design_table(job.spec, {"best": best.design}))
    console.print(results_table({"best": best.scenarios}, job.objectives))
    searched = search_line(best)
    if searched is not None:
        console.print(searched, markup=False)


def provenance_line(provenance: JobProvenance) -> str:
    """What numbers depend on, digests shortened to what tells them apart."""
    simulation = provenance.simulation
    return (
        f"gaitswarm {provenance.gaitswarm}, {simulation.backend} backend in"
        f" {simulation.precision} precision, code {simulation.code_digest[:8]} and"
        f" {provenance.optimizer_digest[:8]}, robot {simulation.robot}"
        f" {simulation.robot_digest[:8]}"
    )


def number(value: float | str | None, digits: int = 4) -> str:
    """As many significant digits, or all before the decimal point; a choice's name as it is."""
    if isinstance(value, str):
        return value
    if value is None:
        return MISSING
    return f"{value:.0f}" if 10.0**digits <= abs(value) < 1e9 else f"{value:.{digits}g}"


def duration(seconds: float) -> str:
    """`42 s`, `3 min 05 s`, `2 h 07 min`."""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60:02d} s"
    return f"{whole // 3600} h {whole % 3600 // 60:02d} min"


def recordings_table(recordings: Iterable[RecordingEntryView]) -> Table:
    """One row a recording; one that cannot be read has an id and a time."""
    table = Table(box=None)
    # Ids are what other commands take: they are never cut.
    table.add_column("id", no_wrap=True)
    for heading in ("walk", "currents", "recorded (UTC)"):
        table.add_column(heading)
    for entry in recordings:
        walk = Text(" ".join(filter(None, (entry.scenario, entry.controller))) or MISSING)
        if entry.synthetic:
            walk.append(" SYNTHETIC")
        known = entry.joints is not None and entry.seconds is not None
        table.add_row(
            entry.id,
            walk,
            f"{entry.joints} over {number(entry.seconds)} s" if known else MISSING,
            f"{entry.created_at:%Y-%m-%d %H:%M}",
        )
    return table
