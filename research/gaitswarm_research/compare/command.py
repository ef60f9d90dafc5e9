"""`gaitswarm-research compare`."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final, Literal

import typer
from rich.console import Console

from gaitswarm import InvalidRequest
from gaitswarm_research.compare.functions import FUNCTIONS
from gaitswarm_research.compare.rivals import RIVALS
from gaitswarm_research.compare.runs import Run, Task

Preset = Literal["small", "thesis", "robot"]

THESIS: Final = (
    *("ga", "pso", "pso-ps", "gsa", "sa", "ps", "tlbo", "dts"),
    *("global-unirandi", "global-nelder-mead", "global-bfgs"),
)
"""The methods of section 3.2.1."""


@dataclass(frozen=True, slots=True)
class Plan:
    """Defaults of a preset: problems with budgets, methods, repetitions, settings."""

    problems: dict[str, int]
    methods: tuple[str, ...]
    repetitions: int
    random_settings: bool = False


PLANS: Final[dict[str, Plan]] = {
    "small": Plan(
        {"D4C0R0I1": 625, "D7C1R1I0": 625, "D7C0R0I1": 625, "chapter-4.A": 100},
        (*THESIS, "cma-es", "de", "random"),
        3,
    ),
    "thesis": Plan(dict.fromkeys(FUNCTIONS, 2500), (*THESIS, "cma-es", "de"), 100, True),
    "robot": Plan(
        {
            **{f"chapter-4.{name}": 625 for name in "ABC"},
            **{f"chapter-3.{name}": 625 for name in ("pi", "fuzzy-pi")},
        },
        (*THESIS, "pso-falling-inertia", "nelder-mead", "mads", "cma-es", "de", "random", *RIVALS),
        20,
    ),
}


def compare(
    preset: Annotated[
        Preset,
        typer.Argument(
            help="small: three functions and one walking job. thesis: the sixteen functions of"
            " 3.2.1, settings drawn at random. robot: the jobs of chapters 4 and 3, with rivals.",
        ),
    ] = "small",
    *,
    methods: Annotated[
        str | None, typer.Option(metavar="NAME,...", help="Methods and rivals to compare.")
    ] = None,
    problems: Annotated[
        str | None, typer.Option(metavar="NAME,...", help="Test functions and walking jobs.")
    ] = None,
    repetitions: Annotated[
        int | None, typer.Option(min=1, help="Runs of each method on each problem.")
    ] = None,
    evaluations: Annotated[
        int | None,
        typer.Option(help="Budget of each run: 25, 50, 100, 250, 625, 1250, 2500, 5000."),
    ] = None,
    settings: Annotated[
        Literal["default", "random"] | None,
        typer.Option(help="Whether settings are drawn for every run. Default: the preset's."),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed from which all others are drawn.")] = 1,
    output: Annotated[
        Path, typer.Option("--output", "-o", help="Folder of runs.csv, summary and picture.")
    ] = Path("comparison"),
    read: Annotated[
        list[Path] | None,
        typer.Option(metavar="FILE", help="Report recorded runs and run nothing; repeatable."),
    ] = None,
    processes: Annotated[
        int | None, typer.Option(min=1, help="Runs at a time. Default: all processors.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")] = False,
) -> None:
    """Compare search methods on test functions and walking jobs.

    Every run is appended to runs.csv of the output folder. The same command resumes an interrupted
    comparison; more methods or repetitions run only what is missing.
    """
    import json

    from gaitswarm_research.compare import report
    from gaitswarm_research.compare import runs as running
    from gaitswarm_research.compare.statistics import grouped, summarize

    if read:
        found = list(running.read(read))
        if methods is not None:
            found = [run for run in found if run.task.method in _names(methods)]
        if problems is not None:
            found = [run for run in found if run.task.problem in _names(problems)]
    else:
        plan = PLANS[preset]
        budgets = {
            name: evaluations or plan.problems.get(name, 625)
            for name in (_names(problems) if problems else plan.problems)
        }
        tasks = [
            task
            for name, budget in budgets.items()
            for task in running.tasks(
                _names(methods) if methods else plan.methods,
                [name],
                repetitions=repetitions or plan.repetitions,
                evaluations=budget,
                seed=seed,
                random_settings=plan.random_settings if settings is None else settings == "random",
            )
        ]
        found = _execute(tasks, output, processes or os.cpu_count() or 1)
    groups = grouped(found)
    if not groups or not next(iter(groups.values())):
        raise InvalidRequest("no method has runs on all problems", field="methods")
    summary = summarize(groups)
    written = report.write(summary, groups, output)
    if as_json:
        typer.echo(json.dumps(report.document(summary), indent=2, allow_nan=False))
        return
    report.print_table(summary, Console())
    typer.echo(f"written: {', '.join(map(str, written))}")


def _execute(tasks: list[Task], output: Path, processes: int) -> list[Run]:
    from rich.progress import Progress

    from gaitswarm_research.compare.runs import execute_missing

    console = Console(stderr=True, highlight=False)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as progress:
        bar = progress.add_task("runs", total=None)
        try:
            return execute_missing(
                tasks,
                output / "runs.csv",
                processes=processes,
                progress=lambda _: progress.advance(bar),
            )
        except KeyboardInterrupt:
            console.print("interrupted; the same command resumes")
            raise


def _names(text: str) -> list[str]:
    return [name.strip() for name in text.split(",") if name.strip()]
