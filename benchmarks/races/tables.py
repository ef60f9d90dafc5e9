"""The tables of docs/optimizers.md, from recorded runs."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from benchmarks.races.plans import BETWEEN, CHAPTER_3, FUNCTION, PLANS, ROBOT
from benchmarks.races.records import EARLIER, Record
from benchmarks.races.statistics import (
    MEASURE,
    Medians,
    correlation,
    in_order,
    medians_of,
    probability,
    read_medians,
    results_of,
    with_more_runs,
)
from gaitswarm.services.optimizer.analysis.tournaments.tournament import Results, Runs
from gaitswarm.services.optimizer.search.registry import OPTIMIZERS

_BUDGET: Final = 625
_LOOKED_AT: Final = (100, 250, 625)
_LONG: Final = PLANS["chapter-4-long"].evaluations
_CALLS: Final = PLANS["function"].evaluations

_LARGE: Final = 1000.0
"""Values from here on are shown without decimals."""

_SMALL_P: Final = 0.01

_ENOUGH: Final = 4
"""Runs of which medians, quartiles and tests are reported."""


def all_tables(records: Iterable[Record], earlier: Path = EARLIER) -> list[str]:
    """Every table for which there are runs, as Markdown, in the order of the document.

    Args:
        records: Runs.
        earlier: File of medians of runs on the robot that were not kept.

    Returns:
        The tables.
    """
    records = list(records)
    robot = results_of(records, ROBOT, _BUDGET)
    function = results_of(records, FUNCTION, _CALLS)
    known = with_more_runs(medians_of(robot, _LOOKED_AT), read_medians(earlier, _LOOKED_AT))
    sure = {method: medians for method, medians in known.items() if medians.runs >= _ENOUGH}
    found = [medians_table(sure, ROBOT, _LOOKED_AT)]
    if few := [method for method in known if method not in sure]:
        found.append(few_runs_table(robot, few))
    found += spread_table(robot)
    for problems, budget, looked_at in (
        (ROBOT, _LONG, (625, 1250, 2500)),
        (CHAPTER_3, _BUDGET, _LOOKED_AT),
        (BETWEEN, _BUDGET, _LOOKED_AT),
    ):
        if results := results_of(records, problems, budget):
            found.append(medians_table(medians_of(results, looked_at), problems, looked_at))
            found += spread_table(results)
    if function:
        found.append(calls_table(function[FUNCTION[0]]))
        found.append(correlation_table(function[FUNCTION[0]], sure, known))
    return found


def medians_table(
    medians: Mapping[str, Medians], problems: Sequence[str], checkpoints: Sequence[int]
) -> str:
    """Medians after some evaluations on every problem; the least of a column is bold."""
    methods = in_order(medians)
    head = ["method", "runs"]
    columns = [[shown(m) for m in methods], [str(medians[m].runs) for m in methods]]
    for problem in problems:
        for k, count in enumerate(checkpoints):
            head.append(str(count) if k else f"{_short(problem)}: {count}")
            of = [medians[m].by_problem.get(problem) for m in methods]
            columns.append(_bold_least([values[k] if values else math.inf for values in of]))
    return markdown(head, columns)


def few_runs_table(results: Results, methods: Sequence[str]) -> str:
    """What every run came to, of methods that have too few for a median."""
    columns = [[shown(method) for method in methods]]
    for of in results.values():
        runs = [of[m].final.tolist() if m in of else [] for m in methods]
        columns.append([", ".join(map(_value, sorted(values))) or "-" for values in runs])
    return markdown(["method", *map(_short, results)], columns)


def spread_table(results: Results) -> list[str]:
    """Quartiles at the end on every problem, and the test against the default search.

    Args:
        results: Runs by problem, then by method.

    Returns:
        The table, of the methods that have `_ENOUGH` runs; none if there is no such method.
    """
    kept = {p: {m: r for m, r in of.items() if len(r) >= _ENOUGH} for p, of in results.items()}
    problems = [problem for problem, of in kept.items() if MEASURE in of]
    if not problems:
        return []
    budget = kept[problems[0]][MEASURE].budget
    methods = in_order(medians_of({p: kept[p] for p in problems}, (budget,)))
    head, columns = ["method"], [[shown(m) for m in methods]]
    for problem in problems:
        of = kept[problem]
        head += [f"{_short(problem)}: quartiles", "p"]
        columns.append([_quartiles(of[m]) if m in of else "-" for m in methods])
        tested = {m: _p(probability(of[m], of[MEASURE])) for m in of if m != MEASURE}
        columns.append([tested.get(m, "-") for m in methods])
    return [markdown(head, columns)]


def calls_table(by_method: Mapping[str, Runs]) -> str:
    """Calls until the target is reached, of a test function."""
    calls = {m: _call_quartiles(runs) for m, runs in by_method.items()}
    order = sorted(calls, key=lambda m: (calls[m][1], -by_method[m].solved.sum(), m))
    rows = [
        [
            shown(m),
            str(len(by_method[m])),
            str(int(by_method[m].solved.sum())),
            _count(calls[m][1]),
            f"{_count(calls[m][0])} to {_count(calls[m][2])}",
            f"{by_method[m].median_after(_CALLS):.2g}",
        ]
        for m in order
    ]
    head = ["method", "runs", "solved", "median calls", "first to third quartile", "median at end"]
    return markdown(head, list(map(list, zip(*rows, strict=True))))


def correlation_table(
    function: Mapping[str, Runs], sure: Mapping[str, Medians], known: Mapping[str, Medians]
) -> str:
    """Spearman's correlation of ranks on the function with those on the robot.

    Args:
        function: Runs by method.
        sure: Medians on the robot of enough runs, by method.
        known: The same with those of few runs.

    Returns:
        The table; its last row is of all that were raced under preference A.
    """
    sets: list[tuple[str, tuple[str, ...], Mapping[str, Medians]]] = [("A, B and C", ROBOT, sure)]
    sets += [(_short(problem), (problem,), sure) for problem in ROBOT]
    if len(known) > len(sure):
        sets.append(("A, with those of few runs", ROBOT[:1], known))
    rows = []
    for name, problems, robot in sets:
        found = [correlation(function, robot, problems, k) for k in range(len(_LOOKED_AT))]
        values = [f.value for f in found]
        shown = [f"{v.value:.2f} ({v.low:.2f} to {v.high:.2f})" for v in values]
        rows.append([name, str(found[0].methods), *shown])
    head = ["robot", "methods", *(f"after {count}" for count in _LOOKED_AT)]
    return markdown(head, list(map(list, zip(*rows, strict=True))))


def shown(method: str) -> str:
    """A method's name: in code style one of jobs, in italics another library's."""
    return f"`{method}`" if method in OPTIMIZERS else f"*{method}*"


def markdown(head: Sequence[str], columns: Sequence[Sequence[str]]) -> str:
    """A table of columns of texts, with a head each."""
    rows = [head, ["---"] * len(head), *zip(*columns, strict=True)]
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


def _call_quartiles(runs: Runs) -> list[float]:
    """Of the calls until the target was reached, +inf for a run that did not."""
    calls = np.where(runs.solved, runs.to_target, np.inf)
    return [float(q) for q in np.quantile(calls, (0.25, 0.5, 0.75), method="inverted_cdf")]


def _short(problem: str) -> str:
    """Of a preference its letter alone."""
    return problem.removeprefix("chapter-4.")


def _bold_least(values: Sequence[float]) -> list[str]:
    shown = [_value(value) for value in values]
    least = _value(min(values))
    return [f"**{text}**" if text == least else text for text in shown]


def _quartiles(runs: Runs) -> str:
    low, _, high = runs.quartiles()[:, -1].tolist()
    return f"{_value(low)} to {_value(high)}"


def _value(value: float) -> str:
    if not math.isfinite(value):
        return "-"
    return f"{value:,.0f}".replace(",", " ") if value >= _LARGE else f"{value:.2f}"


def _count(value: float) -> str:
    return f"{value:.0f}" if math.isfinite(value) else "-"


def _p(value: float) -> str:
    return f"{value:.2f}" if value >= _SMALL_P else f"{value:.1g}"
