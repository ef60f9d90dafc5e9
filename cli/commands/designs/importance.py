"""`gaitswarm importance`: which variables of a job matter."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import typer

from gaitswarm.cli.inputs.options import Db, JobId, Json, Server

if TYPE_CHECKING:
    from gaitswarm.views.analysis import (
        ImportanceView,
        IndexIntervalView,
        VariableImportanceView,
    )


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command()(importance)


def importance(job_id: JobId, server: Server = None, db: Db = None, as_json: Json = False) -> None:
    """Say which variables of a job matter, from what is stored: no walk is run.

    First-order Sobol' indices for the fitness, for each objective and for failing, with intervals;
    and whether the winner lies at a bound of the search.
    """
    from gaitswarm.cli.output import print_json
    from gaitswarm.jobs.open import open_jobs

    with open_jobs(server, db) as jobs:
        view = jobs.importance(job_id)
    if as_json:
        print_json(view)
    else:
        _print(view)


def _print(view: ImportanceView) -> None:
    from gaitswarm.cli.output import stdout_console
    from gaitswarm.cli.tables.fitted import Table
    from gaitswarm.cli.tables.views import MISSING, SHORT

    table = Table(box=None, padding=(0, 1, 0, 0))
    table.add_column("variable", no_wrap=True)
    for head in ("fitness\n%", "95 %", *(SHORT[name] for name in view.objectives), "failing"):
        table.add_column(head, justify="right", no_wrap=True)
    table.add_column("moved with", no_wrap=True)
    for variable in sorted(view.variables, key=_order):
        companion = MISSING
        if variable.moved_with is not None:
            companion = f"{variable.moved_with}, {variable.correlation:.2f}"
        table.add_row(
            variable.name,
            _percent(variable.fitness),
            _interval(variable.fitness),
            *(_percent(variable.objectives[name]) for name in view.objectives),
            _percent(variable.failing),
            companion,
        )
    console = stdout_console()
    console.print(table)
    for line in _lines(view):
        console.print(line, markup=False, highlight=False)


def _order(variable: VariableImportanceView) -> float:
    return -1.0 if variable.fitness is None else -variable.fitness.value


def _lines(view: ImportanceView) -> Iterator[str]:
    from gaitswarm.services.optimizer.analysis.importance import LEAST_DESIGNS

    if view.designs < LEAST_DESIGNS:
        yield (
            f"{view.designs} designs walk in every case, and indices need {LEAST_DESIGNS}:"
            " `gaitswarm extend` lets the job try more"
        )
    yield (
        f"share of the variance of ranks that goes with each variable alone, among {view.sampled}"
        f" designs that were tried, {view.failed} of {view.designs + view.failed} in all failed;"
        " variables that moved together share it"
    )
    for variable in view.variables:
        if variable.at is None:
            continue
        bound = variable.low if variable.at == "low" else variable.high
        wider = variable.widened
        advice = "no wider bound is known that can be simulated"
        if wider is not None:
            advice = f"widen it to {wider.low:g} to {wider.high:g} and run again"
        unit = "" if variable.unit == "1" else f" {variable.unit}"
        yield (
            f"{variable.name}: the winner lies at the {variable.at} bound {bound:g}{unit}; {advice}"
        )


def _percent(index: IndexIntervalView | None) -> str:
    return "–" if index is None else f"{100.0 * index.value:.0f}"


def _interval(index: IndexIntervalView | None) -> str:
    return "" if index is None else f"{100.0 * index.low:.0f}–{100.0 * index.high:.0f}"
