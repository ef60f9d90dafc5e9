"""`fork`, and forks in `status` and `list`."""

from __future__ import annotations

import shlex
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.cli.conftest import Finished, Gaitswarm

pytestmark = pytest.mark.slow

Place = Callable[[Path], list[str]]


@pytest.fixture
def own_db(finished: Finished, db: Path) -> Path:
    return Path(shutil.copy(finished.db, db))


def test_a_fork_is_shown_with_its_parent(
    gaitswarm: Gaitswarm, finished: Finished, own_db: Path, place: Place
) -> None:
    where = place(own_db)
    made = gaitswarm("fork", finished.id, "--from", "1", *where)
    assert made.code == 0, made.err
    fork = made.out.strip()
    assert "continues from its iteration 1" in made.err
    assert f"fork of {finished.id}" in gaitswarm("status", fork, *where).out
    assert gaitswarm("list", *where).out.count(finished.id) == 2
    (only,) = gaitswarm("list", "--forks-of", finished.id, *where, "--json").json
    assert only["id"] == fork


def test_a_fork_states_why_it_starts_a_new_search(
    gaitswarm: Gaitswarm, finished: Finished, own_db: Path, place: Place
) -> None:
    asked = ("fork", finished.id, "--from", "2", "--optimizer", "random", "--start-count", "1")
    made = gaitswarm(
        *asked,
        "--preference",
        '{"bias": [0,0,0,0,0], "exponent": [1,1,1,1,1]}',
        *place(own_db),
        "--json",
    )
    assert made.code == 0, made.err
    lineage = made.json["lineage"]
    assert (lineage["carried"], lineage["changed"]) == ("designs", ["optimizer", "preference"])
    assert "another search method" in lineage["reason"]
    assert len(made.json["spec"]["start"]) == 1


def test_scenarios_are_weighed_differently_in_forks_and_rankings(
    gaitswarm: Gaitswarm, finished: Finished, own_db: Path, place: Place
) -> None:
    (scenario,) = finished.job["spec"]["scenarios"]
    weight = ("--scenario-weight", f"{scenario['name']}=2")
    made = gaitswarm("fork", finished.id, "--from", "1", *weight, *place(own_db), "--json")
    assert made.json["spec"]["scenario_weights"] == {scenario["name"]: 2.0}
    assert made.json["lineage"]["changed"] == ["scenario_weights"]
    worst = ("--scenario-aggregate", "worst")
    ranked = gaitswarm("rank", finished.id, *worst, *place(own_db), "--json")
    assert ranked.json["top"][0]["rank_before"] == 1
    refused = gaitswarm("rank", finished.id, "--scenario-weight", "x=1", *place(own_db))
    assert refused.code == 2 and "the job has no scenario 'x'" in refused.err


def test_the_command_of_a_verdict_forks_a_job_within_wider_bounds(
    gaitswarm: Gaitswarm, db: Path, place: Place
) -> None:
    started = {"I": 0.1, "FI1R": 6000, "FI2R": 12000, "FOR": 2000, "FOMF": 3}
    started |= {"FW1": 0.3, "FW23": 0.3, "FW4": 1.0, "FW56": 0.1}
    start = db.with_suffix(".csv")
    start.write_text(f"{','.join(started)}\n{','.join(map(str, started.values()))}\n", "utf-8")
    budget = "--optimizer random --particles 1 --iterations 1 --scenarios 1 --evaluator in-process"
    made = gaitswarm(
        "optimize", *budget.split(), "--start-from", start, "--db", db, "--json"
    )  # fmt: skip
    verdict = made.json["verdict"]
    assert [bound["name"] for bound in verdict["bounds"]] == [
        "I",
        "FI1R",
        "FOR",
        "FOMF",
        "FW4",
        "FW56",
    ]

    program, *command = shlex.split(verdict["widen"])
    assert program == "gaitswarm"
    fork = gaitswarm(*command, *place(db), "--json")
    assert fork.code == 0, fork.err
    bounds = {v["name"]: (v["low"], v["high"]) for v in fork.json["spec"]["variables"]}
    assert (bounds["FI1R"], bounds["I"]) == ((1500.0, 8250.0), (0.01, 1.0))
    assert fork.json["spec"]["start"] == [made.json["best"]["design"]]

    refused = gaitswarm(*command[:4], "--bounds", "FI1R=1500", *place(db))
    assert "bounds: 'FI1R=1500' is not NAME=LOW:HIGH" in refused.err


def test_a_fork_from_a_missing_iteration_is_bad_input(
    gaitswarm: Gaitswarm, finished: Finished, own_db: Path, place: Place
) -> None:
    refused = gaitswarm("fork", finished.id, "--from", "3", *place(own_db))
    assert refused.code == 2
    assert "at most 2" in refused.err
