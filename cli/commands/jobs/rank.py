"""`gaitswarm rank`: what if another preference had judged."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from gaitswarm.cli.inputs.options import Db, JobId, Json, Server

if TYPE_CHECKING:
    from gaitswarm.views import RankingRequest, RankingView


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command()(rank)


def rank(
    job_id: JobId,
    preference: Annotated[
        str,
        typer.Option(
            metavar="NAME|JSON",
            help='A, B, C, chapter-3, or your own: {"bias": [five or six numbers], "exponent": [as'
            " many]}.",
        ),
    ],
    top: Annotated[int, typer.Option(help="How many of the best designs to show.")] = 20,
    server: Server = None,
    db: Db = None,
    as_json: Json = False,
) -> None:
    """Rank all designs of a job by another preference, from what is stored: no walk is run."""
    from gaitswarm.cli.output import print_json
    from gaitswarm.jobs.open import open_jobs

    request = _request(preference, top)
    with open_jobs(server, db) as jobs:
        ranking = jobs.ranking(job_id, request.preference, top=request.top)
    if as_json:
        print_json(ranking)
    else:
        _print(ranking)


def _request(preference: str, top: int) -> RankingRequest:
    """Raises InvalidRequest that names the field."""
    from pydantic import ValidationError

    from gaitswarm.cli.inputs.spec_file import preference_choice
    from gaitswarm.errors import invalid_request
    from gaitswarm.views import RankingRequest

    data = {"preference": preference_choice(preference), "top": top}
    try:
        return RankingRequest.model_validate(data)
    except ValidationError as error:
        raise invalid_request(error) from error


def _print(ranking: RankingView) -> None:
    from gaitswarm.cli.output import stdout_console
    from gaitswarm.cli.tables.views import MISSING, number, ranking_table

    console = stdout_console()
    console.print(ranking_table(ranking))
    agreement = MISSING if ranking.correlation is None else f"{ranking.correlation:.3f}"
    console.print(
        f"of {ranking.evaluations} designs; the job's own best:"
        f" {number(ranking.fitness_of_present_best)}; rank correlation: {agreement}",
        markup=False,
    )
