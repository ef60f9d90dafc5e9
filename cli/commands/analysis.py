"""Analyses of a job's stored designs."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer

from gaitswarm.cli.commands.robustness import Radius, Samples, Seed
from gaitswarm.cli.inputs.options import Db, JobId, Json, Precision, Server

if TYPE_CHECKING:
    from gaitswarm.cli.front import Placed
    from gaitswarm.jobs.base import Jobs
    from gaitswarm.services.optimizer.analysis.preferences import RobustPreferencesView
    from gaitswarm.sim.kernel.walk import Precision as PhysicsPrecision
    from gaitswarm.views import RankingRequest, RankingView
    from gaitswarm.views.analysis import (
        ImportanceView,
        IndexIntervalView,
        LossView,
        ScenarioFamiliesView,
        VariableImportanceView,
    )


def register(app: typer.Typer) -> None:
    """Add the commands."""
    app.command()(rank)
    app.command()(front)
    app.command()(importance)
    app.command()(scenarios)
    app.command()(preferences)


def rank(
    job_id: JobId,
    preference: Annotated[
        str,
        typer.Option(
            metavar="NAME|JSON",
            help='A, B, C, chapter-3, or JSON: {"bias": [five or six numbers], "exponent": [as'
            " many]}.",
        ),
    ],
    top: Annotated[int, typer.Option(help="Number of designs to show.")] = 20,
    server: Server = None,
    db: Db = None,
    as_json: Json = False,
) -> None:
    """Rank a job's stored designs by another preference, without simulation."""
    from gaitswarm.cli.output import print_json
    from gaitswarm.jobs.open import open_jobs

    request = _ranking_request(preference, top)
    with open_jobs(server, db) as jobs:
        ranking = jobs.ranking(job_id, request.preference, top=request.top)
    if as_json:
        print_json(ranking)
    else:
        _print_ranking(ranking)


def _ranking_request(preference: str, top: int) -> RankingRequest:
    from pydantic import ValidationError

    from gaitswarm.cli.inputs.spec_file import preference_choice
    from gaitswarm.errors import invalid_request
    from gaitswarm.views import RankingRequest

    data = {"preference": preference_choice(preference), "top": top}
    try:
        return RankingRequest.model_validate(data)
    except ValidationError as error:
        raise invalid_request(error) from error


def _print_ranking(ranking: RankingView) -> None:
    from gaitswarm.cli.output import stdout_console
    from gaitswarm.cli.tables import MISSING, number, ranking_table

    console = stdout_console()
    console.print(ranking_table(ranking))
    agreement = MISSING if ranking.correlation is None else f"{ranking.correlation:.3f}"
    console.print(
        f"{ranking.evaluations} designs; fitness of the job's best:"
        f" {number(ranking.fitness_of_present_best)}; rank correlation: {agreement}",
        markup=False,
    )


def front(
    job_id: JobId,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE.csv", help="Also write the front's designs."),
    ] = None,
    most: Annotated[
        int, typer.Option(help="Maximum number of designs with --json and --output.")
    ] = 1000,
    published: Annotated[
        bool,
        typer.Option(help="Also simulate the controller's published designs and place them."),
    ] = False,
    server: Server = None,
    db: Db = None,
    as_json: Json = False,
) -> None:
    """Show the Pareto front of a job's stored designs, without simulation.

    Lists knees, the best design in each objective, under A, B and C, and under the job's
    preference, and the hypervolume.
    """
    from gaitswarm.cli.files import replacing
    from gaitswarm.cli.front import front_csv, marked_table, placed_lines, summary
    from gaitswarm.cli.output import note, print_json, stdout_console
    from gaitswarm.jobs.open import open_jobs
    from gaitswarm.services.optimizer.errors import InvalidRequest

    if output is not None and output.suffix != ".csv":
        raise InvalidRequest(f"{output} must end in .csv", field="output")
    if published and as_json:
        raise InvalidRequest("cannot be combined with --json", field="published")
    with open_jobs(server, db) as jobs:
        view = jobs.front(job_id, most=most)
        placed = _place_published(jobs, job_id) if published else {}
    if output is not None:
        with replacing(output, "output") as file:
            file.write(front_csv(view))
        note(f"{len(view.designs)} designs written to {output}")
    if as_json:
        print_json(view)
        return
    console = stdout_console()
    console.print(marked_table(view))
    for line in (*summary(view), *placed_lines(placed)):
        console.print(line, markup=False)


