"""Tables of research/docs/comparison.md, from the recorded runs in research/data.

python -m gaitswarm_research.published
"""

from __future__ import annotations

import csv
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import rankdata

Floats = NDArray[np.float64]

DATA: Final = Path(__file__).parents[1] / "data"

ROBOT: Final = ("chapter-4.A", "chapter-4.B", "chapter-4.C")
FUNCTION: Final = "D7C0R0I1"
BUDGET: Final = 625
"""Evaluations of a run on the robot."""

CALLS: Final = 5000
"""Evaluations of a run on the test function."""

CHECKPOINTS: Final = (100, 250, 625)
RIVALS: Final = (
    *("catcmawm", "cma", "optuna-cma-es", "optuna-gp", "optuna-tpe", "pymoo-pso", "scipy-de"),
)

SMALL_BUDGETS: Final = (50, 100, 250)
JOBS: Final = {
    "chapter-4.A": "chapter 4",
    "chapter-3.pi": "chapter 3, PI",
    "chapter-3.fuzzy-pi": "Fuzzy-PI",
    "constrained.A-gait": "constrained",
}
"""Titles of the jobs of small budgets."""

ADAPTING: Final = ("de", "pso", "pso-ps")
"""Methods whose runs depend on the budget, or that are not compared at small ones."""

ENOUGH: Final = 4
"""Least number of runs whose median is shown."""

GROUPS: Final[dict[str, Callable[[str], bool]]] = {
    "all": lambda _: True,
    FUNCTION: lambda name: name == FUNCTION,
    "C0": lambda name: "C0" in name,
    "C1R0": lambda name: "C1R0" in name,
    "C1R1": lambda name: "C1R1" in name,
}
"""Groups of test functions that the thesis distinguishes, by their tags."""

RESAMPLES: Final = 2000


class Medians(NamedTuple):
    """Medians of a method after `CHECKPOINTS`, by problem, and the least number of runs."""

    runs: int
    by_problem: Mapping[str, tuple[float, ...]]


class Scores(NamedTuple):
    """Runs of a method on a test function: evaluations to the target, and least value."""

    to_target: Floats
    best: Floats

    @property
    def solved(self) -> NDArray[np.bool_]:
        """Whether each run reached the target."""
        return ~np.isnan(self.to_target)


def robot_medians(data: Path = DATA) -> dict[str, Medians]:
    """Medians on the robot by method; of two records of a method the one with more runs."""
    runs: dict[str, dict[str, list[list[float]]]] = {}
    for row in _recorded(data):
        if row["problem"] in ROBOT and int(row["evaluations"]) == BUDGET:
            values = [_number(row[f"best_{count}"]) for count in CHECKPOINTS]
            runs.setdefault(row["method"], {}).setdefault(row["problem"], []).append(values)
    medians = {
        method: Medians(
            min(map(len, by_problem.values())),
            {problem: tuple(_median(rows)) for problem, rows in by_problem.items()},
        )
        for method, by_problem in sorted(runs.items())
    }
    earlier: dict[str, dict[str, tuple[float, ...]]] = {}
    counts: dict[str, int] = {}
    # Single runs of these were not recorded.
    for row in _rows(data / "races-medians.csv"):
        counts[row["method"]] = int(row["runs"])
        earlier.setdefault(row["method"], {})[row["problem"]] = tuple(
            float(row[str(count)]) for count in CHECKPOINTS
        )
    for method, by_problem in earlier.items():
        if method not in medians or counts[method] > medians[method].runs:
            medians[method] = Medians(counts[method], by_problem)
    return medians


