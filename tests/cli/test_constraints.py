"""Constraints on the command line: what they require, and what a job says of them"""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest

from tests.cli.conftest import Gaitswarm

pytestmark = pytest.mark.slow


def test_a_speed_that_no_design_reaches_is_a_result_with_its_reason(
    gaitswarm: Gaitswarm, small_spec: Path, db: Path
) -> None:
    given = ["--spec", small_spec, "--db", db, "--evaluator", "in-process"]
    result = gaitswarm("optimize", *given, "--constraint", "speed>=0.5", "--constraint", "roll<=60")
    assert result.code == 0, result.err
    assert "no design met the constraints; closest is" in result.out
    assert "speed in short is" in result.out and "instead of at least 0.5 m/s" in result.out
    assert "no feasible design yet, least violation" in result.err
    (job,) = gaitswarm("list", "--db", db, "--json").json
    assert (job["best_fitness"], job["infeasible"]) == (None, 6)

    status = gaitswarm("status", job["id"], "--db", db)
    assert "infeasible" in status.out and "closest is" in status.out
    assert "infeasible" in gaitswarm("history", job["id"], "--db", db).out
    best = gaitswarm("best", job["id"], "--db", db)
    assert best.code != 0 and "instead of at least 0.5 m/s" in best.err

    verdict = gaitswarm("verdict", job["id"], "--db", db, "--json").json
    assert verdict["sentences"][0].startswith("no design met the constraints; closest is")
    assert verdict["relax"] in result.out
    program, *command = shlex.split(verdict["relax"])
    queued = gaitswarm(*command, "--db", db, "--json")
    assert (program, queued.code) == ("gaitswarm", 0)
    assert queued.json["best_fitness"] is not None or queued.json["lineage"]["carried"] == "designs"

    again = gaitswarm("optimize", "--resume", job["id"], *given, "--constraint", "speed>=0.6")
    assert "was submitted with another constraints" in again.err

    lifted = gaitswarm(
        "fork",
        job["id"],
        "--from",
        "2",
        "--iterations",
        "3",
        "--no-constraints",
        "--db",
        db,
        "--json",
    )
    assert lifted.json["spec"]["constraints"] == [] and lifted.json["best_fitness"] is not None


def test_a_job_no_worse_than_the_published_optimum_ends_at_least_as_well(
    gaitswarm: Gaitswarm, small_spec: Path, db: Path
) -> None:
    given = ["--spec", small_spec, "--db", db, "--evaluator", "in-process"]
    result = gaitswarm("optimize", *given, "--no-worse-than", "published:A", "--json")
    assert result.code == 0, result.err
    (constraint,) = result.json["spec"]["constraints"]
    assert constraint["relative_to"] == "published:A" and set(constraint["reference"]) == {"short"}
    assert result.json["gain"] >= 0.0
    walked = result.json["best"]["scenarios"]["short"]["objectives"]
    assert all(walked[name] <= value for name, value in constraint["reference"]["short"].items())

    verdict = gaitswarm("verdict", result.json["id"], "--db", db, "--against", "published:C").out
    assert "Compared with published C, " in verdict

    resumed = gaitswarm(
        *("optimize", "--resume", result.json["id"], *given, "--no-worse-than", "published:A"),
    )
    assert resumed.code == 0, resumed.err


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--constraint", "sped>=1"], "did you mean 'speed'?"),
        (["--constraint", "speed>=1", "--constraint", "speed<=0.5"], "contradicts speed>=1"),
        (
            ["--no-worse-than", "published:Z"],
            "no published design 'Z' of fuzzy-pi; known are A, B, C",
        ),
        (["--no-worse-than", "missing.json"], "cannot read missing.json"),
    ],
)
def test_an_impossible_constraint_is_refused_by_name(
    gaitswarm: Gaitswarm, small_spec: Path, db: Path, options: list[str], message: str
) -> None:
    result = gaitswarm("submit", "--spec", small_spec, "--db", db, *options)
    assert result.code == 2 and message in result.err