def _place_published(jobs: Jobs, job_id: str) -> dict[str, Placed]:
    """Place the published designs with respect to the front."""
    from gaitswarm.cli.comparison import published_walk
    from gaitswarm.cli.front import placed
    from gaitswarm.services.optimizer.errors import InvalidRequest
    from gaitswarm.services.optimizer.jobs.kinds.tuning import JobSpec
    from gaitswarm.sim.controllers import CONTROLLERS

    spec, view = jobs.job(job_id).spec, jobs.front(job_id, most=10_000)
    if not isinstance(spec, JobSpec) or spec.worlds is not None:
        raise InvalidRequest(
            "a job with worlds cannot be compared with published designs", field="published"
        )
    names = CONTROLLERS[spec.controller].published
    return {name: placed(published_walk(spec, name), view) for name in names}


def importance(job_id: JobId, server: Server = None, db: Db = None, as_json: Json = False) -> None:
    """Show which variables of a job matter, from stored designs, without simulation.

    First-order Sobol' indices of the fitness, each objective and failures, with intervals; and
    variables whose best value lies at a bound.
    """
    from gaitswarm.cli.output import print_json
    from gaitswarm.jobs.open import open_jobs

    with open_jobs(server, db) as jobs:
        view = jobs.importance(job_id)
    if as_json:
        print_json(view)
    else:
        _print_importance(view)


def _print_importance(view: ImportanceView) -> None:
    from gaitswarm.cli.output import stdout_console
    from gaitswarm.cli.tables import MISSING, SHORT, Table

    table = Table(box=None, padding=(0, 1, 0, 0))
    table.add_column("variable", no_wrap=True)
    for head in ("fitness\n%", "95 %", *(SHORT[name] for name in view.objectives), "failing"):
        table.add_column(head, justify="right", no_wrap=True)
    table.add_column("moved with", no_wrap=True)
    for variable in sorted(view.variables, key=_by_fitness):
        companion = MISSING
        if variable.moved_with is not None:
            companion = f"{variable.moved_with}, {variable.correlation:.2f}"
        table.add_row(
            variable.name,
            _index_percent(variable.fitness),
            _index_interval(variable.fitness),
            *(_index_percent(variable.objectives[name]) for name in view.objectives),
            _index_percent(variable.failing),
            companion,
        )
    console = stdout_console()
    console.print(table)
    for line in _importance_lines(view):
        console.print(line, markup=False, highlight=False)


def _by_fitness(variable: VariableImportanceView) -> float:
    return -1.0 if variable.fitness is None else -variable.fitness.value


def _importance_lines(view: ImportanceView) -> Iterator[str]:
    from gaitswarm.services.optimizer.analysis.importance import LEAST_DESIGNS

    if view.designs < LEAST_DESIGNS:
        yield (
            f"indices need {LEAST_DESIGNS} designs that succeed in every case, and the job has"
            f" {view.designs}: add some by `gaitswarm extend`"
        )
    yield (
        "share of the variance of ranks explained by each variable alone, among"
        f" {view.sampled} designs; {view.failed} of all {view.designs + view.failed} failed;"
        " correlated variables share it"
    )
    for variable in view.variables:
        if variable.at is None:
            continue
        bound = variable.low if variable.at == "low" else variable.high
        wider = variable.widened
        advice = "no wider bound can be simulated"
        if wider is not None:
            advice = f"widen it to {wider.low:g} to {wider.high:g} and run again"
        unit = "" if variable.unit == "1" else f" {variable.unit}"
        yield (
            f"{variable.name}: the best design lies at the {variable.at} bound {bound:g}{unit};"
            f" {advice}"
        )


def _index_percent(index: IndexIntervalView | None) -> str:
    return "–" if index is None else f"{100.0 * index.value:.0f}"


def _index_interval(index: IndexIntervalView | None) -> str:
    return "" if index is None else f"{100.0 * index.low:.0f}–{100.0 * index.high:.0f}"