def robot_table(medians: Mapping[str, Medians]) -> str:
    """Medians on the robot, best method first; the least of a column is bold."""
    sure = {method: of for method, of in medians.items() if of.runs >= ENOUGH}
    least = {
        problem: min(of.by_problem[problem][-1] for of in sure.values() if problem in of.by_problem)
        for problem in ROBOT
    }

    def level(method: str) -> float:
        lasts = sure[method].by_problem.items()
        return sum(math.log(values[-1] / least[problem]) for problem, values in lasts) / len(lasts)

    methods = sorted(sure, key=level)
    head, columns = ["method", "runs"], [[_styled(m) for m in methods]]
    columns.append([str(sure[m].runs) for m in methods])
    for problem in ROBOT:
        for k, count in enumerate(CHECKPOINTS):
            head.append(str(count) if k else f"{problem.removeprefix('chapter-4.')}: {count}")
            texts = [
                _value(sure[m].by_problem[problem][k]) if problem in sure[m].by_problem else "-"
                for m in methods
            ]
            best = _value(
                min(of.by_problem[problem][k] for of in sure.values() if problem in of.by_problem)
            )
            columns.append([f"**{text}**" if text == best else text for text in texts])
    return _markdown(head, columns)


def small_budgets_table(data: Path = DATA) -> str:
    """Medians with the present swing after `SMALL_BUDGETS`, by job; the least of a column is bold.

    The recorded methods do not adapt to their budget.
    """
    runs: dict[tuple[str, str], list[list[float]]] = {}
    for row in (*_rows(data / "small-budgets.csv"), *_rows(data / "half-ellipse.csv")):
        if row["problem"] in JOBS and row["method"] not in ADAPTING:
            curve = [_number(row[f"best_{count}"]) for count in SMALL_BUDGETS]
            runs.setdefault((row["method"], row["problem"]), []).append(curve)
    methods = dict.fromkeys(method for method, _ in runs)
    head, columns = ["method"], [[_styled(method) for method in methods]]
    for problem, title in JOBS.items():
        rows = {m: runs.get((m, problem), []) for m in methods}
        medians = {m: _median(of) for m, of in rows.items() if len(of) >= ENOUGH}
        head.append(f"{title}: runs")
        columns.append([str(len(rows[m])) if m in medians else "-" for m in methods])
        for k, most in enumerate(SMALL_BUDGETS):
            head.append(str(most))
            texts = [_value(medians[m][k]) if m in medians else "-" for m in methods]
            best = _value(min(values[k] for values in medians.values()))
            columns.append([f"**{text}**" if text == best else text for text in texts])
    return _markdown(head, columns)


def function_scores(data: Path = DATA) -> dict[str, dict[str, Scores]]:
    """Runs of the thesis's comparison by test function and method."""
    runs: dict[str, dict[str, list[tuple[float, float]]]] = {}
    for row in _rows(data / "test-functions.csv"):
        values = (_number(row["to_target"]), _number(row["best"]))
        runs.setdefault(row["problem"], {}).setdefault(row["method"], []).append(values)
    return {
        problem: {method: Scores(*np.array(rows).T) for method, rows in by_method.items()}
        for problem, by_method in runs.items()
    }


def functions_table(scores: Mapping[str, Mapping[str, Scores]]) -> str:
    """Mean ranks of the methods and shares of solved runs, by group of test functions."""
    methods = list(next(iter(scores.values())))
    ranks, solved = {}, {}
    for group, belongs in GROUPS.items():
        chosen = [by_method for problem, by_method in scores.items() if belongs(problem)]
        means = np.mean([_ranks([by_method[m] for m in methods]) for by_method in chosen], axis=0)
        ranks[group] = dict(zip(methods, means.tolist(), strict=True))
        solved[group] = {
            m: float(np.mean(np.concatenate([by_method[m].solved for by_method in chosen])))
            for m in methods
        }
    order = sorted(methods, key=lambda m: ranks["all"][m])
    columns = [[_styled(m) for m in order]]
    for group in GROUPS:
        columns.append([f"{ranks[group][m]:.1f}" for m in order])
        columns.append([f"{solved[group][m]:.0%}".replace("%", " %") for m in order])
    head = [text for group in GROUPS for text in (f"{group}: rank", "solved")]
    return _markdown(["method", *head], columns)


