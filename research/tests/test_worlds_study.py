"""Searches with and without worlds, judged in held-out worlds."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import gaitswarm
from gaitswarm import PREFERENCES, CertificateView
from gaitswarm_research.studies.worlds import (
    Contestant,
    Run,
    contestants,
    runs_table,
    study_document,
    study_table,
)
from research.tests.conftest import Command

TINY = ("--particles", "4", "--iterations", "1", "--worlds", "2", "--held-out", "3")
COMMON = {
    "robot": "szabadka2",
    "preference": "A",
    "optimizer": "cma-es",
    "particles": 4,
    "iterations": 1,
    "precision": "single",
}


def planned(**changes: Any) -> list[Contestant]:
    options: dict[str, Any] = {"counts": [2], "aggregates": ["cvar"], "level": 0.75, "seeds": 2}
    return contestants(COMMON, **(options | changes))


def judged(nominal: float | None, *, failed: int = 0) -> CertificateView:
    """A certificate of 1 000 worlds whose median is twice, and whose CVaR thrice the nominal."""
    value = nominal or 10.0
    quantiles = [value, value, 2 * value, 2 * value, 2 * value]
    worst_tail = {"cvar": 3 * value, "worst": 3 * value, "tail_failed": failed / 50}
    chance = {"count": failed, "share": failed / 1000, "low": 0.0, "high": 0.1}
    return CertificateView.model_validate(
        {
            "job": "",
            "robot": "szabadka2",
            "controller": "pi",
            "design": {},
            "preference": PREFERENCES["A"],
            "seed": 0,
            "worlds": 1000,
            "worlds_planned": 1000,
            "quantiles": [0.05, 0.25, 0.5, 0.75, 0.95],
            "fitness": {
                "quantiles": quantiles,
                "nominal": nominal,
                **worst_tail,
            },
            "fell": chance,
            "failed": chance,
            "scenarios": {},
            "worst": [],
            "influences": [],
        }
    )


def with_runs(contestant: Contestant, *views: CertificateView) -> Contestant:
    runs = tuple(Run(seed, "", view) for seed, view in enumerate(views, start=1))
    return Contestant(contestant.title, contestant.worlds, contestant.specs, runs)


def test_searches_have_the_same_budget_and_seeds_have_different_worlds() -> None:
    plain, *others = planned(counts=[2, 4], aggregates=["mean", "cvar"])
    assert [c.title for c in (plain, *others)] == [
        "without worlds",
        "mean of 2",
        "cvar of 2",
        "mean of 4",
        "cvar of 4",
    ]
    assert [spec.worlds for spec in plain.specs] == [None, None]
    for contestant in others:
        assert [spec.worlds and spec.worlds.seed for spec in contestant.specs] == [1, 2]
    names = {"worlds", "name"}
    for seed in (0, 1):
        assert len({c.specs[seed].model_dump_json(exclude=names) for c in (plain, *others)}) == 1


def test_quantities_are_medians_over_runs_and_ratios_to_the_search_without_worlds() -> None:
    plain, cvar = planned()
    found = [
        with_runs(plain, *map(judged, (10.0, 12.0, 11.0, 13.0))),
        with_runs(cvar, *map(judged, (20.0, 24.0, 22.0, 26.0))),
    ]
    searches = study_document(found, 1000, 0)["searches"]
    medians = [
        {name: values["of_runs"]["median"] for name, values in search["quantities"].items()}
        for search in searches
    ]
    assert medians == [
        {"nominal": 11.5, "median": 23.0, "cvar": 34.5, "failed": 0.0, "fell": 0.0},
        {"nominal": 23.0, "median": 46.0, "cvar": 69.0, "failed": 0.0, "fell": 0.0},
    ]
    ratio = searches[1]["quantities"]["cvar"]["ratio"]
    assert ratio["median"] == pytest.approx(2.0)
    assert ratio["low"] < 2.0 < ratio["high"]
    assert searches[0]["quantities"]["cvar"]["ratio"] is None


def test_a_quantity_that_a_run_lacks_is_left_out() -> None:
    plain, cvar = planned()
    found = [
        with_runs(plain, judged(10.0), judged(None)),
        with_runs(cvar, judged(20.0), judged(22.0)),
    ]
    first, second = study_document(found, 1000, 0)["searches"]
    assert first["quantities"]["nominal"]["of_runs"] is None
    assert second["quantities"]["nominal"]["of_runs"]["median"] == 21.0
    assert second["quantities"]["nominal"]["ratio"] is None
    _, _, median, *_ = study_table(found).columns
    assert next(iter(median.cells)) == "–"


def test_without_a_design_that_walks_nothing_is_compared() -> None:
    for search in study_document(planned(), 1000, 0)["searches"]:
        assert search["runs"] == []
        assert {values["of_runs"] for values in search["quantities"].values()} == {None}
    _, _, median, _, change, _ = study_table(planned()).columns
    assert {*median.cells, *change.cells} == {"–"}


def test_a_tail_that_failed_in_part_is_a_lower_bound() -> None:
    plain, cvar = planned()
    found = [with_runs(plain, judged(10.0, failed=7)), with_runs(cvar, judged(20.0))]
    cells = [list(column.cells) for column in runs_table(found).columns]
    assert cells[4] == ["> 30", "60"]
    assert [str(cell).split()[0] for cell in cells[5]] == ["7", "0"]
    _, quantity, median, *_ = (list(column.cells) for column in study_table(found).columns)
    assert median[quantity.index("CVaR 95 %")] == "> 30"


@pytest.mark.slow
def test_searches_are_judged_in_the_same_held_out_worlds(research: Command, db: Path) -> None:
    arguments = ("study", "worlds", *TINY, "--seeds", "1", "--db", db)
    done = research(*arguments, "--json")
    assert done.code == 0, done.err
    with gaitswarm.open(db) as jobs:
        for search in done.json["searches"]:
            (run,) = search["runs"]
            spec: Any = jobs.job(run["certificate"]).spec
            assert spec.design == jobs.best(run["job"]).design
            assert (spec.worlds, spec.seed, spec.precision) == (3, 0, "double")
        stored = len(list(jobs.jobs()))
        shown = research(*arguments)
        assert shown.code == 0, shown.err
        assert len(list(jobs.jobs())) == stored, "a job was run again"
    assert "cvar of 2" in shown.out
    assert "…" not in shown.out, "a table is wider than a terminal"


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--held-out-seed", "2"), "held-out-seed: 2 is the seed of a search's worlds"),
        (("--worlds", "8,many"), "worlds: '8,many' is not a list of integers"),
        (("--worlds", "0"), "worlds.count"),
        (("--aggregate", "median"), "worlds.aggregate"),
        (("--preference", "D"), "preference"),
        (("--optimizer", "annealer"), "unknown optimizer 'annealer'"),
    ],
)
def test_invalid_options_are_refused_before_anything_is_stored(
    research: Command, db: Path, options: tuple[str, ...], said: str
) -> None:
    refused = research("study", "worlds", *options, "--db", db)
    assert refused.code == 2
    assert said in refused.err
    assert not db.exists()
