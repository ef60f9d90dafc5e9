"""Tables, and views of jobs and designs as text."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

from gaitswarm.cli.output import Parts

if TYPE_CHECKING:
    from rich.table import Table

    from gaitswarm.services.optimizer.analysis.evaluations import (
        EvaluationView,
        ObjectiveView,
        ScenarioResultView,
    )
    from gaitswarm.services.optimizer.analysis.verdict import FigureView, VerdictView
    from gaitswarm.services.optimizer.jobs.fork import Lineage
    from gaitswarm.services.optimizer.jobs.provenance import JobProvenance
    from gaitswarm.services.optimizer.jobs.spec import Spec
    from gaitswarm.sim.outcome import Objective
    from gaitswarm.sim.variables import Variable
    from gaitswarm.simulation import PlannedGaitView, SimulationView
    from gaitswarm.views.job import BestView, JobSummaryView, JobView, Spent

MISSING: Final = "–"

SHORT: Final = {
    "torque": "torque",
    "acceleration": "accel.",
    "angular_acceleration": "ang.acc.",
    "energy": "energy",
    "reciprocal_speed": "1/speed",
    "height_loss": "h. loss",
}
"""Headings short enough for six objectives on 80 characters."""

_STATES: Final = {
    "running": "cyan",
    "succeeded": "green",
    "failed": "red",
    "cancelled": "yellow",
    "paused": "yellow",
}


class Bold(list[Any]):
    """Cells of a row in bold."""


def table(
    headings: Sequence[str] | None,
    rows: Iterable[Sequence[Any]],
    *,
    title: str | None = None,
    gap: int = 2,
) -> Table:
    from rich.table import Table

    made = Table(box=None, title=title, title_justify="left", padding=(0, gap, 0, 0))
    made.show_header = headings is not None
    for index, heading in enumerate(headings or ()):
        left = heading.startswith("<") or not index
        made.add_column(heading.removeprefix("<"), justify="left" if left else "right")
    for row in rows:
        made.add_row(*map(_cell, row), style="bold" if isinstance(row, Bold) else None)
    return made


def _cell(value: Any) -> Any:
    from rich.text import Text

    if isinstance(value, tuple):
        return Text(value[0], style=value[1])
    return Text(value if isinstance(value, str) else number(value))


def number(value: float | str | None, digits: int = 4) -> str:
    """Format a number with significant digits, at least all integer ones; names do not change."""
    if isinstance(value, str):
        return value
    if value is None:
        return MISSING
    if isinstance(value, int):
        return str(value)
    return f"{value:.0f}" if 10.0**digits <= abs(value) < 1e9 else f"{value:.{digits}g}"


def percent(share: float | None, digits: int = 4) -> str:
    """Format a share as percents without the sign."""
    return number(None if share is None else 100.0 * share, digits)


def interval(index: Any, digits: int = 3) -> tuple[str, str]:
    if index is None:
        return MISSING, MISSING
    return number(
        index.value, digits
    ), f"{number(index.low, digits)} – {number(index.high, digits)}"


def duration(seconds: float) -> str:
    """Format seconds, as `42 s`, `3 min 05 s` or `2 h 07 min`."""
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60:02d} s"
    return f"{whole // 3600} h {whole % 3600 // 60:02d} min"


def place(design: Any) -> str:
    """Format the place of a design, such as 24.7."""
    return f"{design.iteration}.{design.particle}"


def jobs_table(jobs: Iterable[JobSummaryView]) -> Table:
    """Return a table of jobs, with columns of priorities and gains only if there are any."""
    jobs = list(jobs)
    optional = {
        "priority": any(job.priority for job in jobs),
        "<gain": any(job.gain is not None for job in jobs),
    }
    headings = ["id", "<name", "<state", "priority"]
    headings += ["<iterations", "<best fitness", "<gain", "<submitted (UTC)"]
    shown = [optional.get(heading, True) for heading in headings]
    rows = [
        (
            job.id,
            _name(job),
            (job.state.value, _STATES.get(job.state.value, "")),
            job.priority,
            _spent(job.spent),
            number(job.best_fitness),
            _gain(job),
            f"{job.created_at:%Y-%m-%d %H:%M}",
        )
        for job in jobs
    ]

    def only_shown(row: Sequence[Any]) -> list[Any]:
        return [cell for cell, is_shown in zip(row, shown, strict=True) if is_shown]

    return table(only_shown(headings), map(only_shown, rows))


def _gain(job: JobSummaryView) -> str:
    if job.gain is None:
        return MISSING
    of_start = job.reference is not None and job.reference.kind == "start"
    return f"{job.gain:.1%}{' over start' if of_start else ''}"


def _name(job: JobSummaryView) -> str:
    """Return the name, with tags, the archived mark and a fork's parent."""
    fork = [] if job.lineage is None else ["fork of", job.lineage.parent]
    marks = [*(f"#{tag}" for tag in job.tags), *(["archived"] if job.archived else [])]
    return "\n".join(filter(None, [job.name, *fork, " ".join(marks)])) or MISSING


