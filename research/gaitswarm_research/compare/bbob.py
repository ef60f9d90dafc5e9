"""`gaitswarm-research bbob`."""

from __future__ import annotations

import csv
import json
import os
from concurrent.futures import ProcessPoolExecutor
from importlib.util import find_spec
from itertools import product
from multiprocessing import get_context
from pathlib import Path
from typing import Annotated, Final, Literal

import numpy as np
import typer
from rich.console import Console
from rich.table import Table

from gaitswarm import InvalidRequest
from gaitswarm_research.compare.coco import FUNCTIONS, SUITES, TARGETS
from gaitswarm_research.compare.problems import problem
from gaitswarm_research.compare.runs import Task, check_method, search, seeds

Suite = Literal["bbob", "bbob-mixint"]

_METHODS: Final = "cma-es,de,pso,catcmawm,cma,optuna-tpe"


def bbob(
    *,
    suite: Annotated[
        Suite, typer.Option(help="bbob-mixint: four in five variables are integers.")
    ] = "bbob",
    dimensions: Annotated[
        str, typer.Option(metavar="D,...", help="Numbers of variables that the suite has.")
    ] = "5,10",
    methods: Annotated[
        str, typer.Option(metavar="NAME,...", help="Methods and rivals to compare.")
    ] = _METHODS,
    instances: Annotated[
        str, typer.Option(metavar="FIRST-LAST", help="Instances of each of the 24 functions.")
    ] = "1-3",
    budget: Annotated[int, typer.Option(min=2, help="Evaluations of each run, per variable.")] = 50,
    seed: Annotated[int, typer.Option(min=0, help="Seed from which all others are drawn.")] = 1,
    output: Annotated[Path, typer.Option("--output", "-o", help="CSV file of the runs.")] = Path(
        "bbob.csv"
    ),
    processes: Annotated[
        int | None, typer.Option(min=1, help="Runs at a time. Default: all processors.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")] = False,
) -> None:
    """Compare search methods on COCO's test functions at small budgets.

    The score is the share of 51 targets that a run reaches, from 100 to 1e-8 above the minimum,
    after half of the budget and at its end.
    """
    plan = tasks(suite, dimensions, methods, instances=instances, budget=budget, seed=seed)
    with ProcessPoolExecutor(processes or os.cpu_count(), get_context("spawn")) as pool:
        scores = list(pool.map(shares, plan, chunksize=8))
    with output.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("problem", "method", "seed", "evaluations", "half", "end"))
        for task, score in zip(plan, scores, strict=True):
            writer.writerow((task.problem, task.method, task.seed, task.evaluations, *score))
    cells: dict[str, dict[str, list[tuple[float, float]]]] = {}
    for task, score in zip(plan, scores, strict=True):
        by_dimension = cells.setdefault(task.method, {})
        by_dimension.setdefault(str(task.evaluations // budget), []).append(score)
    means = {
        method: {d: np.mean(rows, axis=0).round(4).tolist() for d, rows in by_dimension.items()}
        for method, by_dimension in cells.items()
    }
    if as_json:
        typer.echo(json.dumps(means, indent=2))
        return
    table = Table("method", box=None, header_style="bold", pad_edge=False)
    for d, share in product(next(iter(means.values())), (budget / 2, budget)):
        table.add_column(f"d = {d}: {share:g} d", justify="right")
    for method, by_dimension in means.items():
        table.add_row(method, *(f"{x:.3f}" for pair in by_dimension.values() for x in pair))
    Console().print(table)
    typer.echo(f"written: {output}")


def tasks(
    suite: Suite, dimensions: str, methods: str, *, instances: str, budget: int, seed: int
) -> list[Task]:
    """List the runs of a comparison; `budget`: evaluations per variable.

    Raises:
        InvalidRequest: A method, dimension or instance is unknown, or a library is missing.
    """
    if find_spec("cocoex") is None:
        raise InvalidRequest(
            "coco-experiment is not installed: pip install './research[bbob]'", field="suite"
        )
    sizes, names = ([x.strip() for x in text.split(",")] for text in (dimensions, methods))
    for size in sizes:
        if size not in map(str, SUITES[suite]):
            known = ", ".join(map(str, SUITES[suite]))
            raise InvalidRequest(f"{size!r} is not one of {known}", field="dimensions")
    for name in names:
        check_method(name)
    first, _, last = instances.partition("-")
    numbers = [int(text) if text.isdecimal() else 0 for text in (first, last or first)]
    if not 1 <= numbers[0] <= numbers[1] <= 15:
        raise InvalidRequest("must be from 1 to 15, such as 3 or 1-3", field="instances")
    run_seeds = seeds(15, seed)
    return [
        Task(
            f"{suite}_f{function:03}_i{instance:02}_d{int(size):02}",
            name,
            "",
            budget * int(size),
            0,
            run_seeds[instance - 1],
        )
        for name, size, function in product(names, sizes, FUNCTIONS)
        for instance in range(numbers[0], numbers[1] + 1)
    ]


def shares(task: Task) -> tuple[float, float]:
    """Return the shares of targets reached after half of the budget and at its end."""
    case, improvements = problem(task.problem), search(task).improvements
    half, end = (
        min((value for done, value, _ in improvements if done <= most), default=np.inf)
        for most in (task.evaluations // 2, task.evaluations)
    )
    distances = case.final(np.empty((2, 0)), np.array([half, end]))
    first, last = (float(np.mean(distance <= TARGETS)) for distance in distances)
    return first, last
