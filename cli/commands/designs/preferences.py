"""`gaitswarm preferences`: whose winner is the most robust, and under which a design wins."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, cast

import typer

from gaitswarm.cli.commands.designs.robustness import Radius, Samples, Seed
from gaitswarm.cli.inputs.options import Db, JobId, Json, Precision, Server

if TYPE_CHECKING:
    from gaitswarm.sim.kernel.walk import Precision as PhysicsPrecision
    from gaitswarm.views.analysis import RobustPreferencesView


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command()(preferences)


def preferences(
    job_id: JobId,
    drawn: Annotated[int, typer.Option(help="Preferences to draw beside A, B and C.")] = 512,
    candidates: Annotated[
        int, typer.Option(help="Winners to let walk, beside those of A, B and C.")
    ] = 8,
    samples: Samples = 128,
    radius: Radius = 0.02,
    seed: Seed = 1,
    precision: Precision = None,
    for_design: Annotated[
        str | None,
        typer.Option(
            "--for",
            metavar="ITERATION.DESIGN",
            help="Find the preference under which this design of the job wins instead; no walk is"
            " run.",
        ),
    ] = None,
    server: Server = None,
    db: Db = None,
    as_json: Json = False,
) -> None:
    """Choose a preference so that its winner is robust (thesis 4.5), among a job's designs.

    They are ranked anew under many preferences, from what is stored; of the winners the robustness
    index is estimated, by walks. With --for: which preference makes a design of the job its best.
    """
    if for_design is not None:
        _suit(job_id, for_design, server=server, db=db, as_json=as_json)
        return
    from gaitswarm.cli.commands.designs.robustness import shown_progress
    from gaitswarm.cli.output import print_json
    from gaitswarm.jobs.open import open_jobs
    from gaitswarm.preferences import robust_preferences

    with open_jobs(server, db) as jobs, shown_progress() as progress:
        view = robust_preferences(
            jobs,
            job_id,
            drawn=drawn,
            candidates=candidates,
            samples=samples,
            radius=radius,
            seed=seed,
            precision=cast("PhysicsPrecision", precision or "double"),
            progress=progress,
        )
    if as_json:
        print_json(view)
    else:
        _print(view)


def _suit(
    job_id: str, for_design: str, *, server: str | None, db: str | None, as_json: bool
) -> None:
    from gaitswarm.cli.output import print_json, stdout_console
    from gaitswarm.cli.tables.front import fits_table, verdict
    from gaitswarm.jobs.open import open_jobs
    from gaitswarm.settings import read_place

    iteration, particle = read_place(for_design, field="for")
    with open_jobs(server, db) as jobs:
        view = jobs.preference_for(job_id, iteration, particle)
    if as_json:
        print_json(view)
        return
    console = stdout_console()
    console.print(fits_table(view))
    console.print(verdict(view), markup=False)


def _print(view: RobustPreferencesView) -> None:
    from gaitswarm.cli.output import stdout_console
    from gaitswarm.cli.tables.fitted import Table
    from gaitswarm.cli.tables.views import MISSING, number
    from gaitswarm.settings import place_of

    table = Table(box=None, padding=(0, 2, 0, 0))
    heads = ("design", "index", "95 %", "wins under", "fitness", "loss %", "bias", "exponent")
    for head in heads:
        table.add_column(head, no_wrap=head not in ("bias", "exponent"))
    for found in view.candidates:
        index = found.index
        share = f"{100.0 * found.share:.0f} %"
        table.add_row(
            place_of(found.iteration, found.particle),
            number(None if index is None else index.value, 3),
            MISSING if index is None else f"{number(index.low, 3)}–{number(index.high, 3)}",
            ", ".join([*found.named, share]),
            number(found.fitness),
            number(None if found.loss is None else 100.0 * found.loss, 2),
            " ".join(number(value, 2) for value in found.preference.bias),
            " ".join(number(value, 2) for value in found.preference.exponent),
        )
    console = stdout_console()
    console.print(table)
    console.print(
        f"{view.winners} designs of the job win under A, B, C or any of {view.drawn} drawn"
        " preferences; smaller indices are more robust; fitness and loss are by the job's own",
        markup=False,
    )
