"""Options of `optimize` and `submit` on the aggregation over worlds and scenarios."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.cli.conftest import Gaitswarm, WriteJson
from tests.examples.jobs import SMALL_SPEC


def asked(gaitswarm: Gaitswarm, db: Path, *options: Any) -> dict[str, Any] | None:
    """`worlds` of a job that is submitted with these options, without their ranges."""
    submitted = gaitswarm("submit", "--db", db, *options, "--json")
    assert submitted.code == 0, submitted.err
    worlds: dict[str, Any] | None = submitted.json["spec"]["worlds"]
    return worlds and {name: value for name, value in worlds.items() if name != "ranges"}


def test_options_of_worlds_set_the_spec(gaitswarm: Gaitswarm, db: Path) -> None:
    assert asked(gaitswarm, db) is None
    default = {"count": 4, "seed": 1, "aggregate": "cvar", "level": 0.75}
    assert asked(gaitswarm, db, "--worlds", 4) == default
    options = ("--aggregate", "quantile", "--level", 0.5, "--worlds-seed", 9)
    own = {"count": 4, "seed": 9, "aggregate": "quantile", "level": 0.5}
    assert asked(gaitswarm, db, "--worlds", 4, *options) == own


def test_options_are_laid_over_the_worlds_of_a_spec(
    gaitswarm: Gaitswarm, db: Path, write_json: WriteJson
) -> None:
    spec = write_json(SMALL_SPEC | {"worlds": {"count": 5, "seed": 3}}, "spec.json")
    found = asked(gaitswarm, db, "--spec", spec, "--aggregate", "worst")
    assert found == {"count": 5, "seed": 3, "aggregate": "worst", "level": 0.75}


def test_a_job_in_worlds_is_run_reported_and_ranked(
    gaitswarm: Gaitswarm, db: Path, write_json: WriteJson
) -> None:
    spec = write_json(SMALL_SPEC, "spec.json")
    job = gaitswarm(
        "optimize", "--spec", spec, "--worlds", 2, "--db", db, "--evaluator", "in-process", "--json"
    ).json
    assert job["scenarios"] == ["short"]
    results = job["best"]["scenarios"]
    assert list(results) == ["short.world-0", "short.world-1"]
    # A quarter of two worlds is less than one: the tail is the worse of them.
    assert job["best_fitness"] == pytest.approx(max(r["utility"] for r in results.values()))
    table = gaitswarm("best", job["id"], "--db", db)
    assert "short.world-1" in table.out
    ranked = gaitswarm("rank", job["id"], "--preference", "A", "--db", db, "--json").json
    assert ranked["top"][0]["fitness"] == pytest.approx(job["best_fitness"])


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--aggregate", "worst"], "aggregate: requires --worlds"),
        (["--worlds-seed", "3"], "worlds-seed: requires --worlds"),
        (["--worlds", "4", "--aggregate", "median"], "worlds.aggregate: "),
        (["--worlds", "4", "--level", "1.5"], "worlds.level: "),
    ],
)
def test_invalid_input_names_the_field(
    gaitswarm: Gaitswarm, new_db: Path, options: list[str], said: str
) -> None:
    refused = gaitswarm("submit", "--db", new_db, *options)
    assert refused.code == 2
    assert said in refused.err
    assert not new_db.exists()


def test_scenarios_are_weighed_by_name(gaitswarm: Gaitswarm, db: Path) -> None:
    weights = ("--scenario-weight", "slope-fast=3", "--scenario-weight", "normal-slow=0.5")
    spec = gaitswarm("submit", "--db", db, *weights, "--json").json["spec"]
    assert spec["scenario_weights"] == {"slope-fast": 3.0, "normal-slow": 0.5}
    worst = gaitswarm("submit", "--db", db, "--scenario-aggregate", "worst", "--json").json
    assert worst["spec"]["scenario_aggregate"] == "worst"
    refused = gaitswarm("submit", "--db", db, "--scenario-weight", "slope-fast")
    assert (refused.code, "NAME=WEIGHT" in refused.err) == (2, True)