def scenarios(
    job_id: JobId,
    tolerance: Annotated[
        float, typer.Option(help="Largest accepted regret of a subset of scenarios, as a share.")
    ] = 0.01,
    server: Server = None,
    db: Db = None,
    as_json: Json = False,
) -> None:
    """Show which scenarios of a job matter, from stored designs, without simulation.

    Compares the job's best with those by subsets of its scenarios. A search with fewer scenarios
    visits other designs, so confirm the result by a job.
    """
    from gaitswarm.cli.output import print_json
    from gaitswarm.jobs.open import open_jobs

    with open_jobs(server, db) as jobs:
        view = jobs.scenarios(job_id, tolerance=tolerance)
    if as_json:
        print_json(view)
    else:
        _print_families(view)


def _print_families(view: ScenarioFamiliesView) -> None:
    from gaitswarm.cli.output import stdout_console
    from gaitswarm.cli.tables import MISSING, Table, number

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
            _loss_percent(left.family.regret),
            _loss_percent(left.loss),
            similar,
        )
    sizes = Table(title="Families", title_justify="left", box=None, padding=(0, 2, 0, 0))
    for head in ("scenarios", "families", "median regret %", "worst %", "within tolerance"):
        sizes.add_column(head, justify="right")
    for size in view.sizes:
        shares = [_loss_share(size.median), _loss_share(size.worst)]
        sizes.add_row(str(size.size), str(size.families), *shares, str(size.within))
    console = stdout_console()
    console.print(without)
    console.print(sizes)
    smallest = view.smallest
    subset = (
        "none"
        if smallest is None
        else f"{', '.join(smallest.scenarios)}; regret {_loss_percent(smallest.regret)} %"
    )
    console.print(
        f"{view.designs} designs walk in all scenarios; smallest family within"
        f" {100.0 * view.tolerance:g} %: {subset}",
        markup=False,
    )


def _loss_percent(loss: LossView) -> str:
    return f"{_loss_share(loss.value)} ({_loss_share(loss.low)}–{_loss_share(loss.high)})"


def _loss_share(value: float | None) -> str:
    return "fails" if value is None else f"{100.0 * value:.1f}"


def preferences(
    job_id: JobId,
    drawn: Annotated[int, typer.Option(help="Preferences to sample besides A, B and C.")] = 512,
    candidates: Annotated[
        int, typer.Option(help="Winners to simulate, besides those of A, B and C.")
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
            help="Instead, find the preference under which this design of the job wins, without"
            " simulation.",
        ),
    ] = None,
    server: Server = None,
    db: Db = None,
    as_json: Json = False,
) -> None:
    """Find preferences whose winner among a job's designs is robust (thesis 4.5).

    Ranks stored designs under many preferences, and estimates the robustness index of the winners
    by simulation. With --for, finds the preference that makes a design the best.
    """
    if for_design is not None:
        _find_preference(job_id, for_design, server=server, db=db, as_json=as_json)
        return
    from gaitswarm.cli.commands.robustness import shown_progress
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
        _print_preferences(view)


def _find_preference(
    job_id: str, for_design: str, *, server: str | None, db: str | None, as_json: bool
) -> None:
    from gaitswarm.cli.front import fits_table, verdict
    from gaitswarm.cli.output import print_json, stdout_console
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


def _print_preferences(view: RobustPreferencesView) -> None:
    from gaitswarm.cli.output import stdout_console
    from gaitswarm.cli.tables import MISSING, Table, number
    from gaitswarm.settings import place_of

    table = Table(box=None, padding=(0, 2, 0, 0))
    heads = ("design", "index", "95 %", "wins under", "fitness", "loss %", "bias", "exponent")
    for head in heads:
        table.add_column(head, no_wrap=head not in ("bias", "exponent"))
    for candidate in view.candidates:
        index = candidate.index
        share = f"{100.0 * candidate.share:.0f} %"
        table.add_row(
            place_of(candidate.iteration, candidate.particle),
            number(None if index is None else index.value, 3),
            MISSING if index is None else f"{number(index.low, 3)}–{number(index.high, 3)}",
            ", ".join([*candidate.named, share]),
            number(candidate.fitness),
            number(None if candidate.loss is None else 100.0 * candidate.loss, 2),
            " ".join(number(value, 2) for value in candidate.preference.bias),
            " ".join(number(value, 2) for value in candidate.preference.exponent),
        )
    console = stdout_console()
    console.print(table)
    console.print(
        f"{view.winners} designs of the job win under A, B, C or any of {view.drawn} sampled"
        " preferences; smaller indices are more robust; fitness and loss use the job's preference",
        markup=False,
    )