def correlations(
    medians: Mapping[str, Medians], data: Path = DATA
) -> list[tuple[float, float, float]]:
    """Spearman's correlation of the order of methods on the test function with that on the robot.

    Value and interval of 95 % of resampled sets of methods, for each of `CHECKPOINTS`.
    """
    runs: dict[str, list[tuple[float, float]]] = {}
    for row in _recorded(data):
        if row["problem"] == FUNCTION and int(row["evaluations"]) == CALLS:
            values = (_number(row["to_target"]), _number(row[f"best_{CALLS}"]))
            runs.setdefault(row["method"], []).append(values)
    methods = [
        m
        for m in sorted(runs)
        if m in medians and medians[m].runs >= ENOUGH and medians[m].by_problem.keys() >= set(ROBOT)
    ]
    on_function = _ranks([Scores(*np.array(runs[m]).T) for m in methods])
    found = []
    for k in range(len(CHECKPOINTS)):
        on_robot = np.sum(
            [rankdata([medians[m].by_problem[p][k] for m in methods]) for p in ROBOT], axis=0
        )
        both = np.stack([on_function, on_robot])
        picks = np.random.default_rng(1).integers(len(methods), size=(RESAMPLES, len(methods)))
        samples = np.array([_spearman(*both[:, pick]) for pick in picks])
        samples = samples[~np.isnan(samples)]
        low, high = np.quantile(samples, (0.025, 0.975), method="inverted_cdf")
        found.append((_spearman(*both), float(low), float(high)))
    return found


def _ranks(by_method: Sequence[Scores]) -> Floats:
    """Ranks of methods by the mean rank of their runs.

    A run precedes another one if it reached the target and the other did not, if both did and it
    took fewer evaluations, or if neither did and its best is lower.
    """
    keys = [
        (not solved, count if solved else best)
        for scores in by_method
        for solved, count, best in zip(
            scores.solved.tolist(),
            scores.to_target.tolist(),
            np.nan_to_num(scores.best, nan=np.inf).tolist(),
            strict=True,
        )
    ]
    places = {key: place for place, key in enumerate(sorted(set(keys)))}
    counts = np.array([len(scores.best) for scores in by_method])
    sums = np.add.reduceat(rankdata([places[key] for key in keys]), np.cumsum(counts) - counts)
    return np.asarray(rankdata(sums / counts), dtype=np.float64)


def _spearman(one: Floats, other: Floats) -> float:
    a, b = (rankdata(values) for values in (one, other))
    a, b = a - a.mean(), b - b.mean()
    scale = math.sqrt(float((a * a).sum()) * float((b * b).sum()))
    return float((a * b).sum()) / scale if scale > 0.0 else math.nan


def _median(rows: Sequence[Sequence[float]]) -> list[float]:
    """Medians of columns, each the value of a run."""
    values = np.nan_to_num(np.array(rows), nan=np.inf, posinf=np.inf)
    medians: list[float] = np.quantile(values, 0.5, axis=0, method="inverted_cdf").tolist()
    return medians


def _recorded(data: Path) -> Iterable[dict[str, str]]:
    return (row for path in sorted((data / "races").glob("*.csv")) for row in _rows(path))


def _rows(path: Path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def _number(text: str) -> float:
    return float(text) if text else math.nan


def _styled(method: str) -> str:
    return f"*{method}*" if method in RIVALS else f"`{method}`"


def _value(value: float) -> str:
    if not math.isfinite(value):
        return "-"
    return f"{value:,.0f}".replace(",", " ") if value >= 1000.0 else f"{value:.2f}"


def _markdown(head: Sequence[str], columns: Sequence[Sequence[str]]) -> str:
    rows = [head, ["---"] * len(head), *zip(*columns, strict=True)]
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


if __name__ == "__main__":
    on_robot = robot_medians()
    lines = [robot_table(on_robot), "", functions_table(function_scores()), ""]
    lines += [small_budgets_table(), ""]
    for checkpoint, (value, low, high) in zip(CHECKPOINTS, correlations(on_robot), strict=True):
        lines.append(f"correlation after {checkpoint}: {value:.2f} ({low:.2f} to {high:.2f})")
    print("\n".join(lines))  # noqa: T201
