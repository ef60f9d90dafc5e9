"""PI against Fuzzy-PI: jobs of the database, reused by name, specification and provenance."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import gaitswarm
from gaitswarm_research.studies.controllers import comparisons, study_document, study_table
from research.tests.conftest import Command

TINY = ("--particles", "2", "--iterations", "1", "--robots", "szabadka2")


def study(research: Command, db: Path, *options: str) -> Any:
    done = research("study", "controllers", *TINY, *options, "--db", db, "--json")
    assert done.code == 0, done.err
    return done.json


def names(db: Path) -> list[str]:
    with gaitswarm.open(db) as jobs:
        return sorted(job.name for job in jobs.jobs())


@pytest.mark.slow
def test_both_are_optimized_alike_and_compared(research: Command, db: Path) -> None:
    chapter_3, chapter_4 = study(research, db, "--seeds", "2")["comparisons"]
    assert (chapter_3["chapter"], chapter_3["quantity"]) == (3, "F")
    assert (chapter_4["chapter"], chapter_4["quantity"]) == (4, "f_G")
    searched = {}
    with gaitswarm.open(db) as jobs:
        for comparison in (chapter_3, chapter_4):
            both = (comparison["pi"], comparison["fuzzy"])
            specs = [jobs.job(job_id).spec for runs in both for job_id in runs["jobs"]]
            assert [spec.seed for spec in specs] == [1, 2, 1, 2]
            assert len({(s.optimizer, s.iterations, s.case_names, s.robot) for s in specs}) == 1
            for runs, spec in zip(both, specs[::2], strict=True):
                key = (comparison["chapter"], runs["controller"])
                searched[key] = len(spec.design_space().variables)
    assert len(names(db)) == 8
    assert searched == {(3, "pi"): 7, (3, "fuzzy-pi-3"): 17, (4, "pi"): 2, (4, "fuzzy-pi"): 9}


@pytest.mark.slow
def test_the_gain_is_the_ratio_of_f_or_the_inverse_ratio_of_the_fitness(
    research: Command, db: Path
) -> None:
    chapter_3, chapter_4 = study(research, db, "--seeds", "1")["comparisons"]
    ((pi,), (fuzzy,)) = chapter_3["pi"]["values"], chapter_3["fuzzy"]["values"]
    assert chapter_3["ratio"]["median"] == pytest.approx(fuzzy / pi)
    ((pi,), (fuzzy,)) = chapter_4["pi"]["values"], chapter_4["fuzzy"]["values"]
    assert chapter_4["ratio"]["median"] == pytest.approx(pi / fuzzy)


@pytest.mark.slow
def test_finished_jobs_are_reused(research: Command, db: Path) -> None:
    first = study(research, db, "--seeds", "1", "--chapters", "3")
    before = names(db)
    assert study(research, db, "--seeds", "1", "--chapters", "3") == first
    assert names(db) == before
    more = study(research, db, "--seeds", "2", "--chapters", "3")
    assert set(names(db)) - set(before) == {
        f"study of controllers: chapter 3, {controller}, szabadka2, seed 2"
        for controller in ("pi", "fuzzy-pi-3")
    }
    (comparison,) = more["comparisons"]
    assert comparison["pi"]["values"][:1] == first["comparisons"][0]["pi"]["values"]
    study(research, db, "--seeds", "1", "--chapters", "3", "--optimizer", "pso-falling-inertia")
    assert len(names(db)) == 6


@pytest.mark.slow
def test_an_interrupted_study_is_resumed(research: Command, db: Path) -> None:
    (planned,) = comparisons(
        [3], ["szabadka2"], 1, particles=2, iterations=1, optimizer="pso", precision="double"
    )
    with gaitswarm.open(db) as jobs:
        paused = jobs.submit(planned.fuzzy.specs[0])
        jobs.pause(paused.id)
    document = study(research, db, "--seeds", "1", "--chapters", "3")
    assert document["comparisons"][0]["fuzzy"]["jobs"] == [paused.id]


@pytest.mark.slow
def test_the_table_shows_the_gain_next_to_the_thesis(research: Command, db: Path) -> None:
    shown = research("study", "controllers", *TINY, "--seeds", "1", "--chapters", "3", "--db", db)
    assert shown.code == 0, shown.err
    assert "3 (F)" in shown.out
    assert "%" in shown.out
    assert "+22 % (table 3.6, PSO-PS) and +20 % on average" in shown.err


def test_without_a_design_that_walks_nothing_is_compared() -> None:
    planned = comparisons([4], ["szabadka2"], 1, particles=2, iterations=1, optimizer="pso")
    (document,) = study_document(planned)["comparisons"]
    assert document["pi"]["values"] == []
    assert document["pi"]["median"] is None
    assert document["ratio"] is None
    *_, median, interval = study_table(planned).columns
    assert [*median.cells, *interval.cells] == ["–"] * 6


@pytest.mark.parametrize(
    ("options", "field"),
    [
        (("--chapters", "5"), "chapters"),
        (("--chapters", ""), "chapters"),
        (("--robots", "spot"), "unknown robot 'spot'"),
        (("--optimizer", "annealer"), "unknown optimizer 'annealer'"),
        (("--iterations", "0"), "iterations"),
        (("--particles", "0"), "optimizer.particles"),
    ],
)
def test_invalid_options_are_refused_before_anything_is_stored(
    research: Command, db: Path, options: tuple[str, ...], field: str
) -> None:
    refused = research("study", "controllers", *options, "--db", db)
    assert refused.code == 2
    assert field in refused.err
    assert not db.exists()
