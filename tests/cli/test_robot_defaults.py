"""Defaults of a robot's folder in every command."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from gaitswarm.services.optimizer.jobs.preference import PREFERENCES
from gaitswarm.sim.controllers import CONTROLLERS
from tests.examples.commands import Result, run_command, synthesize
from tests.examples.paths import ROOT
from tests.examples.robots import SLOW, robot_folder

PID = '{"P": 0.4, "I": 0.1, "D": 0.002}'


@pytest.fixture
def dog(tmp_path: Path) -> Path:
    """A folder whose jobs have pid, C and one walk."""
    return robot_folder(tmp_path / "dog", controller="pid", scenarios=[SLOW])


def command(name: str, dog: Path, *options: Any) -> Result:
    return run_command(*name.split(), "--robot", dog, "--design", PID, *options)


@pytest.mark.slow
def test_a_design_is_judged_as_a_job_of_the_folder_judges_it(dog: Path, tmp_path: Path) -> None:
    job = run_command(
        "optimize", "--robot", dog, "--iterations", 1, "--particles", 3, "--evaluator",
        "in-process", "--db", tmp_path / "jobs.db", "--json",
    ).json  # fmt: skip
    assert job["spec"]["preference"] == PREFERENCES["C"].model_dump(mode="json")
    best = json.dumps(job["best"]["design"])
    again = run_command("simulate", "--robot", dog, "--design", best, "--json").json
    assert again["fitness"] == job["best"]["fitness"]
    other = run_command(
        "simulate", "--robot", dog, "--design", best, "--preference", "A", "--json"
    ).json
    assert other["fitness"] != again["fitness"]


@pytest.mark.thorough("test_the_robot_of_a_log_is_that_of_its_validation_by_default")
@pytest.mark.slow
def test_walks_that_are_compared_with_logs_take_the_folders_controller(
    dog: Path, tmp_path: Path
) -> None:
    log = tmp_path / "log.csv"
    made = synthesize(
        "--robot", dog, "--design", PID, "--scenario", "slow", "--cycles", 2, "-o", log
    )
    assert made.code == 0, made.err
    assert "# controller: pid" in log.read_text(encoding="utf-8")
    options = ("--robot", dog, "--design", PID, "--scenario", "slow", "--cycles", 2)
    judged = run_command("validate", log, *options, "--report", tmp_path / "report")
    assert judged.code == 0, judged.err
    assert "\n| controller | pid |" in (tmp_path / "report" / "report.md").read_text(
        encoding="utf-8"
    )
    kept = run_command("record", log, *options, "--db", tmp_path / "jobs.db", "--json")
    assert kept.code == 0, kept.err
    assert kept.json["controller"] == "pid"
    # An option goes before the folder.
    refused = synthesize(
        "--robot", dog, "--design", PID, "--scenario", "slow", "--controller", "pi", "-o", log
    )
    assert (refused.code, "design.D: unknown variable" in refused.err) == (2, True)


@pytest.mark.slow
def test_robustness_is_by_the_bounds_of_the_folders_variables(tmp_path: Path) -> None:
    wide = {"name": "P", "low": 0.1, "high": 1.0}
    dog = robot_folder(tmp_path / "dog", scenarios=[SLOW], variables=[wide, "I"])
    asked = ("robustness", '{"P": 0.4, "I": 0.1}', "--robot", dog, "--samples", 12, "--json")
    found = run_command(*asked)
    assert found.code == 0, found.err
    known = {v["name"]: v for v in found.json["variables"]}
    # The sample extends by 0.02 of the bounds, 0.1 to 1, to both sides.
    assert (known["P"]["least"], known["P"]["most"]) == (
        pytest.approx(0.4, abs=0.018),
        pytest.approx(0.4, abs=0.018),
    )
    assert known["P"]["most"] - known["P"]["least"] > 0.01


def test_an_unpublished_design_lists_the_choices(dog: Path) -> None:
    result = run_command("simulate", "--robot", dog, "--design", "published:A")
    assert result.code == 2
    assert (
        "design: no design of pid was published; pass a JSON object or a file with values of P, I,"
        " D, or job:ID" in " ".join(result.err.split())
    )


@pytest.mark.parametrize("name", ["optimize", "simulate", "certify", "validate"])
def test_help_names_every_controller_that_exists(name: str) -> None:
    shown = " ".join(run_command(*name.split(), "--help").out.replace("│", " ").split())
    for controller in CONTROLLERS.built_in:
        assert f" {controller}" in shown


@pytest.mark.parametrize("file", ["docs/cli.md", "docs/robots.md"])
def test_documents_name_every_controller_that_exists(file: str) -> None:
    text = (ROOT / file).read_text(encoding="utf-8")
    assert [name for name in CONTROLLERS.built_in if f"`{name}`" not in text] == []
