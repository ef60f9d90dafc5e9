"""`gaitswarm scenarios`: which scenarios of a job matter."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from gaitswarm.cli.inputs.options import Db, JobId, Json, Server

if TYPE_CHECKING:
    from gaitswarm.views.analysis import LossView, ScenarioFamiliesView


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command()(scenarios)


def scenarios(
    job_id: JobId,
    tolerance: Annotated[
        float, typer.Option(help="Largest regret of the smallest family of scenarios, as a share.")
    ] = 0.01,
    server: Server = None,
    db: Db = None,
    as_json: Json = False,
) -> None:
    """Say which scenarios of a job matter, from what is stored: no walk is run.

    What would the job have taken for its best without one of them, or with few? A search with fewer
    scenarios goes elsewhere, so check the answer by a job.
    """
    from gaitswarm.cli.output import print_json
    from gaitswarm.jobs.open import open_jobs

    with open_jobs(server, db) as jobs:
        view = jobs.scenarios(job_id, tolerance=tolerance)
    if as_json:
        print_json(view)
    else:
        _print(view)


def _print(view: ScenarioFamiliesView) -> None:
    from gaitswarm.cli.output import stdout_console
    from gaitswarm.cli.tables.fitted import Table
    from gaitswarm.cli.tables.views import MISSING, number

    without = Table(title="Left out", title_justify="left", box=None, padding=(0, 1, 0, 0))
    without.add_column("scenario", no_wrap=True)
    for head in ("rank\ncorrelation", "regret\nover all %", "loss\nin it %"):
        without.add_column(head, justify="right", no_wrap=True)
    without.add_column("most like", no_wrap=True)
    for left in view.left_out:
        similar = MISSING if left.similar is None else f"{left.similar}, {left.similarity:.2f}"
        without.add_row(
            left.scenario,
            number(left.family.correlation, 3),
            _percent(left.family.regret),
            _percent(left.loss),
            similar,
        )
    sizes = Table(title="Families", title_justify="left", box=None, padding=(0, 2, 0, 0))
    for head in ("scenarios", "families", "median regret %", "worst %", "within tolerance"):
        sizes.add_column(head, justify="right")
    for size in view.sizes:
        shares = [_share(size.median), _share(size.worst)]
        sizes.add_row(str(size.size), str(size.families), *shares, str(size.within))
    console = stdout_console()
    console.print(without)
    console.print(sizes)
    smallest = view.smallest
    told = (
        "none"
        if smallest is None
        else f"{', '.join(smallest.scenarios)}; regret {_percent(smallest.regret)} %"
    )
    console.print(
        f"of {view.designs} designs that walk in all scenarios; smallest family within"
        f" {100.0 * view.tolerance:g} %: {told}",
        markup=False,
    )


def _percent(loss: LossView) -> str:
    return f"{_share(loss.value)} ({_share(loss.low)}–{_share(loss.high)})"


def _share(value: float | None) -> str:
    return "fails" if value is None else f"{100.0 * value:.1f}"
