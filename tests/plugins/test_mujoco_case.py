"""The example: a package with a case that walks in MuJoCo, installed, tested and optimized with."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.examples.processes import COMMAND_LINE
from tests.plugins.conftest import EXAMPLE

pytestmark = pytest.mark.slow

CASE = {"name": "mujoco-walk", "rate": 1000}
SPEC = {
    "controller": "p",
    "scenarios": [
        {"name": "brief", "cycle_time": 0.9, "cycles": 1, "radius": 0.16, "hip_height": 0.15}
    ],
    "case": CASE,
    "optimizer": {"name": "random", "particles": 2},
    "iterations": 2,
}


def command(*arguments: object) -> subprocess.CompletedProcess[str]:
    """A command in a process of its own."""
    return subprocess.run(
        [sys.executable, *COMMAND_LINE, *map(str, arguments)],
        capture_output=True,
        text=True,
        check=False,
    )


def gaitswarm(*arguments: object) -> Any:
    """What a command prints as JSON."""
    done = command(*arguments, "--json")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def run(db: Path, *options: object) -> Any:
    return gaitswarm("optimize", "--db", db, "--evaluator", "in-process", *options)


def test_it_keeps_to_the_contract_of_cases(mujoco_case: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--rootdir", EXAMPLE,
         EXAMPLE / "tests"],
        capture_output=True,
        text=True,
        check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout
    assert " passed" in done.stdout and "skipped" not in done.stdout


def test_it_is_listed_with_its_distribution_and_the_schema_of_its_settings(
    mujoco_case: Path,
) -> None:
    (listed,) = gaitswarm("plugins")
    assert listed == {
        "kind": "case",
        "name": "mujoco-walk",
        "distribution": "gaitswarm-mujoco-case",
        "version": "0.1.0",
        "state": "ok",
        "reason": None,
    }
    (case,) = gaitswarm("cases")
    assert case["settings_schema"]["properties"]["rate"]["default"] == 5000


def test_a_job_of_it_is_resumed_to_the_same_bits(mujoco_case: Path, tmp_path: Path) -> None:
    spec = tmp_path / "spec.json"
    spec.write_text(json.dumps(SPEC))
    whole = run(tmp_path / "whole.db", "--spec", spec)
    assert whole["spec"]["case"] == {**CASE, "contacts": True}
    libraries = whole["provenance"][0]["provenance"]["simulation"]["libraries"]
    assert libraries["gaitswarm-mujoco-case"].startswith("0.1.0 (code ")
    assert "mujoco-core" in libraries

    begun = run(tmp_path / "half.db", "--spec", spec, "--iterations", 1)
    job_id = begun["id"]
    gaitswarm("extend", job_id, "--db", tmp_path / "half.db", "--iterations", 2)
    resumed = run(tmp_path / "half.db", "--resume", job_id)
    assert resumed["best"] == whole["best"]

    refused = command("preferences", job_id, "--db", tmp_path / "half.db", "--samples", 5)
    assert refused.returncode == 2
    assert "samples: the job's designs were put to mujoco-walk" in refused.stderr


def test_with_other_code_of_the_plug_in_a_job_does_not_go_on(
    mujoco_case: Path, tmp_path: Path
) -> None:
    db, spec = tmp_path / "jobs.db", tmp_path / "spec.json"
    spec.write_text(json.dumps(SPEC))
    job_id = run(db, "--spec", spec, "--iterations", 1)["id"]
    gaitswarm("extend", job_id, "--db", db, "--iterations", 2)
    package = mujoco_case / "gaitswarm_mujoco_case"
    package.unlink()
    shutil.copytree(EXAMPLE / "gaitswarm_mujoco_case", package)
    with (package / "case.py").open("a") as file:
        file.write("# edited\n")
    refused = command("optimize", "--db", db, "--resume", job_id)
    assert refused.returncode == 4, refused.stderr
    assert "gaitswarm-mujoco-case 0.1.0 (code " in refused.stderr


def test_without_the_package_its_jobs_are_listed_and_say_what_is_missing(
    mujoco_case: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    db, spec = tmp_path / "jobs.db", tmp_path / "spec.json"
    spec.write_text(json.dumps(SPEC | {"name": "in MuJoCo"}))
    job_id = run(db, "--spec", spec, "--iterations", 1)["id"]
    monkeypatch.delenv("PYTHONPATH")
    (listed,) = gaitswarm("list", "--db", db)
    assert (listed["id"], listed["name"], listed["state"]) == (job_id, "in MuJoCo", "succeeded")
    assert "unknown case 'mujoco-walk'" in gaitswarm("status", job_id, "--db", db)["error"]
