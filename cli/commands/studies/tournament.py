"""`gaitswarm tournament`: search methods against each other."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from gaitswarm.cli.inputs.options import Json, WorkerOptions, with_groups

if TYPE_CHECKING:
    from collections.abc import Iterable

    from gaitswarm.services.optimizer.analysis.tournaments.standings import Standings
    from gaitswarm.services.optimizer.jobs.kinds.tournament import TournamentSpec

Preset = Annotated[
    Literal["thesis", "robot"],
    typer.Argument(
        help="thesis: the test functions of 3.2.1, settings drawn at random. robot: the jobs of"
        " chapters 4 and 3, default settings.",
        show_default=False,
    ),
]


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command()(tournament)


@with_groups
def tournament(
    preset: Preset,
    *,
    output: Annotated[
        Path, typer.Option("--output", "-o", help="Folder of the report; made if there is none.")
    ] = Path("tournament"),
    methods: Annotated[
        str | None,
        typer.Option(
            metavar="NAME,...",
            help="Search methods, and other libraries' as rivals. Default: all that are installed;"
            " thesis: without rivals.",
        ),
    ] = None,
    method_file: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Further methods, as a JSON object: a label of your own for a name, or for an"
            " object with name and settings.",
        ),
    ] = None,
    problems: Annotated[
        str | None,
        typer.Option(
            metavar="NAME,...", help="Test functions and robot jobs. Default: the preset's."
        ),
    ] = None,
    repetitions: Annotated[
        int | None,
        typer.Option(
            min=1, help="Runs of each method on each problem. Default: thesis 100, robot 20."
        ),
    ] = None,
    evaluations: Annotated[
        int | None,
        typer.Option(min=10, help="Budget of each run. Default: thesis 2500, robot 625."),
    ] = None,
    settings: Annotated[
        str | None,
        typer.Option(
            metavar="random|default",
            help="Whether settings are drawn anew for every run. Default: the preset's.",
        ),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="From which all others are drawn.")] = 1,
    precision: Annotated[
        str,
        typer.Option(
            metavar="single|double",
            help="Of the searches' walks; what they find is judged in double.",
        ),
    ] = "single",
    compare_with: Annotated[
        Path | None,
        typer.Option(metavar="FOLDER", help="Compare ranks with those of an earlier report."),
    ] = None,
    workers: WorkerOptions,
    as_json: Json = False,
) -> None:
    """Let search methods compete, and report which needs the fewest evaluations.

    Every method is a job of the database. The same command goes on where it was stopped; more
    methods or repetitions run only what is missing.
    """
    import json

    from gaitswarm.cli.inputs.spec_file import read_json_object
    from gaitswarm.cli.output import print_text
    from gaitswarm.cli.tournament.plan import (
        PRESETS,
        Size,
        chosen_methods,
        chosen_problems,
        tournament_jobs,
    )
    from gaitswarm.cli.tournament.report import write_report
    from gaitswarm.cli.tournament.runs import read_runs, results_of, run_jobs, write_runs
    from gaitswarm.services.optimizer.analysis.tournaments.standings import standings_of
    from gaitswarm.services.optimizer.errors import InvalidRequest
    from gaitswarm.views.tournament import StandingsView

    known = PRESETS[preset]
    if settings not in (None, "random", "default"):
        raise InvalidRequest(f"{settings!r} is neither random nor default", field="settings")
    if precision not in ("single", "double"):
        raise InvalidRequest(f"{precision!r} is neither single nor double", field="precision")
    size = Size(
        repetitions=repetitions or known.repetitions,
        evaluations=evaluations or known.evaluations,
        seed=seed,
        settings=known.settings if settings is None else _drawn(settings),
    )
    own: dict[str, Any] = (
        {} if method_file is None else read_json_object(method_file, "method-file")
    )
    entrants = chosen_methods(known, methods, own)
    names = chosen_problems(known, problems)
    other = None if compare_with is None else read_runs(compare_with, "compare-with")
    specs = tournament_jobs(entrants, names, size, precision)
    try:
        output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InvalidRequest(f"cannot make {output}: {error.strerror}", field="output") from error
    entries = run_jobs(specs, workers)
    found = standings_of(results_of(entries, size.repetitions), size.looked_at, other)
    write_runs(output, entries, found.results)
    facts = {
        "problems": ", ".join(names),
        "runs of each method on each problem": str(size.repetitions),
        "evaluations of a run": str(size.evaluations),
        "settings": size.settings,
        "seed": str(size.seed),
        "precision of searches on the robot": precision,
        **_versions(specs.values()),
    }
    path = write_report(output, found, entries, facts)
    if as_json:
        document = StandingsView.from_standings(found).model_dump(mode="json")
        print_text(json.dumps({"report": str(path), **document}, indent=2, allow_nan=False))
    else:
        _show(found)
        print_text(str(path))


def _drawn(settings: str) -> Literal["random", "default"]:
    return "random" if settings == "random" else "default"


def _versions(specs: Iterable[TournamentSpec]) -> dict[str, str]:
    """Of gaitswarm and the libraries that took part."""
    from importlib import metadata

    libraries = {name for spec in specs for name in spec.search_libraries}
    return {name: metadata.version(name) for name in ("gaitswarm", *sorted({"numpy"} | libraries))}


def _show(found: Standings) -> None:
    """Mean ranks, and medians of the best at the end of the budget."""
    from gaitswarm.cli.output import stdout_console
    from gaitswarm.cli.tables.fitted import Table

    table = Table(box=None, header_style="bold", pad_edge=False)
    for heading in ("method", "mean rank", "from", "to", *found.by_problem):
        table.add_column(heading, justify="left" if heading == "method" else "right")
    for method, rank in found.mean_ranks.items():
        last = [
            next(s.medians[-1] for s in standings if s.method == method)
            for standings in found.by_problem.values()
        ]
        table.add_row(
            method,
            *(f"{value:.2f}" for value in (rank.value, rank.low, rank.high)),
            *(f"{value:.4g}" for value in last),
        )
    stdout_console().print(table)
