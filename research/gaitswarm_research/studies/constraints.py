"""Constrained search of controller and gait, by gaitswarm and by Optuna."""

from __future__ import annotations

import json
import tempfile
import warnings
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from statistics import median
from typing import Annotated, Any, Final

import numpy as np
import typer
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

import gaitswarm
from gaitswarm import CONTROLLERS, OBJECTIVES, JobSpec, NotFound, optimize, simulate
from gaitswarm_research import options

Floats = NDArray[np.float64]

PUBLISHED: Final = "A"
LIMITED: Final = [objective.name for objective in OBJECTIVES[:5]]
"""Objectives that the constraints limit, f1 to f5."""

_FAILED: Final = 1e6
"""Fitness and constraints of a failed simulation."""


def problem(evaluations: int, seed: int) -> JobSpec:
    """Return the job that both sides are given, with the default search."""
    spec = JobSpec.model_validate(
        {
            "name": f"constrained, seed {seed}",
            "constraints": [{"quantity": "*", "relative_to": f"published:{PUBLISHED}", "max": 1.0}],
            "iterations": evaluations // 25,
            "seed": seed,
        }
    )
    return spec.with_gait_searched()


def start_designs(spec: JobSpec) -> list[dict[str, Any]]:
    """Return the designs from which the job starts, those nearest to its references."""
    with tempfile.TemporaryDirectory() as folder, gaitswarm.open(Path(folder, "job.db")) as jobs:
        started = jobs.submit(spec).spec.start
        return [dict(design) for design in started if isinstance(design, dict)]


def by_gaitswarm(evaluations: int, seed: int) -> float | None:
    """Return the fitness of the best feasible design; None if no design is feasible."""
    with tempfile.TemporaryDirectory() as folder:
        run = optimize(problem(evaluations, seed), db=Path(folder, "job.db"))
        try:
            return run.best.fitness
        except NotFound:
            return None


def by_optuna(evaluations: int, seed: int) -> float | None:
    """Search by Optuna's default sampler with its constraints, one for each objective.

    A constraint is the greatest ratio to the published design over the scenarios, less one. Both
    searches begin with the same designs.
    """
    optuna = import_module("optuna")
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    spec = problem(evaluations, seed)
    published = simulate(dict(CONTROLLERS["fuzzy-pi"].published[PUBLISHED]))
    limits = published.objectives[0, :, :5]
    best: list[float] = []

    def objective(trial: Any) -> float:
        chosen = {
            v.name: trial.suggest_int(v.name, int(v.low), int(v.high))
            if v.kind == "integer"
            else trial.suggest_float(v.name, v.low, v.high)
            for v in spec.design_space().variables
        }
        result = simulate(chosen)
        fitness = float(result.fitness[0])
        excess = (result.objectives[0, :, :5] / limits - 1.0).max(axis=0)
        for name, value in zip(LIMITED, np.nan_to_num(excess, nan=_FAILED), strict=True):
            trial.set_constraint(name, float(value))
        if np.isfinite(fitness) and (excess <= 0.0).all():
            best.append(fitness)
        return fitness if np.isfinite(fitness) else _FAILED

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
        study = optuna.create_study(sampler=optuna.samplers.TPESampler(seed=seed))
        for design in start_designs(spec):
            study.enqueue_trial(design)
        study.optimize(objective, n_trials=evaluations)
    return min(best, default=None)


SEARCHES: Final[dict[str, Callable[[int, int], float | None]]] = {
    "gaitswarm": by_gaitswarm,
    "optuna-tpe": by_optuna,
}


def constraints(
    *,
    evaluations: Annotated[int, typer.Option(min=25, help="Designs of a search.")] = 625,
    seeds: Annotated[int, typer.Option(min=1, help="Searches of each kind.")] = 5,
    as_json: options.Json = False,
) -> None:
    """Search controller and gait under constraints, by gaitswarm and by Optuna.

    No objective may be worse than that of published A in any of the six scenarios.
    """
    found = {
        name: [search(evaluations, seed) for seed in range(1, seeds + 1)]
        for name, search in SEARCHES.items()
    }
    if as_json:
        typer.echo(json.dumps({"evaluations": evaluations, "fitness": found}, indent=2))
        return
    table = Table("search", "feasible", "fitness: median", "best", "worst")
    for name, values in found.items():
        feasible = [value for value in values if value is not None]
        cells = ["", "", ""]
        if feasible:
            numbers = (median(feasible), min(feasible), max(feasible))
            cells = [f"{number:.2f}" for number in numbers]
        table.add_row(name, f"{len(feasible)} of {len(values)}", *cells)
    Console().print(table)
