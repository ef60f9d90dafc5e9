"""Races whose runs are kept as CSV files, and the document's tables of them."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pyarrow as pa
import pytest
from pyarrow import parquet

from benchmarks.races import functions
from benchmarks.races.plans import CHECKPOINTS, FUNCTION, Plan
from benchmarks.races.records import HEADER, BadRecord, Record, append, read, read_all
from benchmarks.races.running import run_missing, seeds_of
from benchmarks.races.statistics import (
    correlation,
    medians_of,
    probability,
    read_medians,
    results_of,
    with_more_runs,
)
from benchmarks.races.tables import (
    all_tables,
    calls_table,
    few_runs_table,
    medians_table,
    spread_table,
)

DOCUMENT = Path(__file__).parents[2] / "docs" / "optimizers.md"

SMALL = Plan(("random",), FUNCTION, 2, 25)


def record(method: str, repetition: int, *best: float, to_target: float = math.nan) -> Record:
    """A run of 100 evaluations, with its best after 25, 50 and 100."""
    return Record(
        problem=FUNCTION[0],
        method=method,
        settings="0123456789",
        evaluations=100,
        repetition=repetition,
        seed=repetition,
        best=(*best, *[math.nan] * (len(CHECKPOINTS) - len(best))),
        to_best=20.0,
        to_target=to_target,
        cpu_s=0.5,
        search="a",
        simulator="b",
        libraries="numpy 2",
    )


RECORDS = [
    record("cma-es", 0, 3.0, 2.0, 0.001, to_target=90.0),
    record("cma-es", 1, 4.0, 1.0, 0.0005, to_target=60.0),
    record("cma-es", 2, 5.0, 3.0, 1.5),
    record("cma-es", 3, 6.0, 4.0, 2.5),
    record("de", 0, 1.0, 0.9, 0.8),
    *(record("pymoo-pso", k, 2.0, 2.0, 2.0 + k) for k in range(4)),
    *(record("random", k, 9.0, 8.0, 7.0 + k) for k in range(4)),
]


def test_a_plan_runs_what_is_not_recorded_and_nothing_twice(tmp_path: Path) -> None:
    path = tmp_path / "small.csv"
    first = list(run_missing(SMALL, path))
    assert [(r.method, r.repetition) for r in first] == [("random", 0), ("random", 1)]
    assert not list(run_missing(SMALL, path))
    # What another file of the folder has is not run again either.
    assert not list(run_missing(SMALL, tmp_path / "other.csv"))
    more = replace(SMALL, repetitions=3, methods=("random", "de"))
    assert [(r.method, r.repetition) for r in run_missing(more, path)] == [
        ("de", 0),
        ("de", 1),
        ("random", 2),
        ("de", 2),
    ]
    kept = read(path)
    assert [r.row() for r in kept[:2]] == [r.row() for r in first]
    assert [r.seed for r in kept if r.method == "random"] == seeds_of(more)
    assert all(r.best[0] > 0.0 and math.isnan(r.best[1]) and r.to_best <= 25.0 for r in kept)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("problem,method\n", "the header must be problem,"),
        (",".join(HEADER) + "\nD7C0R0I1,de\n", "line 2"),
        (",".join(HEADER) + "\n" + ",".join("x" for _ in HEADER) + "\n", "line 2"),
    ],
)
def test_a_file_that_is_none_of_runs_is_refused(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "bad.csv"
    path.write_text(text)
    with pytest.raises(BadRecord, match=message):
        read_all(tmp_path)


def test_runs_come_back_from_a_file_to_nine_digits(tmp_path: Path) -> None:
    path = tmp_path / "runs.csv"
    for one in RECORDS:
        append(path, replace(one, best=tuple(value / 3.0 for value in one.best)))
    expected = [r.best[0] / 3.0 for r in RECORDS]
    assert [r.best[0] for r in read(path)] == pytest.approx(expected, rel=1e-8)
    assert [r.to_target for r in read(path)][:2] == [90.0, 60.0]
    assert [r.row()[:6] for r in read(path)] == [r.row()[:6] for r in RECORDS]


def test_tables_have_the_medians_quartiles_and_tests_of_the_runs() -> None:
    results = results_of(RECORDS, FUNCTION, 100)
    medians = medians_of(results, CHECKPOINTS[:3])
    assert medians_table(medians, FUNCTION, CHECKPOINTS[:3]).splitlines() == [
        "| method | runs | D7C0R0I1: 25 | 50 | 100 |",
        "| --- | --- | --- | --- | --- |",
        "| `cma-es` | 4 | 4.00 | 2.00 | **0.00** |",
        "| `de` | 1 | **1.00** | **0.90** | 0.80 |",
        "| *pymoo-pso* | 4 | 2.00 | 2.00 | 3.00 |",
        "| `random` | 4 | 9.00 | 8.00 | 8.00 |",
    ]
    # Four runs against four that are all greater: one of the seventy orders on either side.
    spread = spread_table(results)[0].splitlines()
    assert spread[-1] == "| `random` | 7.00 to 9.00 | 0.03 |"
    # One run has no quartiles.
    assert not any("`de`" in line for line in spread)
    assert few_runs_table(results, ["de"]).splitlines()[-1] == "| `de` | 0.80 |"
    by_method = results[FUNCTION[0]]
    assert probability(by_method["cma-es"], by_method["cma-es"]) == pytest.approx(1.0)
    assert calls_table(by_method).splitlines()[2] == "| `cma-es` | 4 | 2 | 90 | 60 to - | 0.001 |"


def test_ranks_that_agree_and_ranks_that_are_opposed_correlate_fully() -> None:
    enough = [r for r in RECORDS if r.method != "de"]
    of_methods = results_of(enough, FUNCTION, 100)[FUNCTION[0]]
    medians = medians_of({FUNCTION[0]: of_methods}, (25, 100))
    same = correlation(of_methods, medians, FUNCTION, 1)
    assert (same.methods, same.value.value, same.value.low) == (3, 1.0, 1.0)
    turned = {
        m: replace(v, by_problem={"p": (-v.by_problem[FUNCTION[0]][1],)})
        for m, v in medians.items()
    }
    assert correlation(of_methods, turned, ("p",), 0).value.value == -1.0


def test_medians_of_more_runs_count(tmp_path: Path) -> None:
    path = tmp_path / "medians.csv"
    path.write_text("method,runs,problem,25\nde,20,p,1.5\nde,20,q,2.5\ncma-es,3,p,0.1\n")
    earlier = read_medians(path, (25,))
    assert earlier["de"].by_problem == {"p": (1.5,), "q": (2.5,)}
    recorded = medians_of(results_of(RECORDS, FUNCTION, 100), (25,))
    known = with_more_runs(recorded, earlier)
    assert known["de"].runs == 20
    assert known["cma-es"] == recorded["cma-es"]


def test_a_tournament_on_functions_is_kept_by_its_last_best_and_ranked_by_group(
    tmp_path: Path,
) -> None:
    def row(problem: str, method: str, repetition: int, *best: float) -> dict[str, object]:
        names = ("best_10", "best_100", "best_20")
        solved = min(best) <= 1e-3
        return {
            "problem": problem,
            "method": method,
            "repetition": repetition,
            "evaluations_to_target": 50.0 + repetition if solved else math.nan,
            **dict(zip(names, best, strict=True)),
        }

    rows = [
        *(row("D7C0R0I1", "de", k, 3.0, 1e-4, 2.0) for k in range(2)),
        row("D7C0R0I1", "ps", 0, 3.0, 1e-4, 2.0),
        row("D7C0R0I1", "ps", 1, 3.0, 0.5, 2.0),
        *(row("D4C1R1I0", "de", k, 9.0, 7.0, 8.0) for k in range(2)),
        *(row("D4C1R1I0", "ps", k, 9.0, 6.0, 8.0) for k in range(2)),
        *(row("D4C1R0I0", name, 0, 9.0, 1e-4, 8.0) for name in ("de", "ps")),
    ]
    parquet.write_table(pa.Table.from_pylist(rows), tmp_path / "runs.parquet")
    kept = tmp_path / "kept.csv"
    functions.keep(tmp_path, kept)
    assert kept.read_text().splitlines()[1] == "D7C0R0I1,de,0,50,0.0001"
    assert functions.table(functions.read(kept)).splitlines()[2:] == [
        "| `de` | 1.5 | 60 % | 1.0 | 100 % | 1.0 | 100 % | 1.5 | 100 % | 2.0 | 0 % |",
        "| `ps` | 1.5 | 40 % | 2.0 | 50 % | 2.0 | 50 % | 1.5 | 100 % | 1.0 | 0 % |",
    ]
    kept.write_text("problem,method\nD7C0R0I1,de\n")
    with pytest.raises(BadRecord, match="the header must be problem,method,repetition"):
        functions.read(kept)


@pytest.mark.thorough("the tables of a document, of all recorded runs")
def test_the_document_has_the_tables_of_the_recorded_runs() -> None:
    text = DOCUMENT.read_text(encoding="utf-8")
    tables = all_tables(read_all())
    assert tables
    for table in (*tables, functions.table(functions.read())):
        assert table in text, f"put this into {DOCUMENT.name}:\n{table}"
