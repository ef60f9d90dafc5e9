"""Preferences whose optima are robust and even, judged independently of the preference."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gaitswarm
from gaitswarm import PREFERENCES
from gaitswarm_research.studies.preferences import (
    CRITERIA,
    Study,
    mean_ranks,
    ratios_and_unevenness,
    refine,
    study_table,
)
from research.tests.conftest import Command

TINY = (
    *("--robot", "szabadka2", "--drawn", "1", "--refined", "0", "--pool", "2", "--particles", "6"),
    *("--iterations", "1", "--samples", "40", "--held-out", "2"),
)
PUBLISHED = np.array([[10.0, 1.0, 12.0, 90.0, 20.0], [12.0, 2.0, 14.0, 80.0, 10.0]])


def optimum(candidate: str = "A", **values: Any) -> dict[str, Any]:
    judged = {"index": 3.0, "failed": 0.0, "risk": 1.2, "unevenness": 1.1, "speed": 0.05}
    preference = PREFERENCES["A"].model_dump()
    return {
        "candidate": candidate,
        "preference": preference,
        "ratios": [1.0] * 5,
        **judged,
        **values,
    }


def test_a_design_that_is_equally_better_in_every_scenario_is_even() -> None:
    factors = np.array([0.5, 0.9, 1.0, 1.1, 2.0])
    ratios, unevenness = ratios_and_unevenness(PUBLISHED * factors, PUBLISHED)
    assert ratios == pytest.approx(factors)
    assert unevenness == pytest.approx(1.0)


def test_unevenness_is_the_geometric_deviation_over_scenarios() -> None:
    by_scenario = np.array([[2.0], [0.5]])
    ratios, unevenness = ratios_and_unevenness(PUBLISHED * by_scenario, PUBLISHED)
    assert ratios == pytest.approx(np.ones(5))
    assert unevenness == pytest.approx(2.0)


@pytest.mark.parametrize("criterion", CRITERIA)
def test_less_is_better_by_each_criterion(criterion: str) -> None:
    worse = optimum() | {criterion: 5.0}
    assert mean_ranks([optimum(), worse]) == [(3 * 1.5 + 1) / 4, (3 * 1.5 + 2) / 4]


def test_a_value_that_cannot_be_estimated_ranks_last() -> None:
    best, *_, last = mean_ranks([optimum(), optimum(index=9.0), optimum(index=None)])
    assert best < last


def test_refined_exponents_are_around_the_best_and_keep_its_biases() -> None:
    searched: list[Any] = []

    class Judge(Study):
        def optimum(self, candidate: str, preference: Any) -> dict[str, Any]:
            searched.append(preference)
            return optimum(candidate, index=3.0 - preference.exponent[0])

    optima = [optimum("A"), optimum("B", index=2.9)]
    optima[1]["preference"] = PREFERENCES["B"].model_dump()
    refine(Judge({}, 1, 40, 2, "", PUBLISHED, {}), optima, 40, seed=1)
    assert [o["candidate"] for o in optima[2:]] == [f"refined {k}" for k in range(1, 41)]
    assert {preference.bias for preference in searched} == {PREFERENCES["B"].bias}
    first, last = (
        np.mean([p.exponent for p in part], axis=0) for part in (searched[:8], searched[-8:])
    )
    # B's exponents with 1 as the largest; a large first exponent has the least index.
    assert first == pytest.approx(np.array([0.25, 0.75, 1.0, 0.125, 0.25]), abs=0.25)
    assert last[0] > first[0] + 0.2


def test_the_table_shows_the_reference_first_and_fits_a_terminal() -> None:
    reference = optimum("published A")
    rows = [{**optimum("refined 16", ratios=[1.1, 0.9, 1, 1, 1], risk=None), "mean_rank": 12.5}]
    columns = {
        str(column.header): list(column.cells)
        for column in study_table({"reference": reference, "candidates": rows}).columns
    }
    assert columns["preference"] == ["published A", "refined 16"]
    assert columns["rank"] == ["–", "12.5"]
    assert columns["risk"] == ["1.20", "–"]
    assert [columns["f1"][1], columns["f2"][1]] == ["+10", "-10"]
    assert columns["cm/s"] == ["5.0", "5.0"]


@pytest.mark.slow
def test_candidates_are_searched_and_judged_in_held_out_worlds(research: Command, db: Path) -> None:
    done = research("study", "preferences", *TINY, "--db", db, "--json")
    assert done.code == 0, done.err
    candidates = done.json["candidates"]
    names = [row["candidate"] for row in candidates]
    assert sorted(names) == ["A", "B", "C", "drawn 1"]
    ranks = [row["mean_rank"] for row in candidates]
    assert ranks == sorted(ranks)
    assert done.json["reference"]["unevenness"] == pytest.approx(1.0)
    assert done.json["reference"]["ratios"] == pytest.approx([1.0] * 5)
    with gaitswarm.open(db) as jobs:
        for row in candidates:
            spec: Any = jobs.job(row["job"]).spec
            assert spec.resolved_preference().model_dump(mode="json") == row["preference"]
            assert jobs.best(row["job"]).design == row["design"]
        judged: list[Any] = [job for job in jobs.jobs() if job.name.endswith("certificate")]
        stored = len(list(jobs.jobs()))
        specs: list[Any] = [jobs.job(job.id).spec for job in judged]
        assert {spec.seed for spec in specs} == {1, 2}
        assert len({spec.preference for spec in specs}) == 1, "worlds are judged by one preference"
    assert {row["candidate"] for row in candidates if "fresh_worlds" in row} >= {"A", "B", "C"}
    shown = research("study", "preferences", *TINY, "--drawn", "0", "--db", db)
    assert shown.code == 0, shown.err
    assert "…" not in shown.out, "the table is wider than a terminal"
    assert "3 candidates" in shown.err
    with gaitswarm.open(db) as jobs:
        assert len(list(jobs.jobs())) == stored, "a job was run again"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--robot", "spot"), "unknown robot 'spot'"),
        (("--precision", "half"), "precision"),
        (("--particles", "0"), "particles"),
        (("--samples", "8"), "samples"),
    ],
)
def test_invalid_options_are_refused_before_anything_is_stored(
    research: Command, db: Path, options: tuple[str, ...], message: str
) -> None:
    refused = research("study", "preferences", *options, "--db", db)
    assert refused.code == 2
    assert message in refused.err
    assert not db.exists()
