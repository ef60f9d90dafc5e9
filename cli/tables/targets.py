"""How near a calibration comes to its targets, and what the evidence decides, as tables."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gaitswarm.cli.tables.fitted import Table
    from gaitswarm.views.calibration import ReachedView, TargetsView
    from gaitswarm.views.identification import IdentifiabilityView


def show_targets(reached: TargetsView, parameters: IdentifiabilityView) -> None:
    """The result of the commands `calibrate` and `targets`."""
    from gaitswarm.cli.output import note, stdout_console
    from gaitswarm.cli.tables.parameters import parameters_table
    from gaitswarm.settings import place_of

    console = stdout_console()
    console.print(targets_table(reached))
    console.print(
        f"misfit {reached.fitness:.3f} tolerances, root mean square over what is fitted: job"
        f" {reached.job}, design {place_of(reached.iteration, reached.particle)}",
        markup=False,
    )
    for job, fitness in zip(parameters.jobs, parameters.fitness, strict=True):
        console.print(f"job {job}: misfit {fitness:.3f}", markup=False)
    console.print(parameters_table(parameters, {}))
    if any(parameter.choices for parameter in parameters.parameters):
        console.print(choices_table(parameters))
    if len(parameters.jobs) == 1:
        note("note: one run always narrows down; run others with other seeds to see what to trust")


def targets_table(reached: TargetsView) -> Table:
    """Targets as rows: what was printed or measured, what is simulated, and how far off it is."""
    from gaitswarm.cli.tables.fitted import Table
    from gaitswarm.cli.tables.views import number

    left_out = any(target.left_out is not None for target in reached.targets)
    title = "Targets; off: in tolerances"
    table = Table(title=title, title_justify="left", box=None, padding=(0, 1, 0, 0))
    for column in ("walk", "quantity", "unit"):
        table.add_column(column, overflow="fold")
    columns = ("target", "simulated", "off", *(("left out", "off") if left_out else ()))
    for column in columns:
        table.add_column(column, justify="right")
    table.add_column("")
    for t in reached.targets:
        walk = t.walk if t.relative_to is None else f"{t.walk} / {t.relative_to}"
        table.add_row(
            walk,
            t.quantity,
            t.unit,
            number(t.value),
            number(t.simulated),
            _off(t),
            *(_left_out(t.left_out) if left_out else ()),
            "" if t.use == "fit" else "predict",
        )
    return table


def choices_table(parameters: IdentifiabilityView) -> Table:
    """Choices as rows: the least misfit with each, over all runs and of each run."""
    from gaitswarm.cli.tables.fitted import Table
    from gaitswarm.cli.tables.views import number

    title = "Least misfit by choice"
    table = Table(title=title, title_justify="left", box=None, padding=(0, 1, 0, 0))
    for column in ("variable", "choice"):
        table.add_column(column, no_wrap=True)
    for column in ("misfit", *(f"run {k}" for k in range(1, len(parameters.jobs) + 1))):
        table.add_column(column, justify="right")
    table.add_column("evidence")
    for parameter in parameters.parameters:
        for row, choice in enumerate(parameter.choices):
            table.add_row(
                "" if row else parameter.name,
                choice.name,
                number(choice.fitness),
                *map(number, choice.by_run),
                "" if row else parameter.explanation or "one run",
            )
    return table


def _left_out(reached: ReachedView | None) -> tuple[str, str]:
    from gaitswarm.cli.tables.views import MISSING, number

    return (MISSING if reached is None else number(reached.simulated)), _off(reached)


def _off(reached: ReachedView | None) -> str:
    from gaitswarm.cli.tables.views import MISSING

    if reached is None or reached.difference is None:
        return MISSING
    return f"{reached.difference:+.2f}"
