"""What recorded runs come to: medians, tests against a method, correlation of ranks."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from benchmarks.races.plans import CHECKPOINTS, Plan
from benchmarks.races.records import Record
from gaitswarm.services.optimizer.analysis.statistics import (
    Interval,
    average_ranks,
    percentile_interval,
    spearman,
)
from gaitswarm.services.optimizer.analysis.tournaments.tournament import (
    Results,
    Runs,
    ranks,
)

MEASURE: Final = "cma-es"
"""The default, which all others are compared with."""

_RESAMPLES: Final = 2000


def results_of(
    records: Iterable[Record], problems: Sequence[str], evaluations: int
) -> dict[str, dict[str, Runs]]:
    """Runs of one budget, by problem, then by method, as a tournament has them.

    Args:
        records: Any.
        problems: Names of those that are wanted.
        evaluations: Budget of the runs that are wanted.

    Returns:
        Problems and methods of which there is a run; methods in order of their names.
    """
    mine = [r for r in records if r.evaluations == evaluations and r.problem in problems]
    methods = sorted({r.method for r in mine})
    found: dict[str, dict[str, Runs]] = {}
    for problem in problems:
        known = Plan((MEASURE,), (problem,), 1, evaluations).spec(MEASURE, problem).problems[0]
        for method in methods:
            rows = [r for r in mine if (r.problem, r.method) == (problem, method)]
            if rows:
                runs = _runs(rows, evaluations, known.space.dimension, known.target)
                found.setdefault(problem, {})[method] = runs
    return found


def probability(runs: Runs, measure: Runs) -> float:
    """Of a difference as great as between two methods' last values, if there were none.

    Two-sided, by the test of Mann and Whitney; exact for few runs without ties.
    """
    from scipy.stats import mannwhitneyu  # noqa: PLC0415 - slow to import

    return float(mannwhitneyu(runs.final, measure.final, alternative="two-sided").pvalue)


@dataclass(frozen=True, slots=True)
class Medians:
    """What a method came to on several problems.

    Attributes:
        runs: Of each problem that it was raced on; the fewest.
        by_problem: Medians after some evaluations, by problem.
    """

    runs: int
    by_problem: Mapping[str, tuple[float, ...]]


def in_order(medians: Mapping[str, Medians]) -> list[str]:
    """Methods as tables have them: by their last medians over the least of all, multiplied up.

    Args:
        medians: By method, each on one problem at least.

    Returns:
        The names; of a method that was raced on some problems alone, these count.
    """
    least: dict[str, float] = {}
    for of_method in medians.values():
        for problem, values in of_method.by_problem.items():
            least[problem] = min(values[-1], least.get(problem, math.inf))

    def level(method: str) -> float:
        lasts = medians[method].by_problem.items()
        return sum(math.log(values[-1] / least[problem]) for problem, values in lasts) / len(lasts)

    return sorted(medians, key=level)


def medians_of(results: Results, checkpoints: Sequence[int]) -> dict[str, Medians]:
    """Medians of every method after some evaluations.

    Args:
        results: Runs by problem, then by method.
        checkpoints: Evaluations.

    Returns:
        By method; the lower one of two middle runs.
    """
    runs: dict[str, int] = {}
    found: dict[str, dict[str, tuple[float, ...]]] = {}
    for problem, by_method in results.items():
        for method, of in by_method.items():
            runs[method] = min(len(of), runs.get(method, len(of)))
            medians = tuple(of.median_after(count) for count in checkpoints)
            found.setdefault(method, {})[problem] = medians
    return {method: Medians(runs[method], of) for method, of in found.items()}


def read_medians(path: Path, checkpoints: Sequence[int]) -> dict[str, Medians]:
    """Medians of runs that were not kept, from a CSV file with a column for each checkpoint.

    Args:
        path: Of the file.
        checkpoints: Evaluations.

    Returns:
        By method.
    """
    found: dict[str, Medians] = {}
    with path.open(newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            medians = tuple(float(row[str(count)]) for count in checkpoints)
            before = found.get(row["method"], Medians(int(row["runs"]), {}))
            found[row["method"]] = replace(
                before, by_problem={**before.by_problem, row["problem"]: medians}
            )
    return found


def with_more_runs(one: Mapping[str, Medians], other: Mapping[str, Medians]) -> dict[str, Medians]:
    """Of every method the medians of more runs; those of `one` where there are as many."""
    return {**one, **{m: v for m, v in other.items() if m not in one or v.runs > one[m].runs}}


@dataclass(frozen=True, slots=True)
class Correlation:
    """Spearman's correlation of the order of methods on a function with that on the robot.

    Attributes:
        methods: How many are on both.
        value: The correlation, with an interval of resampled methods: what it would be with
            other methods. How sure the place of each one is has no part.
    """

    methods: int
    value: Interval


def correlation(
    function: Mapping[str, Runs],
    robot: Mapping[str, Medians],
    problems: Sequence[str],
    checkpoint: int,
) -> Correlation:
    """How well the ranking on a function tells that on the robot.

    Args:
        function: Runs by method: ranked by when they reached the target, else by their best.
        robot: Medians by method: ranked on each problem, the places averaged.
        problems: Of the robot.
        checkpoint: Which of the medians.

    Returns:
        Of the methods on the function and on all of these problems.
    """
    methods = [m for m in function if m in robot and robot[m].by_problem.keys() >= set(problems)]
    there = ranks({m: function[m] for m in methods})
    here = np.zeros(len(methods))
    for problem in problems:
        values = np.array([robot[m].by_problem[problem][checkpoint] for m in methods])
        here += average_ranks(values)
    both = np.stack([there, here])
    picks = np.random.default_rng(1).integers(len(methods), size=(_RESAMPLES, len(methods)))
    resampled = np.array([spearman(*both[:, pick]) for pick in picks])
    return Correlation(len(methods), percentile_interval(spearman(*both), resampled))


def _runs(rows: Sequence[Record], evaluations: int, dimension: int, target: float | None) -> Runs:
    kept = [k for k, count in enumerate(CHECKPOINTS) if count <= evaluations]
    return Runs(
        checkpoints=np.array([CHECKPOINTS[k] for k in kept]),
        best=np.array([[row.best[k] for k in kept] for row in rows]),
        to_best=np.array([row.to_best for row in rows]),
        to_target=np.array([row.to_target for row in rows]),
        dimension=dimension,
        target=target,
    )