def _spent(spent: Spent) -> str:
    unit = "" if spent.unit == "iterations" else f" {spent.unit}"
    return f"{spent.done}/{spent.planned}{unit}"


def design_table(spec: Spec, designs: Mapping[str, Mapping[str, float | str]]) -> Table:
    """Return a table of variables with the values of designs, bounds and units."""
    space = spec.design_space()
    searched = {variable.name: variable for variable in space.variables}
    rows = (
        (
            name,
            *(design.get(name) for design in designs.values()),
            _range(searched.get(name)),
            searched[name].unit if name in searched else "",
        )
        for name in space.names
    )
    return table(["variable", *designs, "bounds", "<unit"], rows, title="Design")


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
    """Return a table of results by scenario, with one row per design."""
    rows: list[Sequence[Any]] = []
    for scenario in next(iter(designs.values())):
        if len(designs) > 1:
            rows.append(Bold([scenario]))
        for design, results in designs.items():
            result = results[scenario]
            rows.append(
                (
                    f"  {design}" if len(designs) > 1 else scenario,
                    (result.status, "" if result.status == "ok" else "red"),
                    result.utility,
                    *(_objective(name, value) for name, value in result.objectives.items()),
                )
            )
    heads = [f"{SHORT.get(o.name, o.name.replace('_', ' '))}\n{o.unit}" for o in objectives]
    return table(["scenario", "<status", "utility", *heads], rows, title="By scenario", gap=1)


def measurements_tables(
    results: Mapping[str, Mapping[str, float | None]],
    measurements: Sequence[Objective | ObjectiveView],
) -> Iterator[Table]:
    """Yield tables of measurements by scenario, each as wide as a terminal."""
    for first in range(0, len(measurements), 5):
        columns = measurements[first : first + 5]
        heads = [f"{m.name.replace('_', ' ')}\n{m.unit}" for m in columns]
        rows = (
            (scenario, *(number(measured[m.name]) for m in columns))
            for scenario, measured in results.items()
        )
        yield table(["scenario", *heads], rows, title="" if first else "Measured", gap=1)


def _objective(name: str, value: float | None) -> str:
    # Losses of height are millimetres: show four decimals instead of four digits.
    return f"{value:.4f}" if name == "height_loss" and value is not None else number(value)


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


def worth(view: EvaluationView | SimulationView, *, digits: int = 4) -> str:
    """Format the minimized fitness, and the maximized figure of merit if there is one."""
    fitness = number(view.fitness, digits)
    if view.figure_of_merit is None:
        return fitness
    return f"{fitness} (F of eq. 3.1, maximized: {number(view.figure_of_merit)})"


def search_line(best: BestView) -> Iterator[str]:
    """Describe the best's fitness in the search's precision, unless that is double, too."""
    if best.search is not None:
        fitness = number(best.search.fitness, 6)
        yield (
            f"evaluated in double precision; in {best.search.precision} precision of the search,"
            f" its fitness is {fitness} ({100.0 * best.search.difference:+.2g} %)"
        )


