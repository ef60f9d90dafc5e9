"""Analyses of a job's stored designs."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from gaitswarm.cli.options import (
    ConstraintOption,
    JobId,
    NoConstraints,
    NoWorseThan,
    ScenarioAggregate,
    ScenarioWeight,
    completed_reference,
)
from gaitswarm.cli.output import Parts, Printed, note, replacing
from gaitswarm.cli.tables import MISSING, SHORT, Bold, number, percent, place, table
from gaitswarm.services.optimizer.errors import InvalidRequest

if TYPE_CHECKING:
    from gaitswarm.jobs.base import Jobs
    from gaitswarm.services.optimizer.analysis.failures import FailuresView
    from gaitswarm.services.optimizer.analysis.front import (
        FrontView,
        FrontWinnerView,
        NormalisedDesignView,
    )
    from gaitswarm.services.optimizer.analysis.importance import (
        ImportanceView,
        IndexIntervalView,
        VariableImportanceView,
    )
    from gaitswarm.services.optimizer.analysis.preferences import (
        CandidatePreferencesView,
        PreferenceFitView,
        PreferenceForView,
        RankingView,
    )


def rank(
    job_id: JobId,
    preference: Annotated[str | None, typer.Option(metavar="NAME|JSON")] = None,
    constraint: ConstraintOption = None,
    no_worse_than: NoWorseThan = None,
    no_constraints: NoConstraints = False,
    scenario_weight: ScenarioWeight = None,
    scenario_aggregate: ScenarioAggregate = None,
    top: int = 20,
    *,
    jobs: Jobs,
) -> Printed:
    """Rank a job's stored designs by another preference, other constraints or weights.

    Args:
        preference: A, B, C, chapter-3, or JSON: {"bias": [five or six numbers], "exponent": [as
            many]} [default: the job's].
        top: Number of designs to show.
    """
    from gaitswarm.cli.inputs import constraint_choice, preference_choice, weights_choice

    ranking = jobs.ranking(
        job_id,
        None if preference is None else preference_choice(preference),
        constraints=constraint_choice(constraint, no_worse_than, none=no_constraints),
        scenario_weights=weights_choice(scenario_weight),
        scenario_aggregate=scenario_aggregate,  # type: ignore[arg-type]
        top=top,
    )
    return ranking, _ranking(ranking)


def _ranking(ranking: RankingView) -> Parts:
    columns = [">rank", "before", "design", "fitness", "before"]
    maximized = any(design.figure_of_merit is not None for design in ranking.top)
    rows = (
        (
            *(design.rank, design.rank_before, place(design)),
            *(number(design.fitness), number(design.fitness_before)),
            *([design.figure_of_merit] if maximized else []),
        )
        for design in ranking.top
    )
    yield table(columns + (["F (eq. 3.1)"] if maximized else []), rows)
    infeasible = f", {ranking.infeasible} of them infeasible" if ranking.infeasible else ""
    agreement = MISSING if ranking.correlation is None else f"{ranking.correlation:.3f}"
    yield (
        f"{ranking.evaluations} designs{infeasible}; fitness of the job's best:"
        f" {number(ranking.fitness_of_present_best)}; rank correlation: {agreement}"
    )


def front(
    job_id: JobId,
    output: Annotated[Path | None, typer.Option("--output", "-o", metavar="FILE.csv")] = None,
    most: int = 1000,
    constraint: ConstraintOption = None,
    no_worse_than: NoWorseThan = None,
    no_constraints: NoConstraints = False,
    *,
    jobs: Jobs,
) -> Printed:
    """Show the Pareto front of a job's stored designs, without simulation.

    Lists knees, the best design in each objective, under A, B and C, and under the job's
    preference, and the hypervolume.

    Args:
        output: Also write the front's designs.
        most: Maximum number of designs with --json and --output.
    """
    from gaitswarm.cli.inputs import constraint_choice

    if output is not None and output.suffix != ".csv":
        raise InvalidRequest(f"{output} must end in .csv", field="output")
    constraints = constraint_choice(constraint, no_worse_than, none=no_constraints)
    view = jobs.front(job_id, constraints=constraints, most=most)
    if output is not None:
        with replacing(output, "output") as file:
            file.write(_front_csv(view))
        note(f"{len(view.designs)} designs written to {output}")
    return view, _front(view)


def _front(view: FrontView) -> Parts:
    heads = [f"{SHORT[o.name]}\n{o.unit}" for o in view.objectives]
    rows = (
        (label, place(design), *map(number, design.objectives.values()), number(design.fitness))
        for label, design in _marked(view).items()
    )
    yield table(["", "design", *heads, "fitness"], rows, gap=1)
    error = f" ± {view.hypervolume_error:.4f}" if view.hypervolume_error else ""
    yield (
        f"{view.size} of {view.designs_judged} designs are not dominated; hypervolume"
        f" {view.hypervolume:.4f}{error}; fitness uses the job's preference; all values are"
        " minimized"
    )
    for winner in view.winners:
        if not winner.on_front:
            yield (
                f"the best under {_whose(winner)} is dominated by {winner.dominated_by} designs,"
                f" and behind one in every objective by {100.0 * winner.behind:.2g} %"
            )


def _marked(view: FrontView) -> Mapping[str, NormalisedDesignView]:
    """Return notable designs by label."""
    marked: dict[str, NormalisedDesignView] = {}
    for index, knee in enumerate(view.knees, start=1):
        marked[f"knee {index} ({knee.distance:.2f})"] = knee
    for extreme in view.extremes:
        marked[f"least {extreme.objective.replace('_', ' ')}"] = extreme
    for winner in view.winners:
        dominated = "" if winner.on_front else ", dominated"
        marked[f"best under {_whose(winner)}{dominated}"] = winner
    return marked


def _whose(winner: FrontWinnerView) -> str:
    return "the job's own" if winner.preference == "job" else winner.preference


def _front_csv(view: FrontView) -> bytes:
    """Return a CSV with one row per design: position, marks, fitness, objectives, variables."""
    text = io.StringIO()
    names = [objective.name for objective in view.objectives]
    variables = list(view.designs[0].design) if view.designs else []
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(
        [
            *("iteration", "particle", "marks", "fitness"),
            *names,
            *(f"normalised.{name}" for name in names),
            *(f"design.{name}" for name in variables),
        ]
    )
    for design in view.designs:
        cells: list[Any] = [design.iteration, design.particle, "; ".join(design.marks)]
        cells += [design.fitness, *design.objectives.values(), *design.normalised.values()]
        writer.writerow([*cells, *design.design.values()])
    return text.getvalue().encode()


def importance(job_id: JobId, *, jobs: Jobs) -> Printed:
    """Show which variables of a job matter, from stored designs, without simulation.

    First-order Sobol' indices of the fitness, each objective and failures, with intervals; and
    variables whose best value lies at a bound.
    """
    view = jobs.importance(job_id)
    return view, _importance(view)


def _importance(view: ImportanceView) -> Parts:
    def share(index: IndexIntervalView | None) -> str:
        return MISSING if index is None else f"{100.0 * index.value:.0f}"

    def by_fitness(variable: VariableImportanceView) -> float:
        return -1.0 if variable.fitness is None else -variable.fitness.value

    rows = []
    for variable in sorted(view.variables, key=by_fitness):
        companion = index = ""
        if variable.moved_with is not None:
            companion = f"{variable.moved_with}, {variable.correlation:.2f}"
        if variable.fitness is not None:
            index = f"{100.0 * variable.fitness.low:.0f}–{100.0 * variable.fitness.high:.0f}"
        rows.append(
            (
                *(variable.name, share(variable.fitness), index),
                *(share(variable.objectives[name]) for name in view.objectives),
                *(share(variable.failing), companion or MISSING),
            )
        )
    objectives = [SHORT[name] for name in view.objectives]
    heads = ["variable", "fitness\n%", "95 %", *objectives, "failing", "<moved with"]
    yield table(heads, rows, gap=1)
    yield from _importance_lines(view)


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


def verdict(
    job_id: JobId,
    against: Annotated[
        str | None,
        typer.Option(
            metavar="published:NAME|ID|FILE.json",
            callback=completed_reference,
            help="Compare with this published design, a job's best, or a design of a file.",
        ),
    ] = None,
    *,
    jobs: Jobs,
) -> Printed:
    """Compare a job's best design with the published, the start or another one, by scenario."""
    from gaitswarm.cli.inputs import reference_choice
    from gaitswarm.cli.tables import verdict_lines, verdict_table

    reference = None if against is None else reference_choice(against, "against")
    if isinstance(reference, dict):
        reference = json.dumps(reference)
    view = jobs.verdict(job_id, against=reference)
    tables = [verdict_table(view)] if view.quantities else []
    return view, [*tables, *verdict_lines(view, jobs.place)]


def failures(job_id: JobId, *, jobs: Jobs) -> Printed:
    """Show why designs of a job failed, by scenario, without simulation."""
    view = jobs.failures(job_id)
    return view, _failures(view)


def _failures(view: FailuresView) -> Parts:
    rows = (
        (
            *(case.case, case.failed, case.alone),
            *(ended.status, ended.designs, place(ended), ended.reason),
        )
        for case in view.cases
        for ended in case.statuses
    )
    if view.cases:
        heads = ["scenario", "failed", "in it\nalone", "<status", "designs", "latest", "<reason"]
        yield table(heads, rows, gap=1)
    recent = "" if view.recent is None else f"; {percent(view.recent, 2)} % of the latest quarter"
    yield f"{view.failed} of {view.designs} designs failed in at least one scenario{recent}"


def preferences(
    job_id: JobId,
    for_design: Annotated[str | None, typer.Option("--for", metavar="ITERATION.DESIGN")] = None,
    *,
    search: bool = False,
    jobs: Jobs,
) -> Printed:
    """Show what each preference of a search buys (thesis 4.5, 4.6), or submit such a search.

    A search judges the optimum of each preference by its robustness and its evenness over the
    scenarios. With --for, finds the preference that makes a design the best.

    Args:
        for_design: Find the preference under which this design of a tuning job wins, without
            simulation.
        search: Submit a search for preferences around a tuning job; it judges the design that is
            optimal under each.
    """
    from gaitswarm.services.optimizer.analysis.utilities import tuning_spec
    from gaitswarm.services.optimizer.jobs.kinds.preferences import search_document
    from gaitswarm.settings import read_place

    if for_design is not None:
        iteration, particle = read_place(for_design, field="for")
        fits = jobs.preference_for(job_id, iteration, particle)
        return fits, _fits(fits)
    if search:
        tuned = tuning_spec(job_id, jobs.job(job_id).spec, "preferences")
        submitted = jobs.submit(search_document(job_id, tuned))
        command = f"gaitswarm preferences {submitted.id}{jobs.place}"
        return submitted, iter([f"job {submitted.id}; to see its preferences, run\n  {command}"])
    view = jobs.preferences(job_id)
    return view, _candidates(view)


_BOUGHT: Final = ("torque", "acceleration", "angular_acceleration", "energy", "speed", "slowest")


def _candidates(view: CandidatePreferencesView) -> Parts:
    rows = [
        [
            *("reference", *[MISSING] * 5),
            *(number(view.reference_figures[name], 3) for name in _BOUGHT),
        ]
    ]
    for c in view.candidates:
        cells = [
            c.named or place(c),
            *(number(value, 3) for value in (c.fitness, c.sensitivity)),
            *(percent(c.failures, 2), number(c.risk, 3), number(c.unevenness, 3)),
            *(f"{100.0 * c.changes[name]:+.0f} %" for name in _BOUGHT),
        ]
        rows.append(Bold(cells) if c.recommended else cells)
    criteria = ("factor", "index", "failed %", "risk", "uneven")
    figures = ("torque\nN m", "accel.\nm/s2", "ang.acc.\nrad/s2", "energy\nJ/m", "speed\nm/s")
    yield table(["preference", *criteria, *figures, "slowest\nm/s"], rows, gap=1)
    first = view.candidates[0]
    yield f"recommended: {first.preference.model_dump_json()}"
    yield (
        f"factor: by which objectives may get worse, exp(0.05 index) risk uneven / (1 - failed)\n"
        f"index: sensitivity to the variables, from {view.samples} designs around the optimum\n"
        f"failed, risk: in {view.worlds} held-out worlds; uneven: over the scenarios"
    )


def _fits(view: PreferenceForView) -> Parts:
    rows = (
        (
            ", ".join("the job" if owner == "job" else owner for owner in fit.biases_of),
            fit.rank,
            percent(fit.margin, 3),
            MISSING if fit.rival is None else place(fit.rival),
            " ".join(number(value, 3) for value in fit.preference.bias),
            " ".join(number(value) for value in fit.preference.exponent),
        )
        for fit in view.fits
    )
    heads = ("rank", "margin %", "rival", "bias", "exponent")
    yield table(["biases of", *(f"<{head}" for head in heads)], rows)
    yield _verdict(view)


def _verdict(view: PreferenceForView) -> str:
    chosen, best = place(view.chosen), view.fits[0]
    if view.wins:
        return f"design {chosen} wins{_by(best)} under {best.preference.model_dump_json()}"
    tried = "" if view.certain else " that were tried"
    dominated = "" if view.on_front else ", which is dominated"
    rival = "another" if best.rival is None else place(best.rival)
    return (
        f"no exponents{tried} with these biases make design {chosen} win{dominated}; under"
        f" {best.preference.model_dump_json()} it has rank {best.rank}, and {rival} is better"
        f"{_by(best)}"
    )


def _by(fit: PreferenceFitView) -> str:
    return "" if fit.margin is None else f" by {100.0 * abs(fit.margin):.3g} %"
