"""The thesis's race on test functions: its runs as a small file, and its table."""

from __future__ import annotations

import csv
import math
from collections import defaultdict
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from benchmarks.races.records import FOLDER, BadRecord
from benchmarks.races.tables import markdown, shown
from gaitswarm.services.optimizer.analysis.tournaments.tournament import Results, Runs, mean_ranks
from gaitswarm.services.optimizer.tournament.functions import FUNCTIONS

KEPT: Final = FOLDER.parent / "test-functions.csv"
"""Runs that the document speaks of."""

HEADER: Final = ("problem", "method", "repetition", "to_target", "best")
"""Columns of the file: evaluations until the target was reached, nothing if it was not, and the
least value of all."""

GROUPS: Final[dict[str, Callable[[str], bool]]] = {
    "all": lambda _: True,
    "D7C0R0I1": lambda name: name == "D7C0R0I1",
    "C0": lambda name: "C0" in name,
    "C1R0": lambda name: "C1R0" in name,
    "C1R1": lambda name: "C1R1" in name,
}
"""What the thesis tells apart, by tags of the functions."""


def keep(report: Path, path: Path = KEPT) -> None:
    """Write the runs of a tournament's report as a small file.

    Args:
        report: Folder that `gaitswarm tournament thesis` wrote.
        path: Of the new file.
    """
    import pyarrow.parquet as pq  # noqa: PLC0415 - the table needs none

    rows = pq.read_table(report / "runs.parquet").to_pylist()
    best = max((name for name in rows[0] if name.startswith("best_")), key=_count)
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(HEADER)
        for row in rows:
            values = (_text(row["evaluations_to_target"]), _text(row[best]))
            writer.writerow((row["problem"], row["method"], row["repetition"], *values))


def read(path: Path = KEPT) -> Results:
    """Runs of a file that `keep` wrote, by problem, then by method.

    Raises:
        BadRecord: It has another header.
    """
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    if not rows or tuple(rows[0]) != HEADER:
        raise BadRecord(f"{path}: the header must be {','.join(HEADER)}")
    found: dict[str, dict[str, list[tuple[float, float]]]] = defaultdict(lambda: defaultdict(list))
    for row in rows:
        values = (float(row["to_target"] or math.nan), float(row["best"] or math.nan))
        found[row["problem"]][row["method"]].append(values)
    return {
        problem: {method: _runs(problem, values) for method, values in by_method.items()}
        for problem, by_method in found.items()
    }


def table(results: Results) -> str:
    """Mean ranks of the methods, and the share of runs that have solved, by group of functions.

    Args:
        results: With runs of the same methods on every problem.
    """
    methods = list(next(iter(results.values())))
    ranks, solved = {}, {}
    for group, belongs in GROUPS.items():
        own = {problem: of for problem, of in results.items() if belongs(problem)}
        ranks[group] = {m: of.value for m, of in mean_ranks(own, methods).items()}
        solved[group] = {m: _share([of[m] for of in own.values()]) for m in methods}
    order = sorted(methods, key=lambda m: ranks["all"][m])
    columns = [[shown(m) for m in order]]
    for group in GROUPS:
        columns.append([f"{ranks[group][m]:.1f}" for m in order])
        columns.append([f"{solved[group][m]:.0%}".replace("%", " %") for m in order])
    head = [text for group in GROUPS for text in (f"{group}: rank", "solved")]
    return markdown(["method", *head], columns)


def _share(runs: Sequence[Runs]) -> float:
    return float(np.mean(np.concatenate([of.solved for of in runs])))


def _runs(problem: str, values: Sequence[tuple[float, float]]) -> Runs:
    to_target, best = np.array(values).T
    return Runs(
        checkpoints=np.array([1]),
        best=best[:, np.newaxis],
        to_best=np.full(len(best), np.nan),
        to_target=to_target,
        dimension=len(FUNCTIONS[problem].low),
        target=None,
    )


def _count(column: str) -> int:
    return int(column.removeprefix("best_"))


def _text(value: float | None) -> str:
    return "" if value is None or math.isnan(value) else f"{value:.9g}"