def job_parts(job: JobView) -> Parts:
    rate, time_left = job.evaluations_per_second, None
    if not job.state.terminal:
        time_left = job.eta_basis if job.eta_seconds is None else duration(job.eta_seconds)
    of_iterations = f"{job.iterations} of {job.iterations_planned}"
    if job.spent.unit != "iterations":
        of_iterations = f"{job.iterations}, of up to {job.particles} designs"
    rows = {
        "job": job.id,
        "name": job.name or MISSING,
        "state": job.state.value,
        "waiting": job.waiting,
        "priority": str(job.priority) if job.priority else None,
        "error": job.error,
        "lineage": None if job.lineage is None else lineage_line(job.lineage),
        "iterations": of_iterations,
        "evaluations": f"{job.evaluations} of {job.evaluations_planned}",
        "evaluations saved": str(job.evaluations_saved),
        "speed": None if rate is None else f"{rate:.1f} designs/s",
        "simulated on": job.evaluated_on,
        "time left": time_left,
        "precision": job.precision,
        "infeasible": str(job.infeasible) if job.least_violation is not None else None,
        "best fitness": number(job.best_fitness),
    }
    for record in job.provenance:
        since = f" from iteration {record.from_iteration}" if record.from_iteration else ""
        rows[f"computed by{since}"] = _provenance_line(record.provenance)
    rows["head"] = job.head
    yield table(None, ((name, value) for name, value in rows.items() if value is not None))
    if job.best is not None:
        yield from best_parts(job.best, job)
    elif job.closest is not None:
        yield job.closest.explanation


def best_parts(best: BestView, job: JobView) -> Parts:
    yield design_table(job.spec, {"best": best.design})
    yield results_table({"best": best.scenarios}, job.objectives)
    if job.measurements:
        measured = {name: result.measurements for name, result in best.scenarios.items()}
        yield from measurements_tables(measured, job.measurements)
    yield from search_line(best)


def verdict_lines(verdict: VerdictView, place: str) -> Iterator[str]:
    """Yield the verdict on a job's best design in words, and the command for wider bounds."""
    yield from verdict.sentences
    if verdict.reason is not None:
        yield f"no gain: {verdict.reason}"
    if verdict.widen is not None:
        yield f"to queue a search within wider bounds, run\n  {verdict.widen}{place}"
    if verdict.relax is not None:
        yield f"to continue under relaxed constraints, run\n  {verdict.relax}{place}"


def verdict_table(verdict: VerdictView) -> Table:
    """Return a table of values by scenario, each with its change against the reference."""
    scenarios = dict.fromkeys(name for q in verdict.quantities for name in q.scenarios)
    rows = [
        [name, *(_change(quantity.scenarios.get(name)) for quantity in verdict.quantities)]
        for name in scenarios
    ]
    heads = (
        f"{SHORT.get(q.name, q.name.replace('_', ' '))}\n{q.unit} %" for q in verdict.quantities
    )
    title = "Best design, and change against the reference"
    return table(["scenario", *heads], rows, title=title, gap=1)


def _change(figure: FigureView | None) -> tuple[str, str]:
    from gaitswarm.services.optimizer.analysis.verdict import percentage

    if figure is None:
        return MISSING, ""
    style = {"better": "green", "worse": "red"}.get(figure.judgement, "")
    change = f"{'-' if figure.change < 0.0 else '+'}{percentage(figure.change)}"
    return f"{number(figure.value, 3)} {change.removesuffix(' %')}", style


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


def _provenance_line(provenance: JobProvenance) -> str:
    simulation = provenance.simulation
    return (
        f"gaitswarm {provenance.gaitswarm}, {simulation.backend} backend in"
        f" {simulation.precision} precision, code {simulation.code_digest[:8]} and"
        f" {provenance.optimizer_digest[:8]}, robot {simulation.robot}"
        f" {simulation.robot_digest[:8]}"
    )
